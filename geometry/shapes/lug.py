"""A straight lug: a plate with a hole near its end, a clamp at the other, and a pin that pulls at it in +x.

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
from archord.geometry.shapes.joint_mesh import PinPart, Sketch, around, mesh_joint

_ACROSS = 3  # elements across the narrowest ligament, at least
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
    **options,
) -> TaggedMesh:
    """Mesh the bodies "pin" and "lug", with ``options`` as for `mesh_joint`. Lengths share one unit.

    A round end is an arc of radius width/2, wherever its apex lies. ``element_size`` is the edge length on the arcs of
    pin and hole, shorter if less than three would lie across the narrowest ligament; away from the arcs it grows by
    ``growth`` per unit of distance. Sets: "pin", "hole", "end", "sides", "clamp", "axis" (y = 0) and "flat", the pin's
    line x = dR, which halves a whole pin and bounds the front half of a ``half`` one. The half y >= 0 is meshed or all.
    """
    hole, side, tip, back = (v / radius for v in (radius + clearance, width / 2, edge_distance, length))
    size, x = min(element_size / radius, (min(side, tip) - hole) / _ACROSS), max(hole - 1, 0.0)
    apex = Circle("end", (tip - side, 0.0), side) if end == "round" else None
    sketch = Sketch(("pin", "lug"), ("pin", "hole", "flat", "clamp", "axis", "end", "sides"))
    for up in (1,) if half else (1, -1):
        arc = sketch.path("lug", (hole, 0), (0, up * hole), (-hole, 0), on=Circle("hole", (0.0, 0.0), hole))
        axis = sketch.path("lug", (-hole, 0), (-back, 0)) + sketch.path("lug", (tip, 0), (hole, 0))
        corner = (tip - side if apex else tip, up * side)
        clamp, sides = sketch.path("lug", (-back, 0), (-back, up * side)), [(-back, up * side), corner]
        last = sketch.path("lug", corner, (tip, 0), on=apex)
        sketch.face("lug", hole=arc, axis=axis, clamp=clamp, sides=sketch.path("lug", *sides), end=last)
        sketch.pin(x, up, pin)
    growing = f"{size!r} + {growth!r} * Abs({{}} - {{!r}})"
    clamped = f"{_CORNER * size!r} + {growth!r} * Sqrt((x + {back!r})^2 + (Abs(y) - {side!r})^2)"
    sketch.sizes["pin"] = growing.format(around(x), 1.0)
    sketch.sizes["lug"] = f"Min({growing.format(around(0), hole)}, {clamped})"
    sketch.parts |= dict.fromkeys(sketch.lines["pin"] + sketch.lines["hole"], math.pi / 2 / size)
    return mesh_joint(comm, sketch, radius=radius, **options)
