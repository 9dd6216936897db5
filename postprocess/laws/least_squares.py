"""Least squares with standard errors and confidence intervals of the parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from archord.geometry.basis import Array


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter.

    ``standard_error`` is that of least squares, ``discretisation_error`` that of the mesh (None: unknown, counted as
    none); ``error`` is both in quadrature, and ``low`` to ``high`` the confidence interval with Student's t.
    """

    value: float
    standard_error: float
    discretisation_error: float | None
    error: float
    low: float
    high: float


@dataclass(frozen=True)
class LeastSquares:
    """Parameters ``(m,)`` with their standard errors, residuals ``(n,)`` (prediction - data), R2, degrees of
    freedom."""

    parameters: Array
    standard_errors: Array
    residuals: Array
    r2: float
    dof: int

    def estimate(self, i: int, confidence: float, discretisation: float | None = None) -> Estimate:
        """Parameter ``i`` with its interval at ``confidence``, the error ``discretisation`` of the mesh carried in."""
        value, own = float(self.parameters[i]), float(self.standard_errors[i])
        error = float(np.hypot(own, discretisation or 0.0))
        half = float(student.ppf((1 + confidence) / 2, self.dof)) * error
        return Estimate(value, own, discretisation, error, value - half, value + half)


def fit(predict: Callable[[Array], Array], starts: Sequence[Sequence[float]], data: Array) -> LeastSquares:
    """Positive parameters that minimise ``sum (predict(parameters) - data)^2``, the best of several ``starts``.

    The covariance is ``s^2 (J^T J)^-1`` with ``s^2 = sum r^2/(n - m)`` (Seber and Wild 2003, section 2.1). It takes the
    residuals as independent. A parameter without influence on any prediction gets an infinite error. Raises ValueError
    unless there are more data than parameters, or where only combinations of parameters can be told. Without parameters
    the residuals are all.
    """
    m, n = len(starts[0]), len(data)
    if n <= m:
        raise ValueError(f"{n} points cannot determine {m} parameters and their errors")
    if m == 0:
        return _judged(np.zeros(0), np.zeros(0), predict(np.zeros(0)) - data, data)
    tight = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
    found = [least_squares(lambda v: predict(v) - data, s, bounds=(0, np.inf), x_scale="jac", **tight) for s in starts]
    best = min(found, key=lambda solution: solution.cost)
    size = np.linalg.norm(best.jac, axis=0)
    felt = size > 0
    scaled = best.jac[:, felt] / size[felt]
    if np.linalg.cond(scaled) > 1e8:
        raise ValueError("the points do not determine the parameters")
    squares = float(best.fun @ best.fun)
    errors = np.full(m, np.inf)
    errors[felt] = np.sqrt(np.diag(np.linalg.inv(scaled.T @ scaled)) * squares / (n - m)) / size[felt]
    return _judged(best.x, errors, best.fun, data)


def _judged(parameters: Array, errors: Array, residuals: Array, data: Array) -> LeastSquares:
    squares, spread = float(residuals @ residuals), float(((data - data.mean()) ** 2).sum())
    r2 = 1 - squares / spread if spread else float("nan")
    return LeastSquares(parameters, errors, residuals, r2, len(data) - len(parameters))
