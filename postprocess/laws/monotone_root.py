"""Roots of rising functions of one variable, many at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
_FAR = 1e150  # no displacement, and its square is still a number
_ENOUGH = 200  # halvings leave no digit of any bracket after 64; the rest is for doubling and halving to tiny roots


def monotone_root(f: Callable[[Array], Array], slope: Callable[[Array], Array], target: Array, start: float) -> Array:
    """Solve ``f(x) = target`` for ``x >= 0`` with ``f`` rising from ``f(0) <= target``; nan where f stays below it.

    Newton's method in a bracket, with the middle of the bracket where a step would leave it. ``start`` is a first guess
    of the size of x. Targets that are not positive or not finite give 0 and nan. Shapes ``(...)`` in and out.
    """
    target = np.asarray(target, dtype=float)
    wanted = np.isfinite(target) & (target > 0)
    goal = np.where(wanted, target, 1.0)
    low, high = np.zeros_like(goal), np.full_like(goal, start)
    for _ in range(_ENOUGH * 5):
        short = (f(high) < goal) & (high < _FAR)
        if not short.any():
            break
        low, high = np.where(short, high, low), np.where(short, 2 * high, high)
    reached = f(high) >= goal
    goal = np.where(reached, goal, f(high))
    x = high
    for _ in range(_ENOUGH * 5):
        excess = f(x) - goal
        low, high = np.where(excess <= 0, x, low), np.where(excess >= 0, x, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = x - excess / slope(x)
        # NaN compares false, so a vanishing slope falls to the middle as well
        step = np.where((step > low) & (step < high), step, 0.5 * (low + high))
        done = (np.abs(step - x) <= 4e-16 * np.abs(step)) | (excess == 0)
        x = np.where(excess == 0, x, step)
        if done.all():
            break
    return np.where(wanted & reached, x, np.where(target <= 0, 0.0, np.nan))
