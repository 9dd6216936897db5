"""Facets in space broken where an opposite surface's facets end."""

from __future__ import annotations

from itertools import pairwise

import basix
import numpy as np
import pytest

from archord.geometry.basis import lagrange_element
from archord.geometry.overlay import (
    broken_facets,
    coincide,
    piece_rule,
    polygon_rule,
    quartered,
    without_slivers,
)
from archord.geometry.patches import Patches

TRIANGLE = basix.CellType.triangle
SQUARE = basix.CellType.quadrilateral
every_kind = pytest.mark.parametrize("cell", [TRIANGLE, SQUARE], ids=lambda cell: cell.name)


def sheet(cell, cells, side=1.0, *, height=lambda s, t: 0 * s, up=True, turn=0.0):
    """A square sheet of so many ``cells`` a side about the origin, turned about z, with facets of
    second order at the ``height``."""
    squares = [
        [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]] for i, j in np.ndindex(cells, cells)
    ]
    corners = np.array(squares) / cells - 0.5
    if cell == TRIANGLE:
        corners = np.concatenate([corners[:, [0, 1, 3]], corners[:, [0, 3, 2]]])
    if not up:
        corners = corners[:, [0, 2, 1] if cell == TRIANGLE else [0, 2, 1, 3]]
    linear = lagrange_element(cell, 1).tabulate(0, lagrange_element(cell, 2).points)[0, ..., 0]
    nodes = side * (linear @ corners)
    c, s = np.cos(turn), np.sin(turn)
    flat = nodes.reshape(-1, 2) @ np.array([[c, s], [-s, c]])
    unique, node = np.unique(np.round(flat, 12), axis=0, return_inverse=True)
    X = np.column_stack([unique, height(*unique.T)])
    return Patches(X, node.reshape(nodes.shape[:2]), cell, 2)


def saddle(s, t):
    return 0.2 * s * t + 0.1 * s**2


def points(own, opposite, degree):
    facet, _, pieces = broken_facets(own, opposite)
    xi, w = piece_rule(pieces, degree)
    return facet, xi, w


@every_kind
@pytest.mark.parametrize("turn", [0.0, 0.3], ids=["aligned", "turned"])
@pytest.mark.parametrize("side", [0.7, 1.5], ids=["smaller", "larger"])
def test_pieces_cover_every_facet_whatever_lies_over_it(cell, turn, side):
    """Also facets beyond the border of the opposite surface."""
    own = sheet(cell, 3, height=saddle)
    over = sheet(cell, 5, side, height=saddle, up=False, turn=turn)
    facet, _, w = points(own, over, 4)
    assert (np.diff(facet) >= 0).all()
    assert (w > 0).all()
    covered = np.bincount(facet, w.sum(axis=1), own.n_facets)
    np.testing.assert_allclose(covered, 0.5 if cell == TRIANGLE else 1.0, rtol=1e-9)


@every_kind
@pytest.mark.parametrize("height", [lambda s, t: 0 * s, saddle], ids=["plane", "saddle"])
def test_shape_functions_of_the_opposite_surface_are_integrated_exactly(cell, height):
    """Their integrals over one surface are those over the other, times the normal."""
    turn = 0.3 if cell == TRIANGLE else 0.0
    own = sheet(cell, 3, 2.0, height=height)
    opposite = sheet(cell, 4, height=height, up=False, turn=turn)
    assert coincide(own, opposite)
    farthest = 1.0 if cell == TRIANGLE else 2.0
    integrals = []
    for one, other in ((own, opposite), (opposite, own)):
        facet, xi, w = points(one, other, 4)
        at = np.repeat(facet, xi.shape[1])
        shape, slope = one.shapes(xi.reshape(-1, 2))
        nodes = one.X[one.connectivity[at]]
        x = np.einsum("ma,mai->mi", shape, nodes)
        tangents = np.einsum("mca,mai->mci", slope, nodes)
        normal = np.cross(tangents[:, 0], tangents[:, 1]) * w.ravel()[:, None]
        if one is own:
            sides = normal / np.linalg.norm(normal, axis=1)[:, None]
            met = opposite.closest_point(x, sides, np.zeros_like(opposite.X))
            # facets are continued a little beyond a free border
            is_over = ((met.xi > 0) & (met.xi < 1)).all(axis=1) & (met.xi.sum(axis=1) < farthest)
            shape, at, normal = met.shape, met.facet, -normal * is_over[:, None]
        total = np.zeros_like(opposite.X)
        np.add.at(total, opposite.connectivity[at], shape[..., None] * normal[:, None])
        integrals.append(total)
    np.testing.assert_allclose(*integrals, rtol=0, atol=1e-10)


def test_surfaces_apart_do_not_coincide():
    own = sheet(TRIANGLE, 3)
    assert not coincide(own, sheet(TRIANGLE, 4, height=lambda s, t: 1e-3 + 0 * s, up=False))


def test_four_quarters_are_the_triangle():
    triangle = np.array([[[0.1, 0.2], [0.9, 0.3], [0.2, 0.8]]])
    for degree in (2, 4):
        whole, parts = (piece_rule(t, degree) for t in (triangle, quartered(triangle)))
        for power in range(degree + 1):
            wanted = (whole[1] * whole[0][..., 0] ** power).sum()
            assert (parts[1] * parts[0][..., 0] ** power).sum() == pytest.approx(wanted, rel=1e-13)


def polygon(corners):
    """Triangles of a convex polygon from its first corner."""
    return np.array([[corners[0], *pair] for pair in pairwise(corners[1:])])


def convex_polygons(n=200):
    """Polygons of three to seven corners on ellipses of every shape, some as thin as slivers."""
    rng = np.random.default_rng(5)
    found = []
    for _ in range(n):
        angle = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 8)))
        axes = np.diag([1.0, 10 ** rng.uniform(-5, 0)])
        corners = np.column_stack([np.cos(angle), np.sin(angle)]) @ axes
        turn = rng.uniform(0, 2 * np.pi)
        c, s = np.cos(turn), np.sin(turn)
        found.append(corners @ np.array([[c, s], [-s, c]]) + rng.normal(size=2))
    return found


def test_three_points_in_a_polygon_are_exact_for_the_second_degree_and_lie_in_it():
    corners = convex_polygons()
    triangles = np.concatenate([polygon(c) for c in corners])
    number = np.repeat(np.arange(len(corners)), [len(c) - 2 for c in corners])
    xi, w = polygon_rule(triangles, number)
    exact_xi, exact_w = piece_rule(triangles, 2)
    for i, j in np.ndindex(3, 3):
        if i + j > 2:
            continue
        exact = (exact_w * exact_xi[..., 0] ** i * exact_xi[..., 1] ** j).sum(axis=1)
        found = (w * xi[..., 0] ** i * xi[..., 1] ** j).sum(axis=1)
        np.testing.assert_allclose(found, np.bincount(number, exact), rtol=1e-11, atol=1e-13)
    for points_of_one, around in zip(xi, corners, strict=True):
        sides = np.roll(around, -1, axis=0) - around
        apart = points_of_one[:, None] - around
        beside = sides[:, 0] * apart[..., 1] - sides[:, 1] * apart[..., 0]
        assert (beside > -1e-8 * np.abs(beside).max()).all()


def test_three_points_in_a_triangle_are_the_usual_ones():
    corners = [[0.1, 0.2], [0.9, 0.3], [0.2, 0.8]]
    usual, w = piece_rule(np.array([corners]), 2)
    found, weights = polygon_rule(np.array([corners]), np.zeros(1, dtype=int))
    np.testing.assert_allclose(weights, w, rtol=1e-13)
    to_nearest = np.linalg.norm(found[0, :, None] - usual[0], axis=-1).min(axis=1)
    np.testing.assert_allclose(to_nearest, 0.0, atol=1e-13)


def test_points_in_a_polygon_do_not_depend_on_the_corner_with_which_it_begins():
    corners = np.array([[0.0, 0.0], [1.0, 0.1], [1.1, 0.7], [0.4, 1.0]])
    rules = [
        polygon_rule(polygon(np.roll(corners, k, axis=0)), np.zeros(2, dtype=int))[0][0]
        for k in range(4)
    ]
    for other in rules[1:]:
        apart = np.linalg.norm(rules[0][:, None] - other, axis=-1).min(axis=1)
        np.testing.assert_allclose(apart, 0.0, atol=1e-13)


@pytest.mark.parametrize("cells", [4, 60], ids=["as_large", "20_times_as_small"])
def test_slivers_belong_to_the_nearest_polygon_of_their_facet(cells):
    """No facet loses an area, whatever the sizes of those over it."""
    own = sheet(TRIANGLE, 3, height=saddle)
    over = sheet(TRIANGLE, cells, 1.3, height=saddle, up=False, turn=0.3)
    facet, number, triangles = broken_facets(own, over)
    merged = without_slivers(triangles, number, facet)
    area = piece_rule(triangles, 1)[1].sum(axis=1)
    before = np.bincount(number, area)
    after = np.bincount(merged, area)
    mean = 0.5 / np.bincount(facet[np.unique(number, return_index=True)[1]])
    assert before.min() < mean.min() / 40
    assert (
        len(after)
        == (before > mean[facet[np.searchsorted(number, np.arange(len(before)))]] / 40).sum()
    )
    _, first = np.unique(merged, return_index=True)
    np.testing.assert_array_equal(facet[first][merged], facet)
    assert (after > mean[facet[first]] / 40).all()
