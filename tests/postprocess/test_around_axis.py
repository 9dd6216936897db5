"""Contact in space around an axis: a cylinder of known facets, pressures and forces."""

from __future__ import annotations

import numpy as np
import pytest

from archord.measures.edge import PatchProfile
from archord.postprocess.around_axis import Axis, line_load, unrolled
from archord.report.errors import InputError

R = 2.0
N = 12  # facets around
LAYERS = [0.0, 0.5, 2.0]
DIRECTION = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
POINT = np.array([0.3, -1.0, 0.7])


def placed(angle, along):
    """Points at ``angle`` and ``along`` of the cylinder about a slanted axis."""
    first = np.array([1.0, 0, 0]) - DIRECTION[0] * DIRECTION
    first /= np.linalg.norm(first)
    second = np.cross(DIRECTION, first)
    a = np.asarray(angle)[..., None]
    arm = R * (np.cos(a) * first + np.sin(a) * second)
    return POINT + arm + np.asarray(along)[..., None] * DIRECTION


def cylinder(pressure) -> PatchProfile:
    """Quadrilateral facets in two layers, each broken into two pieces of one point."""
    begin = 2 * np.pi * np.arange(N) / N - np.pi
    low = np.repeat(LAYERS[:-1], N)
    high = np.repeat(LAYERS[1:], N)
    left = np.tile(begin, 2)
    right = left + 2 * np.pi / N
    corners = np.stack(
        [placed(left, low), placed(right, low), placed(right, high), placed(left, high)], axis=1
    )
    facet = np.repeat(np.arange(2 * N), 2)
    angle = np.stack([0.75 * left + 0.25 * right, 0.25 * left + 0.75 * right], axis=1).ravel()
    middle = np.repeat((low + high) / 2, 2)
    X = placed(angle, middle)
    normal = (X - POINT) - ((X - POINT) @ DIRECTION)[:, None] * DIRECTION
    normal /= R
    p = pressure(angle, middle)
    weight = np.repeat(R * 2 * np.pi / N * (high - low) / 2, 2)
    of_facets = (p * weight).reshape(-1, 2).sum(axis=1) / weight.reshape(-1, 2).sum(axis=1)
    zero = np.zeros((4 * N, 1))
    return PatchProfile(
        weight=weight[:, None],
        coordinates=X[:, None],
        pressure=p[:, None],
        raw_pressure=p[:, None],
        gap=zero,
        X=X[:, None],
        slip=np.zeros((4 * N, 1, 3)),
        normal=normal[:, None],
        facet=facet,
        corners=corners[facet],
        facet_pressure=of_facets[facet],
        corner_pressure=np.repeat(of_facets[facet, None], 4, axis=1),
        traction=-p[:, None, None] * normal[:, None],
    )


def test_facets_are_unrolled_over_angle_and_length():
    """Their middles, corners, pressures and areas; no facet is torn at 180 degrees."""
    found = unrolled(cylinder(lambda angle, along: 3.0 + along), Axis(POINT, DIRECTION))
    assert found.radius == pytest.approx(R, rel=1e-12)
    assert len(found.angle) == 2 * N
    np.testing.assert_allclose(sorted(found.angle[:N]), -180 + 15 + 30 * np.arange(N), atol=1e-9)
    np.testing.assert_allclose(found.along, np.repeat([0.25, 1.25], N), atol=1e-12)
    np.testing.assert_allclose(found.pressure, np.repeat([3.25, 4.25], N), atol=1e-12)
    assert found.area.sum() == pytest.approx(2 * np.pi * R * 2.0)
    assert np.abs(found.corners[..., 0] - found.angle[:, None]).max() == pytest.approx(15.0)
    np.testing.assert_allclose(np.ptp(found.corners[..., 1], axis=1), np.repeat([0.5, 1.5], N))


def test_a_cosine_pressure_has_the_line_load_of_the_handbook():
    """p cos(angle) makes pi R p a length, in each layer, and its integral is the force."""
    profile = cylinder(lambda angle, along: 5.0 * np.cos(angle))
    axis = Axis(POINT, DIRECTION)
    other = cylinder(lambda angle, along: 0.0 * angle)
    found = line_load([other, profile], [-0.25, 1.0], axis, along=[0.0, 0.25, 0.5, 1.0, 2.0])
    length = np.linalg.norm(found.load, axis=1)
    np.testing.assert_allclose(length, np.pi * R * 5.0, rtol=1e-12)
    np.testing.assert_allclose(found.load @ DIRECTION, 0.0, atol=1e-12)
    force = np.einsum("nq,nqi->i", profile.weight, profile.traction)
    fine = line_load([profile], [1.0], axis)
    assert len(fine.load) == 40
    np.testing.assert_allclose(np.diff(fine.along) @ fine.load, force, rtol=1e-12)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"direction": (0, 0, 0)}, r"direction = \[0, 0, 0\] must have a length"),
        ({"direction": np.full(3, 1e-200)}, "direction = .* must have a length"),
        ({"direction": (0, 0, np.inf)}, "direction = .* must be three numbers"),
        ({"direction": "z"}, "direction = .* must be three numbers"),
        ({"point": (0, 0)}, "point = .* must be three numbers"),
    ],
)
def test_an_axis_has_a_place_and_a_direction(given, said):
    """A direction without a length ended in a traceback."""
    with pytest.raises(InputError, match=rf"archord\.Axis: {said}"):
        Axis(**given)


@pytest.mark.parametrize("along", [[0.0, 1.0, 1.0], [1.0, 0.0], [0.5], 1.0, [0.0, np.nan], ["a"]])
def test_places_along_an_axis_rise(along):
    """Pieces without a length had loads that are no numbers, and backward ones their negative."""
    profile = cylinder(lambda angle, along: 5.0 * np.cos(angle))
    with pytest.raises(InputError, match=r"line_load: along = .* must be two numbers or more"):
        line_load([profile], [1.0], Axis(POINT, DIRECTION), along)


def test_the_largest_pressure_is_the_mean_of_a_facet():
    """Pressures that scatter at a point do not count; the place is the middle of the facet."""
    profile = cylinder(lambda angle, along: 3.0 + along + np.cos(angle - 0.3))
    spike = int(profile.facet_pressure.argmin())
    profile.pressure[spike] = 100.0
    profile.raw_pressure[spike] = 100.0
    value, place = profile.largest
    assert value == profile.facet_pressure.max()
    most = profile.facet == profile.facet[profile.facet_pressure.argmax()]
    np.testing.assert_allclose(place, profile.X[most].mean(axis=(0, 1)), atol=1e-12)
