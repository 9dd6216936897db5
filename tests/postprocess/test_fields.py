"""Gaps are drawn as many times as wide as displacements are."""

import numpy as np
import pytest

from archord.benchmarks.case import paper_joint
from archord.postprocess.fields import BODIES, magnification, magnified, nominal, rigid_arc
from archord.postprocess.run import Run


@pytest.mark.parametrize("factor", [1.0, 5.0, 20.0])
def test_the_clearance_grows_by_the_factor(runs, factor):
    """Before loading the pin keeps its circle, touches at the bottom, and the hole's radius is R + factor dR. Factor 1
    is the deformed mesh itself."""
    run = Run(runs["elastic"])
    fields, (R, dR) = run.fields(), (run.scene.joint.radius, run.scene.joint.dR)
    x = magnified(run.scene, fields, factor, displaced=False)
    if factor == 1:
        np.testing.assert_allclose(x, fields.coordinates, atol=1e-14)
        np.testing.assert_allclose(magnified(run.scene, fields, 1.0), fields.deformed, atol=1e-14)
    size, pin = np.hypot(*fields.coordinates.T), fields.body_of_node == BODIES["pin"]
    hole = ~pin & (np.abs(size - R - dR) < 1e-9)
    np.testing.assert_allclose(np.hypot(*x[hole].T), R + factor * dR, rtol=1e-12)
    down = np.array([0.0, -dR])
    arc = pin & (np.abs(np.hypot(*(fields.coordinates - down).T) - R) < 1e-9)
    np.testing.assert_allclose(np.hypot(*(x[arc] - factor * down).T), R, rtol=1e-12)
    assert x[arc, 1].min() == pytest.approx(x[hole, 1].min(), rel=1e-12)
    circle = nominal(run.scene, fields)
    np.testing.assert_allclose(np.hypot(*circle[arc | hole].T), R, rtol=1e-12)


@pytest.mark.parametrize("clearance", [1e-5, 1e-3, 0.05, 0.4])
def test_the_factor_shows_the_clearance_and_no_more(runs, clearance):
    """1 or more, never so large that clearance or displacement exceed a fifth of the radius as drawn."""
    scene = paper_joint(0.2, 1, joint={"clearance": clearance}, load={"displacement": 0.2 if clearance > 0.1 else 2.0})
    fields = Run(runs["elastic"]).fields()
    scaled = type(fields)(**{**fields.__dict__, "displacement": fields.displacement * clearance / 0.005,
                             "delta": fields.delta * clearance / 0.005})  # fmt: skip
    factor = magnification(scene, scaled)
    assert factor >= 1
    if factor > 1:
        assert factor * clearance <= 0.1 * (1 + 1e-9)
        assert factor * np.abs(scaled.displacement).max() <= 0.2
        assert factor * clearance > 0.02


def test_a_rigid_pin_is_a_circle_that_goes_down():
    """By the factor times clearance and delta."""
    scene = paper_joint(0.2, 1, pin={"rigid": True})
    arc = rigid_arc(scene, 0.01, 10.0)
    np.testing.assert_allclose(np.hypot(arc[:, 0], arc[:, 1] + 10 * (0.01 + 0.005)), 1.0, rtol=1e-14)
