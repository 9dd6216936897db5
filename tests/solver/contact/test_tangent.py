"""The contact's linearisation is the derivative of its forces, in every variant."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from archord.solver.contact.tangent import point_rates
from tests.geometry.shapes.measures import Cells
from tests.solver.parts import (
    DR,
    ELASTIC,
    HARDENING,
    PERFECT,
    PLANE_STRESS,
    YIELD_STRESS,
    E,
    commit,
    contact_force,
    joint_parts,
)

YIELD_STRAIN = YIELD_STRESS / E

BODIES = {
    "elastic": (ELASTIC, ELASTIC),
    "perfect": (PERFECT, PERFECT),
    "hardening in plane stress": (PLANE_STRESS, PLANE_STRESS),
    "elastic pin, plastic hole": (ELASTIC, HARDENING),
    "rigid pin": (None, ELASTIC),
    "rigid pin, plastic hole": (None, PERFECT),
}
every_kinematics = pytest.mark.parametrize(
    "kinematics", ["current", "reference", "tied", "current, rubbing", "reference, rubbing"]
)


def matrix(contact, n):
    """The tangent over all nodes and, behind them, the rigid pin."""
    n += 2
    rows = contact.tangent.rows
    columns = contact.tangent.columns
    values = contact.tangent.blocks()
    K = sp.csr_matrix((n, n))
    for i, j in np.ndindex(2, 2):
        K += sp.coo_matrix((values[:, i, j], (2 * rows + i, 2 * columns + j)), shape=(n, n)).tocsr()
    return K


def partners(contact):
    """Every point's partner."""
    projections = [pair.projection for pair in contact.pairs]
    return np.concatenate([(P.found, P.slides, P.facet) for P in projections], axis=1)


def plastic_points(contact):
    return [points for _, points in contact.histories().values() if points.yields]


def branch(contact):
    """What decides on the branch of every point: contact, partner, flow."""
    flags = [p.trial.peeq > p.state.peeq for p in plastic_points(contact)]
    for pair in contact.pairs:
        P = pair.projection
        flags += [pair.active, pair.sticks, P.found, P.slides, P.facet.astype(float)]
    return np.concatenate(flags)


def assert_tangent_is_derivative(parts, u, *, directions=3):
    """Central differences in random directions that move the pin as a whole, a rigid one too, and
    every node by itself; a rigid pin's own force is against the resultant."""
    contact = parts.contact
    rng = np.random.default_rng(7)
    contact.search()
    contact_force(contact, u)
    K = matrix(contact, u.size)
    at = branch(contact)
    active = contact.n_active()
    h = 1e-6 * DR
    for k in range(directions):
        d = rng.normal(size=u.shape) if k else parts.pressed(1.0)
        rigid = len(contact.rigid)
        e = rng.normal(size=2) * rigid
        motion = [disc.motion for disc in contact.rigid]
        sides = []
        for sign in (1, -1):
            for disc, at_start in zip(contact.rigid, motion, strict=True):
                disc.motion = at_start + sign * h * e
            force = contact_force(contact, u + sign * h * d)
            sides.append(np.append(force.ravel(), contact.resultant() * rigid))
            np.testing.assert_array_equal(branch(contact), at)
        for disc, at_start in zip(contact.rigid, motion, strict=True):
            disc.motion = at_start
        difference = (sides[0] - sides[1]) / (2 * h)
        assert np.linalg.norm(difference) > 0
        assert np.linalg.norm(K @ np.append(d, e) - difference) < 1e-6 * np.linalg.norm(difference)
    return active


def indented(parts):
    """A state with a history, in partial contact, at which points flow, unload and lift."""
    contact = parts.contact
    if parts.cells.find(Cells.PIN).size == 0:
        contact.rigid[0].motion = np.array([[0.0, -1.5 * DR]])
    contact.evaluate(parts.pressed(1.2 * DR, noise=0.02 * YIELD_STRAIN, seed=1))
    commit(contact)
    return parts.pressed(1.5 * DR, noise=0.04 * YIELD_STRAIN, seed=2)


CASES = [
    pytest.param(
        bodies,
        integrated,
        id=f"{name}, {'both sides' if integrated is None else ('pin', 'hole')[integrated]}",
    )
    for name, bodies in BODIES.items()
    for integrated in ((None, 0, 1) if bodies[0] else (None,))
]


@every_kinematics
@pytest.mark.parametrize(("bodies", "integrated"), CASES)
def test_tangent_is_the_derivative_of_the_forces(bodies, integrated, kinematics):
    """Of either body's points or both's, pairs moving, fixed or tied, whatever the bodies are made
    of."""
    parts = joint_parts(
        pin=bodies[0], block=bodies[1], kinematics=kinematics, integrated=integrated
    )
    active = assert_tangent_is_derivative(parts, indented(parts))
    points = sum(pair.surface.weight.size for pair in parts.contact.pairs)
    assert active > 0.2 * points
    assert active < points or kinematics == "tied"
    for p in plastic_points(parts.contact):
        assert 0.1 < (p.trial.peeq > p.state.peeq).mean() < 1
    if "rubbing" in kinematics:
        assert 0 < sum(pair.sticks.sum() for pair in parts.contact.pairs) < active


@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_tangent_when_the_pin_has_slid_along_the_hole(kinematics):
    """Far from the matching nodes of the first touch: another facet, no symmetry."""
    parts = joint_parts(size=0.15, kinematics=kinematics)
    u = parts.pressed(0.08, noise=1e-4)
    pin = np.unique(parts.V.dofmap.list[parts.cells.find(Cells.PIN)])
    u[pin, 0] += 0.2
    assert_tangent_is_derivative(parts, u)


def test_tangent_where_the_closest_points_are_vertices():
    """A hole of bulging facets has corners between them: points that have one as partner do not
    slide."""
    parts = joint_parts(size=0.3)
    u = parts.pressed(20 * DR)
    hole = parts.sides[1]
    middle = hole.curve_dofs[1::2]
    normal = hole.curve.X[1::2] / np.linalg.norm(hole.curve.X[1::2], axis=1)[:, None]
    u[middle] -= 0.02 * normal
    parts.contact.evaluate(u)
    pair = parts.contact.pairs[0]
    corner = ~pair.projection.slides & pair.active
    assert corner.sum() >= 2, corner.sum()
    assert_tangent_is_derivative(parts, u)


@pytest.mark.parametrize(
    "kinematics", ["current", "reference", "current, rubbing", "reference, rubbing"]
)
@pytest.mark.parametrize("bodies", ["elastic", "elastic pin, plastic hole", "rigid pin"])
def test_trial_tractions_follow_the_displacements(bodies, kinematics):
    """At every point, open or closed, by central differences; between fixed pairs and where they
    rub shears as well."""
    pin, block = BODIES[bodies]
    parts = joint_parts(pin=pin, block=block, kinematics=kinematics)
    contact = parts.contact
    u = indented(parts)
    rng = np.random.default_rng(3)
    h = 1e-6 * DR
    direction = rng.normal(size=u.shape)
    levels = rng.normal(size=max((len(s.rate) for s in contact.rigid), default=1))
    motions = [surface.motion.copy() for surface in contact.rigid]
    contact.evaluate(u)
    at = partners(contact)
    rates = [point_rates(pair, direction, levels)[0] for pair in contact.pairs]
    trials = []
    for sign in (1, -1):
        for surface, motion in zip(contact.rigid, motions, strict=True):
            surface.motion = motion + sign * h * levels[None] @ surface.rate
        contact.evaluate(u + sign * h * direction)
        np.testing.assert_array_equal(partners(contact), at)
        trials.append([pair.trial for pair in contact.pairs])
    for pair, rate, ahead, behind in zip(contact.pairs, rates, *trials, strict=True):
        difference = (ahead - behind) / (2 * h)
        assert 0.1 < pair.active.mean() < 0.95
        components = slice(0, 1 if kinematics == "current" else 2)
        found = pair.projection.found | (
            "rubbing" not in kinematics
        )  # the others are told to carry nothing
        off = (rate - difference)[found, components]
        assert np.abs(off).max() < 1e-6 * np.abs(difference).max()


def test_the_points_that_are_expected_to_close_do():
    """Under reference kinematics pressures are linear where signs do not matter: the next
    evaluation finds no other."""
    parts = joint_parts(kinematics="reference")
    contact = parts.contact
    u = parts.pressed(DR)
    v = parts.pressed(3 * DR, noise=1e-4)
    contact.evaluate(u)
    few = contact.n_active()
    still = np.zeros(1)
    assert contact.anticipate(v - u, still)
    assert not contact.anticipate(v - u, still)
    expected = [pair.active for pair in contact.pairs]
    assert any((pair.traction[:, 0] < 0).any() for pair in contact.pairs), (
        "closed points pull where they were open"
    )
    contact.evaluate(v)
    assert contact.active_set_changes == 0
    assert contact.n_active() > few
    for pair, active in zip(contact.pairs, expected, strict=True):
        assert (pair.active == active).all()


def test_tangent_of_a_tied_elastic_contact_is_constant():
    """Tied elastic bodies are linear: K u + f0 is the force anywhere."""
    parts = joint_parts(kinematics="tied")
    u = parts.pressed(DR, noise=1e-4, seed=1)
    v = parts.pressed(30 * DR, noise=1e-2, seed=2)
    at_u = contact_force(parts.contact, u).ravel()
    K = matrix(parts.contact, u.size)[:-2, :-2]
    at_v = contact_force(parts.contact, v).ravel()
    np.testing.assert_allclose(
        at_v - at_u, K @ (v - u).ravel(), rtol=0, atol=1e-12 * np.abs(at_v).max()
    )


@every_kinematics
def test_the_pattern_holds_the_tangent(kinematics):
    """No entry of the tangent lies outside the slots announced for the matrix."""
    parts = joint_parts(kinematics=kinematics)
    parts.contact.evaluate(parts.pressed(1.5 * DR, noise=1e-4))
    rows = parts.contact.tangent.rows
    columns = parts.contact.tangent.columns
    n = len(parts.pressed(0.0))
    slots = set((parts.contact.pattern()[0] * n + parts.contact.pattern()[1]).tolist())
    assert set((rows * n + columns).tolist()) <= slots
