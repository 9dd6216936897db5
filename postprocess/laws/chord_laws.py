"""Laws that assume a pressure over the chord, or a Winkler foundation on the arc, with the geometry of rigid circles.

All share ``cos(eps) = dR/(dR + delta)`` and the semi-chord ``l = 2 R sin(eps/2) = 2 R sqrt(delta/(2 (dR + delta)))``
(Hu et al., "A new model for elasto-plastic conformal contact between cylinders", eqs 4 and 5), with R the radius of the
pin. Displacements ``delta`` and forces ``P`` per unit length are arrays of one shape, positive in compression.
"""

from __future__ import annotations

import math

import numpy as np

from archord.postprocess.laws.joint import Array, LawJoint

# Liu, Zhang and Yang (2007), P = (pi/2) E* delta sqrt(delta/(2 (dR + delta))): an ellipse over the chord with p0 = E*
# delta/(2 R), whose force is that of the parabola with this k
LIU_K = 3 * math.pi / 16


def chord_angle(joint: LawJoint, delta: Array) -> Array:
    """Contact semi-angle [rad] of rigid circles that overlap: ``cos(eps) = dR/(dR + delta)`` (Hu et al., eq. 5)."""
    return 2 * np.arcsin(np.sqrt(delta / (2 * (joint.clearance + delta))))


def semi_chord(joint: LawJoint, delta: Array) -> Array:
    """Chord from the deepest point to the edge of the contact, ``l = 2 R sin(eps/2)`` (Hu et al., eq. 5)."""
    return 2 * joint.radius * np.sqrt(delta / (2 * (joint.clearance + delta)))


def winkler_pressure(joint: LawJoint, delta: Array) -> Array:
    """Peak pressure of the Winkler foundation, ``p0 = k E* delta / R`` (Hu et al., eq. 6)."""
    return joint.k * joint.E_star * delta / joint.radius


def paper_force(joint: LawJoint, delta: Array) -> Array:
    """Elastic NFD, ``P = (8/3) k E* delta sqrt(delta/(2 (dR + delta)))``: a parabola over the chord (eqs 8, 9)."""
    return 8 * joint.k / 3 * joint.E_star * delta * np.sqrt(delta / (2 * (joint.clearance + delta)))


def paper_stiffness(joint: LawJoint, delta: Array) -> Array:
    """``dP/d(delta)`` of `paper_force`."""
    root = np.sqrt(delta / (2 * (joint.clearance + delta)))
    return 8 * joint.k / 3 * joint.E_star * root * (1 + joint.clearance / (2 * (joint.clearance + delta)))


def _truncation(joint: LawJoint, delta: Array) -> tuple[Array, Array]:
    """``s = sqrt(1 - delta0/delta)``, half-width of the yielded zone over l, and ``2/3 - s + s^3/3``.

    The latter is the elastic flank's force over ``2 p0 l``; written as a product it does not cancel where s nears one.
    """
    below = joint.first_yield / np.maximum(delta, joint.first_yield)
    s = np.sqrt(1 - below)
    return s, (below / (1 + s)) ** 2 * (2 + s) / 3


def plastic_force(joint: LawJoint, delta: Array) -> Array:
    """Elasto-plastic NFD: the parabola of `paper_force`, cut off at ``c sigY`` (Hu et al., eqs 10 to 12, with c = 1).

    ``P = 2 c sigY l [ (delta/delta0) (2/3 - s + s^3/3) + s ]``, ``s = sqrt(1 - delta0/delta)``, beyond ``delta0 = c
    sigY R/(k E*)``; `paper_force` below, and everywhere without a yield stress. Perfect plasticity.
    """
    if joint.yield_stress is None:
        return paper_force(joint, delta)
    s, flank = _truncation(joint, delta)
    shape = delta / joint.first_yield * flank + s
    return 2 * joint.threshold * semi_chord(joint, delta) * shape


def plastic_stiffness(joint: LawJoint, delta: Array) -> Array:
    """``dP/d(delta)`` of `plastic_force`."""
    if joint.yield_stress is None:
        return paper_stiffness(joint, delta)
    dR = joint.clearance
    s, flank = _truncation(joint, delta)
    root = np.sqrt(delta / (2 * (dR + delta)))
    slope = flank + (flank + joint.first_yield * s / np.where(delta > 0, delta, 1)) * dR / (2 * (dR + delta))
    return 4 * joint.threshold * joint.radius * root * slope / joint.first_yield


def plastic_peak(joint: LawJoint, delta: Array) -> Array:
    """Peak pressure of `plastic_force`: Winkler's, at most ``c sigY``."""
    return np.minimum(winkler_pressure(joint, delta), joint.threshold)


def winkler_force(joint: LawJoint, delta: Array) -> Array:
    """Winkler foundation on the arc: ``P = k E* [ (dR + delta) eps - dR sin(eps) ]``.

    Integral of ``p(phi) = (k E*/R) (delta cos(phi) - dR (1 - cos(phi)))`` (Hu et al., eqs 4 and 6, without the chord).
    Where eps is small the difference is taken from its series, ``dR (eps - sin(eps))``, to keep all digits.
    """
    eps, dR = chord_angle(joint, delta), joint.clearance
    small = eps**3 / 6 * (1 - eps**2 / 20 * (1 - eps**2 / 42))
    return joint.k * joint.E_star * (delta * eps + dR * np.where(eps < 0.02, small, eps - np.sin(eps)))


def winkler_stiffness(joint: LawJoint, delta: Array) -> Array:
    """``dP/d(delta) = k E* (eps + sin(eps) cos(eps))`` of `winkler_force`."""
    eps = chord_angle(joint, delta)
    return joint.k * joint.E_star * (eps + np.sin(eps) * np.cos(eps))
