"""Cells and their sides as rows of node numbers, in the order of basix and of other programs.

A row names the corners of a Lagrange cell first, then the nodes within its edges, then those within
its faces, then those inside it. A side is an edge of a plane cell, a face of a cell in space. Its
row has the same order.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import basix
import numpy as np
from dolfinx.mesh import CellType, to_type

from archord.geometry.basis import (
    HEXAHEDRON,
    QUADRILATERAL,
    TETRAHEDRON,
    TRIANGLE,
    Array,
    dimension_of,
    element_of,
    lagrange_element,
    order_of,
)
from archord.materials.kinematics import Bools, Ints

_HIGHEST = 3  # order
_SERENDIPITY = {QUADRILATERAL: (8, 9), HEXAHEDRON: (20, 27)}  # nodes, without and with middle ones
# Corners of the parts within a simplex, as pairs of its corners between which they lie. What the
# parts at the corners of a tetrahedron leave is cut from the edge 0 2 to the edge 1 3.
_WITHIN = {
    TRIANGLE: [[(1, 2), (0, 2), (0, 1)]],
    TETRAHEDRON: [
        [(0, 2), (1, 3), (0, 1), (0, 3)],
        [(0, 2), (1, 3), (0, 3), (2, 3)],
        [(0, 2), (1, 3), (2, 3), (1, 2)],
        [(0, 2), (1, 3), (1, 2), (0, 1)],
    ],
}


def n_corners(kind: basix.CellType) -> int:
    """How many corners a cell has."""
    return len(basix.topology(kind)[0])


def is_simplex(kind: basix.CellType) -> bool:
    """Whether a cell is a triangle or a tetrahedron."""
    return n_corners(kind) == dimension_of(kind) + 1


def side_kind(kind: basix.CellType) -> basix.CellType:
    """The kind of the sides of a cell: interval, triangle or quadrilateral."""
    return basix.cell.subentity_types(kind)[-2][0]


def n_sides(kind: basix.CellType) -> int:
    """How many sides a cell has."""
    return len(basix.topology(kind)[-2])


def entities_of(kind: basix.CellType, cells: Ints, dim: int) -> Ints:
    """Nodes ``(m s, b)`` of the edges (``dim`` 1), faces or insides of ``cells`` ``(m, a)``, cell
    by cell."""
    of_entity = _closures(kind, cells.shape[1])[dim]
    return cells[:, of_entity].reshape(-1, of_entity.shape[1])


@cache
def _closures(kind: basix.CellType, nodes: int) -> list[Ints]:
    """For each dimension the nodes ``(s, b)`` of the entities of a cell of so many ``nodes``."""
    return [np.array(of_dim) for of_dim in element_of(kind, nodes).entity_closure_dofs]


def sides_of(kind: basix.CellType, cells: Ints) -> Ints:
    """Nodes ``(m s, b)`` of the sides of ``cells`` ``(m, a)``, cell by cell."""
    return entities_of(kind, cells, dimension_of(kind) - 1)


def along(sides: Ints) -> Ints:
    """Edges ``sides`` ``(k, b)`` with their nodes as they follow each other."""
    return sides[:, [0, *range(2, sides.shape[1]), 1]]


def lengths(x: Array, edges: Ints) -> Array:
    """How far the ends of ``edges`` ``(k, b)`` are from each other ``(k,)``."""
    ends = x[edges[:, :2]]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def distinct(corners: Ints) -> tuple[Ints, Ints]:
    """Where each edge or face comes first among ``corners`` ``(k, c)``, and the number ``(k,)`` of
    each.

    They have no direction.
    """
    rising = np.sort(corners.astype(np.int64), axis=1)
    number, *others = rising.T
    first = np.zeros(0, dtype=np.int64)
    for other in others:
        n_others = other.max(initial=0) + 1
        number = number * n_others + other
        _, first, number = np.unique(number, return_index=True, return_inverse=True)
    return first, number


def corners_of(kind: basix.CellType, sides: Ints) -> Ints:
    """The corners ``(k, c)`` of ``sides`` ``(k, b)`` of cells."""
    return sides[:, : n_corners(side_kind(kind))]


def sides_among(kind: basix.CellType, sides: Ints, others: Ints) -> Bools:
    """Whether each of the ``sides`` ``(k, b)`` is one of the ``others`` ``(j, b)``."""
    together = np.concatenate([corners_of(kind, sides), corners_of(kind, others)])
    _, which = distinct(together)
    own, of_others = np.split(which, [len(sides)])
    return np.isin(own, of_others)


def sides_between(kind: basix.CellType, cells: Ints, corners: Ints) -> Ints:
    """Which of `sides_of` ``cells`` has each row of ``corners`` ``(k, c)``; where none has, a
    number beyond them."""
    sides = sides_of(kind, cells)
    together = np.concatenate([corners_of(kind, sides), corners])
    first, which = distinct(together)
    wanted = which[len(sides) :]
    return first[wanted]


def outer_sides(kind: basix.CellType, cells: Ints) -> tuple[Ints, Ints]:
    """The sides ``(k, b)`` of ``cells`` that belong to one cell alone, and that cell ``(k,)``."""
    sides = sides_of(kind, cells)
    first, which = distinct(corners_of(kind, sides))
    n_cells = np.bincount(which)
    alone = first[n_cells == 1]
    return sides[alone], alone // n_sides(kind)


def in_mirror(X: Array) -> Array:
    """Points ``X`` ``(q, d)`` of a reference cell, with its first two axes exchanged."""
    x, y, *others = X.T
    return np.stack([y, x, *others], axis=1)


def are_mirrored(kind: basix.CellType, x: Array) -> Bools:
    """Which cells ``(m,)`` have a negative determinant at the first of their nodes ``x`` ``(m, a,
    d)``."""
    distance = basix.geometry(kind).sum(axis=1)
    beside = np.flatnonzero(distance == 1)
    edges = x[:, beside] - x[:, :1]
    return np.linalg.det(edges) < 0


def turned(kind: basix.CellType, order: int, cells: Ints, which: Bools) -> Ints:
    """``cells`` ``(m, a)`` of this ``order``, those ``which`` ``(m,)`` are chosen with their nodes
    as in a mirror."""
    points = lagrange_element(kind, order).points
    apart = points[:, None] - in_mirror(points)
    image = np.abs(apart).sum(axis=2).argmin(axis=0)
    return np.where(which[:, None], cells[:, image], cells)


def inner_weights(kind: basix.CellType, order: int) -> Array:
    """Weights ``(i, b)`` that place the ``i`` nodes inside a cell by the ``b`` nodes on its sides.

    They are exact for all polynomials that the sides determine (Coons 1967), in cubic triangles for
    quadratic ones.
    """
    element = lagrange_element(kind, order)
    d = dimension_of(kind)
    powers = np.indices((order + 1,) * d).reshape(d, -1)
    determined = powers.sum(axis=0) < order if is_simplex(kind) else powers.min(axis=0) <= 1
    x = element.points.T[:, :, None]
    values = np.prod(x ** powers[:, None, determined], axis=0)  # (nodes, polynomials)
    n_on_sides = len(values) - len(element.entity_dofs[-1][0])
    on_sides, inside = np.split(values, [n_on_sides])
    return inside @ np.linalg.pinv(on_sides)


def with_middle_nodes(kind: basix.CellType, x: Array, cells: Ints) -> tuple[Array, Ints]:
    """Nodes and ``cells`` with middle nodes, for quadrilaterals ``(m, 8)`` and hexahedra ``(m,
    20)``, which have none in their faces and inside.

    A new node lies where the nodes around it interpolate. Corners come first, then the middles of
    the edges in basix' order.
    """
    element = lagrange_element(kind, 2)
    for dim in range(2, dimension_of(kind) + 1):
        face = basix.cell.subentity_types(kind)[dim][0]
        (weights,) = inner_weights(face, 2)
        around = np.array(element.entity_closure_dofs[dim])[:, :-1]
        faces = cells[:, around].reshape(-1, around.shape[1])
        first, which = distinct(faces[:, : 2**dim])
        middles = np.einsum("b,cbk->ck", weights, x[faces[first]])
        numbers = (len(x) + which).reshape(len(cells), -1)
        cells = np.hstack([cells, numbers])
        x = np.concatenate([x, middles])
    return x, cells


def in_basix_order(
    kind: basix.CellType,
    x: Array,
    cells: Ints,
    permutation: Callable[[CellType, int], list[int]],
) -> tuple[Array, Ints]:
    """Nodes and ``cells`` ``(m, a)`` from those in another program's order.

    Quadrilaterals of 8 nodes get a ninth, hexahedra of 20 nodes seven more.
    """
    given = cells.shape[1]
    without, whole = _SERENDIPITY.get(kind, (0, 0))
    wanted = whole if given == without else given
    order_of(kind, wanted)
    cells = cells[:, permutation(to_type(kind.name), wanted)[:given]]
    return (x, cells) if given == wanted else with_middle_nodes(kind, x, cells)


@cache
def _parts(kind: basix.CellType) -> tuple[Array, Array]:
    """First corners ``(p, d)`` and edges ``(p, d, d)`` of the parts of a reference cell, half as
    large."""
    corner = basix.geometry(kind)
    n, d = corner.shape
    if kind not in _WITHIN:
        return corner / 2, np.broadcast_to(np.eye(d) / 2, (n, d, d))
    at_corners = [[(k, other) for other in range(n)] for k in range(n)]
    ends = np.array([*at_corners, *_WITHIN[kind]])  # (p, corners of a part, 2)
    x = corner[ends].mean(axis=2)
    return x[:, 0], x[:, 1:] - x[:, :1]


def parts_of(kind: basix.CellType, X: Array) -> Array:
    """Where the parts ``(2^d, q, d)`` of a reference cell, cut in the middles of its edges, have
    the points ``X`` ``(q, d)``."""
    corner, edges = _parts(kind)
    return corner[:, None] + X @ edges
