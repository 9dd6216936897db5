"""Curved second-order cells, the highest order that XDMF and its readers know, in the place of
cells of any order."""

from __future__ import annotations

import basix
import numpy as np

from archord.geometry.basis import QUADRILATERAL, Array, order_of, tabulate
from archord.geometry.curve import lagrange
from archord.geometry.meshes.cells import distinct_edges, n_corners, sides_of


class SecondOrder:
    """Second-order cells in the place of cells with ``nodes`` ``(m, a)``.

    Their nodes are vertices, then the middles of edges, then the middles of quadrilaterals.

    - ``corners``: how many of a cell's nodes are vertices
    - ``cells`` ``(m, 6)`` or ``(m, 9)``: their nodes, in basix' order
    - ``between``: the vertices ``(e, 2)`` of edges and ``(m, 4)`` of quadrilaterals, between which
      the nodes behind the vertices lie
    """

    def __init__(self, kind: basix.CellType, nodes: np.ndarray) -> None:
        order = order_of(kind, nodes.shape[1])
        m = len(nodes)
        self.corners = n_corners(kind)
        self._vertices, vertex = np.unique(nodes[:, : self.corners], return_inverse=True)
        sides = sides_of(kind, nodes)
        first, edge = distinct_edges(sides[:, :2])
        self._edges = sides[first]
        n_vertices = len(self._vertices)
        parts = [vertex.reshape(m, -1), n_vertices + edge.reshape(m, -1)]
        self._whole = nodes[: m if kind == QUADRILATERAL else 0]  # cells with a node in the middle
        if len(self._whole):
            parts.append(n_vertices + len(first) + np.arange(m)[:, None])
        self.cells = np.hstack(parts)
        ends = self._edges[:, :2]
        around = self._whole[:, : self.corners]
        self.between = [np.searchsorted(self._vertices, of) for of in (ends, around)]
        self._at_middle = tabulate(kind, order, np.array([[0.5, 0.5]]))[0, 0]
        at_half = lagrange(order) @ 0.5 ** np.arange(order + 1)  # of equispaced nodes
        self._weights = at_half[[0, order, *range(1, order)]]

    def __call__(self, values: Array) -> Array:
        """Values ``(m, k)`` at the nodes of the second-order cells, from those at the nodes of the
        cells."""
        middles = np.einsum("a,eak->ek", self._weights, values[self._edges])
        within = np.einsum("a,nak->nk", self._at_middle, values[self._whole])
        return np.concatenate([values[self._vertices], middles, within])

    def along(self, ends: np.ndarray) -> np.ndarray:
        """Nodes ``(k, 3)`` of edges with the vertices ``ends`` ``(k, 2)``: the first one, the
        middle, the last one."""
        edges = self.between[0]
        wanted = np.searchsorted(self._vertices, ends)
        first, which = distinct_edges(np.concatenate([edges, wanted]))
        middle = len(self._vertices) + first[which[len(edges) :]]
        return np.column_stack([wanted[:, 0], middle, wanted[:, 1]])
