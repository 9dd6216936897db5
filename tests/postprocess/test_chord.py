"""The chord carries what the arc carries."""

import numpy as np
import pytest
from scipy.integrate import quad

from archord.postprocess.chord import (
    arc_angle,
    chord_coordinate,
    chord_projection,
    read_chord_pressure,
)
from archord.postprocess.run import Run


@pytest.mark.parametrize("eps", [0.01, 0.5, 1.2, np.pi / 2])
def test_the_chord_integral_is_the_arc_integral(eps):
    """2 int_0^l py dx over the straight chord, py from eq. 15 at the angle found for x, equals 2
    int p cos(phi) R dphi to 1e-8."""
    R = 3.0

    def p(phi):
        return np.sqrt(np.maximum(eps - phi, 0)) * (1 + phi) + 0.2

    def py(x):
        phi = float(arc_angle(x, eps, R))
        return chord_projection([0.0, phi], [0.0, p(phi)], eps, R).py[-1]

    arc = quad(lambda phi: p(phi) * np.cos(phi) * R, 0, eps, epsabs=0, epsrel=1e-11)[0]
    chord = quad(py, 0, 2 * R * np.sin(eps / 2), epsabs=0, epsrel=1e-10, limit=400)[0]
    assert chord == pytest.approx(arc, rel=1e-8)


def test_the_projection_is_along_the_radius():
    """The point of the chord at x lies on the ray at phi: the chord leaves the deepest point at
    eps/2 to the horizontal."""
    R = 2.0
    eps = 1.1
    phi = np.linspace(0, eps, 9)
    x = chord_coordinate(phi, eps, R)
    assert x[0] == 0
    assert x[-1] == pytest.approx(2 * R * np.sin(eps / 2), rel=1e-14)
    point = np.stack([x * np.cos(eps / 2), -R + x * np.sin(eps / 2)], axis=1)
    np.testing.assert_allclose(np.arctan2(point[:, 0], -point[:, 1]), phi, atol=1e-14)
    np.testing.assert_allclose(arc_angle(x, eps, R), phi, atol=1e-14)


@pytest.mark.parametrize("degrees", [1, 30, 90])
@pytest.mark.parametrize("start", [0.0, 0.3])
def test_a_random_pressure_on_random_points_keeps_its_force(degrees, start):
    """The default weights are the trapezoidal rule on the arc, also where the first point is past
    the axis; and the trapezoidal rule over x, which knows nothing of weights, tends to it. Points
    with pressure beyond the edge stay."""
    random = np.random.default_rng(degrees)
    eps = np.radians(degrees)
    phi = np.sort(random.uniform(start * eps, eps, 30))
    pressure = random.uniform(0, 5, 30)
    arc = 2 * 7.0 * np.trapezoid(pressure * np.cos(phi), phi)
    for edge in (0.3 * eps, eps):
        chord = chord_projection(phi, pressure, edge, 7.0)
        assert chord.resultant == pytest.approx(arc, rel=1e-12)
        assert (np.diff(chord.x) > 0).all()
        assert (chord.x_over_l.max() > 1) == (edge < eps)
    fine = np.linspace(start * eps, eps, 40001)
    chord = chord_projection(fine, np.interp(fine, phi, pressure), eps, 7.0)
    assert 2 * np.trapezoid(chord.py, chord.x) == pytest.approx(chord.resultant, rel=1e-6)


def test_an_arc_may_go_on_where_nothing_presses():
    """Points without pressure may lie anywhere up to pi."""
    phi = np.linspace(0, np.pi, 181)
    pressure = np.maximum(1 - phi, 0)
    assert len(chord_projection(phi, pressure, 0.7, 2.0).x) == (phi < 1).sum()
    whole, near = (chord_projection(phi[:n], pressure[:n], 1.0, 2.0).resultant for n in (181, 91))
    assert whole == near > 0
    with pytest.raises(ValueError, match="within pi/2"):
        chord_projection(phi, np.ones(181), 3.0, 2.0)


@pytest.mark.parametrize("name", ["elastic", "plastic"])
def test_a_runs_chord_carries_its_force(runs, name):
    """Every step and side: chord = arc to 1e-8; the side's arc = P of history.csv to dR/R
    (undeformed arcs differ by that), and so is the table of pressures; the mean of both sides is
    nearer than either where the joint is elastic."""
    run = Run(runs[name])
    curve = run.curve
    for step in range(1, run.steps + 1):
        off = {}
        for side, arc in run.contact(step).items():
            chord = read_chord_pressure(runs[name], step, side)
            force = 2 * (arc.weight * arc.pressure * np.cos(arc.angle)).sum()
            assert chord.resultant == pytest.approx(force, rel=1e-8)
            assert (
                pytest.approx({"pin": curve.R, "hole": curve.R + curve.dR}[side], rel=1e-14)
                == chord.R
            )
            assert chord.eps == curve.eps[step - 1]
            off[side] = chord.resultant / curve.P[step - 1] - 1
            table = run.pressure(step, side)
            in_table = 2 * (table["weight"] * table["pressure"] * np.cos(table["angle"])).sum()
            assert in_table == pytest.approx(force, rel=1e-8)
        assert set(off) == {"pin", "hole"}
        assert max(map(abs, off.values())) < 2 * curve.dR / curve.R
    np.testing.assert_array_equal(
        read_chord_pressure(runs[name]).py, chord.py
    )  # the hole in the last step
    if name == "elastic":
        assert off["pin"] < 0 < off["hole"]
        assert abs(off["pin"] + off["hole"]) / 2 < 0.2 * max(map(abs, off.values()))


@pytest.mark.parametrize(
    ("phi", "pressure", "eps"),
    [
        ([0, 1], [1, 1], 0.0),
        ([0, 1], [1, 1], np.nan),
        ([1, 0], [1, 1], 1.0),
        ([-0.1, 1], [1, 1], 1.0),
        ([0, np.nan], [1, 1], 1.0),
        ([0, 1], [1, np.nan], 1.0),
        ([0, 2], [1, 1], 1.0),
        ([0, 1], [1, 1, 1], 1.0),
        ([0], [1], 1.0),
    ],
)
def test_arrays_that_are_no_arc(phi, pressure, eps):
    with pytest.raises(ValueError, match="must"):
        chord_projection(phi, pressure, eps, 1.0)
