"""Values at points from nodal values of another mesh of curved triangles."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array, lagrange_triangle

_FEW, _MANY = 4, 12  # cells whose centres are next to a point: the first hold nearly every point
_NEWTON = 4  # iterations for the reference point: the cells are nearly straight
_STRAIGHT = 1e-9  # last step in a reference cell
_CHUNK = 50_000  # points at once


class Interpolation:
    """From the nodes ``x`` ``(n, 2)`` of ``cells`` ``(m, a)``, of the given ``degree``, to points ``to`` ``(k, 2)``.

    A point outside of all cells, as between a curved edge and its coarser image, gets the continuation of the next
    cell's polynomial.
    """

    def __init__(self, x: Array, cells: np.ndarray, degree: int, to: Array) -> None:
        from scipy.spatial import cKDTree  # only meshes that are interpolated need it

        corners = x[cells[:, :3]]
        tree = cKDTree(corners.mean(axis=1))
        element = lagrange_triangle(degree)
        self._nodes = np.empty((len(to), cells.shape[1]), dtype=np.int64)
        self._weights = np.empty(self._nodes.shape)
        for start in range(0, len(to), _CHUNK):
            part = slice(start, start + _CHUNK)
            points = to[part]
            cell, X, outside = np.zeros(len(points), dtype=np.int64), np.zeros_like(points), np.arange(len(points))
            for candidates in (min(n, len(cells)) for n in (_FEW, _MANY)):
                some = points[outside]
                near = tree.query(some, k=candidates)[1].reshape(len(some), candidates)
                cell[outside], X[outside], margin = _inside(corners[near], near, some)
                outside = outside[margin < 0]
            moving = np.arange(len(points))
            for _ in range(_NEWTON if degree > 1 else 0):
                table, nodes = element.tabulate(1, X[moving])[..., 0], x[cells[cell[moving]]]
                misfit = points[moving] - np.einsum("na,nai->ni", table[0], nodes)
                J = np.einsum("jna,nai->nij", table[1:], nodes)
                step = np.linalg.solve(J, misfit[..., None])[..., 0]
                X[moving] += step
                moving = moving[np.abs(step).max(axis=1) > _STRAIGHT]
            self._nodes[part], self._weights[part] = cells[cell], element.tabulate(0, X)[0, ..., 0]

    def __call__(self, values: Array) -> Array:
        """Values ``(k, c)`` at the points from those ``(n, c)`` at the nodes."""
        return np.einsum("ka,kac->kc", self._weights, values[self._nodes])


def _inside(corners: Array, near: np.ndarray, to: Array) -> tuple[np.ndarray, Array, Array]:
    """Of the triangles ``near`` ``(k, c)`` with ``corners`` ``(k, c, 3, 2)`` the one around (or next to) each point of
    ``to``, the point's reference coordinates ``(k, 2)`` there, and the smallest barycentric one ``(k,)``."""
    origin = corners[:, :, 0]
    J = np.moveaxis(corners[:, :, 1:] - origin[:, :, None], -1, -2)
    d = to[:, None] - origin
    det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    X = np.stack(
        [J[..., 1, 1] * d[..., 0] - J[..., 0, 1] * d[..., 1], J[..., 0, 0] * d[..., 1] - J[..., 1, 0] * d[..., 0]],
        axis=-1,
    )
    X /= det[..., None]
    smallest = np.minimum(X.min(axis=-1), 1 - X.sum(axis=-1))
    best, row = smallest.argmax(axis=1), np.arange(len(to))
    return near[row, best], X[row, best], smallest[row, best]
