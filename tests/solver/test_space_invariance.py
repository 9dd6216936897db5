"""Problems in space do not depend on how they are put: turned, mirrored, in other units, with
bodies in another order."""

from __future__ import annotations

import numpy as np
import pytest

from archord import Body, Interaction, Load, Problem, Support
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.solver.path.stepping import StepRules
from archord.solver.path.system import System
from tests.materials.test_space import ASKEW
from tests.solver.contact.blocks_in_space import bodies, tagged

MOVE = np.array([0.004, -0.002, -0.012])
E = 200e3


def saddle(x):
    bent = x.copy()
    bent[:, 2] += 0.15 * (x[:, 0] - 0.4) ** 2 - 0.1 * (x[:, 1] - 0.6) ** 2
    return bent


def pressed(comm, Q=None, length=1.0, stress=1.0, swapped=False, strain="small"):
    """A block pressed and rubbed on another one that yields, turned by ``Q``, in units whose length
    and stress are numbers as many times as large; forces and energies in the first units."""
    turn = np.eye(3) if Q is None else np.asarray(Q)
    mesh = tagged(bodies(comm))
    mesh.mesh.geometry.x[:] = length * saddle(mesh.mesh.geometry.x) @ turn.T
    hard = Elastic(2 * E * stress, 0.3)
    soft = J2Material(E * stress, 0.3, hardening=LinearHardening(500.0 * stress, 0.02 * E * stress))
    solids = [Body("lower", soft), Body("upper", hard)]
    surfaces = ("upper", "lower")
    if swapped:
        solids = solids[::-1]
        surfaces = surfaces[::-1]
    moves = length * turn @ MOVE
    loads = [
        Load(f"by {axis}", on="lid", direction=axis, displacement=float(move))
        for axis, move in zip("xyz", moves, strict=True)
    ]
    problem = Problem(
        mesh,
        solids,
        [Interaction("joint", surfaces, friction=0.3)],
        [Support("base")],
        loads,
        strain=strain,
        tolerance=1e-12,
    )
    system = System(problem)
    system.solve([0.5, 1.0], StepRules(minimum=1.0))
    force = stress * length**2
    contact = system.contact_force("joint") * (-1 if swapped else 1)
    energies = np.array([*system.energies(), system.friction_dissipation()])
    return {
        "reaction": turn.T @ system.reaction("base") / force,
        "contact": turn.T @ contact / force,
        "energies": energies / (force * length),
        "peeq": np.array(system.peeq()) / [1.0, length**3],
    }


WAYS = {
    "turned by 37 degrees": {"Q": ASKEW},
    "mirrored": {"Q": np.diag([-1.0, 1.0, 1.0])},
    "in metres and pascals": {"length": 1e-3, "stress": 1e6},
    "bodies in another order": {"swapped": True},
}


@pytest.fixture(scope="module", params=["small", "large"])
def straight(request):
    from mpi4py import MPI

    return request.param, pressed(MPI.COMM_SELF, strain=request.param)


@pytest.mark.parametrize("way", WAYS)
def test_a_problem_does_not_depend_on_how_it_is_put(way, straight, comm):
    """Forces, energies, friction's dissipation and PEEQ, with contact that rubs and a body that
    yields."""
    strain, expected = straight
    assert expected["peeq"][0] > 1e-3
    assert expected["energies"][2] > 0
    found = pressed(comm, strain=strain, **WAYS[way])
    for name, values in expected.items():
        size = np.abs(values).max()
        np.testing.assert_allclose(found[name], values, rtol=0, atol=1e-9 * size, err_msg=name)
