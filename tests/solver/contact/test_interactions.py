"""Several interactions in one problem, each with its own law, gamma and sides; a law from
outside."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.curve import RigidCircle
from archord.materials.elasticity import contact_modulus
from archord.solver.contact.contact import Contact
from archord.solver.contact.interaction import Interface
from archord.solver.contact.laws.law import STICK, ContactLaw, Response
from archord.solver.contact.surface import RigidSurface, Surface
from archord.solver.problem import Body, Dirichlet, Interaction, Problem
from tests.geometry.shapes.measures import Facets
from tests.solver.contact.test_tangent import matrix
from tests.solver.parts import (
    DR,
    ELASTIC,
    NU,
    E,
    R,
    blocks,
    contact_force,
    coordinates,
    joint_parts,
    solve,
)

DEPTH = 0.01
PRESSED = [
    Dirichlet("base", "base", 1),
    Dirichlet("lid", "lid", 1, -1.0),
    Dirichlet("left", "left", 0),
]  # free to widen
LOW = ("lower top", "middle bottom")
HIGH = ("middle top", "upper bottom")


def stack(low: dict, high: dict):
    """Three squares pressed together, with the options of both interactions."""
    bodies = [Body(name, ELASTIC) for name in ("lower", "middle", "upper")]
    interactions = [Interaction("low", LOW, **low), Interaction("high", HIGH, **high)]
    return solve(Problem(blocks(MPI.COMM_SELF, 3, 4, 2), bodies, interactions, PRESSED), [DEPTH])


STACKS = {
    "alike": ({}, {}),
    "one fixed": ({}, {"kinematics": "reference"}),
    "one tied": ({"law": "tied"}, {}),
    "one stiff and one-sided": ({"gamma_factor": 20.0}, {"integrated": "upper bottom"}),
}


@pytest.mark.parametrize(("low", "high"), STACKS.values(), ids=STACKS)
def test_a_stack_of_three_carries_a_uniform_pressure(low, high):
    """The closed form of one column: pressure, resultants of both interactions by name,
    displacement."""
    system = stack(low, high)
    pressure = contact_modulus(E, NU, "strain") * DEPTH / 3
    x = coordinates(system.V)
    expected = DEPTH / 3 * np.stack([NU / (1 - NU) * x[:, 0], -1 - x[:, 1]], axis=1)
    np.testing.assert_allclose(
        system.equilibrium.displacement(), expected, rtol=0, atol=1e-9 * DEPTH
    )
    for pair in system.contact.pairs:
        np.testing.assert_allclose(pair.pressure, pressure, rtol=1e-8)
    for name in ("low", "high"):
        np.testing.assert_allclose(
            system.contact.resultant(name), [0, pressure], atol=1e-9 * pressure
        )
    assert system.sides.keys() == {*LOW, *HIGH}


def test_the_tangent_of_several_interactions_is_the_derivative_of_their_forces():
    """In random directions that move every node."""
    system = stack({}, {"law": "tied"})
    contact = system.contact
    rng = np.random.default_rng(0)
    u = system.equilibrium.displacement() + 1e-3 * DEPTH * rng.normal(
        size=(len(coordinates(system.V)), 2)
    )
    contact_force(contact, u)
    K = matrix(contact, u.size)[:-2, :-2]
    h = 1e-6 * DEPTH
    for _ in range(3):
        d = rng.normal(size=u.shape)
        difference = (
            contact_force(contact, u + h * d) - contact_force(contact, u - h * d)
        ).ravel() / (2 * h)
        assert np.linalg.norm(K @ d.ravel() - difference) < 1e-6 * np.linalg.norm(difference)


def test_a_limit_of_gamma_holds_for_the_interactions_above_it():
    """The others keep their factor; without a limit each has its own again."""
    contact = stack({"gamma_factor": 20.0}, {}).contact
    low, high = (i.pairs[0] for i in contact.interfaces)
    assert contact.gamma_factor == 20
    before = low.gamma.copy(), high.gamma.copy()
    contact.use_gamma_factor(5.0)
    np.testing.assert_allclose(low.gamma, before[0] / 4, rtol=1e-15)
    np.testing.assert_array_equal(high.gamma, before[1])
    contact.use_gamma_factor(contact.gamma_factor)
    np.testing.assert_array_equal(low.gamma, before[0])


class Bilateral(ContactLaw):
    """Surfaces that slide on each other and never part."""

    def respond(self, opening, trial, gamma, state, dt):
        by_trial = np.zeros((len(trial), 2, 2))
        by_trial[:, 0, 0] = 1.0
        branch = np.full(len(trial), STICK)
        return Response(trial * [1.0, 0.0], by_trial, None, branch, state)


@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_a_law_from_outside_pulls_and_slides(kinematics):
    """Pulled, the column carries a uniform tension; pushed aside, its upper half drags nothing
    along."""
    interaction = Interaction(
        "joint", ("upper bottom", "lower top"), law=Bilateral(), kinematics=kinematics
    )
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    mesh = blocks(MPI.COMM_SELF, 4, 7)
    supports = [
        Dirichlet("base", "base", 1),
        Dirichlet("lid", "lid", 1, 1.0),
        Dirichlet("left", "left", 0),
    ]
    system = solve(Problem(mesh, bodies, [interaction], supports), [DEPTH])
    tension = contact_modulus(E, NU, "strain") * DEPTH / 2
    np.testing.assert_allclose(system.reaction("lid"), [0, tension], atol=1e-9 * tension)
    for pair in system.contact.pairs:
        np.testing.assert_allclose(pair.pressure, -tension, rtol=1e-8)
    supports = [Dirichlet("base", "base", k) for k in (0, 1)]
    supports += [Dirichlet("lid", "lid", k, 1.0 - k) for k in (0, 1)]
    u = solve(Problem(mesh, bodies, [interaction], supports), [DEPTH]).equilibrium.displacement()
    assert np.abs(u[coordinates(system.V)[:, 1] < -0.1]).max() < 1e-10 * DEPTH


def test_every_rigid_disc_moves_by_itself():
    """One in the hole, one on the block's upper edge: forces follow the motion of each, and the
    load factor moves both by their rates."""
    parts = joint_parts(pin=None)
    edge = Surface(parts.V, parts.facets.find(Facets.BLOCK_HELD), ELASTIC)
    pin = RigidSurface(RigidCircle(np.array([0.0, -DR]), R), (0.0, -1.0))
    disc = RigidSurface(RigidCircle(np.array([2.5, R]), R), (0.1, -2.0))
    sides = {"pin": [pin, parts.sides[0]], "disc": [disc, edge]}
    interfaces = [
        Interface(Interaction(name, ("disc", "hole")), surfaces) for name, surfaces in sides.items()
    ]
    both = Contact(parts.V, interfaces)
    u = np.zeros((len(coordinates(parts.V)), 2))
    depth = 1.5 * DR
    h = 1e-6 * DR
    both.move(np.array([depth]))
    np.testing.assert_array_equal(
        [pin.motion[0], disc.motion[0]], [depth * pin.rate[0], depth * disc.rate[0]]
    )
    contact_force(both, u)
    assert all(pair.active.any() for pair in both.pairs)
    along = sum(d.rate @ both.resultant(name) for d, name in ((pin, "pin"), (disc, "disc")))
    assert both.force_on_drives() == pytest.approx(along, rel=1e-14)
    rows = both.tangent.rows
    columns = both.tangent.columns
    blocks_ = both.tangent.blocks()
    for number, surface in enumerate((pin, disc)):
        for axis, direction in enumerate(np.eye(2)):
            forces = []
            for sign in (1, -1):
                surface.motion = surface.motion + sign * h * direction
                forces.append(contact_force(both, u))
                surface.motion = surface.motion - sign * h * direction
            expected = (forces[0] - forces[1]) / (2 * h)
            found = np.zeros_like(u)
            here = (columns == len(u) + number) & (rows < len(u))
            np.add.at(found, rows[here], blocks_[here, :, axis])
            assert np.linalg.norm(found - expected) < 1e-6 * np.linalg.norm(expected)
