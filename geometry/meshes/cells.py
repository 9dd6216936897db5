"""Cells and their sides as rows of node numbers, in the order of basix and of other programs.

A row names the corners of a Lagrange cell first, then the nodes within its sides, then those inside
it. A side comes as its two ends and the nodes between them.
"""

from __future__ import annotations

from collections.abc import Callable

import basix
import numpy as np
from dolfinx.mesh import CellType, to_type

from archord.geometry.basis import QUADRILATERAL, TRIANGLE, Array, lagrange_element, order_of

_SERENDIPITY = 8  # nodes of a quadrilateral of second order without one in its middle


def n_corners(kind: basix.CellType) -> int:
    """How many corners, and so how many sides, a cell has."""
    return len(basix.topology(kind)[0])


def sides_of(kind: basix.CellType, cells: np.ndarray) -> np.ndarray:
    """Nodes ``(m s, b)`` of the sides of ``cells`` ``(m, a)``, cell by cell."""
    order = order_of(kind, cells.shape[1])
    of_side = lagrange_element(kind, order).entity_closure_dofs[1]
    return cells[:, of_side].reshape(-1, order + 1)


def along(sides: np.ndarray) -> np.ndarray:
    """``sides`` ``(k, b)`` with their nodes as they follow each other."""
    return sides[:, [0, *range(2, sides.shape[1]), 1]]


def distinct_edges(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each edge comes first among ``ends`` ``(k, 2)``, and the number ``(k,)`` of each edge.

    Edges have no direction.
    """
    low, high = np.sort(ends.astype(np.int64), axis=1).T
    number = low * (high.max(initial=0) + 1) + high
    _, first, which = np.unique(number, return_index=True, return_inverse=True)
    return first, which


def edges_among(edges: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Whether each of ``edges`` ``(k, b)`` is one of the ``others`` ``(j, b)``."""
    _, which = distinct_edges(np.concatenate([edges[:, :2], others[:, :2]]))
    return np.isin(which[: len(edges)], which[len(edges) :])


def sides_between(kind: basix.CellType, cells: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Which of `sides_of` ``cells`` has each pair of ``ends`` ``(k, 2)``; where none has, a number
    beyond them."""
    sides = sides_of(kind, cells)
    first, which = distinct_edges(np.concatenate([sides[:, :2], ends]))
    return first[which[len(sides) :]]


def outer_sides(kind: basix.CellType, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sides ``(k, b)`` of ``cells`` that belong to one cell alone, and that cell ``(k,)``."""
    sides = sides_of(kind, cells)
    first, which = distinct_edges(sides[:, :2])
    alone = first[np.bincount(which) == 1]
    return sides[alone], alone // n_corners(kind)


def inner_weights(kind: basix.CellType, order: int) -> Array:
    """Weights ``(i, b)`` that place the ``i`` nodes inside a cell by the ``b`` nodes on its sides.

    They are exact for all polynomials that the sides determine (Coons 1967), in cubic triangles for
    quadratic ones.
    """
    element = lagrange_element(kind, order)
    p = np.arange(order + 1)
    determined = p[:, None] + p < order if kind == TRIANGLE else np.minimum(p[:, None], p) <= 1
    i, j = np.nonzero(determined)
    x, y = element.points.T[:, :, None]
    values = x**i * y**j
    on_sides = len(values) - len(element.entity_dofs[2][0])
    return values[on_sides:] @ np.linalg.pinv(values[:on_sides])


def with_middle_nodes(x: Array, cells: np.ndarray) -> tuple[Array, np.ndarray]:
    """Nodes and quadrilaterals ``(m, 9)`` for ``cells`` ``(m, 8)``, which have no node inside.

    The new node lies where the others interpolate. Four corners come first, then the middles of the
    sides in any order.
    """
    middle = np.einsum("b,cbk->ck", inner_weights(QUADRILATERAL, 2)[0], x[cells])
    number = len(x) + np.arange(len(cells))
    return np.concatenate([x, middle]), np.column_stack([cells, number])


def in_basix_order(
    kind: basix.CellType,
    x: Array,
    cells: np.ndarray,
    permutation: Callable[[CellType, int], list[int]],
) -> tuple[Array, np.ndarray]:
    """Nodes and ``cells`` ``(m, a)`` from those in another program's order.

    Quadrilaterals of 8 nodes get a ninth.
    """
    if kind == QUADRILATERAL and cells.shape[1] == _SERENDIPITY:
        x, cells = with_middle_nodes(x, cells)
    order_of(kind, cells.shape[1])
    return x, cells[:, permutation(to_type(kind.name), cells.shape[1])]


def quarters(kind: basix.CellType, X: Array) -> Array:
    """Where the four parts ``(4, q, 2)`` of a reference cell have the points ``X`` ``(q, 2)``."""
    corner = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]])
    size = np.full(4, 0.5)
    if kind == TRIANGLE:
        size[3] = -0.5  # the part in the middle is turned
    return corner[:, None] + size[:, None, None] * X
