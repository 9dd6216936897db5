"""Bases on curved triangles."""

from __future__ import annotations

import numpy as np
import pytest

from archord.geometry.basis import bulk_quadrature, cell_basis, lagrange_triangle, strain, strain_matrix
from archord.geometry.quarter_joint import quarter_joint


@pytest.fixture(scope="module")
def mesh():
    from mpi4py import MPI

    return quarter_joint(MPI.COMM_SELF, 1.0, 0.005, 5.0, 0.3, 0.5).mesh


def nodes(mesh):
    return mesh.geometry.x[mesh.geometry.dofmap, :2]


def cell_by_cell(u):
    """Nodes ``(n, a)`` and displacements ``(n a, 2)`` of cells that share none, from those of each ``(n, a, 2)``."""
    n, a, _ = u.shape
    return np.arange(n * a, dtype=np.int32).reshape(n, a), np.ascontiguousarray(u).reshape(-1, 2)


def test_gradients_of_linear_fields_are_exact_on_curved_cells(mesh):
    """The isoparametric basis reproduces a displacement linear in x and y."""
    cells = np.arange(len(nodes(mesh)), dtype=np.int32)
    basis = cell_basis(mesh, 2, cells, bulk_quadrature(2)[0])
    A = np.array([[0.1, -0.4], [0.3, 0.2]])
    u = nodes(mesh) @ A.T + [1.0, 2.0]
    np.testing.assert_allclose(
        np.einsum("nqaj,nai->nqij", basis.gradient, u), np.broadcast_to(A, (len(cells), 3, 2, 2)), atol=1e-13
    )
    np.testing.assert_allclose(
        strain(basis.gradient, *cell_by_cell(u)), np.broadcast_to([0.1, 0.2, -0.1], (len(cells), 3, 3)), atol=1e-13
    )
    np.testing.assert_allclose(np.einsum("qa,nai->nqi", basis.shape, nodes(mesh)), basis.point, atol=1e-14)


def test_gradients_are_the_derivatives_of_the_shape_functions(mesh):
    """Central differences along both axes, through the curved map, on cells of either orientation."""
    cells = np.arange(len(nodes(mesh)), dtype=np.int32)
    X, h = np.array([[0.2, 0.3], [0.6, 0.1]]), 1e-5
    basis = cell_basis(mesh, 2, cells, X)
    shifted = {}
    for j in range(2):
        up, down = (lagrange_triangle(2).tabulate(0, X + s * h * np.eye(2)[j])[0, :, :, 0] for s in (1, -1))
        shifted[j] = (up - down) / (2 * h)
    chain = np.einsum("nqai,nqij->nqaj", basis.gradient, basis.jacobian)
    for j in range(2):
        np.testing.assert_allclose(chain[..., j], np.broadcast_to(shifted[j], chain.shape[:3]), atol=1e-9)


def test_strain_matrix_times_displacement_is_the_strain(mesh):
    """Both ways to the strain agree for any nodal displacement."""
    cells = np.arange(len(nodes(mesh)), dtype=np.int32)
    basis = cell_basis(mesh, 2, cells, bulk_quadrature(2)[0])
    u = np.random.default_rng(0).normal(size=(len(cells), 6, 2))
    B = strain_matrix(basis.gradient)
    expected = np.einsum("nqia,na->nqi", B, u.reshape(len(cells), 12))
    np.testing.assert_allclose(
        strain(basis.gradient, *cell_by_cell(u)), expected, rtol=0, atol=1e-12 * np.abs(expected).max()
    )


def test_rigid_motions_do_not_strain(mesh):
    """Small translations and rotations, on every cell."""
    cells = np.arange(len(nodes(mesh)), dtype=np.int32)
    basis = cell_basis(mesh, 2, cells, bulk_quadrature(2)[0])
    u = nodes(mesh)[..., ::-1] * [-1.0, 1.0] + [3.0, 4.0]
    assert np.abs(strain(basis.gradient, *cell_by_cell(u))).max() < 1e-12
