"""Curved second-order cells, the highest order that XDMF and its readers know, in the place of
cells of any order."""

from __future__ import annotations

import basix
import numpy as np

from archord.geometry.basis import Array, dimension_of, element_of
from archord.geometry.meshes.cells import (
    distinct,
    entities_of,
    n_corners,
    sides_between,
    sides_of,
)
from archord.materials.kinematics import Ints


class SecondOrder:
    """Second-order cells in the place of cells with ``nodes`` ``(m, a)``.

    Their nodes are vertices, then the middles of edges, then the middles of quadrilaterals, then
    the middles of hexahedra.

    - ``corners``: how many of a cell's nodes are vertices
    - ``cells`` ``(m, 6)``, ``(m, 9)``, ``(m, 10)`` or ``(m, 27)``: their nodes, in basix' order
    - ``between``: the vertices of edges ``(e, 2)``, of quadrilaterals ``(f, 4)`` and, in space, of
      hexahedra ``(m, 8)``, between which the nodes behind the vertices lie
    """

    def __init__(self, kind: basix.CellType, nodes: Ints) -> None:
        self._kind = kind
        m = len(nodes)
        self.corners = n_corners(kind)
        self._vertices, vertex = np.unique(nodes[:, : self.corners], return_inverse=True)
        parts: list[Ints] = [vertex.reshape(m, -1)]
        self.between = []
        # nodes ``(e, b)`` of the entities with a node in the middle, and its weights ``(b,)``
        self._middles = []
        n_nodes = len(self._vertices)
        for dim in range(1, dimension_of(kind) + 1):
            of_dim = basix.cell.subentity_types(kind)[dim][0]
            entities = entities_of(kind, nodes, dim)
            if n_corners(of_dim) != 2**dim:
                entities = entities[:0]
            around = entities[:, : n_corners(of_dim)]
            first: np.ndarray = np.arange(len(entities))  # a cell shares its inside with no other
            which = first
            if dim < dimension_of(kind):
                first, which = distinct(around)
            middle = np.full((1, dim), 0.5)
            at_middle = element_of(of_dim, entities.shape[1]).tabulate(0, middle)[0, 0, :, 0]
            self._middles.append((entities[first], at_middle))
            self.between.append(np.searchsorted(self._vertices, around[first]))
            parts.append((n_nodes + which).reshape(m, -1))
            n_nodes += len(first)
        self.cells = np.hstack(parts)

    def __call__(self, values: Array) -> Array:
        """Values ``(m, k)`` at the nodes of the second-order cells, from those at the nodes of the
        cells."""
        middles = [
            np.einsum("a,eak->ek", weights, values[entities]) for entities, weights in self._middles
        ]
        return np.concatenate([values[self._vertices], *middles])

    def sides(self, corners: Ints) -> Ints:
        """Nodes of the sides of cells with the vertices ``corners`` ``(k, c)``: of edges ``(k, 3)``
        the first one, the middle, the last one; of faces ``(k, 6)`` or ``(k, 9)`` in basix'
        order."""
        wanted = np.searchsorted(self._vertices, corners)
        found = sides_between(self._kind, self.cells, wanted)
        sides = sides_of(self._kind, self.cells)[found]
        if corners.shape[1] > 2:
            return sides
        return np.column_stack([wanted[:, 0], sides[:, 2], wanted[:, 1]])
