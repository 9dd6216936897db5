"""A clevis in space: one pin through an inner plate and two outer ones, perhaps in bushings.

A quarter is modelled, y >= 0 and z >= 0, or the half y >= 0. The inner plate's clamp is on the
side -x, the clamps of the outer plates are on the side +x. The inner hole's centre is the origin.
The pin touches the inner plate on the side +x and the outer ones on the side -x.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mpi4py import MPI

from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.bushing import between, draw_ring, longest_edge
from archord.geometry.shapes.lug import ACROSS, draw_plate, plate_size, plates_of, size_around
from archord.geometry.shapes.sketch import Bore, Sketch, around
from archord.geometry.shapes.solids import Rims, Slab, mesh_solids

_SETS = ("hole", "clamp", "end", "sides")
_SIDES = {"inner": 1, "outer": -1}  # of the holes, where the plates end


def solid_clevis(
    comm: MPI.Comm,
    radius: float,
    clearance: float,
    inner: Mapping[str, Any],
    outer: Mapping[str, Any],
    element_size: float,
    growth: float,
    *,
    space: Mapping[str, float],
    partitioner=None,
) -> TaggedMesh:
    """Mesh the bodies "pin", "inner" and "outer", and "inner bushing" and "outer bushing" if they
    have a wall. Lengths share one unit.

    The plates ``inner`` and ``outer`` have a ``width``, ``edge_distance``, ``length``, ``end`` and
    ``thickness``. In ``space`` are the ``gap`` between the inner plate and each outer one, the
    ``overhang`` of the pin beyond the outer plates, the radius of its ``bore``, the ``wall`` of the
    bushings, and the keys of `Rims`. Sets have "inner " or "outer " in front, also the two parts
    "inner pin" and "outer pin" of the one pin; "axis" is y = 0, "flat" halves the pin.
    """
    hole = (radius + clearance) / radius
    wall = space["wall"] / radius
    half = inner["thickness"] / radius / 2
    bottom = half + space["gap"] / radius
    top = bottom + outer["thickness"] / radius
    plates = plates_of({"inner": inner, "outer": outer}, radius, hole + wall)
    longest = [plate.ligament / ACROSS for plate in plates.values()]
    size = min(element_size / radius, *longest)
    if wall:
        size = min(size, longest_edge(wall))
    pinned = max(hole - 1, 0.0)
    places = {"inner": 0.0, "outer": 2 * pinned}
    depths = {"inner": (0.0, half), "outer": (bottom, top)}
    rims = {"inner": (half,), "outer": (bottom, top)}
    sleeves = {name: f"{name} bushing" for name in plates} if wall else {}
    walls = {name: (f"{body} inside", f"{body} outside") for name, body in sleeves.items()}
    of_plates = [f"{name} {part}" for name in plates for part in _SETS]
    of_sleeves = [name for pair in walls.values() for name in pair]
    sets = ["pin", "pin inside", "flat", "axis", *of_plates, *of_sleeves]
    sketch = Sketch(["pin", *plates, *sleeves.values()], sets)
    slabs = []
    for name, plate in plates.items():
        at = places[name]
        draw_plate(sketch, plate, name, 1, at, f"{name} ", _SIDES[name])
        sketch.sizes[name] = plate_size(plate, size, growth, at, _SIDES[name])
        slabs.append(Slab(name, name, *depths[name], rims=() if wall else rims[name]))
        if wall:
            body = sleeves[name]
            draw_ring(sketch, body, walls[name], (hole, hole + wall), at, 1, size)
            away = between(at, hole, hole + wall)
            sketch.sizes[body] = f"{size!r} * {around(at)} + {growth!r} * {away}"
            slabs.append(Slab(body, body, *depths[name], rims=rims[name]))
        bored = walls[name][0] if wall else f"{name} hole"
        sketch.bores.append(Bore(bored, size, growth))
    sketch.pin(pinned, 1, "whole", bore=space["bore"] / radius)
    sketch.sizes["pin"] = size_around(pinned, 1.0, size, growth)
    between_plates = (half + bottom) / 2
    end = top + space["overhang"] / radius
    slabs.append(Slab("pin", "pin", 0.0, between_plates, {"pin": "inner pin"}))
    slabs.append(Slab("pin", "pin", between_plates, end, {"pin": "outer pin"}))
    return mesh_solids(
        comm,
        sketch,
        slabs,
        Rims.of(space, radius),
        radius=radius,
        half=bool(space.get("half", True)),
        partitioner=partitioner,
    )
