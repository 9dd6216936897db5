"""The largest pressure on a surface, and its place."""

from __future__ import annotations

import numpy as np
import pytest

from archord.measures.edge import SurfaceProfile


def profile(pressure):
    """Two facets of two points with these pressures ``(2, 2)``."""
    pressure = np.asarray(pressure)
    place = np.arange(8.0).reshape(2, 2, 2)
    nothing = np.zeros((2, 2))
    return SurfaceProfile(
        s=nothing,
        weight=nothing + 1,
        pressure=pressure,
        raw_pressure=pressure,
        gap=nothing,
        slip=nothing,
        coordinates=place,
        X=place,
    )


def test_images_that_differ_by_round_off_have_the_first_place_and_the_largest_value():
    """The value itself is not rounded."""
    value, place = profile([[1.0, 2.0], [2.0 * (1 + 1e-9), 1.0]]).largest
    assert value == 2.0 * (1 + 1e-9)
    np.testing.assert_array_equal(place, [2.0, 3.0])


@pytest.mark.parametrize("pressure", [0.0, -1.0])
def test_nothing_that_is_pressed_has_no_pressure(pressure):
    value, _ = profile([[pressure] * 2] * 2).largest
    assert value == 0.0
