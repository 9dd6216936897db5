"""A clevis: an inner plate and one of two outer plates, each with its own slice of the pin.

Both plates are drawn as lugs (see lug.py) that their pins pull in +x, the half y >= 0 of each. The
inner hole's centre is the origin; the outer plate lies behind the inner one's end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from mpi4py import MPI

from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import mesh_joint
from archord.geometry.shapes.lug import ACROSS, draw_plate, plate_size, plates_of, size_around
from archord.geometry.shapes.sketch import PinPart, Sketch, in_radii
from archord.geometry.shapes.solid_clevis import solid_clevis

_GAP = 1.0  # between the plates, in radii
_SETS = ("pin", "hole", "flat", "clamp", "end", "sides")


def clevis(
    comm: MPI.Comm,
    radius: float,
    clearance: float,
    inner: Mapping[str, Any],
    outer: Mapping[str, Any],
    element_size: float,
    growth: float,
    *,
    pin: PinPart = "half",
    space: Mapping[str, float] | None = None,
    **options,
) -> TaggedMesh:
    """Mesh the bodies "inner pin", "inner", "outer pin" and "outer", with ``options`` as for
    `mesh_joint`.

    The plates ``inner`` and ``outer`` have a ``width``, ``edge_distance``, ``length`` and ``end``.
    Sets are named as in a lug, with "inner " or "outer " in front, and "axis". Lengths share one
    unit. In ``space`` it is a `solid_clevis`.
    """
    if space is not None:
        parts = (comm, radius, clearance, inner, outer, element_size, growth)
        return solid_clevis(*parts, space=space)
    hole, size = in_radii(radius, radius + clearance, element_size)
    plates = plates_of({"inner": inner, "outer": outer}, radius, hole)
    places = {"inner": 0.0, "outer": plates["inner"].tip + _GAP + plates["outer"].back}
    size = min(size, *(plate.ligament / ACROSS for plate in plates.values()))
    bodies = [f"{name}{part}" for name in plates for part in (" pin", "")]
    sketch = Sketch(bodies, [*(f"{name} {part}" for name in plates for part in _SETS), "axis"])
    for name, plate in plates.items():
        at = places[name]
        x = places[name] + max(hole - 1, 0.0)
        draw_plate(sketch, plate, name, 1, at, f"{name} ")
        sketch.pin(x, 1, pin, f"{name} ")
        sketch.sizes[f"{name} pin"] = size_around(x, 1.0, size, growth)
        sketch.sizes[name] = plate_size(plate, size, growth, at)
        arcs = sketch.lines[f"{name} pin"] + sketch.lines[f"{name} hole"]
        sketch.parts |= dict.fromkeys(arcs, math.pi / 2 / size)
    return mesh_joint(comm, sketch, radius=radius, **options)
