"""Values at points from nodal values of another mesh of curved triangles."""

from __future__ import annotations

import basix.ufl
import numpy as np
from dolfinx.geometry import bb_tree, compute_closest_entity, compute_collisions_points, create_midpoint_tree
from dolfinx.mesh import create_mesh
from mpi4py import MPI

from archord.geometry.basis import Array, lagrange_triangle

_NEWTON = 4  # iterations for the reference point: the cells are nearly straight
_STRAIGHT = 1e-9  # last step in a reference cell
_CHUNK = 50_000  # points at once


class Interpolation:
    """From the nodes ``x`` ``(n, 2)`` of ``cells`` ``(m, a)``, of the given ``degree``, to points ``to`` ``(k, 2)``.

    A point outside of all cells, as between a curved edge and its coarser image, gets the continuation of a cell next
    to it.
    """

    def __init__(self, x: Array, cells: np.ndarray, degree: int, to: Array) -> None:
        element, locate = lagrange_triangle(degree), _Triangles(x, cells[:, :3])
        self._nodes = np.empty((len(to), cells.shape[1]), dtype=np.int64)
        self._weights = np.empty(self._nodes.shape)
        for start in range(0, len(to), _CHUNK):
            part = slice(start, start + _CHUNK)
            points = to[part]
            cell, X = locate(points)
            self._nodes[part] = cells[cell]
            nodes = x[self._nodes[part]]
            moving = np.arange(len(points))
            for _ in range(_NEWTON if degree > 1 else 0):
                table = element.tabulate(1, X[moving])[..., 0]
                misfit = points[moving] - np.einsum("na,nai->ni", table[0], nodes[moving])
                J = np.einsum("jna,nai->nij", table[1:], nodes[moving])
                step = np.linalg.solve(J, misfit[..., None])[..., 0]
                X[moving] += step
                moving = moving[np.abs(step).max(axis=1) > _STRAIGHT]
            self._weights[part] = element.tabulate(0, X)[0, ..., 0]

    def __call__(self, values: Array) -> Array:
        """Values ``(k, c)`` at the points from those ``(n, c)`` at the nodes."""
        return np.einsum("ka,kac->kc", self._weights, values[self._nodes])


class _Triangles:
    """Straight ``triangles`` ``(m, 3)`` with vertices ``x`` ``(n, 2)``, in which points are searched for."""

    def __init__(self, x: Array, triangles: np.ndarray) -> None:
        self._corners = x[triangles]
        straight = basix.ufl.element("P", "triangle", 1, shape=(2,))
        places = np.ascontiguousarray(x)
        self._mesh = create_mesh(MPI.COMM_SELF, cells=triangles.astype(np.int64, order="C"), x=places, e=straight)
        self._number = np.asarray(self._mesh.topology.original_cell_index)
        self._tree = bb_tree(self._mesh, 2)

    def __call__(self, to: Array) -> tuple[np.ndarray, Array]:
        """The number of a triangle around each point of ``to`` ``(k, 2)``, or next to it, and the point's reference
        coordinates ``(k, 2)`` there."""
        places = np.pad(to, ((0, 0), (0, 1)))
        found = compute_collisions_points(self._tree, places)
        point, cell = np.repeat(np.arange(len(to)), np.diff(found.offsets)), found.array
        lost = np.setdiff1d(np.arange(len(to)), point)  # in no triangle's bounding box
        if len(lost):
            everything = create_midpoint_tree(self._mesh, 2, np.arange(len(self._number), dtype=np.int32))
            nearest = compute_closest_entity(self._tree, everything, self._mesh, places[lost])
            point, cell = np.append(point, lost), np.append(cell, nearest)
        cell = self._number[cell]
        X = _reference_points(self._corners[cell], to[point])
        smallest = np.minimum(X.min(axis=1), 1 - X.sum(axis=1))  # barycentric coordinate
        order = np.lexsort((-smallest, point))
        best = order[np.unique(point[order], return_index=True)[1]]
        return cell[best], X[best]


def _reference_points(corners: Array, to: Array) -> Array:
    """Coordinates ``(k, 2)`` of the points ``to`` in the reference triangle of those with ``corners`` ``(k, 3, 2)``."""
    (ax, ay), (bx, by) = (corners[:, i].T - corners[:, 0].T for i in (1, 2))
    dx, dy = to.T - corners[:, 0].T
    return np.stack([by * dx - bx * dy, ax * dy - ay * dx], axis=1) / (ax * by - bx * ay)[:, None]
