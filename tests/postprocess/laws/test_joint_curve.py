"""The table of a joint's law: continuity, slopes, inverse, the way back, first touch, units,
shapes."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from archord.postprocess.laws.general.joint_curve import JointCurve, first_touch
from tests.postprocess.laws.curves import yielding_curve

X = np.linspace(0.0, 3.0, 500)


def test_the_last_force_has_its_displacement() -> None:
    """Whatever round-off makes of it."""
    for length in 0.05 * np.linspace(1, 2, 50):
        curve = replace(yielding_curve(), length=length, force=7e3 * length)
        found = curve.displacement(curve.at(curve.limit).load)
        assert found == pytest.approx(curve.limit, rel=1e-9)
    assert np.isnan(curve.displacement(1.001 * curve.at(curve.limit).load))


def test_slopes_are_those_of_the_force() -> None:
    """dP/d(delta) is the derivative of P, loading and coming back, but at kinks: where it opens,
    and the deepest."""
    curve = yielding_curve()
    h = 1e-7
    for deepest in (0.0, 1.0, 2.5):
        z = float(curve.residual(np.array([deepest]))[0])
        x = X[(np.abs(X - deepest) > 1e-3) & (np.abs(X - z) > 1e-3) & (X > 0)]
        slope = (curve.at(x + h, deepest).load - curve.at(x - h, deepest).load) / (2 * h)
        np.testing.assert_allclose(curve.at(x, deepest).stiffness, slope, rtol=2e-6, atol=2e-6)


def test_both_branches_meet_at_the_deepest_point_and_the_way_back_is_below() -> None:
    """P is continuous, never above first loading on the way back, and zero up to the residual
    clearance."""
    curve = yielding_curve()
    first = curve.at(X).load
    for deepest in (0.3, 1.0, 2.5):
        back = curve.at(X, deepest).load
        z = float(curve.residual(np.array([deepest]))[0])
        assert (back <= first).all()
        assert (np.diff(back) >= 0).all()
        assert 0 <= z < deepest
        np.testing.assert_array_equal(back > 0, (z < X) & (X > 0))
        assert (
            abs(float(curve.at([deepest - 1e-12], deepest).load[0] - curve.at([deepest]).load[0]))
            < 1e-10
        )
    assert float(curve.residual(np.array([2.5]))[0]) > 0.5


def test_the_joint_opens_at_its_residual_clearance() -> None:
    """Also where the toe is wide: there is no force just before, and some just after."""
    curve = yielding_curve()
    deepest = np.array([0.6, 1.0, 1.7, 2.9])
    opens = curve.residual(deepest)
    assert (opens > 0).all()
    assert (curve.at(opens - 1e-9, deepest).load == 0).all()
    assert (curve.at(opens + 1e-6, deepest).load > 0).all()


def test_beyond_the_table_there_is_a_warning() -> None:
    curve = yielding_curve()
    with pytest.warns(UserWarning, match="beyond 3 dR"):
        assert curve.at([1.01 * curve.limit]).load > curve.at([curve.limit]).load


def test_the_inverse_gives_the_displacement_back() -> None:
    """delta(P(delta)) = delta; no displacement of first loading has more than the largest force."""
    curve = yielding_curve()
    x = X[X <= 3.0]
    np.testing.assert_allclose(curve.displacement(curve.at(x).load), x, atol=1e-12)
    assert np.isnan(curve.displacement([1.001 * curve.y[-1]])[0])


def test_first_touch_is_line_contact() -> None:
    """P at first touch solves pi x/y + ln(y/(1 + y)) = F, and its slope tends to zero with the
    logarithm."""
    curve = yielding_curve()
    x = np.geomspace(1e-9, 0.019, 30)
    y = curve.at(x).load
    a = curve.touch[0]
    F = np.pi * x / y + np.log(y / (1 + y))
    np.testing.assert_allclose(F, a + curve.touch[1] * x + curve.touch[2] * x * x, rtol=1e-12)
    y, slope = first_touch(curve.touch, np.array([1e-200]))
    assert slope[0] == pytest.approx(np.pi / (a - np.log(y[0])), rel=0.01)


def test_units_scale_and_nothing_else() -> None:
    """A joint in other units has the same law."""
    curve = yielding_curve()
    other = replace(curve, length=0.05, force=7e3, pressure=210.0)
    for mine, theirs, unit in zip(
        curve.at(X, 1.0), other.at(0.05 * X, 0.05), (7e3, 1.4e5, 7e3, 210.0, 1.0), strict=True
    ):
        np.testing.assert_allclose(mine * unit, theirs, rtol=1e-9, atol=1e-9 * unit)


def test_json_keeps_every_digit() -> None:
    curve = yielding_curve()
    again = JointCurve.from_json(curve.to_json())
    np.testing.assert_array_equal(again.at(X, 1.0).load, curve.at(X, 1.0).load)
    with pytest.raises(ValueError, match="no table"):
        JointCurve.from_json("{}")


@pytest.mark.parametrize(
    ("key", "change", "said"),
    [
        ("x", lambda x: x[::-1], "x must rise from 0"),
        ("x", lambda x: [*x[:20], x[21], x[20], *x[22:]], "x must rise from 0"),
        ("ratio", lambda ratio: ratio[:-1], "ratio must have as many numbers as x"),
        ("y", lambda y: [*y[:9], None, *y[10:]], "y must have numbers alone"),
        ("touch", lambda touch: touch[:2], "touch must have three numbers, or none"),
        ("force", lambda force: -force, "force = -1.0 must be a positive number"),
        ("length", lambda length: None, "length = None must be a positive number"),
    ],
)
def test_a_file_that_was_changed_is_no_table(key, change, said) -> None:
    """Forces of most of them were numbers, without a word."""
    data = json.loads(yielding_curve().to_json())
    data[key] = change(data[key])
    with pytest.raises(ValueError, match=said):
        JointCurve.from_json(json.dumps(data))


def test_any_shape_is_taken() -> None:
    """Numbers, rows and tables of displacements, with one deepest displacement or one for each."""
    curve = yielding_curve()
    table = X[:12].reshape(3, 4)
    deepest = np.array([[0.5], [1.0], [2.0]])
    state = curve.at(table, deepest)
    opens = curve.residual(deepest)
    for row in range(3):
        np.testing.assert_array_equal(state.load[row], curve.at(table[row], deepest[row, 0]).load)
        assert opens[row, 0] == curve.residual(deepest[row, 0])
    assert curve.at(1.0).load.shape == curve.displacement(0.1).shape == ()
