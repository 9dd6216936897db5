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
from functools import reduce

import basix
import numpy as np

from archord.geometry.basis import Array
from archord.materials.kinematics import Ints

# squared distance over the farthest point's, within which points of wide patches count alike
_CORE = 0.05
_SINGULAR = 1e-13  # of patches with fewer points than coefficients, which get the smallest ones


class PatchRecovery:
    """From the ``points`` ``(m, q, d)`` of ``cells`` ``(m, k)`` of a ``kind``, given by their
    corners, to ``nodes`` ``(n, d)``. Cells with fewer points than others have NaN behind them.

    The first nodes are the vertices; ``between`` are the vertices ``(i, e)`` that the further nodes
    lie between, one array after the other. Bodies share no vertex, so that nothing is smoothed over
    their boundaries.

    Attributes
    ----------
    _is_point : array (m, q)
        Whether a cell has the point.
    _powers : array (c, d)
        The powers of the coordinates in the monomials of the polynomials.
    _cell : array (p,)
        The cells of all patches, one patch after the other.
    _first : array (patches,)
        The places in ``_cell`` where the patches begin.
    _patch : array (vertices,)
        The number of each vertex' patch.
    _scale : array (patches,)
        The lengths by which coordinates in the patches are divided.
    _fit : array (p, c, q)
        What takes the values at a cell's points to its part of the patch's coefficients.
    _start : array (n,)
        The places where the terms of each node's mean begin.
    _source : array (t,)
        The patch of each term.
    _value : array (t, c)
        What takes the patch's coefficients to the term.
    """

    def __init__(
        self,
        kind: basix.CellType,
        nodes: Array,
        cells: Ints,
        between: Sequence[Ints],
        points: Array,
        degree: int,
    ) -> None:
        n_vertices = len(nodes) - sum(map(len, between))
        edges, outside = _boundary(kind, cells, n_vertices)
        inward = _inward(edges, outside)
        alone = outside.copy()  # on the boundary, without a neighbour inside
        alone[inward[:, 0]] = False
        own = np.flatnonzero(~outside | alone)
        by_themselves = np.column_stack([own, own])
        wanted, source = np.concatenate([inward, by_themselves]).T

        self._powers = _powers(degree, nodes.shape[1])
        self._is_point = np.logical_and.reduce(np.isfinite(points), axis=-1)
        points = np.where(self._is_point[..., None], points, 0.0)
        vertex, self._cell = _patches(cells, outside, alone)
        self._first = np.flatnonzero(np.diff(vertex, prepend=-1))
        centres = vertex[self._first]
        self._patch = np.zeros(n_vertices, dtype=np.int64)
        self._patch[centres] = np.arange(len(centres))
        ray = points[self._cell] - nodes[vertex][:, None]
        self._fit_patches(ray, self._patch[vertex], alone[vertex])
        self._mean_of_vertices(nodes, between, wanted, source)

    def _fit_patches(self, ray: Array, patch: Ints, wide: np.ndarray) -> None:
        """The fits of all patches by the ``ray`` ``(p, q, d)`` from their vertices to their points;
        in ``wide`` ones ``(p,)`` near points count more."""
        is_point = self._is_point[self._cell]
        square = np.where(is_point, (ray**2).sum(axis=-1), 0.0)
        size = np.maximum.reduceat(square.max(axis=1), self._first)
        self._scale = np.sqrt(size)
        relative = square / size[patch][:, None]
        near = 1 / (_CORE + relative)
        weight = np.where(wide[:, None], near, 1.0) * is_point
        scale = self._scale[patch]
        monomials = self._monomials(ray / scale[:, None, None])
        weighted = np.swapaxes(monomials * weight[..., None], 1, 2)
        moments = np.add.reduceat(weighted @ monomials, self._first)
        trace = np.trace(moments, axis1=1, axis2=2)
        moments += _SINGULAR * trace[:, None, None] * np.eye(moments.shape[1])
        inverse = np.linalg.inv(moments)
        self._fit = inverse[patch] @ weighted

    def _mean_of_vertices(
        self,
        nodes: Array,
        between: Sequence[Ints],
        wanted: np.ndarray,
        source: np.ndarray,
    ) -> None:
        """The terms of the means at all nodes: the vertices ``wanted`` have the mean of the
        polynomials of their ``source``, and further nodes the mean of their vertices."""
        n_vertices = len(self._patch)
        groups = [np.arange(n_vertices)[:, None], *between]
        end = np.concatenate([group.ravel() for group in groups])
        n_nodes = [len(group) for group in groups]
        of_each = [group.shape[1] for group in groups]
        n_ends = np.repeat(of_each, n_nodes)
        place, source = _joined(end, wanted, source)
        node = np.repeat(np.arange(len(nodes)), n_ends)[place]
        n_sources = np.bincount(wanted)[end[place]]
        self._start = np.flatnonzero(np.diff(node, prepend=-1))
        self._source = self._patch[source]
        scale = self._scale[self._source]
        from_centre = nodes[node] - nodes[source]
        value = self._monomials(from_centre / scale[:, None])
        n_terms = n_ends[node] * n_sources
        self._value = value / n_terms[:, None]

    def _monomials(self, y: Array) -> Array:
        powers = np.ones((self._powers.max() + 1, *y.shape))
        above_zero = powers[1:]
        np.cumprod(np.broadcast_to(y, above_zero.shape), axis=0, out=above_zero)
        monomials = []
        for of_axes in self._powers:
            factors = [powers[power, ..., axis] for axis, power in enumerate(of_axes)]
            monomials.append(reduce(np.multiply, factors))
        return np.stack(monomials, axis=-1)

    def __call__(self, values: Array) -> Array:
        """Values ``(n, c)`` at the nodes from ``values`` ``(m, q, c)`` at the points."""
        values = np.where(self._is_point[..., None], values, 0.0)
        fitted = np.add.reduceat(self._fit @ values[self._cell], self._first)
        parts = self._value[:, None] @ fitted[self._source]
        return np.add.reduceat(parts[:, 0], self._start)


def _powers(degree: int, dimension: int) -> Ints:
    """The powers ``(c, d)`` of all monomials up to a ``degree``, the lower degrees first."""
    powers = np.indices((degree + 1,) * dimension).reshape(dimension, -1).T
    total = powers.sum(axis=1)
    order = np.lexsort((*-powers.T[::-1], total))
    chosen = order[total[order] <= degree]
    return powers[chosen]


def _boundary(kind: basix.CellType, cells: Ints, n_vertices: int) -> tuple[np.ndarray, np.ndarray]:
    """The edges ``(e, 2)`` between vertices, and which vertices ``(n_vertices,)`` lie on the
    boundary."""
    topology = basix.topology(kind)
    edges, _ = _distinct(cells, topology[1])
    sides, count = _distinct(cells, topology[-2])
    outside = np.zeros(n_vertices, dtype=bool)
    outside[sides[count == 1]] = True
    return edges, outside


def _distinct(cells: Ints, parts: list[list[int]]) -> tuple[Ints, Ints]:
    """The edges or faces ``(e, v)`` that ``cells`` have as these ``parts``, by their vertices in
    rising order, and how many cells ``(e,)`` have each."""
    vertices = cells[:, np.array(parts)]
    rising = np.sort(vertices.reshape(-1, vertices.shape[-1]), axis=1)
    return np.unique(rising, axis=0, return_counts=True)


def _inward(edges: Ints, outside: np.ndarray) -> Ints:
    """Pairs ``(k, 2)`` of a vertex on the boundary and a neighbour inside."""
    both = np.concatenate([edges, edges[:, ::-1]])
    begins_outside = outside[both[:, 0]]
    ends_inside = ~outside[both[:, 1]]
    return both[begins_outside & ends_inside]


def _patches(cells: Ints, outside: np.ndarray, alone: np.ndarray) -> tuple[Ints, Ints]:
    """The vertices and the cells ``(p,)`` of their patches: one layer around vertices inside, two
    around those on the boundary that are ``alone``."""
    n_cells, k = cells.shape
    vertices = cells.ravel()
    around = np.argsort(vertices, kind="stable")
    vertex = vertices[around]
    cell = around // k
    wide = np.repeat(alone[vertex], k)
    centre = np.repeat(vertex, k)[wide]
    first_layer = cells[cell].ravel()[wide]
    place, second = _joined(first_layer, vertex, cell)
    both_layers = np.unique(centre[place] * n_cells + second)
    wide_vertex, wide_cell = np.divmod(both_layers, n_cells)
    inside = ~outside[vertex]
    return np.append(vertex[inside], wide_vertex), np.append(cell[inside], wide_cell)


def _joined(keys: Ints, of: Ints, items: Ints) -> tuple[Ints, Ints]:
    """All ``items`` ``of`` each of ``keys``, in turn, and the place in ``keys`` of each."""
    order = np.argsort(of, kind="stable")
    rising = of[order]
    first = np.searchsorted(rising, keys)
    count = np.searchsorted(rising, keys, "right") - first
    place = np.repeat(np.arange(len(keys)), count)
    shift = first + count - np.cumsum(count)
    found = np.arange(len(place)) + shift[place]
    return place, items[order[found]]
