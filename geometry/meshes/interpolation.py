"""Values at points from nodal values of another mesh of curved cells."""

from __future__ import annotations

import basix
import basix.ufl
import numpy as np
from dolfinx.geometry import (
    bb_tree,
    compute_closest_entity,
    compute_collisions_points,
    create_midpoint_tree,
)
from dolfinx.mesh import create_mesh
from mpi4py import MPI

from archord.geometry.basis import (
    HEXAHEDRON,
    QUADRILATERAL,
    TETRAHEDRON,
    TRIANGLE,
    Array,
    element_of,
    table_of,
)
from archord.materials.kinematics import Ints

_NEWTON = 8  # iterations for the reference point: the cells are nearly straight
_STRAIGHT = 1e-9  # last step in a reference cell
# corners of the straight triangles or tetrahedra that make up a cell, in basix' order
_SIMPLICES = {
    TRIANGLE: np.array([[0, 1, 2]]),
    QUADRILATERAL: np.array([[0, 1, 2], [3, 2, 1]]),
    TETRAHEDRON: np.array([[0, 1, 2, 3]]),
    HEXAHEDRON: np.array([[0, 1, 2, 4], [3, 1, 7, 2], [5, 1, 4, 7], [6, 2, 7, 4], [1, 2, 4, 7]]),
}


class Interpolation:
    """From the nodes ``x`` ``(n, d)`` of ``cells`` ``(m, a)`` to points ``to`` ``(k, d)``.

    A point outside of all cells, as between a curved edge and its coarser image, gets the
    continuation of a cell next to it. Per point it keeps

    - ``_nodes`` ``(k, a)``: the nodes of its cell
    - ``_weights`` ``(k, a)``: their shape functions
    """

    def __init__(self, kind: basix.CellType, x: Array, cells: Ints, to: Array) -> None:
        self._element = element_of(kind, cells.shape[1])
        parts = _SIMPLICES[kind]
        simplices = cells[:, parts].reshape(-1, parts.shape[1])
        simplex, within = _located(x, simplices, to)
        cell, part = np.divmod(simplex, len(parts))
        self._nodes = cells[cell]
        barycentric = np.column_stack([1 - within.sum(axis=1), within])  # (k, d + 1)
        corners = basix.geometry(kind)[parts[part]]  # (k, d + 1, d), in the reference cell
        X = np.einsum("ki,kij->kj", barycentric, corners)
        if cells.shape[1] > parts.shape[1]:  # not linear
            self._improve(X, x, to)
        self._weights = table_of(self._element, X)[0]

    def _improve(self, X: Array, x: Array, to: Array) -> None:
        """Move the reference points ``X`` ``(k, d)`` to where the curved cells have ``to``."""
        moving = np.arange(len(to))
        for _ in range(_NEWTON):
            shape, *slopes = table_of(self._element, X[moving])
            nodes = x[self._nodes[moving]]
            misfit = to[moving] - np.einsum("na,nai->ni", shape, nodes)
            jacobian = np.einsum("jna,nai->nij", slopes, nodes)
            step = np.linalg.solve(jacobian, misfit[..., None])[..., 0]
            X[moving] += step
            length = np.abs(step).max(axis=1)
            moving = moving[length > _STRAIGHT]

    def __call__(self, values: Array) -> Array:
        """Values ``(k, c)`` at the points from those ``(n, c)`` at the nodes."""
        return np.einsum("ka,kac->kc", self._weights, values[self._nodes])


def _located(x: Array, simplices: Ints, to: Array) -> tuple[Ints, Array]:
    """The number of a straight triangle or tetrahedron ``(m, d + 1)`` with vertices ``x``
    ``(n, d)`` around each point of ``to`` ``(k, d)``, or next to it, and the point's reference
    coordinates ``(k, d)`` there."""
    point, cell = _candidates(x, simplices, to)
    corners = x[simplices[cell]]
    edges = corners[:, 1:] - corners[:, :1]
    ray = to[point] - corners[:, 0]
    X = np.linalg.solve(np.swapaxes(edges, 1, 2), ray[..., None])[..., 0]
    smallest = np.minimum(X.min(axis=1), 1 - X.sum(axis=1))  # barycentric coordinate
    order = np.lexsort((-smallest, point))  # by point, the best simplex first
    _, first = np.unique(point[order], return_index=True)
    best = order[first]
    return cell[best], X[best]


def _candidates(x: Array, simplices: Ints, to: Array) -> tuple[Ints, Ints]:
    """Pairs ``(p,)`` of a point of ``to`` and a simplex whose bounding box it is in, or the
    nearest simplex."""
    d = x.shape[1]
    kind = "triangle" if d == 2 else "tetrahedron"
    straight = basix.ufl.element("P", kind, 1, shape=(d,))
    cells = simplices.astype(np.int64, order="C")
    mesh = create_mesh(MPI.COMM_SELF, cells=cells, x=np.ascontiguousarray(x), e=straight)
    places = np.pad(to, ((0, 0), (0, 3 - d)))
    tree = bb_tree(mesh, mesh.topology.dim)
    found = compute_collisions_points(tree, places)
    points = np.arange(len(to))
    point = np.repeat(points, np.diff(found.offsets))
    cell = found.array
    lost = np.setdiff1d(points, point)
    if len(lost):
        every = np.arange(len(simplices), dtype=np.int32)
        middles = create_midpoint_tree(mesh, mesh.topology.dim, every)
        nearest = compute_closest_entity(tree, middles, mesh, places[lost])
        point = np.append(point, lost)
        cell = np.append(cell, nearest)
    return point, np.asarray(mesh.topology.original_cell_index)[cell]
