"""A pin of radius R in a block with a hole of radius R + dR: the joints that `[joint]` of a scene
is about.

The hole's centre is the origin, the symmetry axis is x = 0.
"""

from __future__ import annotations

import math

from mpi4py import MPI

from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import mesh_joint, refinements
from archord.geometry.shapes.sketch import Bore, Sketch

_EDGE_GROWTH = (
    0.4  # of elements that shrink toward the contact's edge, per unit of distance from it
)


def pin_joint(
    comm: MPI.Comm,
    *,
    ring: bool,
    radius: float,
    clearance: float,
    block_size: float,
    element_size: float,
    growth: float,
    edge: tuple[float, float] | None,
    expected_cells: float,
    pin: str,
    core_radius: float,
    **options,
) -> TaggedMesh:
    """Mesh a joint: a `half_ring` or a `quarter_joint`, whose arguments these are, with a ``pin``
    that is "half", "whole" or "none"; a ring's core has ``core_radius``, over R."""
    sizes = radius, clearance, block_size, element_size, growth
    options["refinements"] = refinements(expected_cells)
    if ring:
        return half_ring(comm, *sizes, core_radius * radius, **options)
    return quarter_joint(
        comm, *sizes, edge=edge, rigid_pin=pin == "none", whole_pin=pin == "whole", **options
    )


def quarter_joint(
    comm: MPI.Comm,
    radius: float,
    clearance: float,
    block_size: float,
    element_size: float,
    growth: float,
    *,
    size_ratio: float = 1.0,
    edge: tuple[float, float] | None = None,
    rigid_pin: bool = False,
    whole_pin: bool = False,
    **options,
) -> TaggedMesh:
    """Mesh the paper's joint, a quarter of pin and hole, with ``options`` as for `mesh_joint`.
    Lengths share one unit.

    The pin's centre is (0, -dR), so pin and hole touch at (0, -R - dR). The block reaches to x = W
    and y = -H, both ``block_size``; its top edge y = 0 is held, the pin's flat top is the loaded
    edge.

    ``element_size`` is the edge length on the hole's arc, ``size_ratio`` times that the one on the
    pin's; away from them it grows by ``growth`` per unit of distance. ``edge`` is an angle from the
    axis [rad] and the size to which the elements shrink there, where the contact is to end. A rigid
    pin is not meshed; of a whole one the upper half, free, is meshed with the rest, which is then
    pressed along a line inside it.
    """
    hole = 1.0 + clearance / radius
    width = block_size / radius
    size = element_size / radius
    sketch = Sketch(
        ("pin", "block"), ("pin", "hole", "pin top", "block held", "symmetry", "pin back")
    )
    middle = (0, 1 - hole)
    bottom = (0, -hole)
    side = (1, 1 - hole)
    top = (0, 2 - hole)
    if not rigid_pin:
        sketch.point("pin", middle)
        arc = sketch.path("pin", bottom, side, on=Circle("pin", middle, 1.0))
        half = sketch.path("pin", side, middle)
        axis = sketch.path("pin", middle, bottom)
        sketch.face("pin", **{"pin": arc, "pin top": half, "symmetry": axis})
        if whole_pin:
            sketch.point("pin", top)
            back = sketch.path("pin", side, top, on=Circle("pin back", middle, 1.0))
            axis = sketch.path("pin", top, middle)
            sketch.face("pin", **{"pin back": back, "symmetry": axis, "pin top": half})
    corners = (hole, 0), (width, 0), (width, -width), (0, -width)
    for place in ((0, 0), bottom, *corners):
        sketch.point("block", place)
    arc = sketch.path("block", bottom, corners[0], on=Circle("hole", (0, 0), hole))
    held, *free, line = sketch.path("block", *corners, bottom)
    sketch.face("block", **{"hole": arc, "block held": [held], "": free, "symmetry": [line]})
    for body, name, on_arc in (("pin", "pin", size_ratio * size), ("block", "hole", size)):
        sketch.sizes[body] = f"{on_arc!r} + {growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
        if edge is None:
            sketch.parts |= dict.fromkeys(sketch.lines[name], math.pi / 2 / on_arc)
        else:
            x = hole * math.sin(edge[0])
            y = hole * math.cos(edge[0])
            near_edge = (
                f"{edge[1] / radius!r} + {_EDGE_GROWTH!r} * Sqrt((x - {x!r})^2 + (y + {y!r})^2)"
            )
            sketch.sizes[body] = f"Min({sketch.sizes[body]}, {near_edge})"
    sketch.bores.append(Bore("hole", size, growth))
    return mesh_joint(comm, sketch, radius=radius, **options)


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
    """Mesh half of a whole pin in a whole ring, with ``options`` as for `mesh_joint`. Lengths share
    one unit. Persson (1964) solved it, but for the finite material around the hole.

    Pin and hole have one centre, also where they interfere; the ring's outer edge is held. Elements
    are ``element_size`` long on the hole's arc and ``size_ratio`` times that on the pin's; away
    from the arcs they grow by ``growth`` per unit of distance, to a third of ``core_radius`` at the
    pin's centre.
    """
    hole = 1 + clearance / radius
    outer = outer_radius / radius
    size = element_size / radius
    core = core_radius / radius
    sketch = Sketch(("pin", "block"), ("pin", "hole", "pin top", "block held", "symmetry"))

    def arcs(body: str, name: str, r: float) -> list[int]:
        return sketch.path(body, (0, -r), (r, 0), (0, r), on=Circle(name, (0.0, 0.0), r))

    sketch.point("pin", (0, 0))
    edge = arcs("pin", "pin", 1.0)
    axis = sketch.path("pin", (0, 1.0), (0, 0), (0, -1.0))
    sketch.face("pin", pin=edge, symmetry=axis)
    edges = {"hole": arcs("block", "hole", hole), "block held": arcs("block", "block held", outer)}
    below = sketch.path("block", (0, -outer), (0, -hole))
    above = sketch.path("block", (0, hole), (0, outer))
    sketch.face("block", **edges, symmetry=below + above)
    from_arc = f"{growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
    from_core = f"{core / 3!r} + {growth!r} * Sqrt(x*x + y*y)"
    for body, arc, on_arc in (("pin", "pin", size_ratio * size), ("block", "hole", size)):
        sketch.sizes[body] = f"Min({on_arc!r} + {from_arc}, {from_core})"
        sketch.parts |= dict.fromkeys(sketch.lines[arc], math.pi / 2 / on_arc)
    sketch.bores.append(Bore("hole", size, growth))
    return mesh_joint(comm, sketch, radius=radius, **options)
