"""Regression of curves by a Gaussian process: several outputs at once; later ones are
known of fewer points.

Rasmussen and Williams (2006), sections 2.2, 2.7 and 5.4. The kernel is Matern's of order 7/2 with a
length for each input, beside a linear mean with wide prior; outputs share it but for their size.
Points are ordered so that output j is known of the first n_j: then one Cholesky factor serves all
outputs, as its leading block is the factor of the leading points.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from archord.materials.material import Array

_BLOCK = 32  # columns of a factor at a time, which caches hold
_WIDE = 1.0  # prior variance of the linear mean's coefficients over the variance of the rest


@dataclass(frozen=True)
class Kernel:
    """``lengths`` ``(d,)`` of the inputs, and ``noise``, the variance of data over the variance of
    the process."""

    lengths: Array
    noise: float

    def between(self, one: Array, other: Array) -> Array:
        """Covariances ``(n, m)`` of points ``(n, d)`` and ``(m, d)``."""
        scale = np.sqrt(7) / self.lengths
        middle = one.mean(axis=0)  # about which squares are small, and so their round-off
        a = (one - middle) * scale
        b = (other - middle) * scale
        r = (-2 * a) @ b.T  # in place from here on: new memory takes longer than numbers
        r += (a**2).sum(1)[:, None]
        r += (b**2).sum(1)
        np.sqrt(np.maximum(r, 0.0, out=r), out=r)
        matern = r / 15  # (1 + r (1 + r (0.4 + r/15))) exp(-r)
        matern += 0.4
        for _ in range(2):
            matern *= r
            matern += 1
        matern *= np.exp(np.negative(r, out=r), out=r)
        matern += one @ (_WIDE * other.T)
        matern += _WIDE
        return matern

    def at(self, points: Array) -> Array:
        """Variances ``(n,)`` at points ``(n, d)``."""
        of_mean = 1 + (points**2).sum(1)
        return 1 + _WIDE * of_mean


class Process:
    """A Gaussian process through ``values`` ``(n, outputs)`` at ``points`` ``(n, d)``; every column
    of values is nan from some row on.

    - ``points`` ``(n, d)``: inputs of the data
    - ``factor`` ``(n, n)``: Cholesky's lower factor of the covariance
    - ``inverses``: the inverses ``(block, block)`` of the blocks on its diagonal
    - ``known`` ``(n, outputs)``: whether a value is known, 1 or 0
    - ``weights`` ``(n, outputs)``: the factor's inverse times the values, 0 where unknown
    - ``count`` ``(outputs,)``: how many values are known
    - ``size`` ``(outputs,)``: variance of each output
    """

    def __init__(self, kernel: Kernel, points: Array, values: Array) -> None:
        self.kernel = kernel
        self.points = points
        self.factor = np.zeros((len(points), len(points)))
        self.inverses = []
        for start in range(0, len(points), _BLOCK):
            columns = slice(start, start + _BLOCK)
            left = kernel.between(points[start:], points[columns])
            size = left.shape[1]
            left[np.diag_indices(size)] += kernel.noise
            left -= self.factor[start:, :start] @ self.factor[columns, :start].T
            lower = np.linalg.cholesky(left[:size])
            # of an upper triangle, of which LAPACK exchanges no rows
            inverse = np.linalg.inv(lower.T).T
            self.factor[start:, columns] = left @ inverse.T
            self.inverses.append(inverse)
        unknown = np.isnan(values)
        self.known = 1.0 - unknown
        self.weights = self._reduced(np.where(unknown, 0.0, values)) * self.known
        self.count = self.known.sum(0).astype(int)
        self.size = (self.weights**2).sum(0) / np.maximum(self.count, 1)

    def _reduced(self, right: Array) -> Array:
        """The inverse of the factor times ``right`` ``(n, m)``."""
        found = np.empty_like(right)
        for i, inverse in enumerate(self.inverses):
            start = i * _BLOCK
            rows = slice(start, start + _BLOCK)
            remaining = right[rows] - self.factor[rows, :start] @ found[:start]
            found[rows] = inverse @ remaining
        return found

    @cached_property
    def coefficients(self) -> Array:
        """The means' coefficients ``(n, outputs)`` of the covariances with the data: the inverse
        of the factor's transpose times the weights."""
        found = np.zeros_like(self.weights)
        for i, inverse in reversed(list(enumerate(self.inverses))):
            rows = slice(i * _BLOCK, (i + 1) * _BLOCK)
            below = self.factor[rows.stop :, rows].T @ found[rows.stop :]
            found[rows] = inverse.T @ (self.weights[rows] - below)
        return found

    @cached_property
    def likelihood(self) -> float:
        """Logarithm of the likelihood of all data."""
        known = self.count > 0
        count = self.count[known]
        size = np.maximum(self.size[known], 1e-300)
        determinants = np.cumsum(np.log(np.diag(self.factor)))
        of_outputs = 0.5 * count * np.log(size) + determinants[count - 1]
        return -float(of_outputs.sum())

    def means(self, points: Array) -> Array:
        """Means ``(m, outputs)`` of values at ``points`` ``(m, d)``."""
        return self.kernel.between(self.points, points).T @ self.coefficients

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Means and standard deviations ``(m, outputs)`` of values at ``points`` ``(m, d)``."""
        between = self.kernel.between(self.points, points)
        reduced = self._reduced(between)
        told = (reduced**2).T @ self.known
        left = np.maximum(self.kernel.at(points)[:, None] - told, 0.0) + self.kernel.noise
        return between.T @ self.coefficients, np.sqrt(left * self.size)

    def left_out(self) -> tuple[Array, Array]:
        """Errors ``(n, outputs)`` of each point's values as the other points predict them, and the
        standard deviations of these errors (section 5.4.2); nan where unknown."""
        off, deviation = np.full((2, *self.known.shape), np.nan)
        every = self._reduced(np.eye(len(self.points)))
        for count in np.unique(self.count):
            if count < 2:
                continue
            inverse = every[:count, :count]
            precision = (inverse**2).sum(0)
            columns = np.flatnonzero(self.count == count)
            precisions = precision[:, None]
            weights = self.weights[:count, columns]
            off[:count, columns] = -(inverse.T @ weights) / precisions
            deviation[:count, columns] = np.sqrt(self.size[columns] / precisions)
        return off, deviation
