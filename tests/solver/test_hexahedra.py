"""Hexahedra of 20 nodes: no deformation without energy, constant strain in curved cells, and a
joint beside values of other codes."""

from __future__ import annotations

import basix
import basix.ufl
import numpy as np
import pytest
from dolfinx.mesh import CellType, create_mesh
from mpi4py import MPI
from scipy.linalg import eigvalsh

from archord.geometry.basis import HEXAHEDRON, cell_basis, lagrange_element
from archord.geometry.cell_rules import cell_rules
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematics import SPACE
from archord.solver.bulk.assembly import assemble, matrix
from archord.solver.bulk.bulk import Bulk
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.path.system import System, displacement_space
from archord.solver.problem import Body, Interaction, Load, Problem, Support
from tests.geometry.shapes.layered_joint import joint
from tests.solver.parts import scipy_matrix
from tests.solver.space import NU, E, box

NO_CELLS = np.zeros(0, dtype=np.int32)
# of the full joint at these displacements, by CalculiX and two prototypes, +- 30 N
REFERENCE = {0.05: 95_876.0, 0.1: 221_445.0}


@pytest.mark.parametrize(
    "cells", [(1, 1, 1), (1, 4, 1), (2, 2, 1), (3, 2, 1), (2, 2, 2), (3, 3, 3)]
)
@pytest.mark.parametrize("is_warped", [False, True], ids=["cubes", "warped"])
def test_only_rigid_motions_have_no_energy(cells, is_warped, comm):
    """Of single cells, columns, plates and blocks, which have 8 points a cell where neighbours
    suppress the rest."""
    mesh = box(comm, cells, cells, CellType.hexahedron).mesh
    if is_warped:
        x = mesh.geometry.x
        x += 0.1 * np.sin(3 * x[:, [1, 2, 0]] + x[:, [2, 0, 1]])
    V = displacement_space(mesh, 2)
    every = np.arange(mesh.topology.index_map(3).size_local, dtype=np.int32)
    bulk = Bulk(V, {1: every}, {1: Elastic(1.0, NU).under(SPACE)}, SPACE)
    A = matrix(V, bulk.elastic_forms)
    assemble(A, bulk.elastic_forms)
    A.assemble()
    energy = eigvalsh(scipy_matrix(A).toarray())
    assert np.count_nonzero(energy < 1e-4 * energy[-1]) == SPACE.n_rigid
    usual, full = cell_rules(mesh, 2, NO_CELLS)
    is_column = sorted(cells)[1] == 1
    assert full.chosen.all() if is_column else usual.chosen.all()


def test_a_curved_cell_takes_a_linear_displacement():
    """Its nodes within faces and inside follow the nodes on edges."""
    nodes = lagrange_element(HEXAHEDRON, 2).points
    x = nodes + 0.2 * np.sin(4 * nodes[:, [1, 2, 0]])
    element = basix.ufl.element("P", "hexahedron", 2, shape=(3,))
    mesh = create_mesh(MPI.COMM_SELF, np.arange(27, dtype=np.int64)[None], x=x, e=element)
    V = displacement_space(mesh, 2)
    A = np.random.default_rng(0).normal(size=(3, 3))
    X, _ = basix.make_quadrature(HEXAHEDRON, 4)
    basis = cell_basis(mesh, 2, np.zeros(1, dtype=np.int32), X)
    u = V.tabulate_dof_coordinates()[V.dofmap.list[0]] @ A.T
    gradient = np.einsum("nqaj,ai->nqij", basis.gradient, u)
    np.testing.assert_allclose(gradient, np.broadcast_to(A, gradient.shape), atol=1e-12)


def pressed(material, depth, comm, size=3.0, order=2) -> System:
    """A quarter of a pin in a block of this ``material``, pressed to a ``depth`` in two steps."""
    held = {"block side": "x", "pin side": "x", "block below": "z", "pin below": "z"}
    supports = [Support(on, fixed=fixed) for on, fixed in held.items()]
    problem = Problem(
        joint(size, 2, comm=comm, order=order),
        bodies=[Body("block", material), Body("pin", Elastic(E, NU))],
        interactions=[Interaction("contact", ("pin", "hole"))],
        supports=[*supports, Support("block top", fixed="xy")],
        loads=[Load("press", on="pin top", direction="y", displacement=-depth)],
        steps=2,
        symmetry=4,
    )
    return System(problem)


@pytest.mark.mpi
def test_a_joint_has_the_force_of_other_codes(comm):
    """On a coarse mesh: 0.3 % too much."""
    system = pressed(Elastic(E, NU), 0.1, comm)
    for part, (_, force) in zip((0.5, 1.0), REFERENCE.items(), strict=True):
        system.solve([part])
        assert -system.drive_force("press") == pytest.approx(force, rel=5e-3)


@pytest.mark.mpi
def test_cells_in_contact_have_more_points(comm):
    """27 instead of 8; missing ones are not numbers where all cells are gathered."""
    system = pressed(J2Material(E, NU, hardening=LinearHardening(300.0)), 0.08, comm, size=4.0)
    system.solve([1.0])
    order = MeshOrder(system)
    parts = list(system.bulk.at_points(system.equilibrium.displacement()))
    stress = order.at_points(lambda part: part.stress, parts)
    if comm.rank:
        return
    n_points = np.isfinite(stress).all(axis=-1).sum(axis=1)
    assert set(n_points) == {8, 27}
