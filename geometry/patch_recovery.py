"""Superconvergent patch recovery: nodal values from those at the integration points of the cells
around.

Zienkiewicz and Zhu (1992, Int. J. Numer. Meth. Engng 33, 1331): around every vertex a polynomial of
the degree of the displacements is fitted by least squares to the values at the integration points
of the cells that meet there. A vertex inside a body has the value of its own polynomial, one on the
boundary the mean of the neighbours' values inside, as its own would extrapolate from one side.
Where it has no such neighbour (corners, walls of one cell), its polynomial is fitted to two layers
of cells; near ones count more. Nodes on edges have the mean of both ends, nodes within
quadrilaterals the mean of the corners.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from archord.geometry.basis import Array

# squared distance over the farthest point's, within which points of wide patches count alike
_CORE = 0.05
_SINGULAR = 1e-13  # of patches with fewer points than coefficients, which get the smallest ones


class PatchRecovery:
    """From the ``points`` ``(m, q, 2)`` of ``cells`` ``(m, k)``, their corners in turn, to
    ``nodes`` ``(n, 2)``.

    The first nodes are the vertices; ``between`` are the vertices ``(i, e)`` that the further nodes
    lie between, one array after the other. Bodies share no vertex, so that nothing is smoothed over
    their boundaries.
    """

    def __init__(
        self,
        nodes: Array,
        cells: np.ndarray,
        between: Sequence[np.ndarray],
        points: Array,
        degree: int,
    ) -> None:
        n_vertices, (n_cells, k) = len(nodes) - sum(map(len, between)), cells.shape
        sides = np.sort(
            np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1
        )
        number, count = np.unique(sides[:, 0] * n_vertices + sides[:, 1], return_counts=True)
        edges = np.column_stack(np.divmod(number, n_vertices))
        outside = np.zeros(n_vertices, dtype=bool)
        outside[edges[count == 1]] = True
        both = np.concatenate([edges, edges[:, ::-1]])
        inward = both[outside[both[:, 0]] & ~outside[both[:, 1]]]
        alone = outside.copy()
        alone[inward[:, 0]] = False
        own = np.flatnonzero(~outside | alone)
        wanted, source = np.concatenate([inward, np.column_stack([own, own])]).T

        around = np.argsort(cells.ravel(), kind="stable")
        vertex, cell = cells.ravel()[around], around // k
        wide, keep = np.repeat(alone[vertex], k), ~outside[vertex]
        place, wider = _joined(cells[cell].ravel()[wide], vertex, cell)
        wider = np.unique(np.repeat(vertex, k)[wide][place] * n_cells + wider)
        vertex, self._cell = (
            np.append(vertex[keep], wider // n_cells),
            np.append(cell[keep], wider % n_cells),
        )
        self._first = np.flatnonzero(np.diff(vertex, prepend=-1))
        self._patch = np.zeros(n_vertices, dtype=np.int64)
        self._patch[vertex[self._first]] = np.arange(len(self._first))
        self._powers = np.array([[i - j, j] for i in range(degree + 1) for j in range(i + 1)])

        ray = points[self._cell] - nodes[vertex][:, None]
        square = (ray**2).sum(axis=-1)
        size = np.maximum.reduceat(square.max(axis=1), self._first)
        scale = np.sqrt(size)
        patch = self._patch[vertex]
        weight = np.where(alone[vertex][:, None], 1 / (_CORE + square / size[patch][:, None]), 1.0)
        P = self._monomials(ray / scale[patch][:, None, None])
        M = np.add.reduceat(np.swapaxes(P * weight[..., None], 1, 2) @ P, self._first)
        M += _SINGULAR * np.trace(M, axis1=1, axis2=2)[:, None, None] * np.eye(M.shape[1])
        self._fit = np.linalg.inv(M)[patch] @ np.swapaxes(P * weight[..., None], 1, 2)

        groups = [np.arange(n_vertices)[:, None], *between]
        end, n_ends = (
            np.concatenate([g.ravel() for g in groups]),
            [np.full(len(g), g.shape[1]) for g in groups],
        )
        count = np.concatenate(n_ends)
        place, source = _joined(end, wanted, source)
        node = np.repeat(np.arange(len(nodes)), count)[place]
        self._start, self._source = np.flatnonzero(np.diff(node, prepend=-1)), self._patch[source]
        value = self._monomials((nodes[node] - nodes[source]) / scale[self._source][:, None])
        self._value = value / (count[node] * np.bincount(wanted)[end[place]])[:, None]

    def _monomials(self, y: Array) -> Array:
        powers = np.ones((self._powers.max() + 1, *y.shape))
        np.cumprod(np.broadcast_to(y, powers[1:].shape), axis=0, out=powers[1:])
        return np.stack([powers[i, ..., 0] * powers[j, ..., 1] for i, j in self._powers], axis=-1)

    def __call__(self, values: Array) -> Array:
        """Values ``(n, c)`` at the nodes from ``values`` ``(m, q, c)`` at the points."""
        fitted = np.add.reduceat(self._fit @ values[self._cell], self._first)
        parts = self._value[:, None] @ fitted[self._source]
        return np.add.reduceat(parts[:, 0], self._start)


def _joined(keys: np.ndarray, of: np.ndarray, items: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All ``items`` ``of`` each of ``keys``, in turn, and the place in ``keys`` of each."""
    order = np.argsort(of, kind="stable")
    first, end = np.searchsorted(of[order], keys), np.searchsorted(of[order], keys, "right")
    place = np.repeat(np.arange(len(keys)), end - first)
    return place, items[order[np.arange(len(place)) + (end - np.cumsum(end - first))[place]]]
