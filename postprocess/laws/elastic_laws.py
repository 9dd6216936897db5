"""Elastic theories of pin and hole: Hertz's contacts, half-spaces with a logarithm, and Persson's
conformal contact.

Johnson, Radzimovsky, ESDU 78035 and Dubowsky and Freudenstein are half-spaces under Hertz's
pressure, ``delta = P/(pi E*) [ ln(A E* dR/P) + q ]``, and differ only in the numbers ``A`` and
``q``. Each ``P(delta)`` rises until ``dP/d(delta)`` is infinite at ``P = A e^(q - 1) E* dR``,
``delta = P/(pi E*)``, and turns back there: the load limit.

Persson's is the conformal contact of two elastic circles of nearly the same radius without
friction, solved exactly for Dundurs' beta = 0. The angles: ``b = tan(eps/2)``, ``y = tan(phi/2)``,
phi from the contact axis, eps the contact semi-angle. With beta = 0 the materials enter only by how
the mean pressure ``p_m = (1/2 pi) integral of p dphi`` changes the clearance: ``dR + (1 + alpha)
p_m R/E*`` is one function of the angle for all pairs. So the pressure over P/R is the same for
every alpha, and alpha moves only the load at which an angle is reached.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import lambertw

from archord.materials.material import Array
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.law import NOTHING, ROUND_OFF, LawState, rising_root

_AT_LIMIT = 1 - 1e-15  # of the limit: beyond it round-off would give a complex W, or none


def hertz(joint: LawJoint, P: Array) -> LawState:
    """Line contact of half-width ``a = 2 sqrt(P R*/(pi E*))``: peak pressure ``p0 = sqrt(P E*/(pi
    R*))`` and semi-angle ``a/R1`` (Johnson 1985, eqs 4.43 and 4.45)."""
    R_star = joint.relative_radius
    root = np.sqrt(P / (math.pi * joint.E_star * R_star))
    half_width = 2 * R_star * root
    semi_angle = half_width / joint.radius
    p0 = joint.E_star * root
    return LawState(NOTHING, P, NOTHING, p0, semi_angle)


def hertz_load_limit(joint: LawJoint) -> float:
    """Load at which the half-width is R1/2; there the parabola for the circle is off by 7 % of the
    depth."""
    quarter = joint.radius / 4
    return math.pi * joint.E_star * quarter**2 / joint.relative_radius


def lankarani_nikravesh(joint: LawJoint, delta: Array) -> LawState:
    """Hertz's ball in a socket (Lankarani and Nikravesh 1990, 1994, without damping), as multibody
    codes use it for pins: ``P = (4/3) E* sqrt(R*) delta^(3/2)/L``, ``p0 = (2/pi) E*
    sqrt(delta/R*)`` (Johnson 1985, eq. 4.24)."""
    assert joint.length is not None
    root = np.sqrt(delta)
    size = math.sqrt(joint.relative_radius)
    spring = 4 / 3 * joint.E_star * size / joint.length
    P = spring * delta * root
    stiffness = 1.5 * spring * root
    p0 = 2 / math.pi * joint.E_star * root / size
    return LawState(delta, P, stiffness, p0)


def logarithm(joint: LawJoint, delta: Array, A: float, q: float) -> LawState:
    """The rising branch: ``P = pi E* delta / y``, ``dP/d(delta) = pi E* / (y - 1)``, where the
    bracket in the law, ``y = -W_-1(-delta/(e delta_limit))`` with Lambert's function, is 1 at the
    limit and infinite for no displacement; nan beyond."""
    spring = math.pi * joint.E_star
    limit = turning_point(joint, A, q)
    argument = -delta / (math.e * limit)
    at_limit = argument <= -_AT_LIMIT / math.e
    below = np.where(at_limit, -0.1, argument)
    y = np.maximum(-lambertw(below, -1).real, 1.0)
    y = np.where(delta > 0, y, np.inf)
    y = np.where(at_limit, 1.0, y)
    is_beyond = delta > limit * (1 + ROUND_OFF)
    y = np.where(is_beyond, np.nan, y)
    with np.errstate(divide="ignore"):
        return LawState(delta, spring * delta / y, spring / (y - 1))


def turning_point(joint: LawJoint, A: float, q: float) -> float:
    """Displacement at the load limit of `logarithm`."""
    return A * math.exp(q - 1) / math.pi * joint.clearance


def dubowsky_freudenstein(joint: LawJoint, delta: Array) -> LawState:
    """``delta = F (s1 + s2)/L [ ln(L^3 dR/(F R1 R2 (s1 + s2))) + 1 ]``, ``s1 + s2 = 1/(pi E*)``, F
    = P L: Lundberg's compression of two half-spaces that touch along a strip of length L and
    Hertz's pressure across it."""
    assert joint.length is not None
    A = math.pi * joint.length**2 / (joint.relative_radius * joint.clearance)
    return logarithm(joint, delta, A, 1.0)


def dubowsky_freudenstein_limit(joint: LawJoint) -> float:
    """Displacement at which Hertz's contact is as wide as the joint is long, no strip: ``P =
    (pi/16) E* L^2/R*``."""
    assert joint.length is not None
    return (1 + math.log(16)) * joint.length**2 / (16 * joint.relative_radius)


def persson_pressure(joint: LawJoint, P: Array, eps: Array, phi: Array) -> Array:
    """Pressure at the angle ``phi`` of a contact of semi-angle ``eps`` under ``P``; zero beyond it
    (broadcasts).

    ``R p/P = 2/(pi sqrt(b^2 + 1)) sqrt(b^2 - y^2)/(1 + y^2) + 1/(2 pi b^2 (1 + b^2)) ln[ (sqrt(b^2
    + 1) + sqrt(b^2 - y^2)) / (sqrt(b^2 + 1) - sqrt(b^2 - y^2)) ]`` (Persson 1964; Hu et al., eq.
    13).
    """
    b = np.tan(eps / 2)
    y = np.tan(phi / 2)
    c = np.sqrt(1 + b**2)
    s = np.sqrt(np.maximum(b**2 - y**2, 0.0))
    of_root = 2 / (np.pi * c) * s / (1 + y**2)
    logarithm_of_roots = np.arctanh(s / c)
    of_logarithm = logarithm_of_roots / (np.pi * b**2 * c**2)
    mean = P / joint.radius
    pressure = (of_root + of_logarithm) * mean
    return np.where(np.abs(phi) < eps, pressure, 0.0)


def persson_load(joint: LawJoint, eps: Array) -> Array:
    """Load at which the contact has the semi-angle ``eps``; infinite from the angle on that closes
    any clearance, 84.83 degrees for like bodies. ``E* dR/P = [ 2 - (1 + alpha) (ln(1 + b^2) + 2
    b^4) ] / [ 2 pi b^2 (1 + b^2) ]``, with alpha positive for the stiffer pin (Ciavarella and
    Decuzzi 2001)."""
    b2 = np.tan(eps / 2) ** 2
    closing = (1 + joint.dundurs_alpha) * (np.log1p(b2) + 2 * b2**2)
    left = np.where(closing < 2, 2 - closing, 0.0)
    with np.errstate(divide="ignore"):
        return joint.unit * 2 * np.pi * b2 * (1 + b2) / left


def persson(joint: LawJoint, P: Array) -> LawState:
    """Peak pressure and contact semi-angle [rad] under ``P``: the root of `persson_load`, zero for
    no load."""
    half = rising_root(lambda b: persson_load(joint, 2 * np.arctan(b)), P, 1.0)
    eps = 2 * np.arctan(half)
    any_angle = np.where(P > 0, eps, 1.0)
    middle = np.zeros_like(eps)
    p0 = persson_pressure(joint, P, any_angle, middle)
    return LawState(NOTHING, P, NOTHING, p0, eps)
