"""Persson's pressure on the arc, with the load-angle relation of Ciavarella and Decuzzi.

The conformal contact of two elastic circles of nearly the same radius without friction, solved exactly for Dundurs'
beta = 0. The angles: ``b = tan(eps/2)``, ``y = tan(phi/2)``, phi from the contact axis, eps the contact semi-angle.

With beta = 0 the materials enter only by how the mean pressure ``p_m = (1/2 pi) integral of p dphi`` changes the
clearance: ``dR + (1 + alpha) p_m R/E*`` is one function of the angle for all pairs. So the pressure over P/R is the
same for every alpha, and alpha moves only the load at which an angle is reached.
"""

from __future__ import annotations

import math

import numpy as np

from archord.postprocess.laws.law_joint import Array, LawJoint
from archord.postprocess.laws.monotone_root import monotone_root


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
    """Load at which the contact has the semi-angle ``eps``; infinite from `largest_angle` on.

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


def largest_angle(alpha: float = 0.0) -> float:
    """Contact semi-angle [rad] under any load if there is no clearance; 1.4805 (84.83 degrees) for like bodies."""
    if alpha <= -1:
        return math.pi
    target = np.array([2 / (1 + alpha)])
    b2 = monotone_root(lambda x: np.log1p(x) + 2 * x**2, lambda x: 1 / (1 + x) + 4 * x, target, 1.0)
    return float(2 * np.arctan(np.sqrt(b2[0])))
