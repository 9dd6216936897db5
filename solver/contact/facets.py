"""The facets of a contact surface in the mesh: the cells behind them, and the nodes on them."""

from __future__ import annotations

from dataclasses import dataclass

import basix
import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh

from archord.geometry.basis import Array, cell_basis, displacement_element, element_of


@dataclass(frozen=True)
class BoundaryFacets:
    """Facets of a surface whose cells this rank owns.

    A facet leads from its origin along the axes of the reference interval, triangle or square, so
    that the body is on the left of an edge, or behind a facet in space.
    """

    cells: np.ndarray  # (n,) the cell behind each facet
    number: np.ndarray  # (n,) the same on any number of ranks, by the cells as they were given
    trace: np.ndarray  # (n, k) nodes on the facet within the cell
    origin: Array  # (n, d) in the reference cell
    axes: Array  # (n, d - 1, d) from there to where each axis ends
    within: np.ndarray  # (n,) whether the facet lies between two cells

    def reordered(self, order: np.ndarray) -> BoundaryFacets:
        """The facets in another ``order`` ``(n,)``."""
        return BoundaryFacets(*(values[order] for values in vars(self).values()))


def facet_kind(cell: basix.CellType) -> basix.CellType:
    """The kind of the facets of a ``cell``."""
    return basix.cell.subentity_types(cell)[-2][0]


def facet_nodes(cell: basix.CellType, degree: int) -> Array:
    """The nodes ``(k, d - 1)`` of the displacements on a reference facet of a ``cell``: along an
    interval, in the order of basix on others."""
    facet = facet_kind(cell)
    if facet == basix.CellType.interval:
        return np.linspace(0.0, 1.0, degree + 1)[:, None]
    on_facet = displacement_element(cell, degree).entity_closure_dofs[2][0]
    return element_of(facet, len(on_facet)).points


def boundary_facets(V: fem.FunctionSpace, facets: np.ndarray) -> BoundaryFacets:
    """The owned ones of these ``facets`` of the mesh of ``V``."""
    degree = V.element.basix_element.degree
    kind = V.mesh.basix_cell()
    d = V.mesh.topology.dim
    vertices = basix.geometry(kind)
    vertices_of_facets = np.array(basix.topology(kind)[d - 1])
    cells, local_facets, within = _owned_facets(V.mesh, facets)
    corners = vertices[vertices_of_facets[local_facets, :d]]
    middle = vertices.mean(axis=0)
    # some of basix' facets turn inwards, and a mirrored cell turns all of them
    inwards = np.linalg.det(corners - middle) < 0
    in_middle = cell_basis(V.mesh, degree, cells, middle[None])
    inwards ^= in_middle.determinant[:, 0] < 0
    last_two = corners[inwards, -2:]
    corners[inwards, -2:] = last_two[:, ::-1]
    origin = corners[:, 0]
    axes = corners[:, 1:] - origin[:, None]
    on_facet = origin[:, None] + facet_nodes(kind, degree) @ axes
    in_cell = displacement_element(kind, degree).points
    distance = np.linalg.norm(on_facet[:, :, None] - in_cell, axis=-1)
    trace = distance.argmin(axis=-1)
    number = _given_number(V.mesh)[cells] * len(vertices_of_facets) + local_facets
    return BoundaryFacets(cells, number, trace, origin, axes, within)


def facet_normals(jacobian: Array, axes: Array) -> Array:
    """Outward normals ``(n, q, d)`` of facets along ``axes`` ``(n, d - 1, d)`` in cells with the
    ``jacobian`` ``(n, q, d, d)``: as long as the first axis is in the mesh, or in space as large as
    the area that both span."""
    tangents = np.einsum("nqij,ntj->tnqi", jacobian, axes)
    if len(tangents) == 1:
        return np.stack([tangents[0, ..., 1], -tangents[0, ..., 0]], axis=-1)
    return np.cross(tangents[0], tangents[1])


def _given_number(mesh: Mesh) -> np.ndarray:
    """The numbers of this rank's cells in the mesh as it was given; of a submesh, which does not
    know them, in the mesh on all ranks."""
    index_map = mesh.topology.index_map(mesh.topology.dim)
    try:
        return np.asarray(mesh.topology.original_cell_index, dtype=np.int64)
    except RuntimeError:
        return index_map.local_range[0] + np.arange(index_map.size_local)


def _owned_facets(mesh: Mesh, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Owned cells behind ``facets``, the facets' numbers within them, and which of these lie
    between two cells."""
    topology = mesh.topology
    d = topology.dim
    topology.create_connectivity(d - 1, d)
    topology.create_connectivity(d, d - 1)
    to_cell = topology.connectivity(d - 1, d)
    to_facet = topology.connectivity(d, d - 1)
    cells = np.array([to_cell.links(f)[0] for f in facets], dtype=np.int32).reshape(-1)
    owned = cells < topology.index_map(d).size_local
    cells = cells[owned]
    facets = np.asarray(facets)[owned]
    within = np.diff(to_cell.offsets)[facets] > 1
    facets_of_cell = len(basix.topology(mesh.basix_cell())[d - 1])
    of_cells = to_facet.array.reshape(-1, facets_of_cell)[cells]
    _, local_facets = np.nonzero(of_cells == facets[:, None])
    return cells, local_facets, within


def refuse_all_but_a_boundary(
    name: str, corners: np.ndarray, middle: Array, within: np.ndarray
) -> None:
    """Raise ValueError unless the facets with the vertices ``corners`` ``(n, v)`` about ``middle``
    ``(n, d)`` are the boundary of a body."""
    if not len(corners):
        raise ValueError(f"the contact surface {name!r} has no facets")
    rising = np.sort(corners)
    _, which, count = np.unique(rising, axis=0, return_inverse=True, return_counts=True)
    twice = count[which.ravel()] > 1  # two ranks may have a cell each
    for x in middle[within | twice]:
        raise ValueError(
            f"the contact surface {name!r} has facets within its body, the first at {place(x)}"
        )


def refuse_branches(name: str, dofs: np.ndarray, x: Array) -> None:
    """Raise ValueError if the edges with nodes ``dofs`` ``(n, k)`` at ``x`` ``(n, k, 2)``
    branch."""
    for end in (0, -1):
        _, first, count = np.unique(dofs[:, end], return_index=True, return_counts=True)
        for vertex in x[first[count > 1], end]:
            raise ValueError(
                f"the contact surface {name!r} branches at {place(vertex)}, "
                "where three of its facets meet"
            )


def place(x: Array) -> str:
    """The position ``x`` ``(d,)`` in words."""
    return "({})".format(", ".join(f"{value:g}" for value in x))
