"""Half of a whole pin in a whole ring: the joint that Persson (1964) solved, with the material around the hole finite.

Pin (radius R) and hole (radius R + dR, smaller than R for an interference fit) have their common centre at the origin,
and the symmetry axis is x = 0. The ring's outer edge is held.
"""

from __future__ import annotations

import math

from mpi4py import MPI

from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import Drawing, mesh_joint


def half_ring(
    comm: MPI.Comm,
    radius: float,
    clearance: float,
    outer_radius: float,
    element_size: float,
    growth: float,
    core_radius: float,
    *,
    size_ratio: float = 1.0,
    **options,
) -> TaggedMesh:
    """Mesh the half joint, with elements ``element_size`` long on the hole's arc and ``size_ratio`` times that on the
    pin's, and ``options`` as for `mesh_joint`. Lengths share one unit.

    Away from the arcs they grow by ``growth`` per unit of distance, to a third of ``core_radius`` at the pin's centre.
    """
    hole, outer, size, core = (1 + clearance / radius, *(v / radius for v in (outer_radius, element_size, core_radius)))

    def draw(geo) -> Drawing:
        centre = geo.addPoint(0, 0, 0)

        def half_circle(r: float) -> tuple[int, int, list[int]]:
            """Bottom and top points and the two arcs from bottom to top."""
            bottom, side, top = (geo.addPoint(*xy, 0) for xy in ((0, -r), (r, 0), (0, r)))
            return bottom, top, [geo.addCircleArc(bottom, centre, side), geo.addCircleArc(side, centre, top)]

        bottom, top, pin_arcs = half_circle(1.0)
        axis = [geo.addLine(top, centre), geo.addLine(centre, bottom)]
        pin = geo.addPlaneSurface([geo.addCurveLoop([*pin_arcs, *axis])])
        bottom, top, hole_arcs = half_circle(hole)
        low, high, edge = half_circle(outer)
        below, above = geo.addLine(low, bottom), geo.addLine(top, high)
        loop = [*hole_arcs, above, *(-arc for arc in reversed(edge)), below]
        faces = {"pin": [pin], "block": [geo.addPlaneSurface([geo.addCurveLoop(loop)])]}
        lines = {"pin": pin_arcs, "hole": hole_arcs, "pin top": [], "block held": edge}
        lines["symmetry"] = [*axis, below, above]
        arcs = {"pin": size_ratio * size, "hole": size}
        from_arc = f"{growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
        from_core = f"{core / 3!r} + {growth!r} * Sqrt(x*x + y*y)"
        on_arcs = zip(faces, arcs.values(), strict=True)
        sizes = {body: f"Min({on_arc!r} + {from_arc}, {from_core})" for body, on_arc in on_arcs}
        parts = {line: math.pi / 2 / size for arc, size in arcs.items() for line in lines[arc]}
        return Drawing(faces, sizes, lines, parts)

    circles = {"pin": (0.0, 0.0, 1.0), "hole": (0.0, 0.0, hole), "block held": (0.0, 0.0, outer)}
    key = ("half ring", hole, outer, size, growth, core, size_ratio)
    return mesh_joint(comm, draw, circles, key, radius=radius, **options)
