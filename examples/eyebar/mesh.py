"""The mesh of the eyebar, quadrilaterals of four nodes: writes eyebar.inp here.

Hole of radius 10 about (0, 0), bar from x = -20 to a round end of radius 20, sides y = +-20; pin of radius 9.5 about
(0.5, 0), cut at x = 0.5, which touches the hole at (10, 0). The half y > 0. Curves are polygons: a scene puts the
middle nodes on their circles (`mesh.circle`).
"""

import math
from itertools import pairwise

import gmsh

AROUND, ACROSS, INSIDE, GROWTH = 8, 6, 3, 1.2  # elements along 45 degrees, from hole to rim, inside the pin


def polar(radius, degrees, x=0.0):
    """A point at this angle about (x, 0)."""
    return gmsh.model.geo.addPoint(
        x + radius * math.cos(math.radians(degrees)), radius * math.sin(math.radians(degrees)), 0
    )


def draw():
    """Blocks of quadrilaterals: four around the hole, three in the pin."""
    geo = gmsh.model.geo
    centre, origin = polar(0, 0, 0.5), polar(0, 0)
    hole = [polar(10, angle) for angle in (0, 45, 90, 135, 180)]
    rim = [polar(20, 0), polar(20, 45), polar(20, 90), geo.addPoint(-20, 20, 0), geo.addPoint(-20, 0, 0)]
    arcs = [geo.addCircleArc(a, origin, b) for a, b in pairwise(hole)]
    rims = [geo.addCircleArc(rim[k], origin, rim[k + 1]) for k in (0, 1)]
    rims += [geo.addLine(rim[k], rim[k + 1]) for k in (2, 3)]
    rays = [geo.addLine(a, b) for a, b in zip(hole, rim, strict=True)]
    eye = [[rays[k], rims[k], -rays[k + 1], -arcs[k]] for k in range(4)]
    inner = [polar(4, 0, 0.5), polar(5, 45, 0.5), polar(4, 90, 0.5)]
    outer = [polar(9.5, angle, 0.5) for angle in (0, 45, 90)]
    tip = [geo.addCircleArc(a, centre, b) for a, b in pairwise(outer)]
    spokes = [geo.addLine(a, b) for a, b in zip(inner, outer, strict=True)]
    square = [geo.addLine(a, b) for a, b in pairwise([centre, *inner, centre])]
    pin = [[spokes[k], tip[k], -spokes[k + 1], -square[k + 1]] for k in (0, 1)] + [square]
    for lines, n, growth in (
        ([*arcs, *rims, *tip, *square], AROUND, 1),
        (rays, ACROSS, GROWTH),
        (spokes, INSIDE, 1 / GROWTH),
    ):
        for line in lines:
            geo.mesh.setTransfiniteCurve(line, n + 1, "Progression", growth)
    faces = {"eye": [], "pin": []}
    for name, loops in (("eye", eye), ("pin", pin)):
        for loop in loops:
            face = geo.addPlaneSurface([geo.addCurveLoop(loop)])
            geo.mesh.setTransfiniteSurface(face)
            geo.mesh.setRecombine(2, face)
            faces[name].append(face)
    geo.synchronize()
    for name, members in faces.items():
        gmsh.model.addPhysicalGroup(2, members, name=name)
    sets = {"hole": arcs, "end": rims[:2], "tip": tip, "axis": [rays[0], rays[4], spokes[0], square[0]],
            "fix": [rims[3]], "flat": [spokes[2], square[3]]}  # fmt: skip
    for name, lines in sets.items():
        gmsh.model.addPhysicalGroup(1, lines, name=name)
    gmsh.model.mesh.generate(2)


if __name__ == "__main__":
    gmsh.initialize()
    draw()
    gmsh.write("eyebar.inp")
    gmsh.finalize()
