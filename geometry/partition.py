"""Which rank gets which cells of a joint: sectors around the pin's centre.

Points in contact face each other along rays from there, so most pairs stay on one rank; and unlike a graph
partitioner's, whose input arrives in any order, the cut is the same in every run.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from dolfinx.cpp.graph import AdjacencyList_int32

from archord.geometry.basis import Array


def sectors(x: Array, cells: np.ndarray, n_parts: int) -> np.ndarray:
    """The part ``(n,)`` of each of the ``cells`` ``(n, k)`` with vertices ``x`` ``(m, 2)``: sectors around the origin,
    numbered from below, of as many cells each."""
    middle = x[cells].mean(axis=1)
    order = np.argsort(np.arctan2(middle[:, 1], middle[:, 0]), kind="stable")
    part = np.empty(len(cells), dtype=np.int32)
    part[order] = np.arange(len(cells)) * n_parts // max(len(cells), 1)
    return part


def sector_partitioner(vertices: Callable[[], Array]) -> Callable:
    """`sectors` as a dolfinx cell partitioner, for a mesh that is whole on the rank that has its ``vertices()``."""

    def partition(comm, n_parts: int, cell_types, cells) -> AdjacencyList_int32:
        triangles = cells[0].reshape(-1, 3)
        part = sectors(vertices()[:, :2], triangles, n_parts) if len(triangles) else np.zeros(0, dtype=np.int32)
        return AdjacencyList_int32(part.reshape(-1, 1))

    return partition
