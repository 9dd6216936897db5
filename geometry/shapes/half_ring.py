"""Half of a whole pin in a whole ring: the joint that Persson (1964) solved, with the material around the hole finite.

Pin (radius R) and hole (radius R + dR, smaller than R for an interference fit) have their common centre at the origin,
and the symmetry axis is x = 0. The ring's outer edge is held.
"""

from __future__ import annotations

import math

from mpi4py import MPI

from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import Sketch, mesh_joint


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
    sketch = Sketch(("pin", "block"), ("pin", "hole", "pin top", "block held", "symmetry"))

    def arcs(body: str, name: str, r: float) -> list[int]:
        return sketch.path(body, (0, -r), (r, 0), (0, r), on=Circle(name, (0.0, 0.0), r))

    sketch.point("pin", (0, 0))
    sketch.face("pin", pin=arcs("pin", "pin", 1.0), symmetry=sketch.path("pin", (0, 1.0), (0, 0), (0, -1.0)))
    round_lines = {name: arcs("block", name, r) for name, r in (("hole", hole), ("block held", outer))}
    below, above = (sketch.path("block", *ends) for ends in (((0, -outer), (0, -hole)), ((0, hole), (0, outer))))
    sketch.face("block", **round_lines, symmetry=below + above)
    from_arc = f"{growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
    from_core = f"{core / 3!r} + {growth!r} * Sqrt(x*x + y*y)"
    for body, arc, on_arc in (("pin", "pin", size_ratio * size), ("block", "hole", size)):
        sketch.sizes[body] = f"Min({on_arc!r} + {from_arc}, {from_core})"
        sketch.parts |= dict.fromkeys(sketch.lines[arc], math.pi / 2 / on_arc)
    return mesh_joint(comm, sketch, radius=radius, **options)
