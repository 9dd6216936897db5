"""Bases on curved cells."""

from __future__ import annotations

import basix.ufl
import numpy as np
import pytest
from dolfinx.mesh import create_mesh
from mpi4py import MPI

from archord.geometry.basis import (
    HEXAHEDRON,
    QUADRILATERAL,
    TETRAHEDRON,
    TRIANGLE,
    bulk_quadrature,
    cell_basis,
    dimension_of,
    displacement_element,
    lagrange_element,
    order_of,
)
from archord.geometry.shapes.pin_in_block import quarter_joint
from archord.geometry.strain import PointStrain
from archord.materials.kinematics import AXISYMMETRIC, PLANE_STRAIN, SPACE


def mesh_and_basis(X):
    """Nodes ``(n, a, 2)`` of a joint's cells, and the basis at points of all of them."""
    mesh = quarter_joint(MPI.COMM_SELF, 1.0, 0.005, 5.0, 0.3, 0.5).mesh
    nodes = mesh.geometry.x[mesh.geometry.dofmap, :2]
    return nodes, cell_basis(mesh, 2, np.arange(len(nodes), dtype=np.int32), X)


def cell_by_cell(u):
    """Nodes ``(n, a)`` and displacements ``(n a, 2)`` of cells that share none, from those of each
    ``(n, a, 2)``."""
    n, a, _ = u.shape
    return np.arange(n * a, dtype=np.int32).reshape(n, a), np.ascontiguousarray(u).reshape(-1, 2)


def test_gradients_of_linear_fields_are_exact_on_curved_cells():
    """The isoparametric basis reproduces a displacement linear in x and y; rigid motions do not
    strain."""
    nodes, basis = mesh_and_basis(bulk_quadrature(TRIANGLE, 2)[0])
    for A, tolerance in (
        (np.array([[0.1, -0.4], [0.3, 0.2]]), 1e-13),
        (np.array([[0.0, -1.0], [1.0, 0.0]]), 1e-12),
    ):
        u = nodes @ A.T + [1.0, 2.0]
        gradient = np.einsum("nqaj,nai->nqij", basis.gradient, u)
        np.testing.assert_allclose(gradient, np.broadcast_to(A, gradient.shape), atol=tolerance)
        dofs, nodal = cell_by_cell(u)
        found = PointStrain(PLANE_STRAIN, basis, dofs)(nodal)
        expected = np.broadcast_to([A[0, 0], A[1, 1], A[0, 1] + A[1, 0]], found.shape)
        np.testing.assert_allclose(found, expected, atol=1e-12)
    np.testing.assert_allclose(
        np.einsum("qa,nai->nqi", basis.shape, nodes), basis.point, atol=1e-14
    )


def test_gradients_are_the_derivatives_of_the_shape_functions():
    """Central differences along both axes, through the curved map, on cells of either
    orientation."""
    X = np.array([[0.2, 0.3], [0.6, 0.1]])
    h = 1e-5
    _, basis = mesh_and_basis(X)
    chain = np.einsum("nqai,nqij->nqaj", basis.gradient, basis.jacobian)
    for j in range(2):
        up, down = (
            lagrange_element(TRIANGLE, 2).tabulate(0, X + s * h * np.eye(2)[j])[0, :, :, 0]
            for s in (1, -1)
        )
        np.testing.assert_allclose(
            chain[..., j], np.broadcast_to((up - down) / (2 * h), chain.shape[:3]), atol=1e-9
        )


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("kinematics", [PLANE_STRAIN, AXISYMMETRIC], ids=lambda k: k.name)
def test_strain_matrix_times_displacement_is_the_strain(kinematics, large):
    """Both ways to the strain agree for any nodal displacement."""
    nodes, basis = mesh_and_basis(bulk_quadrature(TRIANGLE, 2)[0])
    u = np.random.default_rng(0).normal(size=nodes.shape)
    dofs, nodal = cell_by_cell(u)
    strain = PointStrain(kinematics, basis, dofs, large=large)
    expected = np.einsum("nqia,na->nqi", strain.matrix(), u.reshape(len(u), 12))
    np.testing.assert_allclose(strain(nodal), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_the_hoop_strain_is_the_radial_displacement_over_the_radius():
    """At the points of cells, some of which touch the axis; on the axis it is the radial strain."""
    nodes, basis = mesh_and_basis(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.3]]))
    r, z = np.moveaxis(nodes, -1, 0)
    assert (np.abs(basis.point[..., 0]) < 1e-12).any()
    dofs, nodal = cell_by_cell(np.stack([0.1 * r, 0.3 * r * z], axis=-1))
    gradient = PointStrain(AXISYMMETRIC, basis, dofs, large=True)(nodal)
    np.testing.assert_allclose(gradient[..., [0, 4]], 0.1, atol=1e-12)
    np.testing.assert_allclose(gradient[..., 2], 0.0, atol=1e-12)


IN_SPACE = pytest.mark.parametrize("kind", [TETRAHEDRON, HEXAHEDRON], ids=lambda kind: kind.name)


def one_cell(kind, degree):
    """A curved cell in space, and the nodes ``(a, 3)`` of its displacements."""
    X = lagrange_element(kind, degree).points
    x = X + 0.05 * np.stack([np.sin(3 * X[:, 1]), X[:, 0] * X[:, 2], np.cos(2 * X[:, 0])], axis=1)
    element = basix.ufl.element(
        "P", kind.name, degree, shape=(3,), lagrange_variant=basix.LagrangeVariant.equispaced
    )
    mesh = create_mesh(MPI.COMM_SELF, np.arange(len(x), dtype=np.int64)[None], x=x, e=element)
    of_displacements = displacement_element(kind, degree)
    follow = of_displacements.tabulate(0, X)[0, ..., 0]
    nodes = mesh.geometry.dofmap[0]
    mesh.geometry.x[nodes] = follow @ mesh.geometry.x[nodes[: of_displacements.dim]]
    return mesh, mesh.geometry.x[nodes[: of_displacements.dim]]


@IN_SPACE
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_cells_in_space_have_exact_gradients_of_linear_fields(kind, degree):
    """The isoparametric basis reproduces a linear displacement, also at points of each cell."""
    mesh, x = one_cell(kind, degree)
    X, w = bulk_quadrature(kind, degree)
    A = np.random.default_rng(0).normal(size=(3, 3))
    zeroth = np.zeros(1, dtype=np.int32)
    for at in (X, X[None]):
        basis = cell_basis(mesh, degree, zeroth, at)
        gradient = np.einsum("nqaj,ai->nqij", basis.gradient, x @ A.T)
        np.testing.assert_allclose(gradient, np.broadcast_to(A, gradient.shape), atol=1e-12)
        strain = PointStrain(SPACE, basis, np.arange(len(x), dtype=np.int32)[None])(x @ A.T)
        expected = SPACE.small @ [A[i, j] for i, j in SPACE.terms]
        np.testing.assert_allclose(strain, np.broadcast_to(expected, strain.shape), atol=1e-12)
        np.testing.assert_allclose(basis.determinant, np.linalg.det(basis.jacobian), rtol=1e-12)
        unit = np.broadcast_to(np.eye(3), basis.jacobian.shape)
        inverse = np.linalg.inv(basis.jacobian)
        np.testing.assert_allclose(inverse @ basis.jacobian, unit, atol=1e-12)
    assert basis.measure[0] @ w > 0


@IN_SPACE
@pytest.mark.parametrize("degree", [1, 2])
def test_the_bulk_rule_in_space_lets_rigid_motions_alone_be_free(kind, degree):
    """Strains at the points of the full rule vanish for six motions of a cell, and for no more."""
    mesh, x = one_cell(kind, degree)
    X, _ = bulk_quadrature(kind, degree, full=True)
    basis = cell_basis(mesh, degree, np.zeros(1, dtype=np.int32), X)
    B = PointStrain(SPACE, basis, np.arange(len(x), dtype=np.int32)[None]).matrix()
    singular = np.linalg.svd(B.reshape(-1, 3 * len(x)), compute_uv=False)
    assert np.count_nonzero(singular > 1e-10 * singular[0]) == 3 * len(x) - SPACE.n_rigid


def test_cells_are_known_by_their_number_of_nodes():
    cells = [TRIANGLE, QUADRILATERAL, TETRAHEDRON, HEXAHEDRON]
    assert [dimension_of(cell) for cell in cells] == [2, 2, 3, 3]
    for cell in cells:
        for degree in (1, 2, 3):
            assert order_of(cell, lagrange_element(cell, degree).dim) == degree
    with pytest.raises(ValueError, match=r"tetrahedra of 8 nodes .* have 4, 10 or 20, hexahedra 8"):
        order_of(TETRAHEDRON, 8)
    with pytest.raises(ValueError, match=r"triangles of 4 nodes .* have 3, 6 or 10, quadril"):
        order_of(TRIANGLE, 4)
