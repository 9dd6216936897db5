"""The frames of contact points: the opposite's outward normal, then its tangents."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.vectors import unit


def plane_frames(normal: Array) -> Array:
    """Frames ``(m, 2, 2)`` of points with the unit ``normal`` ``(m, 2)``, row by row: the tangent
    is the normal turned by a quarter anticlockwise."""
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    return np.stack([normal, tangent], axis=1)


def frames_at_rest(normal: Array) -> Array:
    """Frames ``(m, 3, 3)`` of points in space with the unit ``normal`` ``(m, 3)``: the first
    tangent leads along the coordinate axis that is least along the normal, as far as it may."""
    least = np.abs(normal).argmin(axis=1)
    axis = np.eye(3)[least]
    along_normal = np.einsum("mi,mi->m", axis, normal)
    first = unit(axis - along_normal[:, None] * normal)
    second = np.cross(normal, first)
    return np.stack([normal, first, second], axis=1)


class TurningFrames:
    """Frames of points in space that turn from the frame ``at_rest`` ``(m, 3, 3)`` to the unit
    ``normal`` ``(m, 3)`` on the shortest way: components along the tangents then mean the same
    whatever tangents are chosen at rest.

    A body that turns about the normal does not take the tangents with it.

    frame : (m, 3, 3) normal and tangents, row by row
    spin : (m, 2) turn of the frame about its normal, as that turns towards each tangent
    """

    def __init__(self, at_rest: Array, normal: Array) -> None:
        along_normal = np.einsum("mij,mj->mi", at_rest, normal)
        start, first, second = along_normal.T
        divisor = (1 + start)[:, None]
        tilt = along_normal[:, 1:] / divisor
        halfway = at_rest[:, 0] + normal
        tangents = at_rest[:, 1:] - tilt[:, :, None] * halfway[:, None]
        self.frame = np.concatenate([normal[:, None], tangents], axis=1)
        self.spin = np.stack([second, -first], axis=1) / divisor
