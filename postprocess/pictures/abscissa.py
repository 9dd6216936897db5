"""The abscissa of quantities along edges: one scale, on which places that touch lie together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from archord.materials.material import Array
from archord.postprocess.probes.probe import Probe

_STRAIGHT = 1e-6  # how far points are off a line, over their extent


def abscissa(probes: Sequence[Probe]) -> tuple[list[Array], str]:
    """Where the points of every probe are drawn, an array ``(n,)`` each, and the label of the axis.

    Arcs have their angles. A whole circle beside a part of one is cut opposite to that part, whose
    angles may go beyond 360 degrees. Edges on a line along an axis have this coordinate, as two
    that touch have the body on their left and so run against each other. Other edges have their
    arc length.
    """
    angles = [probe.angle for probe in probes if probe.angle is not None]
    if len(angles) == len(probes):
        return _turned(angles), "angle [°]"
    first = probes[0]
    if len({probe.place for probe in probes}) > 1:
        x = np.concatenate([probe.x for probe in probes])
        extent = np.ptp(x, axis=0)
        along = int(extent.argmax())
        if np.delete(extent, along).max() <= _STRAIGHT * extent[along]:
            label = f"{first.axes[along]} [{first.length}]"
            return [probe.x[:, along] for probe in probes], label
    return [probe.s for probe in probes], f"arc length [{first.length}]"


def _turned(angles: list[Array]) -> list[Array]:
    parts = [angle for angle in angles if not _is_whole(angle)]
    if not parts or len(parts) == len(angles):
        return angles
    middle = (parts[0].min() + parts[0].max()) / 2
    turns = 360 * np.floor((middle + 180) / 360)
    middle -= turns
    return [
        (angle - middle + 180) % 360 - 180 + middle if _is_whole(angle) else angle - turns
        for angle in angles
    ]


def _is_whole(angle: Array) -> bool:
    """Whether points at these angles leave no gap in a circle that is wider than between them."""
    placed = np.sort(angle)
    left = 360 - np.ptp(placed)
    widest = np.diff(placed).max(initial=0.0)
    return bool(left <= 2 * widest)
