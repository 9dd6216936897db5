"""Facets in space broken where an opposite surface's facets end."""

from __future__ import annotations

import basix
import numpy as np
import pytest

from archord.geometry.basis import lagrange_element
from archord.geometry.overlay import broken_facets, coincide, piece_rule, quartered
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
    facet, pieces = broken_facets(own, opposite)
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
