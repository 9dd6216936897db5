"""Half of a whole pin in a whole ring: the joint that Persson (1964) solved, with the material around the hole finite.

Pin (radius R) and hole (radius R + dR, smaller than R for an interference fit) have their common centre at the origin,
and the symmetry axis is x = 0. The ring's outer edge is held.
"""

from __future__ import annotations

import math

from mpi4py import MPI

from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import Drawing, Sketch, mesh_joint


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
        sketch = Sketch(geo, ("pin", "block"), ("pin", "hole", "pin top", "block held", "symmetry"))

        def arcs(body: str, r: float) -> list[int]:
            return sketch.path(body, (0, -r), (r, 0), (0, r), centre=(0, 0))

        sketch.point("pin", (0, 0))
        sketch.face("pin", pin=arcs("pin", 1.0), symmetry=sketch.path("pin", (0, 1.0), (0, 0), (0, -1.0)))
        round_lines = {"hole": arcs("block", hole), "block held": arcs("block", outer)}
        below, above = (sketch.path("block", *ends) for ends in (((0, -outer), (0, -hole)), ((0, hole), (0, outer))))
        sketch.face("block", **round_lines, symmetry=below + above)
        on_arcs = {"pin": size_ratio * size, "hole": size}
        from_arc = f"{growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
        from_core = f"{core / 3!r} + {growth!r} * Sqrt(x*x + y*y)"
        edges = zip(sketch.faces, on_arcs.values(), strict=True)
        sizes = {body: f"Min({on_arc!r} + {from_arc}, {from_core})" for body, on_arc in edges}
        parts = {line: math.pi / 2 / size for arc, size in on_arcs.items() for line in sketch.lines[arc]}
        return Drawing(sketch.faces, sizes, sketch.lines, parts)

    circles = [Circle(name, (0.0, 0.0), r) for name, r in (("pin", 1.0), ("hole", hole), ("block held", outer))]
    key = ("half ring", hole, outer, size, growth, core, size_ratio)
    return mesh_joint(comm, draw, circles, key, radius=radius, **options)
