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

from archord.geometry.basis import TRIANGLE, Array, cell_kind, tabulate

_NEWTON = 8  # iterations for the reference point: the cells are nearly straight
_STRAIGHT = 1e-9  # last step in a reference cell


class Interpolation:
    """From the nodes ``x`` ``(n, 2)`` of ``cells`` ``(m, a)`` to points ``to`` ``(k, 2)``.

    A point outside of all cells, as between a curved edge and its coarser image, gets the
    continuation of a cell next to it.
    """

    def __init__(self, x: Array, cells: np.ndarray, to: Array) -> None:
        kind, degree = cell_kind(cells.shape[1])
        halves = np.array(
            [[0, 1, 2]] if kind == TRIANGLE else [[0, 1, 2], [3, 2, 1]]
        )  # in basix' order of corners
        triangle, X = _located(x, cells[:, halves].reshape(-1, 3), to)
        cell, half = np.divmod(triangle, len(halves))
        weights = np.column_stack([1 - X.sum(axis=1), X])
        X = np.einsum("ki,kij->kj", weights, basix.geometry(kind)[halves[half]])
        self._nodes, moving = cells[cell], np.arange(len(to))
        for _ in range(0 if cells.shape[1] == 3 else _NEWTON):
            table, nodes = tabulate(kind, degree, X[moving]), x[self._nodes[moving]]
            misfit = to[moving] - np.einsum("na,nai->ni", table[0], nodes)
            step = np.linalg.solve(np.einsum("jna,nai->nij", table[1:], nodes), misfit[..., None])[
                ..., 0
            ]
            X[moving] += step
            moving = moving[np.abs(step).max(axis=1) > _STRAIGHT]
        self._weights = tabulate(kind, degree, X)[0]

    def __call__(self, values: Array) -> Array:
        """Values ``(k, c)`` at the points from those ``(n, c)`` at the nodes."""
        return np.einsum("ka,kac->kc", self._weights, values[self._nodes])


def _located(x: Array, triangles: np.ndarray, to: Array) -> tuple[np.ndarray, Array]:
    """The number of a straight triangle ``(m, 3)`` with vertices ``x`` ``(n, 2)`` around each point
    of ``to`` ``(k, 2)``, or next to it, and the point's reference coordinates ``(k, 2)`` there."""
    straight = basix.ufl.element("P", "triangle", 1, shape=(2,))
    vertices, places = np.ascontiguousarray(x), np.pad(to, ((0, 0), (0, 1)))
    mesh = create_mesh(
        MPI.COMM_SELF, cells=triangles.astype(np.int64, order="C"), x=vertices, e=straight
    )
    tree = bb_tree(mesh, 2)
    found = compute_collisions_points(tree, places)
    point, cell = np.repeat(np.arange(len(to)), np.diff(found.offsets)), found.array
    lost = np.setdiff1d(np.arange(len(to)), point)  # in no triangle's bounding box
    if len(lost):
        everything = create_midpoint_tree(mesh, 2, np.arange(len(triangles), dtype=np.int32))
        nearest = compute_closest_entity(tree, everything, mesh, places[lost])
        point, cell = np.append(point, lost), np.append(cell, nearest)
    cell = np.asarray(mesh.topology.original_cell_index)[cell]
    corners = x[triangles[cell]]
    edges, ray = corners[:, 1:] - corners[:, :1], to[point] - corners[:, 0]
    X = np.linalg.solve(np.swapaxes(edges, 1, 2), ray[..., None])[..., 0]
    smallest = np.minimum(X.min(axis=1), 1 - X.sum(axis=1))  # barycentric coordinate
    order = np.lexsort((-smallest, point))
    best = order[np.unique(point[order], return_index=True)[1]]
    return cell[best], X[best]
