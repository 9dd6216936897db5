"""Angles of points about the centre of an arc."""

from __future__ import annotations

import numpy as np

from archord.materials.material import Array

_GAP = 0.3  # degrees: the least gap in a circle
_ROUND_OFF = 1e-6  # degrees


def angles_about(x: Array, centre: Array) -> Array:
    """Angles in degrees from the x axis, of points ``(n, 2)`` about the ``centre``."""
    along, up = (x - centre).T
    return np.degrees(np.arctan2(up, along))


def rising(angle: Array, begin: Array, end: Array) -> Array:
    """Angles in degrees, risen so far that none is before the arcs of facets from ``begin`` to
    ``end`` ``(k,)``, which start behind the largest gap between the facets, and at 0 on a whole
    circle."""
    order = np.argsort(begin % 360)
    before = np.roll(end[order], 1)
    gap = (begin[order] - before + _GAP) % 360 - _GAP
    start = begin[order[gap.argmax()]] if gap.max() > _GAP else 0.0
    start = (start + _ROUND_OFF) % 360 - _ROUND_OFF
    return start + (angle - start + _ROUND_OFF) % 360 - _ROUND_OFF
