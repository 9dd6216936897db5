"""Slopes of cubics: those of SciPy's splines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PchipInterpolator

from archord.postprocess.laws.general.spline import monotone_slopes, spline_slopes


@pytest.mark.parametrize(
    ("n", "flat"), [(2, False), (4, False), (60, False), (2, True), (3, True), (24, True)]
)
def test_slopes_are_those_of_a_spline(n: int, flat: bool) -> None:
    """Of several curves at once, also of so few nodes that the ends meet."""
    random = np.random.default_rng(n)
    at = np.cumsum(random.uniform(0.1, 1.0, n))
    values = random.normal(size=(n, 3))
    begin = (1, np.zeros(3)) if flat else "not-a-knot"
    expected = CubicSpline(at, values, bc_type=(begin, "not-a-knot"))(at, 1)
    np.testing.assert_allclose(spline_slopes(at, values, flat), expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(spline_slopes(at, values[:, 0], flat), expected[:, 0], rtol=1e-9)


@pytest.mark.parametrize("n", [3, 4, 25])
def test_slopes_are_those_of_a_monotone_cubic(n: int) -> None:
    """Of values that rise and fall, and stay."""
    random = np.random.default_rng(n)
    at = np.cumsum(random.uniform(0.1, 1.0, n))
    values = random.normal(size=(5, n))
    values[1] = np.sort(values[1])
    values[2, : n // 2] = 1.0
    values[3] = 0.0
    expected = PchipInterpolator(at, values, axis=1)(at, 1)
    np.testing.assert_allclose(monotone_slopes(at, values), expected, rtol=1e-9, atol=1e-12)
