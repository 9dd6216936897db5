"""Laws of the form ``delta = P/(pi E*) [ ln(A/P) + q ]``: half-space theories with a logarithm.

Johnson, Radzimovsky, ESDU 78035 and Dubowsky and Freudenstein differ only in the load ``A`` and the number ``q``. Each
``P(delta)`` rises until ``dP/d(delta)`` is infinite at

    P = A e^(q - 1),   delta = P/(pi E*),

and turns back there: the load limit. On the rising branch Lambert's function W_-1 inverts the law in closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import lambertw

from archord.postprocess.laws.law_joint import Array, LawJoint


@dataclass(frozen=True)
class Logarithm:
    """The law ``delta = P/(pi E*) [ ln(A/P) + q ]`` of one joint; P per unit length."""

    E_star: float
    A: float
    q: float

    @property
    def load_limit(self) -> float:
        """Largest load, at which the stiffness has become infinite."""
        return self.A * math.exp(self.q - 1)

    @property
    def delta_limit(self) -> float:
        """Displacement at `load_limit`."""
        return self.load_limit / (math.pi * self.E_star)

    def displacement(self, P: Array) -> Array:
        """``delta(P)``, zero for no load."""
        return P / (math.pi * self.E_star) * (np.log(self.A / np.where(P > 0, P, self.A)) + self.q)

    def force(self, delta: Array) -> Array:
        """``P(delta)`` on the rising branch: ``P = delta pi E* / y`` with ``y = -W_-1(-delta/(e delta_limit))``."""
        return delta * math.pi * self.E_star / self._y(delta)

    def stiffness(self, delta: Array) -> Array:
        """``dP/d(delta) = pi E* / (y - 1)``; zero for no load."""
        with np.errstate(divide="ignore"):
            return math.pi * self.E_star / (self._y(delta) - 1)

    def _y(self, delta: Array) -> Array:
        """The bracket ``ln(A/P) + q``, at least 1 on the rising branch; infinite for no displacement."""
        argument = -delta / (math.e * self.delta_limit)
        # at the very limit round-off would give a complex W, or none
        turning = argument <= -(1 - 1e-15) / math.e
        y = np.maximum(-lambertw(np.where(turning, -0.1, argument), -1).real, 1.0)
        return np.where(turning, 1.0, np.where(delta > 0, y, np.inf))


def johnson(joint: LawJoint) -> Logarithm:
    """Johnson: ``delta = P/(pi E*) [ ln(4 pi E* dR/P) - 1 ]`` (Johnson 1985; Hu et al., eq. 16).

    The same as ``P/(pi E*) [ ln(4 R1/a) + ln(4 R2/a) - 1 ]`` with Hertz's half-width a. Limit 4 pi/e^2 = 1.7007 E* dR.
    """
    return Logarithm(joint.E_star, 4 * math.pi * joint.E_star * joint.clearance, -1.0)


PRINTED_WIDTH = 1.6  # Hu et al., eq. 18
ROARK_WIDTH = 1.6 * math.sqrt(2)  # Roark's 1.60 goes with K_D = D1 D2/(D1 - D2) = 2 R*
HERTZ_WIDTH = 4 / math.sqrt(math.pi)  # full width of Hertz's contact
PAPER_LIMIT = 2.41  # of E* dR (Hu et al., below eq. 9)
IMPLIED_WIDTH = 4 * math.exp(-1 / 6) / math.sqrt(PAPER_LIMIT)

READINGS = {
    "as printed (Hu et al., eq. 18): 1.6 (R* P/E*)^(1/2)": PRINTED_WIDTH,
    "Roark: 1.60 (K_D P/E*)^(1/2) with diameters, K_D = D1 D2/(D1 - D2) = 2 R*": ROARK_WIDTH,
    "Roark for like bodies, nu = 0.3: 2.15 (K_D P/E)^(1/2)": 2.15 * math.sqrt(2 / 1.82),
    "full width of Hertz's contact, 4 (R* P/(pi E*))^(1/2)": HERTZ_WIDTH,
    "half-width of Hertz's contact, 2 (R* P/(pi E*))^(1/2)": HERTZ_WIDTH / 2,
    "2.15 with R* for K_D: 2.15 (R* P/E)^(1/2)": 2.15 / math.sqrt(1.82),
    "2.15 with R* for K_D and E* for E": 2.15,
    "1.60 with diameters, E/2 for E*, nu = 0.3": ROARK_WIDTH * math.sqrt(0.91),
    "what a limit of 2.41 E* dR implies": IMPLIED_WIDTH,
}  # coefficient c of d = c (R* P/E*)^(1/2) in several readings


def radzimovsky(joint: LawJoint, width: float = PRINTED_WIDTH) -> Logarithm:
    """Radzimovsky: ``delta = P/(pi E*) [ 2/3 + ln(4 R1/d) + ln(4 R2/d) ]``, ``d = width (R* P/E*)^(1/2)``.

    Radzimovsky (1953) by way of Hu et al., eqs 17 to 19, and Roark. R1 and R2 cancel: ``A = 16 E* dR/width^2``, limit
    ``16 e^(-1/3)/width^2 E* dR``.
    """
    return Logarithm(joint.E_star, 16 * joint.E_star * joint.clearance / width**2, 2 / 3)


def esdu(joint: LawJoint) -> Logarithm:
    """ESDU 78035: ``delta = F (s1 + s2)/L [ ln(4 L (R2 - R1)/(F (s1 + s2))) + 1 ]``, ``s = (1 - nu^2)/(pi E)``.

    With ``s1 + s2 = 1/(pi E*)`` and F = P L the length cancels: ``P/(pi E*) [ ln(4 pi E* dR/P) + 1 ]``.
    """
    return Logarithm(joint.E_star, 4 * math.pi * joint.E_star * joint.clearance, 1.0)


def dubowsky_freudenstein(joint: LawJoint) -> Logarithm:
    """Dubowsky and Freudenstein: ``delta = F (s1 + s2)/L [ ln(L^3 (R2 - R1)/(F R1 R2 (s1 + s2))) + 1 ]``.

    Dubowsky and Freudenstein (1971), ``s = (1 - nu^2)/(pi E)``, joint of length L. It is Lundberg's compression of two
    half-spaces that touch along a strip of length L and Hertz's pressure across it.
    """
    assert joint.length is not None
    return Logarithm(joint.E_star, math.pi * joint.E_star * joint.length**2 / joint.relative_radius, 1.0)


def slender_load(joint: LawJoint) -> float:
    """Load at which Hertz's contact is as wide as the joint is long: beyond, it is no strip."""
    assert joint.length is not None
    return math.pi * joint.E_star * joint.length**2 / (16 * joint.relative_radius)
