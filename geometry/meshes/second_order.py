"""Curved second-order cells, the highest that XDMF and its readers know, in the place of cells of
any degree."""

from __future__ import annotations

import basix
import numpy as np

from archord.geometry.basis import TRIANGLE, Array, cell_kind, tabulate
from archord.geometry.curve import lagrange
from archord.geometry.meshes.plane_mesh import distinct_edges


class SecondOrder:
    """Second-order cells in the place of cells with nodes ``nodes_of_cell`` ``(n, a)``.

    ``cells`` ``(n, 6)`` or ``(n, 9)`` are their nodes: ``corners`` vertices, then the middles of
    the edges, and of quadrilaterals, in basix' order. The nodes behind the vertices lie between
    those of ``between``.
    """

    def __init__(self, nodes_of_cell: np.ndarray) -> None:
        kind, degree = cell_kind(nodes_of_cell.shape[1])
        n, k = len(nodes_of_cell), len(basix.topology(kind)[0])  # as many vertices as edges
        self._vertices, index = np.unique(nodes_of_cell[:, :k], return_inverse=True)
        inner = np.split(nodes_of_cell[:, k : k * degree], k, axis=1)  # nodes within the edges
        ends = [nodes_of_cell[:, edge] for edge in basix.topology(kind)[1]]
        edges = np.concatenate([np.hstack(pair) for pair in zip(ends, inner, strict=True)])
        first, of_edge = distinct_edges(edges[:, :2])
        self._edges, before = edges[first], len(self._vertices)
        self.cells = np.hstack([index.reshape(-1, k), before + of_edge.reshape(k, -1).T])
        self._whole = nodes_of_cell[: 0 if kind == TRIANGLE else n]  # of cells with a middle
        if len(self._whole):
            self.cells = np.column_stack([self.cells, before + len(first) + np.arange(n)])
        self._at_middle = tabulate(kind, degree, np.array([[0.5, 0.5]]))[0, 0]
        self.corners, within = k, np.searchsorted(self._vertices, self._whole[:, :k])
        self.between = [np.searchsorted(self._vertices, self._edges[:, :2]), within]
        weights = lagrange(degree) @ 0.5 ** np.arange(
            degree + 1
        )  # of equispaced nodes, at the middle
        self._weights = weights[[0, degree, *range(1, degree)]]

    def __call__(self, values: Array) -> Array:
        """Values ``(m, k)`` at the nodes of the second-order cells, from those at the nodes of the
        cells."""
        middles = np.einsum("a,eak->ek", self._weights, values[self._edges])
        within = np.einsum("a,nak->nk", self._at_middle, values[self._whole])
        return np.concatenate([values[self._vertices], middles, within])

    def along(self, ends: np.ndarray) -> np.ndarray:
        """Nodes ``(k, 3)`` of edges with the vertices ``ends`` ``(k, 2)``: the first one, the
        middle, the last one."""
        n, vertices = len(self._vertices), np.searchsorted(self._vertices, ends)
        numbers, wanted = (np.sort(pair, axis=1) @ [n, 1] for pair in (self.between[0], vertices))
        order = np.argsort(numbers)
        middle = n + order[np.searchsorted(numbers, wanted, sorter=order)]
        return np.column_stack([vertices[:, 0], middle, vertices[:, 1]])
