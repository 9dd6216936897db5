"""Laws that assume a pressure over the chord, or a Winkler foundation on the arc, with the geometry
of rigid circles.

All share ``cos(eps) = dR/(dR + delta)`` and the semi-chord ``l = 2 R sin(eps/2) = 2 R sqrt(delta/(2
(dR + delta)))`` (Hu et al., "A new model for elasto-plastic conformal contact between cylinders",
eqs 4 and 5), with R the radius of the pin, and a peak pressure ``p0 = k E* delta/R`` (eq. 6).
Displacements ``delta`` and forces ``P`` per unit length are arrays of one shape, positive in
compression.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.law import LawState

_LIU_K = 3 * math.pi / 16  # whose parabola over the chord has the force of Liu's ellipse


def _half_sine(joint: LawJoint, delta: Array) -> Array:
    """``sin(eps/2)``."""
    return np.sqrt(delta / (2 * (joint.clearance + delta)))


def plastic_winkler(joint: LawJoint, delta: Array) -> LawState:
    """Elasto-plastic NFD: a parabola of pressure over the chord, cut off at ``c sigY`` (eqs 10 to
    12, with c = 1).

    ``P = 2 c sigY l [ (delta/delta0) (2/3 - s + s^3/3) + s ]``, ``s = sqrt(1 - delta0/delta)``,
    beyond ``delta0 = c sigY R/(k E*)``; below, and everywhere without a yield stress, ``P = (8/3) k
    E* delta sqrt(delta/(2 (dR + delta)))`` (eq. 9). Perfect plasticity.
    """
    root = _half_sine(joint, delta)
    dR = joint.clearance
    uncut = joint.k * joint.E_star * delta / joint.radius
    p0 = np.minimum(uncut, joint.threshold)
    below = p0 / np.where(uncut > 0, uncut, 1.0)  # delta0/delta, 1 before the onset
    s = np.sqrt(1 - below)
    # 2/3 - s + s^3/3, the elastic flank's share, as a product that does not cancel where s nears
    # one
    flank = (below / (1 + s)) ** 2 * (2 + s) / 3
    mean_pressure = uncut * flank + p0 * s
    P = 4 * joint.radius * root * mean_pressure
    widening = (flank + below * s) * dR / (2 * (dR + delta))
    stiffness = 4 * joint.k * joint.E_star * root * (flank + widening)
    semi_angle = 2 * np.arcsin(root)
    return LawState(delta, P, stiffness, p0, semi_angle)


def parabola(joint: LawJoint, delta: Array) -> LawState:
    """Elastic NFD (eqs 8, 9): `plastic_winkler` without a yield stress."""
    return plastic_winkler(joint.elastic, delta)


def liu(joint: LawJoint, delta: Array) -> LawState:
    """An ellipse over the chord (Liu, Zhang and Yang 2007): ``P = (pi/2) E* delta sqrt(delta/(2 (dR
    + delta)))``, ``p0 = E* delta/(2 R)``."""
    alike = parabola(replace(joint, k=_LIU_K), delta)
    return alike._replace(peak_pressure=joint.E_star * delta / (2 * joint.radius))


def winkler(joint: LawJoint, delta: Array) -> LawState:
    """Winkler foundation on the arc: ``P = k E* [ (dR + delta) eps - dR sin(eps) ]``, ``dP/d(delta)
    = k E* (eps + sin(eps) cos(eps))``.

    Integral of ``p(phi) = (k E*/R) (delta cos(phi) - dR (1 - cos(phi)))`` (eqs 4 and 6, without the
    chord). Where eps is small the difference is taken from its series, ``dR (eps - sin(eps))``, to
    keep all digits.
    """
    eps = 2 * np.arcsin(_half_sine(joint, delta))
    stiffness = joint.k * joint.E_star
    small = eps**3 / 6 * (1 - eps**2 / 20 * (1 - eps**2 / 42))
    difference = np.where(eps < 0.02, small, eps - np.sin(eps))
    P = stiffness * (delta * eps + joint.clearance * difference)
    slope = stiffness * (eps + np.sin(eps) * np.cos(eps))
    p0 = stiffness * delta / joint.radius
    return LawState(delta, P, slope, p0, eps)
