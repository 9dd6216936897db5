"""Nodal fields of any degree on the six nodes of second-order triangles, the highest that XDMF and its readers know."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import lagrange
from archord.geometry.plane_mesh import distinct_edges

_EDGES = [(1, 2), (0, 2), (0, 1)]  # vertices of a cell's edges, in basix' order of its nodes


class SecondOrder:
    """Second-order triangles in the place of cells with nodes ``nodes_of_cell`` ``(n, a)`` of the given ``degree``.

    ``cells`` ``(n, 6)`` are their nodes: vertices, then the middles of the edges in basix' order.
    """

    def __init__(self, nodes_of_cell: np.ndarray, degree: int) -> None:
        vertices, index = np.unique(nodes_of_cell[:, :3], return_inverse=True)
        corners = index.reshape(-1, 3)
        along = degree - 1
        edges = np.concatenate(
            [
                np.column_stack([nodes_of_cell[:, list(ends)], nodes_of_cell[:, 3 + k * along : 3 + (k + 1) * along]])
                for k, ends in enumerate(_EDGES)
            ]
        )
        first, of_edge = distinct_edges(edges[:, :2])
        middles = len(vertices) + of_edge.reshape(3, -1).T
        self.cells = np.concatenate([corners, middles], axis=1)
        self._vertices, self._edges = vertices, edges[first]
        weights = lagrange(degree) @ 0.5 ** np.arange(degree + 1)  # of equispaced nodes, at the middle
        self._weights = weights[[0, degree, *range(1, degree)]]

    def __call__(self, values: Array) -> Array:
        """Values ``(m, k)`` at the nodes of the second-order triangles, from those at the nodes of the cells."""
        middles = np.einsum("a,eak->ek", self._weights, values[self._edges])
        return np.concatenate([values[self._vertices], middles])
