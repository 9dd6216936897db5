"""The kernel of all stiffnesses, against the strain of points."""

from __future__ import annotations

import basix
import basix.ufl
import numpy as np
import pytest
from dolfinx import fem
from dolfinx.mesh import CellType, create_box, create_rectangle
from mpi4py import MPI

from archord.geometry.basis import bulk_quadrature_degree, cell_basis
from archord.geometry.strain import PointStrain, strain_terms
from archord.materials.kinematics import AXISYMMETRIC, PLANE_STRAIN, SPACE
from archord.solver.bulk.assembly import assemble, matrix
from archord.solver.bulk.stiffness import CellStiffness, value_terms
from archord.solver.path.system import displacement_space
from tests.solver.parts import scipy_matrix

RULE = 6


def two_cells(kind):
    """Displacements of cells that are warped, apart from the axis."""
    corners = [np.array([1.0, 0.0]), np.array([2.0, 1.0])]
    if kind in (CellType.tetrahedron, CellType.hexahedron):
        corners = [np.append(corner, corner[1]) for corner in corners]
        made = create_box(MPI.COMM_SELF, corners, [2, 1, 1], kind)
    else:
        made = create_rectangle(MPI.COMM_SELF, corners, [2, 1], kind)
    d = made.geometry.dim
    made.geometry.x[:, :d] += np.random.default_rng(1).normal(0, 0.05, made.geometry.x[:, :d].shape)
    return made


def assembled(form, V):
    A = matrix(V, [form])
    assemble(A, [form])
    A.assemble()
    return scipy_matrix(A).toarray()


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize(
    ("kind", "kinematics", "degree"),
    [
        (CellType.triangle, PLANE_STRAIN, 2),
        (CellType.triangle, AXISYMMETRIC, 1),
        (CellType.quadrilateral, AXISYMMETRIC, 2),
        (CellType.tetrahedron, SPACE, 3),
        (CellType.hexahedron, SPACE, 2),
    ],
)
def test_stiffness_is_the_integral_of_the_moduli_on_both_strains(kind, kinematics, large, degree):
    """Of moduli that have no symmetry, the same at all points, and others at each; the force of the
    stress at points is what the matrix gives."""
    mesh = two_cells(kind)
    V = displacement_space(mesh, degree)
    cells = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local, dtype=np.int32)
    rule = bulk_quadrature_degree(mesh.basix_cell(), degree)
    X, w = basix.make_quadrature(mesh.basix_cell(), rule)
    basis = cell_basis(mesh, degree, cells, X)
    strain = PointStrain(kinematics, basis, V.dofmap.list, large=large)
    volume = basis.measure * w * kinematics.measure(basis.point)
    B = strain.matrix()
    d = kinematics.dimension
    dofs = (d * V.dofmap.list[..., None] + np.arange(d)).reshape(len(cells), -1)
    rng = np.random.default_rng(2)
    k = strain.k
    shape = (k, k)
    given = fem.functionspace(
        mesh, basix.ufl.quadrature_element(mesh.basix_cell(), shape, degree=rule)
    )
    at_points = fem.Function(given)
    at_points.x.array[:] = rng.normal(size=len(at_points.x.array))
    moduli = rng.normal(size=shape)
    for C in (moduli, at_points):
        values = C.x.array if C is at_points else np.tile(C, (*volume.shape, 1, 1))
        values = values.reshape(*volume.shape, k, k)
        of_cells = np.einsum("nq,nqia,nqij,nqjb->nab", volume, B, values, B, optimize=True)
        expected = np.zeros((dofs.max() + 1,) * 2)
        for K, at in zip(of_cells, dofs, strict=True):
            expected[np.ix_(at, at)] += K
        terms = strain_terms(kinematics, large=large)
        form = CellStiffness(V, kinematics, rule, terms, C).over(cells)
        found = assembled(form, V)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    u = rng.normal(size=(len(expected) // d, d))
    stress = np.einsum("nqij,nqj->nqi", values, strain(u))
    force = np.zeros_like(u)
    strain.add_forces(stress * volume[..., None], force)
    expected = expected @ u.ravel()
    np.testing.assert_allclose(force.ravel(), expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("kinematics", [PLANE_STRAIN, AXISYMMETRIC, SPACE], ids=lambda k: k.name)
def test_springs_on_displacements_weigh_a_rigid_motion(kinematics):
    """Springs of modulus 3 hold a body that moves by 1 along y with 3 times its volume."""
    mesh = two_cells(CellType.hexahedron if kinematics is SPACE else CellType.triangle)
    V = displacement_space(mesh, 2)
    cells = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local, dtype=np.int32)
    d = kinematics.dimension
    springs = CellStiffness(V, kinematics, RULE, value_terms(d), 3.0 * np.eye(d))
    motion = np.zeros((len(V.tabulate_dof_coordinates()), d))
    motion[:, 1] = 1.0
    force = assembled(springs.over(cells), V) @ motion.ravel()
    X, w = basix.make_quadrature(mesh.basix_cell(), RULE)
    basis = cell_basis(mesh, 1, cells, X)
    volume = (basis.measure * w * kinematics.measure(basis.point)).sum()
    along_y = 3.0 * volume * np.eye(d)[1]
    found = force.reshape(-1, d).sum(axis=0)
    np.testing.assert_allclose(found, along_y, atol=1e-12 * volume)
