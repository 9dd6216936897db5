"""The contact pressure on fixed angles of the arcs, and how far two such profiles are apart."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from archord.geometry.basis import Array
from archord.presets.arc import ArcProfile

ANGLES = np.linspace(0.0, np.pi / 2, 401)  # from the contact axis


def sampled(arc: ArcProfile) -> Array:
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


def smoothed(pressure: Array, terms: int) -> Array:
    """``pressure`` ``(401,)`` at `ANGLES` without the scatter from facet to facet, by least squares.

    The fit is ``sqrt(1 - x^2)`` times an even polynomial of ``terms`` coefficients in ``x = angle/edge``, the form of a
    contact pressure with an elastic edge, the edge itself free; zero beyond it. Raises ValueError where nothing is
    pressed.
    """
    pressed = np.flatnonzero(pressure > 0)
    if len(pressed) <= terms:
        raise ValueError("a profile to be smoothed must be pressed at more angles than there are terms")
    guess = float(ANGLES[pressed[-1]])
    # the last angle that is pressed may be anywhere within the last facet
    scan = np.linspace(0.97, 1.03, 61) * guess
    misfits = [np.sum((_fit(pressure, edge, terms) - pressure) ** 2) for edge in scan]
    best = scan[int(np.argmin(misfits))]
    found = minimize_scalar(
        lambda edge: float(np.sum((_fit(pressure, edge, terms) - pressure) ** 2)),
        bounds=(best - 1e-3 * guess, best + 1e-3 * guess),
        method="bounded",
    )
    return _fit(pressure, float(found.x), terms)


def _fit(pressure: Array, edge: float, terms: int) -> Array:
    inside = edge > ANGLES
    x = ANGLES[inside] / edge
    # Chebyshev polynomials of even degree: powers would be ill-conditioned
    A = np.stack([np.sqrt(1 - x**2) * np.cos(2 * k * np.arccos(x)) for k in range(terms)], axis=1)
    fit = np.zeros_like(ANGLES)
    fit[inside] = A @ np.linalg.lstsq(A, pressure[inside], rcond=None)[0]
    return fit
