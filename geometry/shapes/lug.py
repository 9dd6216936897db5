"""A straight lug: a plate with a hole near its end, a clamp at the other, and a pin that pulls at
it in +x, in the hole itself or in a bushing that is pressed into the hole.

The hole's centre is the origin. The pin's centre is (dR, 0), so pin and hole touch at (R + dR, 0);
for an interference both are drawn into each other around the origin. The plate reaches from the
clamp x = -length to the apex x = edge distance of its end, and from y = -width/2 to width/2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from mpi4py import MPI

from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.bushing import between, draw_ring, longest_edge
from archord.geometry.shapes.joint_mesh import mesh_joint
from archord.geometry.shapes.sketch import Bore, PinPart, Sketch, around, in_radii

ACROSS = 3  # elements across the narrowest ligament, at least
_SLEEVE = ["bushing inside", "bushing outside"]
_CORNER = 2.0  # size at the clamp's corners, where the stress is singular, over that on the arcs


@dataclass(frozen=True)
class Plate:
    """Outline of a plate in radii of the pin: radius of the ``hole``, half the width (``side``),
    from the hole's centre to the apex (``tip``) and to the clamp (``back``), and whether the end is
    round."""

    hole: float
    side: float
    tip: float
    back: float
    round: bool

    @property
    def ligament(self) -> float:
        """The narrowest distance from the hole to an edge."""
        return min(self.side, self.tip) - self.hole


def plates_of(
    outlines: Mapping[str, Mapping[str, Any]], radius: float, hole: float
) -> dict[str, Plate]:
    """The plates of these ``outlines`` in radii of the pin, as the ``hole`` is."""
    plates = {}
    for name, keys in outlines.items():
        lengths = (keys["width"] / 2, keys["edge_distance"], keys["length"])
        side, tip, back = in_radii(radius, *lengths)
        plates[name] = Plate(hole, side, tip, back, keys["end"] == "round")
    return plates


def draw_plate(
    sketch: Sketch,
    plate: Plate,
    body: str,
    up: int,
    at: float = 0.0,
    before: str = "",
    to: int = 1,
) -> None:
    """Draw the half of a ``plate`` above (``up`` = 1) or below the axis, with the hole's centre at
    (``at``, 0) and its tip on the side ``to`` (1 or -1) of the hole; the names of its sets but the
    axis have ``before`` in front."""
    hole = plate.hole
    side = plate.side
    tip = at + to * plate.tip
    back = at - to * plate.back
    round_hole = Circle(f"{before}hole", (at, 0.0), hole)
    apex = Circle(f"{before}end", (tip - to * side, 0.0), side) if plate.round else None
    corner = (tip - to * side if apex else tip, up * side)
    near = at + to * hole
    far = at - to * hole
    arc = sketch.path(body, (near, 0), (at, up * hole), (far, 0), on=round_hole)
    axis = sketch.path(body, (far, 0), (back, 0)) + sketch.path(body, (tip, 0), (near, 0))
    clamp = sketch.path(body, (back, 0), (back, up * side))
    last = sketch.path(body, corner, (tip, 0), on=apex)
    sides = sketch.path(body, (back, up * side), corner)
    paths = {f"{before}hole": arc, "axis": axis, f"{before}clamp": clamp}
    sketch.face(body, **paths, **{f"{before}sides": sides, f"{before}end": last})


def size_around(x: float, r: float, size: float, growth: float) -> str:
    """An element size on the circle of radius ``r`` about (x, 0) that grows away from it."""
    return f"{size!r} + {growth!r} * Abs({around(x)} - {r!r})"


def plate_size(plate: Plate, size: float, growth: float, at: float = 0.0, to: int = 1) -> str:
    """The element size in a plate with its hole about (``at``, 0): growing from the hole and the
    clamp's corners."""
    off = f"Sqrt((x - {at!r} + ({to * plate.back!r}))^2 + (Abs(y) - {plate.side!r})^2)"
    clamped = f"{_CORNER * size!r} + {growth!r} * {off}"
    return f"Min({size_around(at, plate.hole, size, growth)}, {clamped})"


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

    A round end is an arc of radius width/2, wherever its apex lies. ``element_size`` is the edge
    length on the arcs of pin and hole, shorter if less than three would lie across the narrowest
    ligament; away from the arcs it grows by ``growth`` per unit of distance. Sets: "pin", "hole",
    "end", "sides", "clamp", "axis" (y = 0) and "flat", the pin's line x = dR, which halves a whole
    pin and bounds the front half of a ``half`` one. The half y >= 0 is meshed or all.

    A bushing has the sets "bushing inside" and "bushing outside". The clearance is then between the
    pin and the bushing, whose outer radius exceeds the hole's by the ``interference``. A pin that
    is not ``touching`` is concentric.
    """
    lengths = radius + clearance, width / 2, edge_distance, length, element_size
    more = wall or 0.0, interference
    bore, side, tip, back, size, thickness, overlap = in_radii(radius, *lengths, *more)
    outer = bore + thickness
    hole = outer - overlap
    plate = Plate(hole, side, tip, back, end == "round")
    size = min(size, plate.ligament / ACROSS)
    x = touching * max(bore - 1, 0.0)
    bodies = ["pin", "lug"]
    sets = ["pin", "hole", "flat", "clamp", "axis", "end", "sides"]
    if wall:
        size = min(size, longest_edge(outer - bore))
        bodies.insert(1, "bushing")
        sets += _SLEEVE
    sketch = Sketch(bodies, sets)
    for up in (1,) if half else (1, -1):
        draw_plate(sketch, plate, "lug", up)
        sketch.pin(x, up, pin)
        if wall:
            draw_ring(sketch, "bushing", _SLEEVE, (bore, outer), 0.0, up, size)
    sketch.bores.append(Bore("bushing inside" if wall else "hole", size, growth))
    sketch.sizes["pin"] = size_around(x, 1.0, size, growth)
    sketch.sizes["lug"] = plate_size(plate, size, growth)
    arcs = sketch.lines["pin"] + sketch.lines["hole"]
    if wall:
        sketch.sizes["bushing"] = (
            f"{size!r} * {around(0)} + {growth!r} * {between(0.0, bore, outer)}"
        )
        arcs += [line for name in _SLEEVE for line in sketch.lines[name]]
    sketch.parts |= dict.fromkeys(arcs, math.pi / 2 / size)
    return mesh_joint(comm, sketch, radius=radius, **options)
