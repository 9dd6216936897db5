"""Bases by values at nodes, and their physical gradients at points of curved cells, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import TYPE_CHECKING

import basix
import numpy as np

from archord.geometry.vectors import crossed
from archord.kernels.compat import cell_degree, cell_nodes
from archord.materials.kinematics import Array, Ints

if TYPE_CHECKING:
    from dolfinx.mesh import Mesh

CONTACT_POINTS = 4  # Gauss points a contact facet
TRIANGLE = basix.CellType.triangle
QUADRILATERAL = basix.CellType.quadrilateral
TETRAHEDRON = basix.CellType.tetrahedron
HEXAHEDRON = basix.CellType.hexahedron
_NODES = {  # of cells of order 1, 2 and 3
    TRIANGLE: (3, 6, 10),
    QUADRILATERAL: (4, 9, 16),
    TETRAHEDRON: (4, 10, 20),
    HEXAHEDRON: (8, 27, 64),
}
_SERENDIPITY = {QUADRILATERAL: 8, HEXAHEDRON: 20}
_HIGHEST = 6  # degree: twice the highest order of meshes, while their cells are cut
_KNOWN = {  # by the dimension
    2: "triangles have 3, 6 or 10, quadrilaterals 4, 9 or 16",
    3: "tetrahedra have 4, 10 or 20, hexahedra 8, 27 or 64",
}


def dimension_of(cell: basix.CellType) -> int:
    """Dimension of a ``cell``."""
    return len(basix.topology(cell)) - 1


@cache
def lagrange_element(cell: basix.CellType, degree: int) -> basix.finite_element.FiniteElement:
    """Lagrange element on the reference ``cell``, with equispaced nodes as in gmsh's curved
    meshes."""
    return basix.create_element(
        basix.ElementFamily.P, cell, degree, basix.LagrangeVariant.equispaced
    )


@cache
def serendipity_element(cell: basix.CellType) -> basix.finite_element.FiniteElement:
    """Element of second order on a quadrilateral (8 nodes) or a hexahedron (20 nodes) without nodes
    within faces and cells.

    It spans the monomials whose powers above the first add up to two at most (Arnold and Awanou
    2011). Its nodes come as they do first in the Lagrange element of second order.
    """
    powers = product(range(3), repeat=dimension_of(cell))
    span = [power for power in powers if sum(k for k in power if k > 1) <= 2]
    x, weight = basix.make_quadrature(cell, 4)
    monomials = np.array([np.prod(x**power, axis=1) for power in span])
    orthonormal = basix.tabulate_polynomials(basix.PolynomialType.legendre, cell, 2, x)
    corners = basix.geometry(cell)
    nodes: list[list[Array]] = []
    values: list[list[Array]] = []
    for dim in range(4):
        entities = basix.topology(cell)[dim] if dim <= dimension_of(cell) else []
        own = slice(1 if dim < 2 else 0)
        nodes.append([corners[entity].mean(axis=0)[None][own] for entity in entities])
        values.append([np.ones((1, 1, 1, 1))[own, :, own] for _ in entities])
    return basix.create_custom_element(
        cell,
        value_shape=(),
        wcoeffs=weight * monomials @ orthonormal.T,
        x=nodes,
        M=values,
        interpolation_nderivs=0,
        map_type=basix.MapType.identity,
        sobolev_space=basix.SobolevSpace.H1,
        discontinuous=False,
        embedded_subdegree=1,
        embedded_superdegree=2,
        poly_type=basix.PolysetType.standard,
    )


def displacement_element(cell: basix.CellType, degree: int) -> basix.finite_element.FiniteElement:
    """Element of displacements: Lagrange's, on hexahedra of degree 2 the one of 20 nodes."""
    if cell == HEXAHEDRON and degree == 2:
        return serendipity_element(cell)
    return lagrange_element(cell, degree)


def element_of(cell: basix.CellType, nodes: int) -> basix.finite_element.FiniteElement:
    """Element on the reference ``cell`` that has so many ``nodes``. Raises ValueError."""
    if nodes == _SERENDIPITY.get(cell):
        return serendipity_element(cell)
    for degree in range(1, 1 + _HIGHEST):
        element = lagrange_element(cell, degree)
        if element.dim == nodes:
            return element
    raise ValueError(f"no element on a {cell.name} has {nodes} nodes")


def order_of(cell: basix.CellType, nodes: int) -> int:
    """Order of a Lagrange ``cell`` that has so many ``nodes``. Raises ValueError."""
    if nodes not in _NODES[cell]:
        plural = f"{cell.name}s".replace("hedrons", "hedra")
        raise ValueError(f"{plural} of {nodes} nodes are not known: {_KNOWN[dimension_of(cell)]}")
    return 1 + _NODES[cell].index(nodes)


@dataclass(frozen=True)
class CellBasis:
    """A displacement basis at ``q`` points of each of ``n`` cells with ``a`` nodes."""

    shape: Array  # (q, a), or (n, q, a) where each cell has points of its own
    gradient: Array  # (n, q, a, d) in physical coordinates
    point: Array  # (n, q, d)
    jacobian: Array  # (n, q, d, d) d x_i / d X_j
    determinant: Array  # (n, q) negative where the cell is mirrored, its vertices run clockwise

    @property
    def measure(self) -> Array:
        """Area per reference area, or volume per reference volume, ``(n, q)``."""
        return np.abs(self.determinant)


def cell_basis(mesh: Mesh, degree: int, cells: Ints, X: Array) -> CellBasis:
    """Basis of the given ``degree`` at the reference points ``X`` ``(q, d)`` of ``cells``, or ``(n,
    q, d)`` of each."""
    geometry = tabulate(mesh.basix_cell(), cell_degree(mesh), X)
    table = table_of(displacement_element(mesh.basix_cell(), degree), X)
    nodes = mesh.geometry.x[cell_nodes(mesh)[cells], : X.shape[-1]]
    at = "qa" if X.ndim == 2 else "nqa"
    point = np.einsum(f"{at},nai->nqi", geometry[0], nodes)
    J = np.einsum(f"j{at},nai->nqij", geometry[1:], nodes)
    det, inverse = _inverse(J)
    gradient = np.einsum(f"j{at},nqji->nqai", table[1:], inverse)
    return CellBasis(table[0], np.ascontiguousarray(gradient), point, J, det)


def _inverse(J: Array) -> tuple[Array, Array]:
    """Determinant ``(n, q)`` and inverse ``(n, q, d, d)`` of ``J``: d X_j / d x_i as [j, i]."""
    inverse = np.empty_like(J)
    if J.shape[-1] == 2:
        det = crossed(J[..., 0, :], J[..., 1, :])
        inverse[..., 0, 0] = J[..., 1, 1]
        inverse[..., 1, 1] = J[..., 0, 0]
        inverse[..., 0, 1] = -J[..., 0, 1]
        inverse[..., 1, 0] = -J[..., 1, 0]
    else:
        one, two, three = np.moveaxis(J, -1, 0)
        inverse[..., 0, :] = np.cross(two, three)
        inverse[..., 1, :] = np.cross(three, one)
        inverse[..., 2, :] = np.cross(one, two)
        det = np.einsum("nqi,nqi->nq", one, inverse[..., 0, :])
    inverse /= det[..., None, None]
    return det, inverse


def tabulate(cell: basix.CellType, degree: int, X: Array) -> Array:
    """Values and derivatives ``(1 + d, ..., a)`` of the Lagrange basis at ``X`` ``(..., d)``."""
    return table_of(lagrange_element(cell, degree), X)


def table_of(element: basix.finite_element.FiniteElement, X: Array) -> Array:
    """Values and derivatives ``(1 + d, ..., a)`` of the basis of an ``element`` at ``X``
    ``(..., d)``."""
    d = X.shape[-1]
    if not X.size:  # basix ends the process
        return np.zeros((1 + d, *X.shape[:-1], element.dim))
    table = element.tabulate(1, X.reshape(-1, d))[..., 0]
    return table.reshape(1 + d, *X.shape[:-1], table.shape[-1])


def bulk_quadrature_degree(cell: basix.CellType, degree: int, *, full: bool = False) -> int:
    """Degree of the bulk rule for displacements of the given ``degree``: full rank, and no
    volumetric locking; of the ``full`` rule where that needs more points.

    Plastic flow in plane strain keeps the volume at every point, which must be fewer conditions
    than a mesh has dofs (Nagtegaal, Parks and Rice 1974). A quadrilateral of degree p adds ``2
    p^2`` dofs; the divergence on a parallelogram spans ``(p + 1)^2 - 1`` functions. At ``p^2``
    points the strains of three deformations would vanish. Distorted second-order ones have 9
    conditions: somewhat stiff where they are large, but convergent.

    Around an axis quadrilaterals of degree 2 have two dofs along the radius for three points.
    Each point has a condition of its own by the hoop strain. A perfectly plastic thick cylinder
    (b/a = 2) that is driven on carries 2.4 % to 8.6 % more than Hill's pressure with 4 square cells
    across its wall, 0.16 % to 0.57 % with 8, 0.01 % to 0.04 % with 16. Degree 3 carries 0.04 % more
    at most with 4 cells, triangles 0.05 % with 2. On square cells rules of 7 or 8 points change
    nothing. With 4 points deformations have no energy. So users are warned.

    A tetrahedron of degree 2 has 4 points with 6 strains each: as many as its 30 dofs without the 6
    rigid motions.

    A hexahedron of 20 nodes has 8 points. One alone would have 6 deformations without energy, but
    neighbours suppress them. A traction does not: where it follows the displacements, as in
    contact, cells need the ``full`` rule of 27 points.
    """
    if cell in (TRIANGLE, TETRAHEDRON):
        return 2 * degree - 2
    if displacement_element(cell, degree).dim == _SERENDIPITY.get(cell) and not full:
        return 2 * degree - 1
    return 2 * degree


def bulk_quadrature(
    cell: basix.CellType, degree: int, *, full: bool = False
) -> tuple[Array, Array]:
    """Points ``(q, d)`` and weights ``(q,)`` of the bulk rule on the reference ``cell``."""
    return basix.make_quadrature(cell, bulk_quadrature_degree(cell, degree, full=full))
