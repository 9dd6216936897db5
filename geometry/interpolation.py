"""Values at points from nodal values of another mesh of curved cells."""

from __future__ import annotations

import basix
import basix.ufl
import numpy as np
from dolfinx.geometry import bb_tree, compute_closest_entity, create_midpoint_tree
from dolfinx.mesh import create_mesh
from mpi4py import MPI

from archord.geometry.basis import Array, cell_kind, tabulate

_NEWTON = 30  # iterations for the reference point: many in a corner where two sides of a cell are nearly in line
_STRAIGHT = 1e-9  # last step in a reference cell


class Interpolation:
    """From the nodes ``x`` ``(n, 2)`` of ``cells`` ``(m, a)`` to points ``to`` ``(k, 2)``.

    A point outside of all cells, as between a curved edge and its coarser image, gets the continuation of a cell next
    to it.
    """

    def __init__(self, x: Array, cells: np.ndarray, to: Array) -> None:
        kind, degree = cell_kind(cells.shape[1])
        corners = basix.geometry(kind)
        straight = basix.ufl.element("P", kind, 1, shape=(2,))
        vertices = np.ascontiguousarray(cells[:, : len(corners)], dtype=np.int64)
        mesh = create_mesh(MPI.COMM_SELF, cells=vertices, x=np.ascontiguousarray(x), e=straight)
        middles = create_midpoint_tree(mesh, 2, np.arange(len(cells), dtype=np.int32))
        nearest = compute_closest_entity(bb_tree(mesh, 2), middles, mesh, np.pad(to, ((0, 0), (0, 1))))
        self._nodes = cells[np.asarray(mesh.topology.original_cell_index)[nearest]]
        X, moving = np.tile(corners.mean(axis=0), (len(to), 1)), np.arange(len(to))
        for _ in range(_NEWTON):
            table, nodes = tabulate(kind, degree, X[moving]), x[self._nodes[moving]]
            misfit = to[moving] - np.einsum("na,nai->ni", table[0], nodes)
            step = np.linalg.solve(np.einsum("jna,nai->nij", table[1:], nodes), misfit[..., None])[..., 0]
            X[moving] += step
            moving = moving[np.abs(step).max(axis=1) > _STRAIGHT]
        self._weights = tabulate(kind, degree, X)[0]

    def __call__(self, values: Array) -> Array:
        """Values ``(k, c)`` at the points from those ``(n, c)`` at the nodes."""
        return np.einsum("ka,kac->kc", self._weights, values[self._nodes])
