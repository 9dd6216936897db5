"""Slopes at the nodes of cubics through given values: of the smoothest ones, and of cubics that
rise and fall where the values do."""

from __future__ import annotations

import numpy as np

from archord.materials.material import Array


def spline_slopes(at: Array, values: Array, flat: bool = False) -> Array:
    """Slopes ``(n, ...)`` of the cubic spline through ``values`` ``(n, ...)`` at ``at`` ``(n,)``
    (de Boor 1978, chapter IV). The first two cubics are one, unless the spline begins ``flat``, and
    so are the last two, which takes four nodes, or three; of two the end has the chord's slope."""
    n = len(at)
    width = np.diff(at)
    # (matrix) slopes = (right) secants
    matrix = np.eye(n)
    right = np.zeros((n, n - 1))
    right[0, 0] = not flat
    right[-1, -1] = 1
    i = np.arange(1, n - 1)
    before = width[:-1]
    after = width[1:]
    matrix[i, i - 1] = after
    matrix[i, i] = 2 * (before + after)
    matrix[i, i + 1] = before
    right[i, i - 1] = 3 * after
    right[i, i] = 3 * before
    if n > 2:
        _one_cubic(matrix[::-1, ::-1], right[::-1, ::-1], width[::-1])
    if n > 2 and not flat:
        _one_cubic(matrix, right, width)
    secants = (np.diff(values, axis=0).T / width).T
    return np.linalg.solve(matrix, right @ secants)


def _one_cubic(matrix: Array, right: Array, width: Array) -> None:
    """Set the first rows of `spline_slopes` such that the first two cubics are one."""
    first, second = width[:2]
    both = first + second
    of_first = (2 * both + first) * second / both
    of_second = first**2 / both
    matrix[0, :2] = second, both
    right[0, :2] = of_first, of_second


def monotone_slopes(at: Array, values: Array) -> Array:
    """Slopes ``(..., n)`` of cubics that rise and fall where ``values`` ``(..., n)`` at ``at``
    ``(n,)`` do (Fritsch and Butland 1984)."""
    width = np.diff(at)
    secants = np.diff(values) / width
    before = secants[..., :-1]
    after = secants[..., 1:]
    one = width[:-1] + 2 * width[1:]
    other = 2 * width[:-1] + width[1:]
    slopes = np.zeros(values.shape)
    product = (one + other) * before * after
    weighted = one * after + other * before
    goes_on = before * after > 0
    np.divide(product, weighted, out=slopes[..., 1:-1], where=goes_on)
    for end, beside in ((0, 1), (-1, -2)):
        own = secants[..., end]
        difference = own - secants[..., beside]
        bend = difference * width[end] / (width[end] + width[beside])
        most = 3 * own
        low = np.minimum(most, 0.0)
        high = np.maximum(most, 0.0)
        slopes[..., end] = np.clip(own + bend, low, high)
    return slopes


def smooth_step(t: Array) -> Array:
    """From 0 for ``t <= 0`` to 1 for ``t >= 1``, without a kink."""
    inside = np.clip(t, 0.0, 1.0)
    return inside**2 * (3 - 2 * inside)
