"""Extrapolation of a quantity to vanishing element size, after Richardson (1911), over three sizes or more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from archord.geometry.basis import Array

# Between the order of a clamped corner's singularity, twice its exponent of 0.7, and that of smooth solutions in P2.
_ORDERS = 1.4, 4.0


@dataclass(frozen=True)
class Limit:
    """``value`` at size zero, the ``order`` of convergence, and ``error``: how far the value moves if any one of the
    sizes is left out."""

    value: float
    order: float
    error: float


def extrapolated(sizes: Sequence[float], values: Sequence[float]) -> Limit:
    """Fit ``values`` = limit + c ``sizes``^order by least squares, the order between 1.4 and 4.

    The order is free: that of unlike meshes scatters. Raises ValueError for fewer than three different sizes.
    """
    h, v = np.asarray(sizes, dtype=float), np.asarray(values, dtype=float)
    if len(np.unique(h)) < 3:
        raise ValueError("an extrapolation needs three element sizes")
    spread = np.ptp(v)
    if spread == 0:
        return Limit(float(v[0]), _ORDERS[1], 0.0)
    h = h / h.max()

    def misfit(order: float) -> float:
        return float(np.log10(_fit(h, v, order)[1] / spread + 1e-300))

    # the misfit over the order can have several minima: the best of a scan, then its neighbourhood
    scan = np.linspace(*_ORDERS, 33)
    best = int(np.argmin([misfit(order) for order in scan]))
    bounds = scan[max(0, best - 1)], scan[min(len(scan) - 1, best + 1)]
    found = minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-9})
    order = float(min(found.x, scan[best], key=misfit))
    limit = _fit(h, v, order)[0]
    others = [_fit(np.delete(h, i), np.delete(v, i), order)[0] for i in range(len(h))]
    return Limit(limit, order, float(np.abs(np.array(others) - limit).max()))


def _fit(h: Array, v: Array, order: float) -> tuple[float, float]:
    """Limit and root mean square residual at a given order."""
    A = np.stack([np.ones_like(h), h**order], axis=1)
    found = np.linalg.lstsq(A, v, rcond=None)[0]
    return float(found[0]), float(np.sqrt(np.mean((A @ found - v) ** 2)))
