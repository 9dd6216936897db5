"""The facets of a contact surface in the mesh: the cells behind them, and the nodes along them."""

from __future__ import annotations

from dataclasses import dataclass

import basix
import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh

from archord.geometry.basis import Array, cell_basis


@dataclass(frozen=True)
class BoundaryFacets:
    """Facets of a surface whose cells this rank owns, run through with the body on the left."""

    cells: np.ndarray  # (n,) the cell behind each facet
    trace: np.ndarray  # (n, k) nodes along the facet within the cell
    ends: Array  # (n, 2, 2) start and end in the reference cell
    within: np.ndarray  # (n,) whether the facet lies between two cells

    def reordered(self, order: np.ndarray) -> BoundaryFacets:
        """The facets in another ``order`` ``(n,)``."""
        return BoundaryFacets(
            self.cells[order], self.trace[order], self.ends[order], self.within[order]
        )


def boundary_facets(V: fem.FunctionSpace, facets: np.ndarray) -> BoundaryFacets:
    """The owned ones of these ``facets`` of the mesh of ``V``."""
    degree = V.element.basix_element.degree
    kind = V.mesh.basix_cell()
    corners = basix.geometry(kind)
    edges = np.array(basix.topology(kind)[1])
    cells, local_facets, within = _owned_facets(V.mesh, facets)
    trace = _nodes_along(V)[local_facets].reshape(-1, degree + 1)
    ends = corners[edges[local_facets]]
    middle = corners.mean(axis=0)
    # some of basix' edges run clockwise, and a mirrored cell turns all of them
    clockwise = np.linalg.det(ends - middle) < 0
    clockwise ^= cell_basis(V.mesh, degree, cells, middle[None]).determinant[:, 0] < 0
    trace[clockwise] = trace[clockwise, ::-1]
    ends[clockwise] = ends[clockwise, ::-1]
    return BoundaryFacets(cells, trace, ends, within)


def _nodes_along(V: fem.FunctionSpace) -> np.ndarray:
    """Nodes within the cell ``(facets of a cell, k)`` along each facet.

    Their order in dolfinx is vertex, vertex, interior; along the facet the interior nodes come
    between the vertices.
    """
    layout = V.dofmap.dof_layout
    n_facets = len(basix.topology(V.mesh.basix_cell())[1])
    closures = [layout.entity_closure_dofs(1, k) for k in range(n_facets)]
    along = [[start, *interior, end] for start, end, *interior in closures]
    return np.array(along, dtype=np.int64)


def _owned_facets(mesh: Mesh, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Owned cells behind ``facets``, the facets' numbers within them, and which of these lie
    between two cells."""
    topology = mesh.topology
    topology.create_connectivity(1, 2)
    topology.create_connectivity(2, 1)
    to_cell = topology.connectivity(1, 2)
    to_facet = topology.connectivity(2, 1)
    cells = np.array([to_cell.links(f)[0] for f in facets], dtype=np.int32).reshape(-1)
    owned = cells < topology.index_map(2).size_local
    cells = cells[owned]
    facets = np.asarray(facets)[owned]
    within = np.diff(to_cell.offsets)[facets] > 1
    facets_of_cell = len(basix.topology(mesh.basix_cell())[1])
    of_cells = to_facet.array.reshape(-1, facets_of_cell)[cells]
    return cells, np.nonzero(of_cells == facets[:, None])[1], within


def refuse_all_but_a_boundary(name: str, dofs: np.ndarray, x: Array, within: np.ndarray) -> None:
    """Raise ValueError unless the facets with nodes ``dofs`` ``(n, k)`` at ``x`` ``(n, k, 2)`` are
    the boundary of a body, which does not branch."""
    if not len(dofs):
        raise ValueError(f"the contact surface {name!r} has no facets")
    ends = np.sort(dofs[:, [0, -1]])
    _, which, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    twice = count[which.ravel()] > 1  # two ranks may have a cell each
    for a, b in x[within | twice].mean(axis=1):
        raise ValueError(
            f"the contact surface {name!r} has facets within its body, the first at ({a:g}, {b:g})"
        )
    for end in (0, -1):
        _, first, count = np.unique(dofs[:, end], return_index=True, return_counts=True)
        for a, b in x[first[count > 1], end]:
            raise ValueError(
                f"the contact surface {name!r} branches at ({a:g}, {b:g}), "
                "where three of its facets meet"
            )
