"""What is wrong with a mesh, or may be, in one sentence each."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array, bulk_quadrature, cell_kind, tabulate
from archord.geometry.meshes.plane_mesh import PlaneMesh, distinct_edges, sides_of

_FLAT = 1e-9  # smallest over largest jacobian of a cell that has collapsed


def _at(x: Array) -> str:
    return f"({x[0]:g}, {x[1]:g})"


def faults(mesh: PlaneMesh) -> list[str]:
    """Why nothing can be computed on ``mesh``: cells that are folded, collapsed, there twice, or three at an edge."""
    (kind, order), said, middle = cell_kind(mesh.cells.shape[1]), [], mesh.x[mesh.cells].mean(axis=1)
    J = np.einsum("jqa,nai->nqij", tabulate(kind, order, bulk_quadrature(kind, order + 1)[0])[1:], mesh.x[mesh.cells])
    det, size = np.linalg.det(J), (J**2).sum(axis=(2, 3)).max(axis=1)
    bad = (det.min(axis=1) <= _FLAT * size) & (det.max(axis=1) >= -_FLAT * size)
    if bad.any():
        said.append(f"{bad.sum()} cells are folded or have no area, the first at {_at(middle[bad][0])}")
    _, first, count = np.unique(np.sort(mesh.cells, axis=1), axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        said.append(f"{(count > 1).sum()} cells are there twice, the first at {_at(middle[first[count > 1][0]])}")
    first, which = distinct_edges(sides_of(mesh.cells)[:, :2])
    crowded = first[np.bincount(which) > 2]
    if len(crowded):
        place = mesh.x[sides_of(mesh.cells)[crowded[0]]].mean(axis=0)
        said.append(f"{len(crowded)} edges belong to more than two cells, the first at {_at(place)}: cells overlap")
    return said
