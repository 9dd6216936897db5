"""Hardening laws that begin vertically (Ludwik), that give no number, and back stresses that
vanish."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import brentq

from archord.materials.finite import LargeStrain
from archord.materials.hardening import Hardening, LinearHardening, SwiftHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematic import KinematicMaterial

E = 210000.0
NU = 0.3
START = 200.0
MU = E / (2 * (1 + NU))
in_both_planes = pytest.mark.parametrize("plane", ["strain", "stress"])


@dataclass(frozen=True)
class Ludwik(Hardening):
    """``START + strength PEEQ^exponent``."""

    strength: float = 500.0
    exponent: float = 0.3

    def stress(self, peeq):
        return START + self.strength * peeq**self.exponent

    def slope(self, peeq):
        with np.errstate(divide="ignore"):
            return self.strength * self.exponent * peeq ** (self.exponent - 1)

    def work(self, peeq):
        n = self.exponent + 1
        return START * peeq + self.strength * peeq**n / n


LAWS = [Ludwik(), Ludwik(exponent=0.05), Ludwik(1e5, 0.7), SwiftHardening(2e4, 1e-30, 0.07)]


def materials(plane, law):
    return J2Material(E, NU, plane, law), KinematicMaterial(E, NU, plane, law, ((1e-6, 0.0),))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("excess", [1e-6, 1e-2, 1.0, 30.0])
def test_a_vertical_beginning_yields_in_shear_by_the_closed_form(law, excess):
    """``sqrt(3) mu gamma = stress(PEEQ) + 3 mu PEEQ``, one equation, solved by brentq."""
    first = float(law.stress(np.zeros(1))[0])
    trial = first * (1 + excess)

    def off(peeq):
        return float(law.stress(np.array([peeq]))[0]) + 3 * MU * peeq - trial

    expected = brentq(off, 0.0, trial / (3 * MU), xtol=1e-300, rtol=1e-14)
    strain = np.array([[0.0, 0.0, trial / (3**0.5 * MU)]])
    for plane in ("strain", "stress"):
        for m in materials(plane, law):
            stress, tangent, state = m.update(strain, m.state(1))
            assert 3**0.5 * stress[0, 3] == pytest.approx(trial - 3 * MU * expected, rel=1e-9)
            assert state.peeq[0] == pytest.approx(expected, rel=1e-7, abs=1e-12)
            assert np.isfinite(tangent).all()


@in_both_planes
def test_the_tangent_of_a_vertical_beginning_is_the_derivative(plane):
    rng = np.random.default_rng(1)
    strain = 4e-3 * rng.standard_normal((50, 3))
    for m in materials(plane, Ludwik()):
        tangent = m.update(strain, m.state(50))[1]
        for k, h in enumerate(1e-8 * np.eye(3)):
            ahead, back = (m.update(strain + side * h, m.state(50))[0] for side in (1, -1))
            found = (ahead - back)[:, [0, 1, 3]] / 2e-8
            np.testing.assert_allclose(found, tangent[:, :, k], rtol=0, atol=1e-4 * E)


@in_both_planes
def test_a_law_that_gives_no_number_is_refused(plane):
    """It would answer as if it never yielded."""
    strain = np.full((1, 3), 0.01)
    for m in materials(plane, SwiftHardening(np.nan, 0.01, 0.2)):
        with pytest.raises(
            ValueError, match="the hardening law gives a yield stress that is not a number"
        ):
            m.update(strain, m.state(1))


@in_both_planes
def test_a_vanishing_back_stress_changes_nothing_at_large_strain(plane):
    """Both yield by Cauchy's stress, on a path with volume changes of a per cent; the tangent is
    the derivative."""
    rng = np.random.default_rng(2)
    law = LinearHardening(2000.0, 1000.0)
    one = LargeStrain(J2Material(E, NU, plane, law))
    other = LargeStrain(KinematicMaterial(E, NU, plane, law, ((1e-9, 0.0),)))
    gradient = 0.03 * rng.standard_normal((40, 4))
    first, second = (m.update(gradient, m.state(40)) for m in (one, other))
    assert (first[2].peeq > 0).sum() > 30
    np.testing.assert_allclose(first[0], second[0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(first[1], second[1], rtol=0, atol=1e-6 * E)


def test_back_stresses_at_large_strain_have_the_consistent_tangent():
    rng = np.random.default_rng(3)
    m = LargeStrain(
        KinematicMaterial(E, NU, "strain", LinearHardening(400.0, 1000.0), ((20000.0, 0.0),))
    )
    gradient = 0.03 * rng.standard_normal((40, 4))
    _, tangent, _ = m.update(gradient, m.state(40))
    for k, h in enumerate(1e-7 * np.eye(4)):
        ahead, back = (m.update(gradient + side * h, m.state(40))[0] for side in (1, -1))
        np.testing.assert_allclose((ahead - back) / 2e-7, tangent[:, :, k], rtol=0, atol=1e-5 * E)
