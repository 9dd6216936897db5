"""Closest points on piecewise quadratic curves."""

from __future__ import annotations

import numpy as np
import pytest

from archord.geometry import curve as curve_module
from archord.geometry.curve import Curve, ProjectionError, RigidCircle, lagrange


def ellipse_of(a, b, angle):
    return np.stack([a * np.cos(angle), b * np.sin(angle)], axis=-1)


def ellipse(s):
    """Lower half, from left to right; the body lies inside. Smallest radius of curvature 0.5."""
    return ellipse_of(2.0, 1.0, np.pi * (1 + s))


def hole(s):
    """Quarter circle run through clockwise: the body lies outside; backwards it is a pin."""
    return ellipse_of(1.0, 1.0, -np.pi / 2 * s)


def wave(s):
    """Five humps; smallest radius of curvature about 0.6."""
    return np.stack([4 * s, 0.1 * np.sin(4 * np.pi * s)], axis=-1)


def backwards(f):
    return lambda s: f(1 - s)


pin = backwards(hole)
CURVES = {
    "ellipse": ellipse,
    "ellipse from outside": backwards(ellipse),
    "hole": hole,
    "pin": pin,
    "wave": wave,
}
CURVES["wave from below"] = backwards(wave)
every_curve = pytest.mark.parametrize("f", CURVES.values(), ids=CURVES.keys())


def interpolate(f, n: int, grading: float = 1.0) -> Curve:
    """Quadratic interpolation of ``f`` on ``n`` facets, shorter towards the start for ``grading`` >
    1."""
    s = np.linspace(0, 1, n + 1) ** grading
    return Curve(f(np.sort(np.concatenate([s, (s[1:] + s[:-1]) / 2]))), 2)


def closest(c: Curve, x, outward, start=None):
    """Closest points of the curve at rest."""
    return c.closest_point(x, outward, np.zeros_like(c.X), start)


def on_curve(c: Curve, facet, xi, displacement=0.0):
    """Points and unit outward normals at ``xi`` of ``facet``."""
    N, dN = c.shapes(xi)
    nodes = (c.X + displacement)[c.connectivity[facet]]
    y = np.einsum("ma,mai->mi", N, nodes)
    t = np.einsum("ma,mai->mi", dN, nodes)
    return y, np.stack([t[:, 1], -t[:, 0]], axis=1) / np.linalg.norm(t, axis=1)[:, None]


def scatter(c: Curve, distance: float, displacement=0.0, n: int = 500, seed: int = 3):
    """Random points up to ``distance`` off the curve, on both sides of it, and outward normals of a
    body facing it."""
    rng = np.random.default_rng(seed)
    facet = rng.integers(0, c.n_facets, n)
    xi = rng.uniform(size=n)
    y, normal = on_curve(c, facet, xi, displacement)
    return y + normal * (distance * rng.uniform(-1, 1, n))[:, None], -normal


def brute_force(c: Curve, x, displacement=0.0, per_facet: int = 200):
    """Distance of ``x`` from the nearest of many points of the curve."""
    facet = np.repeat(np.arange(c.n_facets), per_facet + 1)
    xi = np.linspace(0, 1, per_facet + 1)
    samples, _ = on_curve(c, facet, np.tile(xi, c.n_facets), displacement)
    return np.array([np.sqrt(((samples - p) ** 2).sum(axis=1).min()) for p in x])


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_shape_functions_are_lagrange_polynomials(degree):
    """One at their own node, zero at the others; they reproduce every power up to their degree and
    its derivative."""
    nodes = np.linspace(0, 1, degree + 1)
    xi = np.linspace(-0.05, 1.05, 7)
    values = np.vander(nodes, increasing=True) @ lagrange(degree).T
    np.testing.assert_allclose(values, np.eye(degree + 1), atol=1e-14)
    s = np.linspace(0, 1, 2 * degree + 1)
    c = Curve(wave(s), degree)
    for power in range(degree + 1):
        expected = xi**power, power * xi ** max(power - 1, 0)
        for found, wanted in zip(c.shapes(xi), expected, strict=True):
            np.testing.assert_allclose(found @ nodes**power, wanted, atol=1e-14)


@every_curve
def test_vertices_face_outward(f):
    """Each vertex once, also the free ends; its normal lies between those of the chords beside
    it."""
    c = interpolate(f, 8)
    x, outward = c.vertices()
    corners = c.X[::2]
    np.testing.assert_array_equal(x, corners)
    chord = np.diff(corners, axis=0)
    normal = np.stack([chord[:, 1], -chord[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    beside = np.concatenate([normal[:1], normal, normal[-1:]])
    for of_facet in (beside[:-1], beside[1:]):
        assert ((outward * of_facet).sum(axis=1) > 0.9).all()
    np.testing.assert_allclose(outward[[0, -1]], normal[[0, -1]], atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(outward, axis=1), 1.0, rtol=1e-14)


def test_arc_length():
    """Fourth order, the geometry's own: quarter circles of 4, 8 and 16 facets against pi / 2; and
    the end of a facet is the start of the next, also on a graded wave."""
    errors = []
    for n in (4, 8, 16):
        length = interpolate(pin, n).arc_length(np.array([0.0, 1.0]))
        np.testing.assert_allclose(length[:, 0], length[-1, 1] / n * np.arange(n), atol=1e-14)
        errors.append(abs(length[-1, 1] - np.pi / 2))
    assert errors[-1] < 1e-6
    assert np.all(np.diff(np.log2(errors)) < -3.9)
    length = interpolate(wave, 9, grading=1.5).arc_length(np.array([0.0, 0.4, 1.0]))
    np.testing.assert_allclose(length[1:, 0], length[:-1, 2], rtol=1e-14)
    assert np.all(np.diff(length, axis=1) > 0)


@every_curve
@pytest.mark.parametrize(("n", "grading"), [(8, 1.0), (30, 1.0), (20, 1.5)])
@pytest.mark.parametrize("distance", [1e-3, 0.3])
def test_closest_point_is_the_nearest_of_all(f, n, grading, distance):
    """No point of the curve is nearer; only a sample next to the closest point comes as near. Where
    it slides, (x - y) . tangent = 0 and the distance is the gap; the normal is a unit vector."""
    c = interpolate(f, n, grading)
    x, outward = scatter(c, distance)
    p = closest(c, x, outward)
    assert p.found.all()
    found = np.linalg.norm(x - p.point, axis=1)
    sampled = brute_force(c, x)
    assert np.all(found <= sampled + 1e-14)
    spacing = 1.1 * np.linalg.norm(p.tangent, axis=1).max() / 200
    assert np.all(
        (sampled**2 - found**2)[p.slides] < 1.3 * (spacing / 2) ** 2
    )  # 1 + distance * curvature of the hump
    d, t, normal = (part[p.slides] for part in (x - p.point, p.tangent, p.normal))
    assert p.slides.mean() > 0.95
    assert np.abs((d * t).sum(1) / np.linalg.norm(t, axis=1)).max() < 1e-13
    np.testing.assert_allclose(np.abs((d * normal).sum(1)), found[p.slides], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(p.normal, axis=1), 1, rtol=1e-14)
    np.testing.assert_allclose((p.normal * p.tangent).sum(1), 0, atol=1e-14)
    np.testing.assert_allclose(np.einsum("ma,mai->mi", p.shape, c.X[p.nodes]), p.point, atol=1e-14)


@every_curve
def test_closest_points_of_a_displaced_curve(f):
    """A displaced curve is the curve through its displaced nodes."""
    c = interpolate(f, 12)
    u = 0.03 * np.sin(2 * c.X[:, ::-1] + 1)
    x, outward = scatter(c, 0.2, u)
    p = c.closest_point(x, outward, u)
    q = Curve(c.X + u, 2).closest_point(x, outward, np.zeros_like(u))
    np.testing.assert_array_equal(p.point, q.point)
    assert np.all(np.linalg.norm(x - p.point, axis=1) <= brute_force(c, x, u) + 1e-14)


@every_curve
@pytest.mark.parametrize("shift", [-3, -2, -1, 0, 1, 2, 3, "anywhere"])
def test_the_start_does_not_matter(f, shift):
    """From a facet near the partner, or from any facet, the result is that of the search over the
    whole curve."""
    c = interpolate(f, 24)
    x, outward = scatter(c, 0.2)
    p = closest(c, x, outward)
    random = np.random.default_rng(0).integers(0, c.n_facets, len(x))
    start = random if shift == "anywhere" else np.clip(p.facet + shift, 0, c.n_facets - 1)
    q = closest(c, x, outward, start)
    np.testing.assert_allclose(q.point, p.point, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(q.found, p.found)
    s, t = (c.arc_length(found.xi)[found.facet, np.arange(len(x))] for found in (q, p))
    np.testing.assert_allclose(s, t, atol=1e-12)


def roof():
    """Two straight facets that meet at a right angle at the origin; the body lies below, its corner
    points up."""
    return Curve(np.array([[1.0, -1], [0.5, -0.5], [0, 0], [-0.5, -0.5], [-1, -1]]), 2)


def test_a_corner_is_the_closest_point_of_its_cone():
    """Points in the cone of normals find the vertex, which stands still; points beside it slide on
    a facet."""
    c = roof()
    angle = np.radians([50.0, 80, 100, 130, 30, 150])
    x = 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    p = closest(c, x, np.tile([0.0, -1.0], (6, 1)))
    assert p.found.all()
    np.testing.assert_array_equal(p.slides, [False] * 4 + [True] * 2)
    np.testing.assert_allclose(p.point[:4], 0, atol=1e-15)
    np.testing.assert_array_equal(p.facet[4:], [0, 1])
    for start in range(2):
        q = closest(c, x, np.tile([0.0, -1.0], (6, 1)), np.full(6, start))
        np.testing.assert_allclose(q.point, p.point, atol=1e-15)


@every_curve
def test_points_beyond_a_free_end_or_facing_away_have_no_partner(f):
    """Points farther out than a twentieth of a facet have no partner; nearer ones use the end's
    continuation. Points that face away see only the far side of a body."""
    c = interpolate(f, 10)
    x, outward = scatter(c, 0.1)
    assert not closest(c, x, -outward).found.any()
    y, normal = on_curve(c, np.array([0, 9]), np.array([0.0, 1.0]))
    _, dN = c.shapes(np.array([0.0, 1.0]))
    forward = np.einsum("ma,mai->mi", dN, c.X[c.connectivity[[0, 9]]]) * [[-1.0], [1.0]]
    assert not closest(c, y + 0.1 * forward + 0.01 * normal, -normal).found.any()
    near = closest(c, y + 0.02 * forward + 0.01 * normal, -normal)
    assert near.found.all()
    assert near.slides.all()
    assert closest(c, y - 0.02 * forward + 0.01 * normal, -normal).found.all()


def linearisation(p, x, dx, du):
    """Directional derivatives of gap, normal and closest point that the fields of a projection
    stand for; ``du`` ``(nodes, 2)``, or ``(2,)`` of a rigid circle."""
    speed = np.linalg.norm(p.tangent, axis=1)
    d = x - p.point
    du = np.atleast_2d(du)
    gap = (d * p.normal).sum(1)
    dy_fixed, dt = (np.einsum("ma,mai->mi", N, du[p.nodes]) for N in (p.shape, p.slope))
    dxi = ((dx - dy_fixed) * p.tangent).sum(1) + (d * dt).sum(1)
    dxi *= p.slides / (speed**2 - gap * p.bend)
    turn = ((dt * p.normal).sum(1) + p.bend * dxi) / speed
    dn = -turn[:, None] * p.tangent / speed[:, None]
    dy = dy_fixed + dxi[:, None] * p.tangent
    return ((dx - dy) * p.normal).sum(1) + (d * dn).sum(1), dn, dy


def assert_derivative(project, x, u, h=1e-6):
    """`linearisation` against central differences of the projection, in a random direction."""
    rng = np.random.default_rng(4)
    dx = rng.normal(size=x.shape)
    du = 0.1 * rng.normal(size=u.shape)
    p = project(x, u)
    plus = project(x + h * dx, u + h * du)
    minus = project(x - h * dx, u - h * du)
    same = (
        (plus.facet == p.facet)
        & (minus.facet == p.facet)
        & (plus.slides == p.slides)
        & (minus.slides == p.slides)
    )
    assert same.mean() > 0.98
    dgap, dn, dy = linearisation(p, x, dx, du)
    gap = [((x + s * h * dx - q.point) * q.normal).sum(1) for s, q in ((1, plus), (-1, minus))]
    changes = (
        (dgap, *gap, 1e-7),
        (dn, plus.normal, minus.normal, 1e-6),
        (dy, plus.point, minus.point, 1e-6),
    )
    for found, up, down, tolerance in changes:
        np.testing.assert_allclose(found[same], ((up - down) / (2 * h))[same], atol=tolerance)


@every_curve
def test_linearisation_of_the_closest_point(f):
    """Gap, normal and closest point move as tangent, bend and slope say, for moving points on a
    moving curve."""
    c = interpolate(f, 12)
    u = 0.02 * np.sin(2 * c.X[:, ::-1] + 1)
    x, outward = scatter(c, 0.2, u)
    assert_derivative(lambda x, u: c.closest_point(x, outward, u), x, u)


def test_linearisation_at_a_corner():
    """A vertex stands still on its facets, its normal turns with the nodes."""
    c = roof()
    angle = np.random.default_rng(4).uniform(np.radians(50), np.radians(130), 50)
    x = 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outward = np.tile([0.0, -1.0], (50, 1))
    u = np.zeros_like(c.X)
    p = c.closest_point(x, outward, u)
    assert not p.slides.any()
    assert_derivative(lambda x, u: c.closest_point(x, outward, u, p.facet), x, u)


def test_rigid_circle():
    """Gap = distance from the centre - radius, negative inside; and the linearisation of it."""
    rng = np.random.default_rng(4)
    circle = RigidCircle(np.array([0.3, -0.2]), 2.0)
    motion = np.array([0.01, -0.02])
    ray = rng.normal(size=(100, 2))
    x = (
        circle.centre
        + motion
        + ray / np.linalg.norm(ray, axis=1)[:, None] * rng.uniform(1.9, 2.1, (100, 1))
    )
    p = circle.closest_point(x, -ray, motion)
    assert p.found.all()
    assert not circle.closest_point(x, ray, motion).found.any()
    distance = np.linalg.norm(x - circle.centre - motion, axis=1) - 2.0
    np.testing.assert_allclose(((x - p.point) * p.normal).sum(1), distance, rtol=0, atol=1e-14)
    assert_derivative(lambda x, u: circle.closest_point(x, -ray, u), x, motion)


@pytest.mark.parametrize(
    ("broken", "name", "value", "said"),
    [
        (curve_module, "_NEWTON_STEPS", 1, "found no closest point"),
        (
            Curve,
            "nearest_facet",
            lambda self, x, u: np.full(len(x), 5),
            "beyond the facets searched",
        ),
    ],
)
def test_a_lost_point_is_an_error(monkeypatch, broken, name, value, said):
    """A point whose projection does not converge, or is searched in the wrong place, is never taken
    for one without a partner or left at the rim of the facets searched."""
    c = interpolate(ellipse, 24)
    x, outward = scatter(c, 0.3)
    monkeypatch.setattr(broken, name, value)
    with pytest.raises(ProjectionError, match=said):
        closest(c, x, outward)


def circle(n, centre=(0.0, 0.0)):
    """A hole of radius 1 all the way round: its nodes, of ``n`` quadratic facets."""
    angle = -np.pi * np.arange(2 * n) / n
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) + centre


def joined(*pieces):
    """Closed pieces with nodes of quadratic facets in one curve."""
    start = np.cumsum([0, *map(len, pieces)])
    closed = [
        s + (2 * np.arange(len(x) // 2)[:, None] + np.arange(3)) % len(x)
        for s, x in zip(start[:-1], pieces, strict=True)
    ]
    return Curve(np.concatenate(pieces), 2, np.concatenate(closed))


@pytest.mark.parametrize(
    ("n", "start"), [(3, "near"), (5, "near"), (12, "near"), (12, 0), (12, "other")]
)
def test_closest_points_on_several_pieces(n, start):
    """Points within two holes find the nearest point of theirs, wherever the search starts; of few
    facets, too."""
    c = joined(circle(n), circle(n, (2.5, 0.0)))
    rng = np.random.default_rng(1)
    assert c.n_pieces == 2
    lengths = c.arc_length(np.array([0.0, 1.0]))
    np.testing.assert_allclose(lengths[[0, n], 0], 0, atol=1e-15)
    assert lengths[n - 1, 1] == pytest.approx(lengths[-1, 1], rel=1e-12)
    hole = np.arange(40) % 2
    angle = rng.uniform(-np.pi, np.pi, 40)
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    x = 0.9 * ray + [2.5, 0.0] * hole[:, None]
    facet = {"near": None, "other": n * (1 - hole)}.get(start, np.full(40, start))
    found = closest(c, x, ray, facet)
    np.testing.assert_array_equal(found.facet // n, hole)
    distance = np.linalg.norm(found.point - x, axis=1)
    assert np.all(distance < brute_force(c, x) + 1e-12)
    assert np.all(distance > brute_force(c, x) - 1e-3)


def test_a_closed_curve_has_no_end():
    """A hole run all the way round: points that slide over the node where the chain closes keep
    exact partners."""
    whole = interpolate(
        lambda s: np.stack([np.cos(-2 * np.pi * s), np.sin(-2 * np.pi * s)], axis=-1), 12
    )
    whole = Curve(whole.X[:-1], 2, whole.connectivity % 24)
    assert (whole.before[0], whole.after[-1]) == (11, 0)
    angle = np.linspace(-0.9, 0.9, 41) * np.pi / 6
    x = 0.99 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    start = np.where(np.arange(41) % 2, 0, 11)
    found = closest(whole, x, x / 0.99, start)
    np.testing.assert_allclose(
        np.linalg.norm(found.point - x, axis=1), brute_force(whole, x), atol=1e-4
    )
    assert found.found.all()
    assert set(found.facet) == {0, 11}
