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
from typing import NamedTuple

import numpy as np
from scipy.special import lambertw

from archord.postprocess.laws.joint import Array, LawJoint
from archord.postprocess.laws.law import NOTHING, ROUND_OFF, LawState, rising_root

PRINTED_WIDTH = 1.6  # Radzimovsky's d over (R* P/E*)^(1/2): Hu et al., eq. 18
ROARK_WIDTH = 1.6 * math.sqrt(2)  # Roark's 1.60 goes with K_D = D1 D2/(D1 - D2) = 2 R*
IMPLIED_WIDTH = 4 * math.exp(-1 / 6) / math.sqrt(2.41)  # by the limit of 2.41 E* dR (Hu et al., below eq. 9)


def hertz(joint: LawJoint, P: Array) -> LawState:
    """Line contact of half-width ``a = 2 sqrt(P R*/(pi E*))``: peak pressure ``p0 = sqrt(P E*/(pi R*))`` and semi-angle
    ``a/R1`` (Johnson 1985, eqs 4.43 and 4.45)."""
    root = np.sqrt(P / (math.pi * joint.E_star * joint.relative_radius))
    return LawState(NOTHING, P, NOTHING, joint.E_star * root, 2 * joint.relative_radius * root / joint.radius)


def hertz_load_limit(joint: LawJoint) -> float:
    """Load at which the half-width is R1/2; there the parabola for the circle is off by 7 % of the depth."""
    return math.pi * joint.E_star * (joint.radius / 4) ** 2 / joint.relative_radius


def lankarani_nikravesh(joint: LawJoint, delta: Array) -> LawState:
    """Hertz's ball in a socket (Lankarani and Nikravesh 1990, 1994, without damping), as multibody codes use it for
    pins: ``P = (4/3) E* sqrt(R*) delta^(3/2)/L``, ``p0 = (2/pi) E* sqrt(delta/R*)`` (Johnson 1985, eq. 4.24)."""
    assert joint.length is not None
    root, size = np.sqrt(delta), math.sqrt(joint.relative_radius)
    spring = 4 / 3 * joint.E_star * size / joint.length
    return LawState(delta, spring * delta * root, 1.5 * spring * root, 2 / math.pi * joint.E_star * root / size)


def lankarani_nikravesh_limit(joint: LawJoint) -> float:
    """Displacement at which the radius of Hertz's contact circle, ``sqrt(R* delta)``, is R1/2."""
    return (joint.radius / 2) ** 2 / joint.relative_radius


class Logarithm(NamedTuple):
    """The law ``delta = P/(pi E*) [ ln(A/P) + q ]`` of one joint; P per unit length."""

    E_star: float
    A: float
    q: float

    @property
    def delta_limit(self) -> float:
        """Displacement at the load limit."""
        return self.A * math.exp(self.q - 1) / (math.pi * self.E_star)

    def displacement(self, P: float) -> float:
        """``delta(P)`` of a positive load."""
        return P / (math.pi * self.E_star) * (math.log(self.A / P) + self.q)

    def state(self, delta: Array) -> LawState:
        """The rising branch: ``P = pi E* delta / y``, ``dP/d(delta) = pi E* / (y - 1)``, where the bracket in the law,
        ``y = -W_-1(-delta/(e delta_limit))``, is 1 at the limit and infinite for no displacement; nan beyond."""
        spring, argument = math.pi * self.E_star, -delta / (math.e * self.delta_limit)
        turning = argument <= -(1 - 1e-15) / math.e  # where round-off would give a complex W, or none
        y = np.maximum(-lambertw(np.where(turning, -0.1, argument), -1).real, 1.0)
        y = np.where(turning, 1.0, np.where(delta > 0, y, np.inf))
        y = np.where(delta > self.delta_limit * (1 + ROUND_OFF), np.nan, y)
        with np.errstate(divide="ignore"):
            return LawState(delta, spring * delta / y, spring / (y - 1))


def johnson(joint: LawJoint) -> Logarithm:
    """``delta = P/(pi E*) [ ln(4 pi E* dR/P) - 1 ]``: ``[ ln(4 R1/a) + ln(4 R2/a) - 1 ]`` with Hertz's half-width a."""
    return Logarithm(joint.E_star, 4 * math.pi * joint.unit, -1.0)


def radzimovsky(joint: LawJoint, width: float = PRINTED_WIDTH) -> Logarithm:
    """``delta = P/(pi E*) [ 2/3 + ln(4 R1/d) + ln(4 R2/d) ]``, ``d = width (R* P/E*)^(1/2)``; R1 and R2 cancel."""
    return Logarithm(joint.E_star, 16 * joint.unit / width**2, 2 / 3)


def esdu(joint: LawJoint) -> Logarithm:
    """``delta = F (s1 + s2)/L [ ln(4 L dR/(F (s1 + s2))) + 1 ]``, where ``s1 + s2 = 1/(pi E*)`` and F = P L."""
    return Logarithm(joint.E_star, 4 * math.pi * joint.unit, 1.0)


def dubowsky_freudenstein(joint: LawJoint) -> Logarithm:
    """``delta = F (s1 + s2)/L [ ln(L^3 dR/(F R1 R2 (s1 + s2))) + 1 ]`` of a joint of length L: Lundberg's compression
    of two half-spaces that touch along a strip of length L and Hertz's pressure across it."""
    assert joint.length is not None
    return Logarithm(joint.E_star, math.pi * joint.E_star * joint.length**2 / joint.relative_radius, 1.0)


def dubowsky_freudenstein_limit(joint: LawJoint) -> float:
    """Displacement at which Hertz's contact is as wide as the joint is long, ``P = A/16``: beyond, it is no strip."""
    law = dubowsky_freudenstein(joint)
    return law.displacement(law.A / 16)


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
    degrees for like bodies. ``E* dR/P = [ 2 - (1 + alpha) (ln(1 + b^2) + 2 b^4) ] / [ 2 pi b^2 (1 + b^2) ]``, with
    alpha positive for the stiffer pin (Ciavarella and Decuzzi 2001)."""
    b2 = np.tan(eps / 2) ** 2
    left = 2 - (1 + joint.dundurs_alpha) * (np.log1p(b2) + 2 * b2**2)
    with np.errstate(divide="ignore"):
        return joint.unit * 2 * np.pi * b2 * (1 + b2) / np.where(left > 0, left, 0.0)


def persson(joint: LawJoint, P: Array) -> LawState:
    """Peak pressure and contact semi-angle [rad] under ``P``: the root of `persson_load`, zero for no load."""
    half = rising_root(lambda b: persson_load(joint, 2 * np.arctan(b)), P, 1.0)
    eps = 2 * np.arctan(half)
    p0 = persson_pressure(joint, P, np.where(P > 0, eps, 1.0), np.zeros_like(eps))
    return LawState(NOTHING, P, NOTHING, p0, eps)
