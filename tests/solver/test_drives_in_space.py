"""Drives in space: mean motions and rotations of facets, anchors of free bodies, moments of
reactions."""

import numpy as np
import pytest
from mpi4py import MPI

from archord.solver.conditions import Dirichlet, Drive, Mean
from archord.solver.path.system import System
from archord.solver.problem import Body, Problem
from tests.solver.space import MATERIALS, E, box

SIZE = np.array([1.0, 2.0, 1.5])
POINT = (0.3, -0.2, 2.0)
MOTIONS = ("x", "y", "z", "turn x", "turn y", "turn z")
WALL = [Dirichlet("wall", "z0", axis) for axis in range(3)]


def coupled(comm, values, control="displacement", supports=()) -> System:
    """A box that is moved, or loaded, by the mean motions of its side z1 at `POINT`; as many of
    them as there are values."""
    names = MOTIONS[-len(values) :]
    means = [Mean("top", "z1", MOTIONS.index(name), POINT, name) for name in names]
    drives = [Drive(n, (0.0, value), control) for n, value in zip(names, values, strict=True)]
    problem = Problem(
        box(comm, (2, 3, 2), SIZE),
        [Body("box", MATERIALS["elastic"])],
        supports=supports,
        means=means,
        drives=drives,
        kinematics="space",
    )
    system = System(problem)
    system.solve([1.0])
    return system


@pytest.mark.mpi
def test_a_free_body_follows_the_motions_of_one_side(comm):
    """Rigidly, and without force."""
    values = np.array([0.1, -0.2, 0.3, 1e-3, -2e-3, 3e-3])
    system = coupled(comm, values)
    u = system.equilibrium.displacement()
    arm = system.V.tabulate_dof_coordinates() - POINT
    np.testing.assert_allclose(u, values[:3] + np.cross(values[3:], arm), atol=1e-10)
    displacements, forces = system.driven()
    np.testing.assert_allclose(displacements, values, atol=1e-12)
    np.testing.assert_allclose(forces, 0, atol=1e-8 * E)


@pytest.mark.mpi
def test_moments_on_a_side_balance_the_reactions(comm):
    moments = np.array([1.0, -2.0, 3.0])
    system = coupled(comm, moments, "force", WALL)
    for point in ((0.0, 0.0, 0.0), (7.0, -3.0, 2.0)):
        np.testing.assert_allclose(system.reaction_moments("wall", point), -moments, atol=1e-9)
    np.testing.assert_allclose(system.reaction("wall"), 0, atol=1e-9)
    displacements, forces = system.driven()
    assert displacements @ forces / 2 == pytest.approx(system.energies()[0])


def test_mean_motions_are_what_moments_work_on():
    """The turn about z of a box under a moment about x is its turn about x under one about z."""
    about_x = coupled(MPI.COMM_SELF, (1.0, 0.0, 0.0), "force", WALL).driven()[0]
    about_z = coupled(MPI.COMM_SELF, (0.0, 0.0, 1.0), "force", WALL).driven()[0]
    assert about_x[2] == pytest.approx(about_z[0], rel=1e-6, abs=1e-12)
    assert min(about_x[0], about_z[2]) > 0
