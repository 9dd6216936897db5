"""Least-squares fits of the plastic-Winkler law to P(delta) or p0(delta) of one or more runs, with errors of k and c.

Every curve is fitted in the form that depends on ``delta/dR`` alone where the joint is elastic, ``P/(E* dR)`` and ``p0
R/(E* dR)``, so runs of different clearance weigh alike and units do not matter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.stats import t as student

from archord.postprocess.convergence import Order, Refined
from archord.postprocess.curve import RunCurve
from archord.postprocess.laws.chord_laws import plastic_force, plastic_peak
from archord.postprocess.laws.joint import Array, LawJoint
from archord.scene.errors import InputError

_STARTS_OF_C = (0.7, 1.0, 1.5, 2.5)  # p0 has a kink at the onset: one start may miss the best side of it


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
    """Parameters ``(m,)`` with their standard errors, R2, degrees of freedom."""

    parameters: Array
    standard_errors: Array
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
    unless there are more data than parameters, or where they determine only combinations of parameters.
    """
    m, n = len(starts[0]), len(data)
    if n <= m:
        raise ValueError(f"{n} points cannot determine {m} parameters and their errors")
    spread = float(((data - data.mean()) ** 2).sum()) or np.nan
    if m == 0:
        return LeastSquares(np.zeros(0), np.zeros(0), 1 - float(((predict(np.zeros(0)) - data) ** 2).sum()) / spread, n)
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
    return LeastSquares(best.x, errors, 1 - squares / spread, n - m)


@dataclass(frozen=True)
class Residual:
    """A run's part of a fit, arrays ``(n,)``: ``delta/dR``, the dimensionless data and what the law makes of them."""

    name: str
    load: Array
    data: Array
    law: Array

    @property
    def relative(self) -> Array:
        """``law/data - 1`` ``(n,)``."""
        return self.law / self.data - 1


@dataclass(frozen=True)
class CurveFit:
    """A fit to one curve of one or more runs; ``k`` or ``c`` is None where the curve does not determine it.

    ``orders`` are the orders of convergence taken for the runs that have a second mesh.
    """

    quantity: str
    k: Estimate | None
    c: Estimate | None
    r2: float
    dof: int
    residuals: tuple[Residual, ...]
    refined: int  # of the scenes, how many have a second mesh
    flatness: tuple[float, float] | None = None  # plateau only: smallest and largest median over peak pressure
    orders: tuple[tuple[str, Order], ...] = ()
    k_held: bool = False

    @property
    def rms(self) -> float:
        """Root mean square of the relative residuals."""
        return float(np.sqrt(np.mean(np.concatenate([r.relative for r in self.residuals]) ** 2)))

    @property
    def largest(self) -> float:
        """The largest relative residual, with its sign."""
        every = np.concatenate([r.relative for r in self.residuals])
        return float(every[np.abs(every).argmax()])

    @property
    def serial_correlation(self) -> float:
        """Correlation of residuals of neighbouring steps: about 0 for noise, near 1 where the law has another shape."""
        rows = [part.law - part.data for part in self.residuals]
        squares = sum(float(r @ r) for r in rows)
        return sum(float(r[1:] @ r[:-1]) for r in rows) / squares if squares else 0.0


def fit_curve(
    quantity: str,
    groups: list[Refined],
    load_range: tuple[float, float] = (0.0, np.inf),
    confidence: float = 0.95,
    hold_k: float | None = None,
) -> CurveFit:
    """Fit the law to the curve "P" or "p0" of all ``groups``.

    ``c`` is fitted where two steps or more lie on the plateau. Where fewer than two have not yielded, p0 says nothing
    of ``k``, and ``c`` alone is fitted to those that have. ``hold_k`` is ``k`` where it is given, without an error.
    Where some scenes have a second mesh, the fit is repeated with their data extrapolated to vanishing element size;
    the change of a parameter is its discretisation error.
    Raises `InputError` where too few steps are in the range, or a run's bodies never touch.
    """
    for run in (run for g in groups for run in g.runs):
        if not ((run.P > 0) & (run.p0 > 0)).any():
            raise InputError(f"{run.name}: the bodies never touch in this run, so there is no law to fit to it.")
    runs = [g.run for g in groups]
    chosen = [selected(run, load_range) for run in runs]
    yielded = [rows & (run.peeq_max > 0) for run, rows in zip(runs, chosen, strict=True)]
    steps, plastic = (np.concatenate(rows).sum() for rows in (chosen, yielded))
    plateau_alone = hold_k is None and quantity == "p0" and plastic > 0 and steps - plastic < 2
    problem = _Problem(quantity, runs, yielded if plateau_alone else chosen, hold_k)
    curves = [[getattr(run, quantity) for run in g.runs] for g in groups]
    data = [y[0] for y in curves]
    free, best = (("c",), problem.solve(("c",), data)) if plateau_alone else problem.solve_best(data)
    mesh: dict[str, float] = {}
    refined = sum(bool(g.coarser) for g in groups)
    if refined and free:
        finer = [y[0] + g.shift(y) if g.coarser else y[0] for g, y in zip(groups, curves, strict=True)]
        moved = problem.solve(free, finer).parameters - best.parameters
        mesh = dict(zip(free, map(float, np.abs(moved)), strict=True))
    found = {name: best.estimate(i, confidence, mesh.get(name)) for i, name in enumerate(free)}
    if hold_k is not None:
        found["k"] = Estimate(hold_k, 0.0, 0.0, 0.0, hold_k, hold_k)
    law = problem.predict(free, best.parameters)
    loads = [run.delta[rows] / run.dR for run, rows in zip(problem.runs, problem.chosen, strict=True)]
    residuals = tuple(
        Residual(run.name, *arrays)
        for run, *arrays in zip(problem.runs, loads, problem.dimensionless(data), law, strict=True)
    )
    orders = tuple((g.run.name, g.order(y)) for g, y in zip(groups, curves, strict=True) if g.coarser)
    k, c = found.get("k"), found.get("c")
    return CurveFit(quantity, k, c, best.r2, best.dof, residuals, refined, None, orders, hold_k is not None)


@dataclass(frozen=True)
class _Problem:
    """A curve of some runs at their chosen steps, and the law's fit to it with some parameters free.

    ``held`` is k where it is not free.
    """

    quantity: str
    runs: list[RunCurve]
    chosen: list[npt.NDArray[np.bool_]]
    held: float | None = None

    def dimensionless(self, data: list[Array]) -> list[Array]:
        """The chosen steps of each run's ``data``, over the run's scale."""
        parts = zip(self.runs, self.chosen, data, strict=True)
        return [y[rows] / _scale(self.quantity, run) for run, rows, y in parts]

    def predict(self, free: tuple[str, ...], values: Array) -> list[Array]:
        """The law for each run; without ``c`` it is elastic, without ``k`` rigid up to the plateau."""
        given: dict[str, float] = dict(zip(free, map(float, values), strict=True))
        k, c = given.get("k", self.held), given.get("c")
        parts = zip(self.runs, self.chosen, strict=True)
        return [dimensionless_law(self.quantity, run, run.delta[rows], k, c) for run, rows in parts]

    def solve(self, free: tuple[str, ...], data: list[Array]) -> LeastSquares:
        """Fit the ``free`` parameters. Raises `InputError` where the steps do not determine them."""
        parts = self.dimensionless(data)
        units = self.predict(("k",), np.ones(1))
        slope = float(np.median([y[0] / unit[0] for y, unit in zip(parts, units, strict=True) if len(y)]))
        starts_of_c = _STARTS_OF_C if "c" in free else _STARTS_OF_C[:1]
        starts = [[{"k": slope, "c": c}[name] for name in free] for c in starts_of_c]
        try:
            return fit(lambda v: np.concatenate(self.predict(free, v)), starts, np.concatenate(parts))
        except ValueError as error:
            names, what = ", ".join(run.name for run in self.runs), " and ".join(free)
            raise InputError(f"{names}: {what} cannot be fitted to {self.quantity}: {error}; widen --range.") from None

    def solve_best(self, data: list[Array]) -> tuple[tuple[str, ...], LeastSquares]:
        """The parameters that the steps can tell, and their fit."""
        elastic = ("k",) if self.held is None else ()
        if any(run.sigY for run in self.runs):
            plastic = (*elastic, "c")
            best = self.solve(plastic, data)
            k, c = best.parameters if self.held is None else (self.held, best.parameters[0])
            if np.isfinite(best.standard_errors).all() and self._on_plateau(k, c) >= 2:
                return plastic, best
        return elastic, self.solve(elastic, data)

    def _on_plateau(self, k: float, c: float) -> int:
        """Number of steps past the onset of the plateau that have yielded indeed.

        A falling slope alone is no plateau: that of an elastic p0(delta) falls too.
        """
        return sum(
            int(((r.delta > joint_of(r, k, c).first_yield) & (r.peeq_max > 0))[rows].sum())
            for r, rows in zip(self.runs, self.chosen, strict=True)
            if r.sigY
        )


def dimensionless_law(quantity: str, run: RunCurve, delta: Array, k: float | None, c: float | None) -> Array:
    """``P/(E* dR)`` or ``p0 R/(E* dR)`` of ``run``'s joint ``(n,)``; elastic if ``c`` or its yield stress is None.

    Without ``k`` p0 is at the plateau everywhere.
    """
    if k is None:
        return np.full(delta.shape, (c or np.nan) * (run.sigY or np.nan)) / _scale(quantity, run)
    law = plastic_force if quantity == "P" else plastic_peak
    return law(joint_of(run, k, c), delta) / _scale(quantity, run)


def joint_of(run: RunCurve, k: float, c: float | None = None) -> LawJoint:
    """The joint of ``run`` with these coefficients; elastic without ``c``."""
    return LawJoint(run.R, run.dR, run.E_star, run.sigY if c else None, k=k, c=c or 1.0)


def selected(run: RunCurve, load_range: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Which steps ``(n,)`` of ``run`` lie in the range of ``delta/dR``, ends included. Raises `InputError` if none."""
    load, slack = run.delta / run.dR, 1e-9
    chosen = (load >= load_range[0] * (1 - slack)) & (load <= load_range[1] * (1 + slack))
    chosen &= (run.P > 0) & (run.p0 > 0)
    if not chosen.any():
        raise InputError(
            f"{run.name}: has no step with contact from {load_range[0]:g} to {load_range[1]:g} clearances; "
            f"its {len(load)} steps are from {load.min():g} to {load.max():g}."
        )
    return chosen


def _scale(quantity: str, run: RunCurve) -> float:
    """What makes a quantity dimensionless."""
    return {"P": run.E_star * run.dR, "p0": run.E_star * run.dR / run.R}[quantity]
