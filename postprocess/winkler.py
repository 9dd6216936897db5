"""The Winkler model of conformal contact, elastic and plastic with a free threshold.

Hu et al., "A new model for elasto-plastic conformal contact between cylinders": an elastic foundation under the chord
from the deepest point to the edge of the contact, with the pressure ``p0 (1 - x^2/l^2)`` (eq. 3), cut off at ``c sigY``
where it yields. The paper has ``c = 1``; here its eqs. 10 to 12 hold with ``c sigY`` in the place of ``sigY``. Forces
are per unit thickness, for the whole joint, positive in compression; any consistent units.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from archord.geometry.basis import Array


def chord_length(delta: ArrayLike, R: float, dR: float) -> Array:
    """Chord ``l = 2 R sin(eps/2)`` with ``cos(eps) = dR/(dR + delta)`` (eq. 5), any shape; 0 without compression."""
    delta = np.maximum(delta, 0.0)
    return R * np.sqrt(2 * delta / (dR + delta))


def peak_pressure(delta: ArrayLike, k: float, E_star: float, R: float) -> Array:
    """``p0 = k E* delta/R`` (eq. 6), any shape; 0 without compression."""
    return k * E_star * np.maximum(delta, 0.0) / R


def elastic_force(delta: ArrayLike, k: float, E_star: float, R: float, dR: float) -> Array:
    """``P = 4/3 p0 l = 8/3 k E* delta sqrt(delta/(2 (dR + delta)))`` (eqs. 8, 9), any shape."""
    return 4 / 3 * peak_pressure(delta, k, E_star, R) * chord_length(delta, R, dR)


def onset(k: float, c: float, E_star: float, R: float, sigY: float) -> float:
    """Displacement ``delta0 = c sigY R/(k E*)`` at which the peak pressure reaches the threshold ``c sigY``."""
    return c * sigY * R / (k * E_star)


def plastic_peak_pressure(delta: ArrayLike, k: float, c: float, E_star: float, R: float, sigY: float) -> Array:
    """``p0 = min(k E* delta/R, c sigY)``, any shape."""
    return np.minimum(peak_pressure(delta, k, E_star, R), c * sigY)


def plastic_force(delta: ArrayLike, k: float, c: float, E_star: float, R: float, dR: float, sigY: float) -> Array:
    """Force of the elastic-plastic foundation, any shape; `elastic_force` up to ``delta0`` (see `onset`).

    ``P = 2 int_a^l p0 (1 - x^2/l^2) dx + 2 c sigY a``, ``a = l s``, ``s = sqrt(1 - delta0/delta)`` (eq. 10), that is
    ``P = 2 c sigY l [ (delta/delta0) (2/3 - s + s^3/3) + s ]`` (eqs. 11, 12). With ``u = delta0/delta = 1 - s^2`` the
    bracket is ``s + u (2 + s)/(3 (1 + s)^2)``, which does not cancel far beyond ``delta0``.
    """
    elastic = elastic_force(delta, k, E_star, R, dR)
    delta0 = onset(k, c, E_star, R, sigY)
    u = delta0 / np.maximum(delta, delta0)
    s = np.sqrt(1 - u)
    yielded = 2 * c * sigY * chord_length(delta, R, dR) * (s + u * (2 + s) / (3 * (1 + s) ** 2))
    return np.where(np.asarray(delta) > delta0, yielded, elastic)
