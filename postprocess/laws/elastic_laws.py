"""Elastic theories of pin and hole: Hertz's contacts, half-spaces with a logarithm, and Persson's conformal contact.

Johnson, Radzimovsky, ESDU 78035 and Dubowsky and Freudenstein are half-spaces under Hertz's pressure, ``delta = P/(pi
E*) [ ln(A/P) + q ]``, and differ only in the load ``A`` and the number ``q``. Each ``P(delta)`` rises until
``dP/d(delta)`` is infinite at

    P = A e^(q - 1),   delta = P/(pi E*),

and turns back there: the load limit. On the rising branch Lambert's function W_-1 inverts the law in closed form.

Persson's is the conformal contact of two elastic circles of nearly the same radius without friction, solved exactly for
Dundurs' beta = 0. The angles: ``b = tan(eps/2)``, ``y = tan(phi/2)``, phi from the contact axis, eps the contact
semi-angle. With beta = 0 the materials enter only by how the mean pressure ``p_m = (1/2 pi) integral of p dphi``
changes the clearance: ``dR + (1 + alpha) p_m R/E*`` is one function of the angle for all pairs. So the pressure over
P/R is the same for every alpha, and alpha moves only the load at which an angle is reached.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import lambertw

from archord.postprocess.laws.joint import Array, LawJoint
from archord.postprocess.laws.law import LawState, monotone_root


def hertz_half_width(joint: LawJoint, P: Array) -> Array:
    """Half-width of the line contact, ``a = 2 sqrt(P R*/(pi E*))`` (Johnson 1985, eq. 4.43)."""
    return 2 * np.sqrt(P * joint.relative_radius / (math.pi * joint.E_star))


def hertz_pressure(joint: LawJoint, P: Array) -> Array:
    """Peak pressure of the line contact, ``p0 = sqrt(P E*/(pi R*))`` (Johnson 1985, eq. 4.45)."""
    return np.sqrt(P * joint.E_star / (math.pi * joint.relative_radius))


def hertz_angle(joint: LawJoint, P: Array) -> Array:
    """Contact semi-angle [rad], ``a/R1``."""
    return hertz_half_width(joint, P) / joint.radius


def hertz_load_limit(joint: LawJoint) -> float:
    """Load at which the half-width is R1/2; there the parabola for the circle is off by 7 % of the depth."""
    return math.pi * joint.E_star * (joint.radius / 4) ** 2 / joint.relative_radius


def _spring(joint: LawJoint) -> float:
    """``(4/3) E* sqrt(R*)/L`` of a ball in a socket, the force divided by the length of the joint to be comparable."""
    assert joint.length is not None
    return 4 / 3 * joint.E_star * math.sqrt(joint.relative_radius) / joint.length


def lankarani_nikravesh(joint: LawJoint, delta: Array) -> LawState:
    """Static part of Lankarani and Nikravesh: ``P = (4/3) E* sqrt(R*) delta^(3/2) / L``.

    Hertz's ball in a socket (Lankarani and Nikravesh 1990, 1994, without damping), as multibody codes use it for pins;
    its peak pressure is ``p0 = (2/pi) E* sqrt(delta/R*)`` (Johnson 1985, eq. 4.24).
    """
    root = np.sqrt(delta)
    p0 = 2 / math.pi * joint.E_star * root / math.sqrt(joint.relative_radius)
    return LawState(delta, _spring(joint) * delta * root, 1.5 * _spring(joint) * root, p0)


def lankarani_nikravesh_displacement(joint: LawJoint, P: Array) -> Array:
    """Inverse of `lankarani_nikravesh`."""
    return (P / _spring(joint)) ** (2 / 3)


def lankarani_nikravesh_limit(joint: LawJoint) -> float:
    """Displacement at which the radius of Hertz's contact circle, ``sqrt(R* delta)``, is R1/2."""
    return (joint.radius / 2) ** 2 / joint.relative_radius


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


def persson_pressure(joint: LawJoint, P: Array, eps: Array, phi: Array) -> Array:
    """Pressure at the angle ``phi`` of a contact of semi-angle ``eps`` under ``P``; zero beyond it (broadcasts).

    ``R p/P = 2/(pi sqrt(b^2 + 1)) sqrt(b^2 - y^2)/(1 + y^2) + 1/(2 pi b^2 (1 + b^2)) ln[ (sqrt(b^2 + 1) + sqrt(b^2 -
    y^2)) / (sqrt(b^2 + 1) - sqrt(b^2 - y^2)) ]`` (Persson 1964; Hu et al., eq. 13).
    """
    b, y = np.tan(eps / 2), np.tan(phi / 2)
    c, s = np.sqrt(1 + b**2), np.sqrt(np.maximum(b**2 - y**2, 0.0))
    shape = 2 / (np.pi * c) * s / (1 + y**2) + np.arctanh(s / c) / (np.pi * b**2 * (1 + b**2))
    return np.where(np.abs(phi) < eps, shape * P / joint.radius, 0.0)


def persson_load(joint: LawJoint, eps: Array) -> Array:
    """Load at which the contact has the semi-angle ``eps``; infinite from the angle on that closes any clearance, 84.83
    degrees for like bodies.

    ``E* dR/P = [ 2 - (1 + alpha) (ln(1 + b^2) + 2 b^4) ] / [ 2 pi b^2 (1 + b^2) ]`` (Ciavarella and Decuzzi 2001), with
    alpha positive for the stiffer pin.
    """
    b2 = np.tan(eps / 2) ** 2
    left = 2 - (1 + joint.dundurs_alpha) * (np.log1p(b2) + 2 * b2**2)
    with np.errstate(divide="ignore"):
        load = 2 * np.pi * b2 * (1 + b2) / np.where(left > 0, left, 0.0)
    return joint.E_star * joint.clearance * load


def persson_angle(joint: LawJoint, P: Array) -> Array:
    """Contact semi-angle [rad] under ``P``: the root of `persson_load`, zero for no load."""
    alpha = 1 + joint.dundurs_alpha
    clearance = joint.E_star * joint.clearance / np.where(P > 0, P, 1.0)

    def left(b2: Array) -> Array:
        return 2 * np.pi * b2 * (1 + b2) * clearance + alpha * (np.log1p(b2) + 2 * b2**2)

    def slope(b2: Array) -> Array:
        return 2 * np.pi * (1 + 2 * b2) * clearance + alpha * (1 / (1 + b2) + 4 * b2)

    b2 = monotone_root(left, slope, np.full(np.shape(P), 2.0), 1.0)
    return np.where(P > 0, 2 * np.arctan(np.sqrt(b2)), 0.0)


def persson_peak(joint: LawJoint, P: Array) -> Array:
    """Pressure on the contact axis under ``P``."""
    eps = np.where(P > 0, persson_angle(joint, P), 1.0)
    return np.where(P > 0, persson_pressure(joint, P, eps, np.zeros_like(eps)), 0.0)
