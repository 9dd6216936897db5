"""Closest points on curved triangles and quadrilaterals in space."""

from __future__ import annotations

import basix
import numpy as np
import pytest

from archord.geometry.basis import lagrange_element
from archord.geometry.patches import Patches

TRIANGLE = basix.CellType.triangle
QUADRILATERAL = basix.CellType.quadrilateral
every_cell = pytest.mark.parametrize("cell", [TRIANGLE, QUADRILATERAL], ids=lambda cell: cell.name)
RADIUS = 2.0


def plane(s, t):
    return np.stack([3 * s - 1.5, 2 * t - 1, 0 * s], axis=-1)


def cylinder(s, t):
    """A quarter, about the y axis; the body lies within."""
    angle = np.pi / 2 * s
    return np.stack([-RADIUS * np.cos(angle), 3 * t, RADIUS * np.sin(angle)], axis=-1)


def sphere(s, t):
    """A part around the equator; the body lies within."""
    azimuth = 1.6 * s
    height = 1.2 * (t - 0.5)
    across = RADIUS * np.cos(height)
    return np.stack(
        [across * np.cos(azimuth), across * np.sin(azimuth), RADIUS * np.sin(height)], axis=-1
    )


def saddle(s, t):
    x = 3 * s - 1.5
    y = 3 * t - 1.5
    return np.stack([x, y, 0.1 * (x**2 - y**2)], axis=-1)


SURFACES = {"plane": plane, "cylinder": cylinder, "sphere": sphere, "saddle": saddle}
every_surface = pytest.mark.parametrize("f", SURFACES.values(), ids=SURFACES)


def patches(f, cell=TRIANGLE, n=8, degree=2, *, flipped=False) -> Patches:
    """Interpolation of ``f`` on n by n squares, each one quadrilateral or two triangles; the body
    lies on the other side if they are ``flipped``."""
    points = lagrange_element(cell, degree).points
    corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    of_square = [[0, 1, 2, 3]] if cell == QUADRILATERAL else [[0, 1, 2], [3, 2, 1]]
    at = []
    for origin in np.argwhere(np.ones((n, n))):
        for a, b, c, *_ in of_square:
            start, by_s, by_t = origin + corners[[a, b, c]]
            if flipped:
                by_s, by_t = by_t, by_s
            at.append(start + points[:, :1] * (by_s - start) + points[:, 1:] * (by_t - start))
    nodes = np.round(degree * np.array(at)).astype(int)
    unique, connectivity = np.unique(nodes.reshape(-1, 2), axis=0, return_inverse=True)
    s, t = (unique / (degree * n)).T
    return Patches(f(s, t), connectivity.reshape(nodes.shape[:2]), cell, degree)


def on_patches(p: Patches, facet, xi):
    """Points and unit outward normals at ``xi`` of ``facet``."""
    value, slope = p.shapes(xi)
    nodes = p.X[p.connectivity[facet]]
    point = np.einsum("ma,mai->mi", value, nodes)
    by_s, by_t = np.einsum("mca,mai->cmi", slope, nodes)
    normal = np.cross(by_s, by_t)
    return point, normal / np.linalg.norm(normal, axis=1)[:, None]


def places(p: Patches, n: int = 400, seed: int = 3):
    """Random facets, and places on them."""
    rng = np.random.default_rng(seed)
    xi = rng.uniform(size=(n, 2))
    if p.cell == TRIANGLE:
        over = xi.sum(axis=1) > 1
        xi[over] = 1 - xi[over]
    return rng.integers(0, p.n_facets, n), xi


def scatter(p: Patches, distance: float, n: int = 400):
    """Points up to ``distance`` off random places on either side, and the outward normals of a body
    that faces them there."""
    point, normal = on_patches(p, *places(p, n))
    off = distance * np.random.default_rng(5).uniform(-1, 1, n)
    return point + off[:, None] * normal, -normal, off


def closest(p: Patches, x, outward, start=None):
    """Closest points of the patches at rest."""
    return p.closest_point(x, outward, np.zeros_like(p.X), start)


@every_cell
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_facets_know_their_neighbours(cell, degree):
    """Each across its edges, and both ways; the border is what four sides of a square have."""
    p = patches(plane, cell, n=5, degree=degree)
    assert (p.beyond < 0).sum() == 4 * 5
    facet, edge = np.nonzero(p.beyond >= 0)
    assert all(f in p.beyond[p.beyond[f, e]] for f, e in zip(facet, edge, strict=True))
    assert p.areas().sum() == pytest.approx(3 * 2, rel=1e-13)
    place, near = p.neighbours(np.array([7, 7, 8]), rings=1)
    assert sorted(near[place == 0]) == sorted({7, *p.beyond[7]} - {-1})
    assert (near[place == 1] == near[place == 0]).all()


def test_facets_that_branch_are_refused():
    X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], dtype=float)
    facets = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    with pytest.raises(ValueError, match="more than two facets share an edge"):
        Patches(X, facets, TRIANGLE, 1)


@every_cell
@every_surface
@pytest.mark.parametrize("distance", [1e-3, 0.2])
def test_closest_point_is_the_foot_of_the_normal(f, cell, distance):
    """A point on the normal of a smooth surface comes back to where the normal starts, up to the
    kinks between quadratic facets; inside facets x - y is along the normal, to round-off."""
    p = patches(f, cell)
    x, outward, off = scatter(p, distance)
    found = closest(p, x, outward)
    assert found.found.all()
    gap = ((x - found.point) * found.normal).sum(axis=1)
    kink = 1e-12 if f is plane else 0.02 * distance + 1e-12
    np.testing.assert_allclose(gap, off, rtol=0, atol=kink)
    inside = found.along[:, 0, 0] * found.along[:, 1, 1] - found.along[:, 0, 1] ** 2 > 1e-6
    assert inside.mean() > 0.8
    aside = np.einsum("mi,mci->mc", x - found.point, found.tangent)
    np.testing.assert_allclose(aside[inside], 0.0, atol=1e-11)
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, rtol=1e-14)
    point, normal = on_patches(p, found.facet, found.xi)
    np.testing.assert_allclose(found.point, point, atol=1e-13)
    np.testing.assert_allclose(found.normal, normal, atol=1e-12)


@every_cell
@every_surface
def test_no_point_of_the_surface_is_nearer(f, cell):
    """Among 200 samples of every facet."""
    p = patches(f, cell, n=5)
    x, outward, _ = scatter(p, 0.3, n=60)
    found = closest(p, x, outward)
    distance = np.linalg.norm(x - found.point, axis=1)
    facet, xi = np.arange(p.n_facets).repeat(200), np.tile(places(p, 200)[1], (p.n_facets, 1))
    samples, _ = on_patches(p, facet, xi)
    nearest = np.linalg.norm(x[:, None] - samples, axis=-1).min(axis=1)
    assert (distance <= nearest + 1e-12).all()


@every_cell
@pytest.mark.parametrize(("f", "along_axis"), [(cylinder, True), (sphere, False)])
def test_gap_to_a_round_surface_converges(f, along_axis, cell):
    """Quadratic facets are off a sphere or cylinder by the third power of their size at least."""
    errors = []
    for n in (4, 8, 16):
        p = patches(f, cell, n)
        point, _ = on_patches(p, *places(p))
        centre = point * [0, 1, 0] if along_axis else 0 * point
        normal = point - centre
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        x = centre + 1.1 * RADIUS * normal
        found = closest(p, x, -normal)
        gap = ((x - found.point) * found.normal).sum(axis=1)
        errors.append(np.abs(gap - 0.1 * RADIUS)[found.found].max())
        assert found.found.all()
    assert np.all(np.diff(np.log2(errors)) < -2.8)
    assert errors[-1] < 1e-4


@every_cell
def test_points_beyond_a_free_border_are_not_found(cell):
    """Up to 5 % of a facet they are, by the facet continued."""
    p = patches(plane, cell, n=4)
    size = 3 / 4
    x = np.array([[1.5 + 0.04 * size, 0.1, 0.3], [1.5 + 0.06 * size, 0.1, 0.3], [1.4, 0.1, 0.3]])
    beside_corner = np.array([[1.5 + 0.06 * size, 1.03, 0.3], [1.51, 1.01, 0.3]])
    x = np.concatenate([x, beside_corner])
    found = closest(p, x, np.tile([0.0, 0.0, -1.0], (len(x), 1)))
    assert found.found.tolist() == [True, False, True, False, True]
    np.testing.assert_allclose(found.point[[0, 2, 4]], x[[0, 2, 4]] * [1, 1, 0], atol=1e-14)


@every_cell
@every_surface
def test_orientation_tells_the_side_of_the_body(f, cell):
    """Flipped facets have reversed normals: the same gaps with the other sign, and who faced the
    surface faces away."""
    p = patches(f, cell)
    flipped = patches(f, cell, flipped=True)
    x, outward, _ = scatter(p, 0.1)
    ahead = closest(p, x, outward)
    behind = closest(flipped, x, -outward)
    assert behind.found.all()
    np.testing.assert_allclose(behind.normal, -ahead.normal, atol=1e-9)
    np.testing.assert_allclose(behind.point, ahead.point, atol=1e-10)
    assert not closest(flipped, x, outward).found.any()


@every_cell
@every_surface
def test_closest_point_turns_with_the_surface(f, cell):
    """By 37 degrees about (1, 2, 3), with the body's displacement."""
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
    K = np.cross(np.eye(3), axis)
    turn = np.eye(3) + np.sin(np.radians(37)) * K + (1 - np.cos(np.radians(37))) * K @ K
    p = patches(f, cell)
    x, outward, _ = scatter(p, 0.2)
    before = closest(p, x, outward)
    after = p.closest_point(x @ turn, outward @ turn, p.X @ turn - p.X)
    np.testing.assert_allclose(after.point, before.point @ turn, atol=1e-9)
    np.testing.assert_allclose(after.normal, before.normal @ turn, atol=1e-8)
    assert (after.found == before.found).all()


@every_cell
@every_surface
def test_a_start_anywhere_leads_to_the_same_partner(f, cell):
    """From facets two edges away, and from the far end of the surface; on the inner side of a kink
    between two facets there may be two of them, one as near as the other."""
    p = patches(f, cell)
    x, outward, _ = scatter(p, 1e-3)
    wanted = closest(p, x, outward)
    place, near = p.neighbours(wanted.facet, rings=2)
    last = np.append(np.flatnonzero(np.diff(place)), len(place) - 1)
    for start in (near[last], np.zeros(len(x), dtype=int)):
        found = closest(p, x, outward, start)
        np.testing.assert_allclose(found.point, wanted.point, atol=1e-10)


@every_cell
@every_surface
def test_partners_move_as_their_linearisation_says(f, cell):
    """Central differences by the point and by the nodes of the partner's facet."""
    p = patches(f, cell)
    x, outward, _ = scatter(p, 0.2, n=80)
    rng = np.random.default_rng(1)
    v = rng.uniform(-1, 1, x.shape)
    w = rng.uniform(-1, 1, p.X.shape)
    h = 1e-6
    at = closest(p, x, outward)
    after, before = (p.closest_point(x + s * v, outward, s * w, at.facet) for s in (h, -h))
    stays = (after.facet == at.facet) & (before.facet == at.facet)
    difference = (after.xi - before.xi) / (2 * h)
    nodes = w[at.nodes]
    jump = v - np.einsum("ma,mai->mi", at.shape, nodes)
    aside = np.einsum("mi,mci->mc", jump, at.tangent)
    aside += np.einsum("mi,mca,mai->mc", x - at.point, at.slope, nodes)
    expected = np.einsum("mcd,md->mc", at.along, aside)
    assert stays.mean() > 0.9
    np.testing.assert_allclose(difference[stays], expected[stays], rtol=2e-5, atol=2e-5)


@every_cell
def test_continued_facets_keep_their_points(cell):
    """A point slides off its facet smoothly: on a plane, to where it is."""
    p = patches(plane, cell)
    x, outward, _ = scatter(p, 0.1)
    facet = closest(p, x, outward).facet
    moved = x + np.array([0.1, 0.05, 0.0])
    found = p.continued(moved, outward, np.zeros_like(p.X), facet)
    assert (found.facet == facet).all()
    np.testing.assert_allclose(found.point, moved * [1, 1, 0], atol=1e-12)


@every_cell
def test_a_surface_ends_at_sharp_edges(cell):
    """Facets go to the ridge of a roof and no farther: beside it points have the distance of their
    own side, and above it none has a partner."""

    def roof(s, t):
        return np.stack([s, t, -np.abs(s - 0.5)], axis=-1)

    p = patches(roof, cell, n=4, degree=1)
    assert p.ends.sum() == 4 * 4 + 2 * 4
    t = np.linspace(0.1, 0.9, 7)
    away = 0.003
    for side in (-1.0, 1.0):
        normal = np.tile([side, 0.0, 1.0], (7, 1)) / np.sqrt(2)
        foot = roof(np.full(7, 0.5 + side * away), t)
        for gap in (-0.001, 0.001, 0.01):
            found = closest(p, foot + gap * normal, -normal)
            assert found.found.all()
            np.testing.assert_allclose(found.point, foot, rtol=0, atol=1e-12)
    up = np.tile([0.0, 0.0, 1.0], (7, 1))
    above = roof(np.full(7, 0.5), t) + 0.01 * up
    assert not closest(p, above, -up).found.any()
