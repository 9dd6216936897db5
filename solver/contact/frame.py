"""The frames of contact points: the opposite's outward normal, then its tangents."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array


def frames(normal: Array, towards: Array) -> Array:
    """Frames ``(m, d, d)`` of points with the unit ``normal`` ``(m, d)``, row by row.

    In a plane the tangent is the normal turned by a quarter anticlockwise. In space the first
    tangent leads ``towards`` a vector ``(m, 3)`` as far as it may, and the second is the product of
    normal and first.
    """
    if normal.shape[-1] == 2:
        return np.stack([normal, np.stack([-normal[:, 1], normal[:, 0]], axis=1)], axis=1)
    along_normal = np.einsum("mi,mi->m", towards, normal)
    tangent = towards - along_normal[:, None] * normal
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    return np.stack([normal, tangent, np.cross(normal, tangent)], axis=1)


def askew(outward: Array) -> Array:
    """Unit vectors ``(m, d)`` at right angles to the ``outward`` normals ``(m, d)``: the way of the
    coordinate axis along which they point least."""
    axis = np.eye(outward.shape[1])[np.abs(outward).argmin(axis=1)]
    across = axis - np.einsum("mi,mi->m", axis, outward)[:, None] * outward
    return across / np.linalg.norm(across, axis=1)[:, None]
