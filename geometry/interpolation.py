"""Values at points from nodal values of another mesh of curved triangles."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array, lagrange_triangle

_CANDIDATES = 12  # cells whose centres are next to a point
_NEWTON = 4  # iterations for the reference point: the cells are nearly straight
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
            near = tree.query(to[part], k=min(_CANDIDATES, len(cells)))[1].reshape(len(to[part]), -1)
            cell, X = _inside(corners[near], near, to[part])
            nodes = x[cells[cell]]
            for _ in range(_NEWTON if degree > 1 else 0):
                table = element.tabulate(1, X)[..., 0]
                misfit = to[part] - np.einsum("na,nai->ni", table[0], nodes)
                J = np.einsum("jna,nai->nij", table[1:], nodes)
                X = X + np.linalg.solve(J, misfit[..., None])[..., 0]
            self._nodes[part], self._weights[part] = cells[cell], element.tabulate(0, X)[0, ..., 0]

    def __call__(self, values: Array) -> Array:
        """Values ``(k, c)`` at the points from those ``(n, c)`` at the nodes."""
        return np.einsum("ka,kac->kc", self._weights, values[self._nodes])


def _inside(corners: Array, near: np.ndarray, to: Array) -> tuple[np.ndarray, Array]:
    """Of the triangles ``near`` ``(k, c)`` with ``corners`` ``(k, c, 3, 2)`` the one around (or next to) each point of
    ``to``, and the point's reference coordinates ``(k, 2)`` there."""
    origin = corners[:, :, 0]
    J = np.moveaxis(corners[:, :, 1:] - origin[:, :, None], -1, -2)
    d = to[:, None] - origin
    det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    X = np.stack(
        [J[..., 1, 1] * d[..., 0] - J[..., 0, 1] * d[..., 1], J[..., 0, 0] * d[..., 1] - J[..., 1, 0] * d[..., 0]],
        axis=-1,
    )
    X /= det[..., None]
    best = np.minimum(X.min(axis=-1), 1 - X.sum(axis=-1)).argmax(axis=1)
    row = np.arange(len(to))
    return near[row, best], X[row, best]
