"""A material from outside: Voce's hardening, defined here alone, in bodies that touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from mpi4py import MPI

from archord.materials.hardening import Hardening
from archord.materials.j2 import J2Material
from archord.materials.kinematics import kinematics
from archord.output.fields import collect_fields
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.problem import Body, Dirichlet, Interaction, Problem
from tests.solver.parts import NU, YIELD_STRESS, E, blocks, solve


@dataclass(frozen=True)
class Voce(Hardening):
    """From the yield stress ``start`` to ``end``: ``end - (end - start) exp(-PEEQ / scale)``."""

    start: float
    end: float
    scale: float

    def stress(self, peeq):
        return self.end - (self.end - self.start) * np.exp(-peeq / self.scale)

    def slope(self, peeq):
        return (self.end - self.stress(peeq)) / self.scale

    def work(self, peeq):
        return self.end * peeq - self.scale * (self.stress(peeq) - self.start)


VOCE = Voce(YIELD_STRESS, 2 * YIELD_STRESS, 0.01)


def test_hardening_is_the_slope_and_work_the_integral():
    """By differences; from ``start`` to ``end``."""
    peeq = np.linspace(0, 0.05, 7)
    h = 1e-6
    assert VOCE.stress(np.array([0.0, 1.0])) == pytest.approx([YIELD_STRESS, 2 * YIELD_STRESS])
    for function, derivative in ((VOCE.stress, VOCE.slope), (VOCE.work, VOCE.stress)):
        assert (function(peeq + h) - function(peeq - h)) / (2 * h) == pytest.approx(
            derivative(peeq), rel=1e-6
        )


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_blocks_pressed_together_follow_the_closed_form(plane):
    """Two unit squares on top of each other, between walls (plane strain) or with free sides (plane
    stress).

    The deviator keeps its direction, so the steps are exact: with PEEQ ``p`` and yield stress
    ``s(p)`` the strain is ``(s + 3 mu p) / (2 mu)`` and the pressure ``K strain + 2 s / 3`` between
    walls, ``s / E + p`` and ``s`` without.
    """
    peeq = np.linspace(0, 0.01, 2001)
    s = VOCE.stress(peeq)
    mu = E / (2 * (1 + NU))
    bulk = E / (3 * (1 - 2 * NU))
    strain = (s + 3 * mu * peeq) / (2 * mu) if plane == "strain" else s / E + peeq
    pressure = bulk * strain + 2 / 3 * s if plane == "strain" else s
    material = J2Material(E, NU, plane, VOCE)
    walls = ("left", "right")[: 1 + (plane == "strain")]
    supports = [
        Dirichlet("base", "base", 1),
        Dirichlet("lid", "lid", 1, -2.0),
        *(Dirichlet(w, w, 0) for w in walls),
    ]
    contact = Interaction("contact", ("upper bottom", "lower top"), kinematics="reference")
    bodies = [Body("lower", material), Body("upper", material)]
    problem = Problem(
        blocks(MPI.COMM_SELF, 2, 3), bodies, [contact], supports, kinematics=kinematics(plane)
    )
    system = solve(problem, strain[200::200])
    assert -system.reaction("lid")[1] == pytest.approx(pressure[-1], rel=1e-9)
    fields = collect_fields(MeshOrder(system), at_points=False)
    assert fields["peeq"] == pytest.approx(peeq[-1], rel=1e-8)
    assert system.contact.pair_of(system.sides["upper bottom"]).pressure == pytest.approx(
        pressure[-1], rel=1e-8
    )
    stored, dissipated = system.energies()
    assert dissipated == pytest.approx(2 * VOCE.work(peeq[-1]), rel=1e-9)
    work = np.trapezoid(pressure, strain) + 0.5 * pressure[0] * strain[0]
    assert stored + dissipated == pytest.approx(2 * work, rel=1e-6)
