"""A straight lug: a plate with a hole near its end, a clamp at the other, and a pin that pulls at it in +x, in the hole
itself or in a bushing that is pressed into the hole.

The hole's centre is the origin. The pin's centre is (dR, 0), so pin and hole touch at (R + dR, 0); for an interference
both are drawn into each other around the origin. The plate reaches from the clamp x = -length to the apex x = edge
distance of its end, and from y = -width/2 to width/2.
"""

from __future__ import annotations

import math
from typing import Literal

from mpi4py import MPI

from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.bushing import between, draw_ring, longest_edge
from archord.geometry.shapes.joint_mesh import PinPart, Sketch, around, mesh_joint

_ACROSS = 3  # elements across the narrowest ligament, at least
_SLEEVE = ["bushing inside", "bushing outside"]
_CORNER = 2.0  # size at the clamp's corners, where the stress is singular, over that on the arcs


def lug(
    comm: MPI.Comm,
    radius: float,
    clearance: float,
    width: float,
    edge_distance: float,
    length: float,
    element_size: float,
    growth: float,
    *,
    end: Literal["round", "square"] = "round",
    half: bool = True,
    pin: PinPart = "half",
    wall: float | None = None,
    interference: float = 0.0,
    touching: bool = True,
    **options,
) -> TaggedMesh:
    """Mesh the bodies "pin" and "lug", and "bushing" if it has a ``wall``, with ``options`` as for
    `mesh_joint`. Lengths share one unit.

    A round end is an arc of radius width/2, wherever its apex lies. ``element_size`` is the edge length on the arcs of
    pin and hole, shorter if less than three would lie across the narrowest ligament; away from the arcs it grows by
    ``growth`` per unit of distance. Sets: "pin", "hole", "end", "sides", "clamp", "axis" (y = 0) and "flat", the pin's
    line x = dR, which halves a whole pin and bounds the front half of a ``half`` one. The half y >= 0 is meshed or all.

    A bushing has the sets "bushing inside" and "bushing outside". The clearance is then between the pin
    and the bushing, whose outer radius exceeds the hole's by the ``interference``. A pin that is not
    ``touching`` is concentric.
    """
    bore, side, tip, back = (v / radius for v in (radius + clearance, width / 2, edge_distance, length))
    outer = bore + (wall or 0.0) / radius
    hole = outer - interference / radius
    size, x = min(element_size / radius, (min(side, tip) - hole) / _ACROSS), touching * max(bore - 1, 0.0)
    apex = Circle("end", (tip - side, 0.0), side) if end == "round" else None
    bodies, sets = ["pin", "lug"], ["pin", "hole", "flat", "clamp", "axis", "end", "sides"]
    if wall:
        size = min(size, longest_edge(outer - bore))
        bodies.insert(1, "bushing")
        sets += _SLEEVE
    sketch = Sketch(bodies, sets)
    for up in (1,) if half else (1, -1):
        arc = sketch.path("lug", (hole, 0), (0, up * hole), (-hole, 0), on=Circle("hole", (0.0, 0.0), hole))
        axis = sketch.path("lug", (-hole, 0), (-back, 0)) + sketch.path("lug", (tip, 0), (hole, 0))
        corner = (tip - side if apex else tip, up * side)
        clamp, sides = sketch.path("lug", (-back, 0), (-back, up * side)), [(-back, up * side), corner]
        last = sketch.path("lug", corner, (tip, 0), on=apex)
        sketch.face("lug", hole=arc, axis=axis, clamp=clamp, sides=sketch.path("lug", *sides), end=last)
        sketch.pin(x, up, pin)
        if wall:
            draw_ring(sketch, "bushing", _SLEEVE, (bore, outer), 0.0, up, size)
    growing = f"{size!r} + {growth!r} * Abs({{}} - {{!r}})"
    clamped = f"{_CORNER * size!r} + {growth!r} * Sqrt((x + {back!r})^2 + (Abs(y) - {side!r})^2)"
    sketch.sizes["pin"] = growing.format(around(x), 1.0)
    sketch.sizes["lug"] = f"Min({growing.format(around(0), hole)}, {clamped})"
    arcs = sketch.lines["pin"] + sketch.lines["hole"]
    if wall:
        sketch.sizes["bushing"] = f"{size!r} * {around(0)} + {growth!r} * {between(0.0, bore, outer)}"
        arcs += [line for name in _SLEEVE for line in sketch.lines[name]]
    sketch.parts |= dict.fromkeys(arcs, math.pi / 2 / size)
    return mesh_joint(comm, sketch, radius=radius, **options)
