"""The laws over the chord and on the arc against integrals of the pressures they assume."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from archord.postprocess.laws.chord_laws import parabola, plastic_winkler
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.laws import LAWS

JOINT = LawJoint(radius=7.0, clearance=0.03, E_star=1.2e5, block_yield=300.0)
DEPTHS = JOINT.clearance * np.array([1e-3, 0.1, 0.5, 1.0, 2.0])


def contact_angle(delta):
    return np.arccos(JOINT.clearance / (JOINT.clearance + delta))


@pytest.mark.parametrize(("k", "c"), [(0.85, 1.0), (0.7, 1.6), (1.2, 0.5)])
@pytest.mark.parametrize("delta", [*DEPTHS, 40 * JOINT.clearance])
def test_plastic_law_is_the_force_of_the_cut_parabola(delta, k, c):
    """P = 2 int_0^l min(p0 (1 - x^2/l^2), c sigY) dx, before and beyond the onset."""
    joint = replace(JOINT, k=k, c=c)
    p0 = k * JOINT.E_star * delta / JOINT.radius
    plateau = c * 300.0
    edge = np.sqrt(max(0.0, 1 - plateau / p0))
    l = 2 * JOINT.radius * np.sin(contact_angle(delta) / 2)  # noqa: E741

    def integral(a, b):
        return (
            2 * l * quad(lambda t: min(p0 * (1 - t**2), plateau), a, b, epsabs=0, epsrel=1e-13)[0]
        )

    expected = integral(edge, 1) + (integral(0, edge) if edge else 0)
    assert plastic_winkler(joint, np.array(delta)).load == pytest.approx(expected, rel=1e-11)
    if delta <= 2 * JOINT.clearance:
        assert LAWS["paper-plastic"].force(joint, delta) == pytest.approx(expected, rel=1e-11)
        assert LAWS["paper-plastic"].at_load(joint, expected).peak_pressure == pytest.approx(
            min(p0, plateau), rel=1e-9
        )


@pytest.mark.parametrize("c", [1.0, 1.6])
def test_up_to_the_onset_the_plastic_law_is_the_elastic_one(c):
    """To round-off, and at delta0 Winkler's pressure is the plateau; without a yield stress,
    everywhere."""
    joint = replace(JOINT, c=c)
    lower = np.linspace(0, joint.first_yield, 7)
    deep = 10 * joint.first_yield
    plastic = plastic_winkler(joint, lower)
    elastic = parabola(joint, lower)
    np.testing.assert_allclose(plastic.load, elastic.load, rtol=1e-14)
    eq9 = (
        8 / 3 * joint.k * joint.E_star * DEPTHS * np.sqrt(DEPTHS / (2 * (joint.clearance + DEPTHS)))
    )
    np.testing.assert_allclose(LAWS["paper"].force(joint, DEPTHS), eq9, rtol=1e-14)
    assert elastic.peak_pressure[-1] == pytest.approx(c * 300.0, rel=1e-14)
    assert parabola(joint, deep).load > plastic_winkler(joint, deep).load


def test_at_first_touch_there_is_nothing():
    """No force, pressure or stiffness at delta = 0, a little beyond; no floating point trouble on
    the way."""
    with np.errstate(all="raise"):
        state = plastic_winkler(JOINT, np.array([0.0, 1e-30]))
    for nothing, little in (state.load, state.stiffness, state.peak_pressure):
        assert nothing == 0 < little


def test_plastic_law_joins_the_elastic_one_smoothly():
    """The same force and slope at delta0; above it less and less than elastic."""
    delta0 = JOINT.first_yield
    assert 0.85 * JOINT.E_star * delta0 / JOINT.radius == pytest.approx(JOINT.yield_stress)
    elastic = LAWS["paper"]
    plastic = LAWS["paper-plastic"]
    near = delta0 * np.array([1 - 1e-12, 1 + 1e-12])
    assert plastic.force(JOINT, near) == pytest.approx(elastic.force(JOINT, near), rel=1e-8)
    assert plastic.stiffness(JOINT, near) == pytest.approx(elastic.stiffness(JOINT, near), rel=1e-5)
    deep = np.linspace(1.01 * delta0, 2 * JOINT.clearance, 20)
    ratio = plastic.force(JOINT, deep) / elastic.force(JOINT, deep)
    assert (np.diff(ratio) < 0).all()
    assert ratio[0] < 1


def test_far_beyond_yield_the_chord_is_under_the_yield_stress():
    """P -> 2 sigY l, and no digit is lost on the way."""
    soft = LawJoint(radius=1.0, clearance=1e-3, E_star=1.0, block_yield=1e-12, k=0.8, c=1.3)
    delta = np.array([0.1, 1.0]) * 1e-3
    u = soft.first_yield / delta
    state = plastic_winkler(soft, delta)
    chord = 2 * np.sqrt(delta / (2 * (1e-3 + delta)))
    ratio = state.load / (2 * 1.3e-12 * chord)
    np.testing.assert_allclose(
        ratio, 1 - u / 4, rtol=0, atol=2e-14
    )  # series of eq. 11 for small delta0/delta
    slope = 1.3e-12 * chord / delta * 1e-3 / (1e-3 + delta)  # of 2 c sigY l
    np.testing.assert_allclose(state.stiffness / slope, 1, rtol=2 * u.max())


@pytest.mark.parametrize("delta", DEPTHS)
def test_winkler_law_is_the_force_of_the_foundation(delta):
    eps = contact_angle(delta)
    dR = JOINT.clearance

    def vertical(phi):
        spring = 0.85 * JOINT.E_star / JOINT.radius
        return spring * (delta * np.cos(phi) - dR * (1 - np.cos(phi))) * np.cos(phi) * JOINT.radius

    expected = 2 * quad(vertical, 0, eps, epsabs=0, epsrel=1e-12)[0]
    assert LAWS["winkler"].force(JOINT, delta) == pytest.approx(expected, rel=1e-10)


def test_winkler_keeps_its_digits_at_first_touch():
    """P -> k E* (4/3) delta sqrt(2 delta/dR): the leading term of the integral."""
    delta = JOINT.clearance * 1e-12
    leading = 0.85 * JOINT.E_star * 4 / 3 * delta * np.sqrt(2e-12)
    assert LAWS["winkler"].force(JOINT, delta) == pytest.approx(leading, rel=1e-9)


@pytest.mark.parametrize("delta", DEPTHS)
def test_liu_is_the_force_of_the_ellipse(delta):
    p0 = JOINT.E_star * delta / (2 * JOINT.radius)
    l = 2 * JOINT.radius * np.sin(contact_angle(delta) / 2)  # noqa: E741
    # x = l sin(t) takes the root out of the integrand
    expected = 2 * l * quad(lambda t: p0 * np.cos(t) ** 2, 0, np.pi / 2)[0]
    assert LAWS["liu"].force(JOINT, delta) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("name", ["paper", "paper-plastic", "winkler", "liu"])
def test_angle_is_that_of_overlapping_circles(name):
    assert LAWS[name].at_displacement(JOINT, DEPTHS).angle == pytest.approx(
        contact_angle(DEPTHS), rel=1e-9
    )
    assert LAWS[name].at_displacement(JOINT, 0.0).angle == 0
