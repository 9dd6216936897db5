"""Bases on curved triangles."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.basis import (
    TRIANGLE,
    bulk_quadrature,
    cell_basis,
    lagrange_element,
)
from archord.geometry.shapes.pin_in_block import quarter_joint
from archord.geometry.strain import PointStrain
from archord.materials.kinematics import AXISYMMETRIC, PLANE_STRAIN


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
