"""Calibration of the plastic-Winkler law on P(delta) of runs, each alone and all together: least
squares, and errors.

Every curve is fitted in the form that depends on ``delta/dR`` alone where the joint is elastic,
``P/(E* dR)`` and ``p0 R/(E* dR)``, so runs of different clearance weigh alike and units do not
matter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.stats import t as student

from archord.postprocess.convergence import Order, Refined, group
from archord.postprocess.curve import RunCurve
from archord.postprocess.laws.chord_laws import plastic_winkler
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.general.joint import Array, LawJoint
from archord.report.errors import InputError

POOR = 0.05  # rms of law/run - 1 from which on a fit is worth a warning
_LIKE = 0.01  # share of P by which the blocks of runs of one fit may change it
_STARTS_OF_C = (0.7, 1.0, 1.5, 2.5)  # one start may miss the best side of the onset


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter, with the standard error of least squares with ``dof`` degrees of freedom,
    and the error of the mesh (None: unknown, counted as none)."""

    value: float
    standard_error: float
    discretisation_error: float | None
    dof: int

    @property
    def error(self) -> float:
        """Both errors in quadrature."""
        return float(np.hypot(self.standard_error, self.discretisation_error or 0.0))

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % confidence interval, with Student's t."""
        half = float(student.ppf(0.975, self.dof)) * self.error
        return self.value - half, self.value + half


def fit(
    predict: Callable[[Array], Array], starts: Sequence[Sequence[float]], data: Array
) -> tuple[list[float], list[float]]:
    """Positive parameters that minimise ``sum (predict(parameters) - data)^2``, the best of several
    ``starts``, and their standard errors, infinite for one without influence.

    The covariance is ``s^2 (J^T J)^-1`` with ``s^2 = sum r^2/(n - m)`` (Seber and Wild 2003,
    section 2.1), for independent residuals. Raises ValueError where the data do not determine the
    parameters and their errors.
    """
    m = len(starts[0])
    n = len(data)
    if n <= m:
        raise ValueError(f"{n} points cannot determine {m} parameters and their errors")
    tight = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
    found = [
        least_squares(lambda v: predict(v) - data, s, bounds=(0, np.inf), x_scale="jac", **tight)
        for s in starts
    ]
    best = min(found, key=lambda solution: solution.cost)
    size = np.linalg.norm(best.jac, axis=0)
    felt = size > 0
    scaled = best.jac[:, felt] / size[felt]
    if np.linalg.cond(scaled) > 1e8:
        raise ValueError("the points do not determine the parameters")
    inverse = np.linalg.inv(scaled.T @ scaled)
    variance = best.fun @ best.fun
    errors = np.full(m, np.inf)
    errors[felt] = np.sqrt(np.diag(inverse) * variance / (n - m)) / size[felt]
    return [*map(float, best.x)], [*map(float, errors)]


@dataclass(frozen=True)
class Residual:
    """A run's part of a fit, arrays ``(n,)``: ``delta/dR``, the dimensionless data and what the law
    makes of them."""

    name: str
    load: Array
    data: Array
    law: Array


@dataclass(frozen=True)
class CurveFit:
    """A fit to a curve of one or more runs; ``c`` is None where the curve does not determine it.
    ``orders`` of convergence are those taken for the runs that have a second mesh."""

    k: Estimate
    c: Estimate | None
    residuals: tuple[Residual, ...]
    orders: tuple[tuple[str, Order], ...] = ()

    @property
    def estimates(self) -> dict[str, Estimate]:
        """k, and c if there is one, by name."""
        return {"k": self.k} | ({"c": self.c} if self.c else {})

    @property
    def quality(self) -> tuple[float, float, float, int]:
        """Of all runs one after the other, the coefficient of determination, root mean square and
        largest (with its sign) of ``law/data - 1``, and the number of steps."""
        data = np.concatenate([part.data for part in self.residuals])
        law = np.concatenate([part.law for part in self.residuals])
        off = law / data - 1
        r2 = 1 - ((law - data) ** 2).sum() / ((data - data.mean()) ** 2).sum()
        rms = np.sqrt(np.mean(off**2))
        return float(r2), float(rms), float(off[np.abs(off).argmax()]), len(off)

    @property
    def serial_correlation(self) -> float:
        """Correlation of residuals of neighbouring steps: about 0 for noise, near 1 where the law
        has another shape."""
        rows = [part.law - part.data for part in self.residuals]
        squares = sum(float(r @ r) for r in rows)
        return sum(float(r[1:] @ r[:-1]) for r in rows) / squares if squares else 0.0


def fit_curve(
    groups: list[Refined], load_range: tuple[float, float] = (0.0, np.inf), quantity: str = "P"
) -> CurveFit:
    """Fit the law to the curve "P" or "p0" of all ``groups``: ``c``, too, where two steps or more
    past the onset of the plateau have yielded indeed, as the slope of an elastic p0(delta) falls,
    too.

    Where scenes have a second mesh, the fit is repeated with data extrapolated to vanishing element
    size; the change of a parameter is its discretisation error. Raises `InputError` where the range
    has too few steps with contact.
    """
    chosen = [(g.run, _selected(g.run, load_range)) for g in groups]
    if quantity == "p0" and sum((run.peeq_max[rows] == 0).sum() for run, rows in chosen) < 2:
        raise InputError(
            f"{groups[0].run.name}: p0 says nothing of k past yield, and fewer than two steps are before."
        )
    curves = [[getattr(run, quantity) for run in g.runs] for g in groups]

    def scaled(data: Iterable[Array]) -> list[Array]:
        return [
            y[rows] / _scale(quantity, run) for y, (run, rows) in zip(data, chosen, strict=True)
        ]

    def law(values: Sequence[float] | Array) -> list[Array]:
        return [
            dimensionless_law(quantity, run, run.delta[rows], *map(float, values))
            for run, rows in chosen
        ]

    def solve(data: list[Array], free: str) -> tuple[list[float], list[float]]:
        slope = float(np.median([y[0] / unit[0] for y, unit in zip(data, law([1.0]), strict=True)]))
        starts = [[slope, c] for c in _STARTS_OF_C] if free == "kc" else [[slope]]
        try:
            return fit(lambda values: np.concatenate(law(values)), starts, np.concatenate(data))
        except ValueError as error:
            names, what = ", ".join(g.run.name for g in groups), " and ".join(free)
            raise InputError(
                f"{names}: {what} cannot be fitted to {quantity}: {error}; widen --range."
            ) from None

    data, free = scaled(y[0] for y in curves), "k"
    if any(run.sigY for run, _ in chosen):
        values, errors = solve(data, "kc")
        onsets = [_joint(run, *values).first_yield for run, _ in chosen]
        beyond = [
            rows & (run.peeq_max > 0) & (run.delta > at)
            for (run, rows), at in zip(chosen, onsets, strict=True)
        ]
        free = "kc" if np.isfinite(errors).all() and np.concatenate(beyond).sum() >= 2 else "k"
    if free == "k":
        values, errors = solve(data, free)
    mesh: list[float | None] = [None] * len(free)
    orders = tuple(
        (g.run.name, g.order(y)) for g, y in zip(groups, curves, strict=True) if g.coarser
    )
    if orders:
        finer = scaled(
            y[0] + g.shift(y) if g.coarser else y[0] for g, y in zip(groups, curves, strict=True)
        )
        mesh = [
            abs(moved - value) for moved, value in zip(solve(finer, free)[0], values, strict=True)
        ]
    parts = zip(chosen, data, law(values), strict=True)
    residuals = tuple(
        Residual(run.name, run.delta[rows] / run.dR, *both) for (run, rows), *both in parts
    )
    dof = sum(map(len, data)) - len(free)
    found = [Estimate(*numbers, dof) for numbers in zip(values, errors, mesh, strict=True)]
    return CurveFit(found[0], found[1] if free == "kc" else None, residuals, orders)


def dimensionless_law(
    quantity: str, run: RunCurve, delta: Array, k: float, c: float | None = None
) -> Array:
    """``P/(E* dR)`` or ``p0 R/(E* dR)`` of ``run``'s joint ``(n,)``; elastic if ``c`` or its yield
    stress is None."""
    state = plastic_winkler(_joint(run, k, c), delta)
    return (state.load if quantity == "P" else state.peak_pressure) / _scale(quantity, run)


def _joint(run: RunCurve, k: float, c: float | None = None) -> LawJoint:
    """The joint of ``run`` with these coefficients; elastic without ``c``."""
    return LawJoint(run.R, run.dR, run.E_star, block_yield=run.sigY if c else None, k=k, c=c or 1.0)


def _selected(run: RunCurve, load_range: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Which steps ``(n,)`` of ``run`` lie in the range of ``delta/dR``, ends included. Raises
    `InputError` if none."""
    load, slack = run.delta / run.dR, 1e-9
    touching = (run.P > 0) & (run.p0 > 0)
    if not touching.any():
        raise InputError(
            f"{run.name}: the bodies never touch in this run, so there is no law to fit to it."
        )
    low, high = load_range
    chosen = touching & (load >= low * (1 - slack)) & (load <= high * (1 + slack))
    if not chosen.any():
        raise InputError(f"{run.name}: has no step with contact from {low:g} to {high:g} clearances; its {len(load)} "
                         f"steps are from {load.min():g} to {load.max():g}.")  # fmt: skip
    return chosen


def _scale(quantity: str, run: RunCurve) -> float:
    """What makes a quantity dimensionless."""
    return run.E_star * run.dR / (1.0 if quantity == "P" else run.R)


@dataclass(frozen=True)
class Calibration:
    """Fits to P(delta) of each run, and the one to all ``scenes`` together, each on its finest
    mesh."""

    each: tuple[CurveFit, ...]
    joint: CurveFit
    scenes: tuple[Refined, ...]

    def law(self) -> FittedLaw:
        """The law for the joint of the first scene, with k and c of all scenes."""
        run, found, parts = self.scenes[0].run, self.joint.estimates, self.joint.residuals
        numbers: dict[str, Any] = {
            name: getattr(run, name) for name in ("E_star", "R", "dR", "plane")
        }
        if not run.sigY:
            found.pop("c", None)
        for name, estimate in found.items():
            numbers |= {name: estimate.value, f"{name}_error": estimate.error}
        loads, units = np.concatenate([part.load for part in parts]), run.scene.units
        numbers |= {
            "sigY": run.sigY if "c" in found else None,
            "fitted_to": tuple(part.name for part in parts),
        }
        numbers |= {"length_unit": units.length, "force_unit": units.force_of(None)}
        _, numbers["rms"], numbers["largest"], _ = self.joint.quality
        return FittedLaw(**numbers, fitted_range=(float(loads.min()), float(loads.max())))


def calibrate(runs: list[RunCurve], load_range: tuple[float, float] = (0.0, np.inf)) -> Calibration:
    """Fit the law to each of ``runs`` and to all scenes together, over ``load_range`` of
    ``delta/dR``; of runs of one scene on several meshes, which give the error of the mesh, the
    finest. Raises `InputError` where the range, the steps or the runs do not allow a fit."""
    low, high = load_range
    if not 0 <= low < high:
        raise InputError(
            f"--range {low:g} {high:g}: must be two displacements in clearances, 0 or more and rising."
        )
    check_compatible(runs)
    scenes = group(runs)
    finest = {id(scene.run): scene for scene in scenes}
    each = tuple(fit_curve([finest.get(id(run), Refined(run))], load_range) for run in runs)
    return Calibration(each, fit_curve(scenes, load_range), tuple(scenes))


def check_compatible(runs: list[RunCurve]) -> None:
    """Raise `InputError` for runs that have no such law, or none in common."""
    for run in runs:
        if not run.scene.joint.is_block:
            model = run.scene.joint.model
            raise InputError(
                f'{run.name}: joint.model = "{model}" has no law to fit; only "block" has.'
            )
        if run.scene.analysis.friction:
            raise InputError(
                f"{run.name}: analysis.friction = {run.scene.analysis.friction:g} does not fit: the law is for contact "
                "without friction; archord fit RUN --table FILE keeps the run's own P(delta)."
            )
        for body, solid in (("pin", run.scene.pin), ("block", run.scene.block)):
            if not solid.perfectly_plastic:
                said = (
                    f" = {solid.hardening:g}"
                    if isinstance(solid.hardening, float) and solid.hardening
                    else ""
                )
                key = (
                    "back_stresses"
                    if solid.back_stresses and solid.hardening == 0
                    else f"hardening{said}"
                )
                raise InputError(
                    f"{run.name}: {body}.{key} does not fit: the law is for perfect plasticity, hardening = 0; "
                    "archord fit RUN --table FILE keeps the run's own P(delta)."
                )
    first = runs[0]
    for run in runs[1:]:
        own, wanted = (LawJoint.from_scene(each.scene) for each in (run, first))
        ours, theirs = (
            (joint.pin_share, joint.nu or 0.0, joint.pin_nu or 0.0) for joint in (own, wanted)
        )
        softer, fault = abs(own.softer[0] - wanted.softer[0]), ""
        if own.plane != wanted.plane:
            fault = f"analysis.plane = {run.plane!r} does not fit: {first.name} is in plane {first.plane}"
        elif not np.allclose(ours, theirs, rtol=1e-6, atol=1e-9):
            fault = f"the Poisson's ratios or the ratio of the moduli are not those of {first.name}"
        elif own.large_strain != wanted.large_strain:
            fault = f"analysis.strain = {run.scene.analysis.strain!r} does not fit: {first.name} has the other"
        elif own.fixed_pairs != wanted.fixed_pairs:
            fault = f"analysis.kinematics = {run.scene.analysis.kinematics!r} does not fit: {first.name} has the other"
        elif own.whole != wanted.whole:
            fault = f"pin.whole = {str(own.whole).lower()} does not fit: {first.name} has the other"
        elif softer > _LIKE:
            sizes = [f"{each.scene.joint.W / each.R:.4g} R" for each in (run, first)]
            fault = (f"joint.block_size is {sizes[0]} and that of {first.name} {sizes[1]}, by which their P differs by "
                     f"about {softer:.1%}")  # fmt: skip
        if fault:
            raise InputError(
                f"{run.name}: {fault}; one law is for one kind of joint: fit them separately."
            )
    yielding = [(run.name, LawJoint.from_scene(run.scene).yielding) for run in runs]
    yielding = [(name, bodies) for name, bodies in yielding if bodies != "none"]
    for name, bodies in yielding[1:]:
        like, others = yielding[0]
        if bodies != others:
            said = f"yield stresses ({bodies}) do not fit: {like} has them otherwise ({others})"
            raise InputError(
                f"{name}: {said}; one law is for one kind of joint: fit them separately."
            )
