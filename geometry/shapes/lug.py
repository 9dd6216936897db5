"""A straight lug: a plate with a hole near its end, a clamp at the other, and a pin that pulls at it in +x.

The hole's centre is the origin. The pin's centre is (dR, 0), so pin and hole touch at (R + dR, 0). The plate reaches
from the clamp x = -length to the apex x = edge distance of its end, and from y = -width/2 to width/2.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np
from mpi4py import MPI

from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import Drawing, Pen, mesh_joint

_ACROSS = 3  # elements across the narrowest ligament, at least
PinPart = Literal["half", "whole", "none"]


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
    The point set "centre" is the pin's centre.
    """
    hole, side, tip, back = (v / radius for v in (radius + clearance, width / 2, edge_distance, length))
    size, x = min(element_size / radius, (min(side, tip) - hole) / _ACROSS), hole - 1
    round_end = end == "round"

    def draw(geo) -> Drawing:
        faces: dict[str, list[int]] = {"pin": [], "lug": []}
        lines: dict[str, list[int]] = {name: [] for name in ("pin", "hole", "flat", "clamp", "axis", "end", "sides")}
        of_lug, of_pin = Pen(geo), Pen(geo)

        def add(pen: Pen, body: str, **paths: list[int]) -> None:
            faces[body].append(pen.face(*paths.values()))
            for name, path in paths.items():
                lines[name] += [line for line in path if line not in lines[name]]

        for up in (1,) if half else (1, -1):
            arc = of_lug.path((hole, 0), (0, up * hole), (-hole, 0), centre=(0, 0))
            behind, before = of_lug.path((-hole, 0), (-back, 0)), of_lug.path((tip, 0), (hole, 0))
            clamp = of_lug.path((-back, 0), (-back, up * side))
            corner = (tip - side if round_end else tip, up * side)
            edge = of_lug.path((-back, up * side), corner)
            last = of_lug.path(corner, (tip, 0), centre=(tip - side, 0) if round_end else None)
            add(of_lug, "lug", hole=arc, axis=[*behind, *before], clamp=clamp, sides=edge, end=last)
            for to in {"half": (1,), "whole": (1, -1), "none": ()}[pin]:
                arc = of_pin.path((x + to, 0), (x, up), centre=(x, 0))
                flat, axis = of_pin.path((x, up), (x, 0)), of_pin.path((x, 0), (x + to, 0))
                add(of_pin, "pin", pin=arc, flat=flat, axis=axis)
        growing = f"{size!r} + {growth!r} * Abs(Sqrt((x - {{!r}})^2 + y^2) - {{!r}})"
        sizes = {"pin": growing.format(x, 1.0), "lug": growing.format(0.0, hole)}
        return Drawing(faces, sizes, lines, {line: math.pi / 2 / size for line in lines["pin"] + lines["hole"]})

    circles = {"pin": (x, 0.0, 1.0), "hole": (0.0, 0.0, hole)} | ({"end": (tip - side, 0.0, side)} if round_end else {})
    key = ("lug", hole, side, tip, back, size, growth, end, half, pin)
    joint = mesh_joint(comm, draw, circles, key, radius=radius, **options)
    return joint if pin == "none" else replace(joint, point_sets={"centre": radius * np.array([[x, 0.0]])})
