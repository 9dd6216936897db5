"""A pin in the hole of a block in space, of hexahedra: the quarter x >= 0, z >= 0."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.layers import layered

PIN_RADIUS = 10.0
HOLE_RADIUS = 10.05
MIDDLE = PIN_RADIUS - HOLE_RADIUS  # of the pin: it touches the hole
WIDTH = 20.0
DEPTH = 30.0
THICKNESS = 10.0
_GROWTH = 0.3  # of elements, per unit of distance from the contact


def joint(
    size: float,
    layers: int,
    last: float = 0.4,
    length: float = THICKNESS,
    comm=MPI.COMM_WORLD,
    order: int = 2,
) -> TaggedMesh:
    """Pin and block, with elements about ``size`` large at the contact, in so many ``layers``
    through the block, of which the last one is ``last`` times as thick as the first.

    Sets of facets are "pin", "hole", "pin top", "block top", "pin side", "block side" (x = 0), and
    "pin below", "block below" (z = 0).
    """
    circles = [
        Circle("pin", (0.0, MIDDLE), PIN_RADIUS),
        Circle("hole", (0.0, 0.0), HOLE_RADIUS),
    ]
    plane = gmsh_to_mesh(comm, lambda gmsh: _draw(gmsh, size), circles, order=order, quads=True)
    through = graded(layers, last)
    beyond = [*through, length] if length > THICKNESS else through
    return layered(plane, {"block": through, "pin": beyond})


def graded(layers: int, last: float) -> np.ndarray:
    """Heights ``(layers + 1,)`` between layers that become thinner by the same factor."""
    thickness = np.geomspace(1.0, last, layers)
    share = np.concatenate([[0.0], thickness.cumsum() / thickness.sum()])
    return THICKNESS * share


def _draw(gmsh, size: float) -> None:
    geo = gmsh.model.geo
    places = {
        "centre": (0.0, 0.0),
        "hole low": (0.0, -HOLE_RADIUS),
        "hole right": (HOLE_RADIUS, 0.0),
        "right": (WIDTH, 0.0),
        "corner": (WIDTH, -DEPTH),
        "low": (0.0, -DEPTH),
        "middle": (0.0, MIDDLE),
        "pin low": (0.0, MIDDLE - PIN_RADIUS),
        "pin right": (PIN_RADIUS, MIDDLE),
    }
    point = {name: geo.addPoint(*place, 0.0) for name, place in places.items()}

    def line(start: str, end: str) -> int:
        return geo.addLine(point[start], point[end])

    hole = geo.addCircleArc(point["hole low"], point["centre"], point["hole right"])
    block_top = line("hole right", "right")
    outside = [line("right", "corner"), line("corner", "low")]
    block_side = line("low", "hole low")
    pin = geo.addCircleArc(point["pin low"], point["middle"], point["pin right"])
    pin_top = line("pin right", "middle")
    pin_side = line("middle", "pin low")
    block = geo.addPlaneSurface([geo.addCurveLoop([hole, block_top, *outside, block_side])])
    half = geo.addPlaneSurface([geo.addCurveLoop([pin, pin_top, pin_side])])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(2, [block], name="block")
    gmsh.model.addPhysicalGroup(2, [half], name="pin")
    lines = {
        "pin": pin,
        "hole": hole,
        "pin top": pin_top,
        "block top": block_top,
        "pin side": pin_side,
        "block side": block_side,
    }
    for name, number in lines.items():
        gmsh.model.addPhysicalGroup(1, [number], name=name)
    from_arc = f"Abs(Sqrt(x*x + y*y) - {HOLE_RADIUS!r})"
    field = gmsh.model.mesh.field.add("MathEval")
    gmsh.model.mesh.field.setString(field, "F", f"{size!r} + {_GROWTH!r} * {from_arc}")
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
