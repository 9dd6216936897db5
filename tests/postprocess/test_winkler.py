"""The plastic-Winkler law against the integral it comes from."""

import numpy as np
import pytest
from scipy.integrate import quad

from archord.postprocess.winkler import (
    chord_length,
    elastic_force,
    onset,
    peak_pressure,
    plastic_force,
    plastic_peak_pressure,
)

R, dR, E_star, sigY = 10.0, 0.05, 1.1e5, 230.0


@pytest.mark.parametrize(("k", "c"), [(0.83, 1.0), (0.7, 1.6), (1.2, 0.5)])
@pytest.mark.parametrize("load", [0.05, 0.4, 0.7, 1.1, 3.0, 40.0])
def test_force_is_the_integral_of_the_cut_off_parabola(k, c, load):
    """P = 2 int_0^l min(p0 (1 - x^2/l^2), c sigY) dx, before and beyond the onset; l from cos(eps) = dR/(dR+delta)."""
    delta = load * dR
    length = 2 * R * np.sin(np.arccos(dR / (dR + delta)) / 2)
    p0 = k * E_star * delta / R
    edge = length * np.sqrt(max(0.0, 1 - c * sigY / p0))
    parts = [
        quad(lambda x: min(p0 * (1 - x**2 / length**2), c * sigY), a, b)[0] for a, b in ((0, edge), (edge, length))
    ]
    assert plastic_force(delta, k, c, E_star, R, dR, sigY) == pytest.approx(2 * sum(parts), rel=1e-12)
    assert chord_length(delta, R, dR) == pytest.approx(length, rel=1e-12)


def test_force_and_stiffness_are_continuous_at_the_onset():
    """Both one-sided differences agree, and the elastic law holds up to delta0."""
    k, c = 0.8, 1.3
    delta0 = onset(k, c, E_star, R, sigY)
    assert peak_pressure(delta0, k, E_star, R) == pytest.approx(c * sigY, rel=1e-14)
    h = 1e-5 * delta0
    before, at, after = plastic_force(delta0 + np.array([-h, 0, h]), k, c, E_star, R, dR, sigY)
    assert at == pytest.approx(float(elastic_force(delta0, k, E_star, R, dR)), rel=1e-14)
    assert after - at == pytest.approx(at - before, rel=1e-2)
    lower = np.linspace(0, delta0, 7)
    law = plastic_force(lower, k, c, E_star, R, dR, sigY)
    np.testing.assert_allclose(law, elastic_force(lower, k, E_star, R, dR), rtol=1e-14)


def test_far_beyond_the_onset_the_whole_chord_is_at_the_threshold():
    """P -> 2 c sigY l (1 - O((delta0/delta)^2)), to the last digits: no cancellation."""
    k, c = 0.8, 1.3
    weak = 1e-7 * sigY
    delta = np.array([0.1, 1.0]) * dR
    limit = 2 * c * weak * chord_length(delta, R, dR)
    ratio = plastic_force(delta, k, c, E_star, R, dR, weak) / limit
    u = onset(k, c, E_star, R, weak) / delta
    np.testing.assert_allclose(ratio, 1 - u / 4, rtol=0, atol=2e-14)


def test_an_open_joint_carries_nothing():
    """No force and no pressure at delta <= 0; scalars and any shape alike."""
    delta = np.array([[-1.0, 0.0], [1e-30, 1e-3]])
    with np.errstate(all="raise"):
        forces = [
            plastic_force(delta, 0.8, 1.0, E_star, R, dR, sigY),
            elastic_force(delta, 0.8, E_star, R, dR),
            plastic_peak_pressure(delta, 0.8, 1.0, E_star, R, sigY),
        ]
    for force in forces:
        assert (force[0] == 0).all()
        assert (force[1] > 0).all()
