"""Hertz's line contact, and the point contact that Lankarani and Nikravesh lend to cylinders."""

from __future__ import annotations

import math

import numpy as np

from archord.postprocess.laws.law_joint import Array, LawJoint


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


def lankarani_nikravesh_force(joint: LawJoint, delta: Array) -> Array:
    """Static part of Lankarani and Nikravesh: ``P = (4/3) E* sqrt(R*) delta^(3/2) / L``.

    Hertz's ball in a socket (Lankarani and Nikravesh 1990, 1994, without damping), as multibody codes use it for pins;
    the force, divided by the length of the joint to be comparable.
    """
    assert joint.length is not None
    return 4 / 3 * joint.E_star * math.sqrt(joint.relative_radius) * delta**1.5 / joint.length


def lankarani_nikravesh_displacement(joint: LawJoint, P: Array) -> Array:
    """Inverse of `lankarani_nikravesh_force`."""
    assert joint.length is not None
    return (P * joint.length / (4 / 3 * joint.E_star * math.sqrt(joint.relative_radius))) ** (2 / 3)


def lankarani_nikravesh_stiffness(joint: LawJoint, delta: Array) -> Array:
    """``dP/d(delta)`` of `lankarani_nikravesh_force`."""
    assert joint.length is not None
    return 2 * joint.E_star * math.sqrt(joint.relative_radius) * np.sqrt(delta) / joint.length


def lankarani_nikravesh_limit(joint: LawJoint) -> float:
    """Displacement at which the radius of Hertz's contact circle, ``sqrt(R* delta)``, is R1/2."""
    return (joint.radius / 2) ** 2 / joint.relative_radius


def lankarani_nikravesh_peak(joint: LawJoint, delta: Array) -> Array:
    """Peak pressure of Hertz's point contact, ``p0 = (2/pi) E* sqrt(delta/R*)`` (Johnson 1985, eq. 4.24)."""
    return 2 / math.pi * joint.E_star * np.sqrt(delta / joint.relative_radius)
