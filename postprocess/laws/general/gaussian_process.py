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
from scipy.linalg import cho_factor, solve_triangular

from archord.postprocess.laws.general.joint import Array

_ROWS = 64  # of a matrix at a time, which caches hold
_WIDE = 1.0  # prior variance of the linear mean's coefficients over the variance of the rest


@dataclass(frozen=True)
class Kernel:
    """``lengths`` ``(d,)`` of the inputs, and ``noise``, the variance of data over the variance of
    the process."""

    lengths: Array
    noise: float

    def between(self, one: Array, other: Array) -> Array:
        """Covariances ``(n, m)`` of points ``(n, d)`` and ``(m, d)``."""
        a = one / self.lengths
        b = other / self.lengths
        distance = (a**2).sum(1)[:, None] + (b**2).sum(1) - 2 * a @ b.T
        r = np.sqrt(7 * np.maximum(distance, 0.0))
        matern = r / 15  # (1 + r (1 + r (0.4 + r/15))) exp(-r), in one array
        matern += 0.4
        for _ in range(2):
            matern *= r
            matern += 1
        matern *= np.exp(-r)
        matern += _WIDE * (1 + one @ other.T)
        return matern

    def at(self, points: Array) -> Array:
        """Variances ``(n,)`` at points ``(n, d)``."""
        return 1 + _WIDE * (1 + (points**2).sum(1))


class Process:
    """A Gaussian process through ``values`` ``(n, outputs)`` at ``points`` ``(n, d)``; every column
    of values is nan from some row on.

    - ``points`` ``(n, d)``: inputs of the data
    - ``factor`` ``(n, n)``: Cholesky's upper factor of the covariance; below it is no number of use
    - ``known`` ``(n, outputs)``: whether a value is known, 1 or 0
    - ``weights`` ``(n, outputs)``: the factor's inverse times the values, 0 where unknown
    - ``count`` ``(outputs,)``: how many values are known
    - ``size`` ``(outputs,)``: variance of each output
    """

    def __init__(self, kernel: Kernel, points: Array, values: Array) -> None:
        self.kernel = kernel
        self.points = points
        covariance = np.empty((len(points), len(points)))
        for start in range(0, len(points), _ROWS):  # of the half that Cholesky's factor needs
            rows = slice(start, start + _ROWS)
            covariance[rows, : start + _ROWS] = kernel.between(
                points[rows], points[: start + _ROWS]
            )
        covariance[np.diag_indices_from(covariance)] += kernel.noise
        # The transposed matrix is in LAPACK's order: it is not copied.
        self.factor, _ = cho_factor(covariance.T, overwrite_a=True, check_finite=False)
        unknown = np.isnan(values)
        self.known = 1.0 - unknown
        self.weights = self._reduced(np.where(unknown, 0.0, values)) * self.known
        self.count = self.known.sum(0).astype(int)
        self.size = (self.weights**2).sum(0) / np.maximum(self.count, 1)

    def _reduced(self, right: Array) -> Array:
        """The inverse of the factor's transpose times ``right`` ``(n, m)``."""
        return solve_triangular(self.factor, right, trans=1, check_finite=False)

    @cached_property
    def likelihood(self) -> float:
        """Logarithm of the likelihood of all data."""
        known = self.count > 0
        count = self.count[known]
        told = np.cumsum(np.log(np.diag(self.factor)))[count - 1]
        return -float((0.5 * count * np.log(np.maximum(self.size[known], 1e-300)) + told).sum())

    def means(self, points: Array) -> Array:
        """Means ``(m, outputs)`` of values at ``points`` ``(m, d)``."""
        return self._reduced(self.kernel.between(self.points, points)).T @ self.weights

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Means and standard deviations ``(m, outputs)`` of values at ``points`` ``(m, d)``."""
        reduced = self._reduced(self.kernel.between(self.points, points))
        told = (reduced**2).T @ self.known
        left = np.maximum(self.kernel.at(points)[:, None] - told, 0.0) + self.kernel.noise
        return reduced.T @ self.weights, np.sqrt(left * self.size)

    def left_out(self) -> tuple[Array, Array]:
        """Errors ``(n, outputs)`` of each point's values as the other points predict them, and the
        standard deviations of these errors (section 5.4.2); nan where unknown."""
        off, deviation = np.full((2, *self.known.shape), np.nan)
        for count in np.unique(self.count):
            if count < 2:
                continue
            leading = self.factor[:count, :count]
            inverse = solve_triangular(leading, np.eye(count), trans=1, check_finite=False)
            precision = (inverse**2).sum(0)
            columns = np.flatnonzero(self.count == count)
            off[:count, columns] = -(inverse.T @ self.weights[:count, columns]) / precision[:, None]
            deviation[:count, columns] = np.sqrt(self.size[columns] / precision[:, None])
        return off, deviation
