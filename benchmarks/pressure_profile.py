"""The contact pressure on fixed angles of the arcs, and how far two such profiles are apart."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.postprocess.arc_pressure import ArcPressure

ANGLES = np.linspace(0.0, np.pi / 2, 401)  # from the contact axis


def sampled(arc: ArcPressure) -> Array:
    """Pressure ``(401,)`` of a run's side at `ANGLES`: linear between the points that contact.h5 holds."""
    order = np.argsort(arc.angle, axis=None)
    return interpolated(arc.angle.ravel()[order], arc.pressure.ravel()[order])


def interpolated(angle: Array, pressure: Array) -> Array:
    """Pressure ``(401,)`` at `ANGLES` of one known at growing angles ``(n,)``; constant beyond the ends."""
    return np.interp(ANGLES, angle, pressure)


def profile_error(pressure: Array, reference: Array) -> float:
    """Relative L2 difference over the arc, ``sqrt(int (p - p_ref)^2 / int p_ref^2)``; both ``(401,)`` at `ANGLES`."""
    difference = np.trapezoid((pressure - reference) ** 2, ANGLES)
    return float(np.sqrt(difference / np.trapezoid(reference**2, ANGLES)))
