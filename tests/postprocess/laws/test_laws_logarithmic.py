"""The logarithmic laws against their sources' own forms, root finding, and the half-space integrals behind them."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

from archord.postprocess.laws import elastic_laws as log
from archord.postprocess.laws.elastic_laws import hertz_half_width
from archord.postprocess.laws.joint import LawJoint
from archord.postprocess.laws.laws import LAWS

JOINT = LawJoint(radius=7.0, clearance=0.03, E_star=1.2e5, length=11.0)
UNIT = JOINT.E_star * JOINT.clearance
R1, R2 = 7.0, 7.03
NAMES = ["johnson", "radzimovsky", "radzimovsky-width", "radzimovsky-2.41", "esdu-78035", "dubowsky-freudenstein"]


def printed_radzimovsky(P, c):
    """Eqs 17 to 19 as they stand."""
    d = c * np.sqrt(R1 * R2 / JOINT.clearance * P / JOINT.E_star)
    return P / (np.pi * JOINT.E_star) * (2 / 3 + np.log(4 * R1 / d) + np.log(4 * R2 / d))


def of_total_force(P, logarithm):
    """``F (s1 + s2)/L (ln(...) + 1)`` for two like bodies with nu = 0.3 and a joint of 11."""
    E = 2 * (1 - 0.3**2) * JOINT.E_star
    s = 2 * (1 - 0.3**2) / (np.pi * E)
    F = P * 11.0
    return F * s / 11.0 * (np.log(logarithm(F, s)) + 1)


PRINTED = {
    "johnson": lambda P: P / (np.pi * JOINT.E_star) * (np.log(4 * np.pi * JOINT.E_star * JOINT.clearance / P) - 1),
    "radzimovsky": lambda P: printed_radzimovsky(P, 1.6),
    "radzimovsky-width": lambda P: printed_radzimovsky(P, 1.6 * 2**0.5),
    "radzimovsky-2.41": lambda P: printed_radzimovsky(P, 2.1811),
    "esdu-78035": lambda P: of_total_force(P, lambda F, s: 4 * 11.0 * 0.03 / (F * s)),
    "dubowsky-freudenstein": lambda P: of_total_force(P, lambda F, s: 11.0**3 * 0.03 / (F * R1 * R2 * s)),
}


@pytest.mark.parametrize("name", NAMES)
def test_displacement_is_the_printed_form(name):
    loads = UNIT * np.array([1e-6, 1e-3, 0.05, 0.15])
    expected = [PRINTED[name](P) for P in loads]
    assert LAWS[name].displacement(JOINT, loads) == pytest.approx(expected, rel=1e-5 if "2.41" in name else 1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_force_is_the_lower_root_of_the_printed_form(name):
    """Found by brentq between zero and the maximum of delta(P), which a search finds."""
    law, printed = LAWS[name], PRINTED[name]
    top = minimize_scalar(lambda P: -printed(P), bounds=(1e-9 * UNIT, 20 * UNIT), method="bounded").x
    deepest = law.limit(JOINT)
    for delta in deepest * np.array([1e-8, 1e-3, 0.3, 0.7, 0.99]):
        root = brentq(lambda P, delta=delta: printed(P) - delta, 1e-16 * UNIT, top, xtol=1e-14 * UNIT, rtol=1e-14)
        assert law.force(JOINT, delta) == pytest.approx(root, rel=2e-3 if "2.41" in name else 1e-6)
    assert law.force(JOINT, 0.0) == 0
    assert law.stiffness(JOINT, 0.0) == 0


@pytest.mark.parametrize(
    ("name", "limit"),
    [("johnson", 1.7007), ("radzimovsky", 4.478), ("radzimovsky-2.41", 2.41), ("radzimovsky-width", 2.239)],
)
def test_load_limit_is_where_the_displacement_turns_back(name, limit):
    """In E* dR, by a search for the largest displacement of the printed form."""
    law, printed = LAWS[name], PRINTED[name]
    found = minimize_scalar(lambda x: -printed(x * UNIT), bounds=(0.1, 10), method="bounded", options={"xatol": 1e-9})
    assert found.x == pytest.approx(limit, abs=5e-4)
    assert law.limit(JOINT) == pytest.approx(-found.fun, rel=1e-4)
    assert law.force(JOINT, law.limit(JOINT)) == pytest.approx(found.x * UNIT, rel=1e-4)
    assert law.stiffness(JOINT, law.limit(JOINT)) > 1e6 * JOINT.E_star


def test_johnson_is_two_cylinders_under_hertz():
    """``P/(pi E*) (ln(4 R1/a) + ln(4 R2/a) - 1)`` with the half-width a (Johnson 1985, eq. 5.57 for each body)."""
    P = UNIT * np.array([0.01, 0.1, 0.5])
    a = hertz_half_width(JOINT, P)
    expected = P / (np.pi * JOINT.E_star) * (np.log(4 * R1 / a) + np.log(4 * R2 / a) - 1)
    assert LAWS["johnson"].displacement(JOINT, P) == pytest.approx(expected, rel=1e-12)


def test_radzimovsky_means_the_width_of_the_contact():
    """Roark's d is twice Hertz's half-width to 0.3 %, the printed one is not; with it the law is near Johnson's."""
    P = np.array(0.1 * UNIT)
    width = 2 * hertz_half_width(JOINT, P)
    scale = np.sqrt(JOINT.relative_radius * P / JOINT.E_star)
    assert width / scale == pytest.approx(log.HERTZ_WIDTH, rel=1e-12)
    assert width / scale == pytest.approx(log.ROARK_WIDTH, rel=3e-3)
    assert width / scale > 1.4 * log.PRINTED_WIDTH
    gap = log.radzimovsky(JOINT, log.HERTZ_WIDTH).displacement(P) - log.johnson(JOINT).displacement(P)
    assert gap * np.pi * JOINT.E_star / P == pytest.approx(5 / 3 - 2 * np.log(2), rel=1e-9)


def test_no_listed_reading_of_d_gives_the_stated_limit():
    """But the one made from it."""
    limits = {words: log.radzimovsky(JOINT, c).load_limit / UNIT for words, c in log.READINGS.items()}
    near = [words for words, limit in limits.items() if abs(limit - 2.41) < 0.02]
    assert near == ["what a limit of 2.41 E* dR implies"]


@pytest.mark.parametrize("P", UNIT * np.array([1e-4, 1e-3]))
def test_dubowsky_freudenstein_is_a_strip_on_half_spaces(P):
    """Boussinesq's integral of Hertz's pressure on a strip of length L, at its centre, for a << L."""
    a, L = float(hertz_half_width(JOINT, P)), JOINT.length
    # along the strip: integral of 1/r = 2 arsinh(L/2x); across it x = a sin(t)
    across = quad(lambda t: np.cos(t) ** 2 * 2 * np.arcsinh(L / (2 * a * np.sin(t))), 0, np.pi / 2, epsabs=1e-13)[0]
    p0 = 2 * P / (np.pi * a)
    expected = 2 * p0 * a * across / (np.pi * JOINT.E_star)
    assert LAWS["dubowsky-freudenstein"].displacement(JOINT, P) == pytest.approx(expected, rel=(a / L) ** 2)


def test_esdu_does_not_know_the_length():
    short = LawJoint(radius=7.0, clearance=0.03, E_star=1.2e5, length=0.1)
    assert LAWS["esdu-78035"].force(JOINT, 0.05) == LAWS["esdu-78035"].force(short, 0.05)
