"""Conservation laws of the contact forces."""

from __future__ import annotations

import numpy as np
import pytest

from archord.solver.contact.laws.law import STICK
from tests.geometry.shapes.measures import Cells
from tests.solver.parts import (
    DR,
    ELASTIC,
    PERFECT,
    R,
    commit,
    contact_force,
    coordinates,
    joint_parts,
    nodes_of,
)

every_kinematics = pytest.mark.parametrize("kinematics", ["current", "reference", "tied"])
every_integration = pytest.mark.parametrize("integrated", [None, 0, 1], ids=["both", "pin", "hole"])


def moment(x, force):
    return (x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]).sum()


@every_kinematics
@every_integration
@pytest.mark.parametrize("material", [ELASTIC, PERFECT], ids=["elastic", "plastic"])
def test_action_is_reaction(material, integrated, kinematics):
    """The nodal contact forces of both bodies sum to zero, for any state; those on the hole are the
    resultant."""
    parts = joint_parts(pin=material, block=material, integrated=integrated, kinematics=kinematics)
    force = -contact_force(parts.contact, parts.pressed(1.5 * DR, noise=3e-4))
    on_pin, on_hole = (
        force[nodes_of(parts.V, parts.cells, tag)].sum(axis=0) for tag in (Cells.PIN, Cells.BLOCK)
    )
    size = np.abs(force).sum()
    assert on_pin[1] > 0.1 * size
    assert np.abs(on_pin + on_hole).max() < 1e-14 * size
    np.testing.assert_allclose(parts.contact.resultant(), on_hole, rtol=0, atol=1e-14 * size)


@every_integration
def test_forces_have_no_moment(integrated):
    """Under current kinematics: each force acts along the line through its two points (unless one
    is a vertex)."""
    parts = joint_parts(size=0.1, integrated=integrated)
    u = parts.pressed(1.5 * DR)
    force = contact_force(parts.contact, u)
    for pair in parts.contact.pairs:
        assert pair.projection.slides[pair.active].all()
    x = coordinates(parts.V) + u - np.array([R, 0.0])
    on_pin = nodes_of(parts.V, parts.cells, Cells.PIN)
    assert abs(moment(x[on_pin], force[on_pin])) > 0.1 * np.abs(force).sum()
    assert abs(moment(x, force)) < 1e-13 * np.abs(force).sum()


@pytest.mark.parametrize("kinematics", ["current", "reference"])
@every_integration
def test_the_resultant_is_the_integrated_pressure(integrated, kinematics):
    """Shares of both sides' integrals of p n; the pressure is never negative and zero on points
    without a partner."""
    parts = joint_parts(integrated=integrated, kinematics=kinematics)
    contact = parts.contact
    contact.evaluate(parts.pressed(1.5 * DR, noise=3e-4))
    total = np.zeros(2)
    active = 0
    for pair in contact.pairs:
        assert pair.pressure.min() == 0
        assert not pair.traction[~pair.projection.found].any()
        sign = 1 if pair.surface is parts.sides[-1] else -1
        total += (
            sign
            * pair.share
            * (pair.surface.weight * pair.pressure).ravel()
            @ pair.projection.normal
        )
        active += int((pair.pressure > 0).sum())
    assert sum(pair.share for pair in contact.pairs) == pytest.approx(1, rel=1e-15)
    np.testing.assert_allclose(
        contact.resultant(), total, rtol=0, atol=1e-15 * np.abs(total).max() * 100
    )
    assert contact.n_active() == active > 0


def test_points_that_begin_to_slide_are_counted():
    """A pin is pressed, and then turned by little, by much, and by much the other way: each point
    that goes over to another branch counts once."""
    parts = joint_parts(kinematics="current, rubbing")
    pressed = parts.pressed(1.5 * DR)
    parts.contact.evaluate(pressed)
    commit(parts.contact)
    parts.contact.begin(pressed)
    on_pin = nodes_of(parts.V, parts.cells, Cells.PIN)
    before = [pair.branch for pair in parts.contact.pairs]
    began = False
    for turn in (1e-7, 0.3 * DR, -0.3 * DR):
        u = pressed.copy()
        u[on_pin, 0] += turn
        parts.contact.evaluate(u)
        after = [pair.branch for pair in parts.contact.pairs]
        changed = [a != b for a, b in zip(before, after, strict=True)]
        slid = [(a == STICK) & (b > STICK) for a, b in zip(before, after, strict=True)]
        began |= any(some.any() for some in slid)
        assert parts.contact.active_set_changes == sum(int(some.sum()) for some in changed)
        before = after
    assert began


def test_points_without_a_partner_carry_no_pressure():
    """Hole points above the end of a pin pushed down and into the hole's side, though their gap is
    negative."""
    parts = joint_parts(size=0.1)
    u = parts.pressed(0.0)
    u[nodes_of(parts.V, parts.cells, Cells.PIN)] += [0.05, -0.3]
    parts.contact.evaluate(u)
    pair = next(pair for pair in parts.contact.pairs if pair.surface is parts.sides[1])
    lone = ~pair.projection.found & (pair.opening[:, 0] < 0)
    assert lone.sum() > 3
    assert not pair.traction[lone].any()


@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_forces_push_and_never_pull(kinematics):
    """Every point's force on its own body points against the body's outward normal."""
    parts = joint_parts(kinematics=kinematics)
    parts.contact.evaluate(parts.pressed(1.5 * DR, noise=3e-4))
    for pair in parts.contact.pairs:
        on = pair.traction[:, 0] > 0
        assert on.any()
        assert np.all(
            (pair.projection.normal * pair.surface.outward.reshape(-1, 2)).sum(axis=1)[on] < -0.9
        )


@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_bodies_that_do_not_touch_feel_nothing(kinematics):
    """A pin lifted off has no forces and no tangent."""
    parts = joint_parts(kinematics=kinematics)
    u = parts.pressed(0.0)
    u[nodes_of(parts.V, parts.cells, Cells.PIN), 1] += DR / 2
    assert not contact_force(parts.contact, u).any()
    assert not parts.contact.tangent.blocks().any()
    assert parts.contact.n_active() == 0


@every_kinematics
def test_the_gap_at_rest_is_the_clearance(kinematics):
    """(1 - cos phi) dR on the pin to first order in dR / R, for moving and for fixed pairs."""
    parts = joint_parts(size=0.1, kinematics=kinematics)
    parts.contact.evaluate(parts.pressed(0.0))
    for side in parts.sides:
        pair = parts.contact.pair_of(side)
        phi = np.arctan2(side.point[..., 0], -side.point[..., 1])
        expected = DR * (1 - np.cos(phi))
        geometry = (
            0.1**4 / 384
        )  # sagitta error of a parabola through three points of an arc, 3 % of it
        assert (
            np.abs(pair.distance - expected).ravel()[pair.projection.found].max()
            < 1.5 * DR**2 + geometry
        )


@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_forces_follow_a_common_translation(kinematics):
    """Both bodies shifted together: the same gaps, the same forces."""
    parts = joint_parts(kinematics=kinematics)
    u = parts.pressed(1.5 * DR, noise=3e-4)
    force = contact_force(parts.contact, u)
    moved = contact_force(parts.contact, u + np.array([0.3, -0.2]))
    np.testing.assert_allclose(moved, force, rtol=0, atol=1e-12 * np.abs(force).max())


@every_kinematics
def test_evaluation_leaves_no_trace_without_commit(kinematics):
    """Forces of plastic bodies after an excursion are those of bodies that never made it."""
    parts = joint_parts(pin=PERFECT, block=PERFECT, kinematics=kinematics)
    u = parts.pressed(1.2 * DR, noise=1e-4)
    before = contact_force(parts.contact, u)
    contact_force(parts.contact, parts.pressed(6 * DR, noise=1e-3))
    np.testing.assert_allclose(
        contact_force(parts.contact, u), before, rtol=0, atol=1e-12 * np.abs(before).max()
    )
    contact_force(parts.contact, parts.pressed(6 * DR, noise=1e-3))
    commit(parts.contact)
    assert np.abs(contact_force(parts.contact, u) - before).max() > 0.01 * np.abs(before).max()
