"""Calibration of the plastic-Winkler law on P(delta) of runs, each alone and all together: least
squares, and errors.

Every curve is fitted in the form that depends on ``delta/dR`` alone where the joint is elastic,
``P/(E* dR)`` and ``p0 R/(E* dR)``, so runs of different clearance weigh alike and units do not
matter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from archord.materials.kinematics import Bools
from archord.materials.material import Array
from archord.postprocess.curve import RunCurve, rms
from archord.postprocess.judgement.convergence import Order, Refined, group
from archord.postprocess.laws.chord_laws import plastic_winkler
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.general.joint import LawJoint
from archord.report.errors import InputError

POOR = 0.05  # rms of law/run - 1 from which on a fit is worth a warning
_LIKE = 0.01  # share of P by which the blocks of runs of one fit may change it
_SEPARATELY = "one law is for one kind of joint: fit them separately."
_OWN_TABLE = "archord fit RUN --table FILE keeps the run's own P(delta)."
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
        deviations = float(student.ppf(0.975, self.dof))
        half = deviations * self.error
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
    covariances = np.diag(inverse) * variance / (n - m)
    errors = np.full(m, np.inf)
    errors[felt] = np.sqrt(covariances) / size[felt]
    return [*map(float, best.x)], [*map(float, errors)]


@dataclass(frozen=True)
class Residual:
    """A run's part of a fit.

    - ``load`` ``(n,)``: ``delta/dR`` of the steps
    - ``data`` ``(n,)``: the run's curve, without dimension
    - ``law`` ``(n,)``: the fitted law at the same steps
    """

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
        """Coefficient of determination, root mean square and largest value (with its sign) of
        ``law/data - 1``, and number of steps, over all runs."""
        data = np.concatenate([part.data for part in self.residuals])
        law = np.concatenate([part.law for part in self.residuals])
        off = law / data - 1
        left = ((law - data) ** 2).sum()
        spread = ((data - data.mean()) ** 2).sum()
        determination = 1 - left / spread
        largest = off[np.abs(off).argmax()]
        return float(determination), rms(off), float(largest), len(off)

    @property
    def serial_correlation(self) -> float:
        """Correlation of residuals of neighbouring steps: about 0 for noise, near 1 where the law
        has another shape."""
        rows = [part.law - part.data for part in self.residuals]
        squares = sum(float(row @ row) for row in rows)
        if not squares:
            return 0.0
        of_neighbours = sum(float(row[1:] @ row[:-1]) for row in rows)
        return of_neighbours / squares


@dataclass(frozen=True)
class _Curves:
    """The curves that the law is fitted to, of the finest run of each group.

    - ``quantity``: "P" or "p0"
    - ``groups`` ``(g,)``
    - ``rows`` ``(g,)``: which steps ``(n,)`` of each count
    """

    quantity: str
    groups: list[Refined]
    rows: list[Bools]

    @property
    def runs(self) -> list[RunCurve]:
        """The finest runs ``(g,)``."""
        return [g.run for g in self.groups]

    def on_meshes(self, refined: Refined) -> list[Array]:
        """The curve of a ``refined`` run on all meshes, finest first."""
        return [getattr(run, self.quantity) for run in refined.runs]

    def data(self) -> list[Array]:
        """The curves without dimension."""
        return self._scaled([self.on_meshes(g)[0] for g in self.groups])

    def extrapolated(self) -> list[Array]:
        """The curves without dimension, on elements of vanishing size where there is a second
        mesh."""
        found: list[Array] = []
        for g in self.groups:
            curves = self.on_meshes(g)
            shift = g.shift(curves) if g.coarser else 0.0
            found.append(curves[0] + shift)
        return self._scaled(found)

    def _scaled(self, curves: list[Array]) -> list[Array]:
        parts = zip(curves, self.rows, self.runs, strict=True)
        return [curve[rows] / _scale(self.quantity, run) for curve, rows, run in parts]

    def law(self, values: Sequence[float] | Array) -> list[Array]:
        """The law with these ``values`` of k, or of k and c, at the same steps."""
        numbers = [float(value) for value in values]
        parts = zip(self.rows, self.runs, strict=True)
        return [
            dimensionless_law(self.quantity, run, run.delta[rows], *numbers) for rows, run in parts
        ]

    def solve(self, data: list[Array], free: str) -> tuple[list[float], list[float]]:
        """The values of the ``free`` parameters, "k" or "kc", that fit ``data`` best, and their
        errors. Raises `InputError` where the data do not determine them."""
        slopes = [y[0] / unit[0] for y, unit in zip(data, self.law([1.0]), strict=True)]
        slope = float(np.median(slopes))
        starts = [[slope, c] for c in _STARTS_OF_C] if free == "kc" else [[slope]]
        try:
            return fit(
                lambda values: np.concatenate(self.law(values)), starts, np.concatenate(data)
            )
        except ValueError as error:
            names = ", ".join(run.name for run in self.runs)
            said = f"{' and '.join(free)} cannot be fitted to {self.quantity}: {error}"
            raise InputError(names, f"{said}; widen --range.") from None

    def n_elastic(self) -> int:
        """The number of steps without yielding."""
        parts = zip(self.rows, self.runs, strict=True)
        return sum(int((run.peeq_max[rows] == 0).sum()) for rows, run in parts)

    def n_beyond(self, k: float, c: float) -> int:
        """The number of steps that have yielded past the onset of the plateau."""
        count = 0
        for rows, run in zip(self.rows, self.runs, strict=True):
            onset = _joint(run, k, c).first_yield
            count += int((rows & (run.peeq_max > 0) & (run.delta > onset)).sum())
        return count


def fit_curve(
    groups: list[Refined], load_range: tuple[float, float] = (0.0, np.inf), quantity: str = "P"
) -> CurveFit:
    """Fit the law to the curve "P" or "p0" of all ``groups``.

    ``c`` is fitted, too, where two steps or more past the onset of the plateau have yielded: the
    slope of an elastic p0(delta) falls as well.

    Where scenes have a second mesh, the fit is repeated with data extrapolated to vanishing element
    size; the change of a parameter is its discretisation error. Raises `InputError` where the range
    has too few steps with contact.
    """
    curves = _Curves(quantity, groups, [_selected(g.run, load_range) for g in groups])
    if quantity == "p0" and curves.n_elastic() < 2:
        raise InputError(
            groups[0].run.name,
            "p0 says nothing of k past yield, and fewer than two steps are before.",
        )
    data = curves.data()
    free = "k"
    if any(run.sigY for run in curves.runs):
        values, errors = curves.solve(data, "kc")
        if np.isfinite(errors).all() and curves.n_beyond(*values) >= 2:
            free = "kc"
    if free == "k":
        values, errors = curves.solve(data, free)
    orders = [(g.run.name, g.order(curves.on_meshes(g))) for g in groups if g.coarser]
    mesh: list[float | None] = [None] * len(free)
    if orders:
        moved, _ = curves.solve(curves.extrapolated(), free)
        mesh = [abs(new - value) for new, value in zip(moved, values, strict=True)]
    parts = zip(curves.runs, curves.rows, data, curves.law(values), strict=True)
    residuals = tuple(
        Residual(run.name, run.x[rows], measured, fitted) for run, rows, measured, fitted in parts
    )
    dof = sum(map(len, data)) - len(free)
    k, *c = (Estimate(*numbers, dof) for numbers in zip(values, errors, mesh, strict=True))
    return CurveFit(k, c[0] if c else None, residuals, tuple(orders))


def dimensionless_law(
    quantity: str, run: RunCurve, delta: Array, k: float, c: float | None = None
) -> Array:
    """``P/(E* dR)`` or ``p0 R/(E* dR)`` of ``run``'s joint ``(n,)``; elastic if ``c`` or its yield
    stress is None."""
    state = plastic_winkler(_joint(run, k, c), delta)
    values = state.load if quantity == "P" else state.peak_pressure
    return values / _scale(quantity, run)


def _joint(run: RunCurve, k: float, c: float | None = None) -> LawJoint:
    """The joint of ``run`` with these coefficients; elastic without ``c``."""
    return LawJoint(run.R, run.dR, run.E_star, block_yield=run.sigY if c else None, k=k, c=c or 1.0)


def _selected(run: RunCurve, load_range: tuple[float, float]) -> Bools:
    """Which steps ``(n,)`` of ``run`` lie in the range of ``delta/dR``, ends included. Raises
    `InputError` if none."""
    load = run.x
    slack = 1e-9
    touching = (run.P > 0) & (run.p0 > 0)
    if not touching.any():
        raise InputError(
            run.name, "the bodies never touch in this run, so there is no law to fit to it."
        )
    low, high = load_range
    above = load >= low * (1 - slack)
    below = load <= high * (1 + slack)
    chosen = touching & above & below
    if not chosen.any():
        raise InputError(
            run.name,
            f"has no step with contact from {low:g} to {high:g} clearances; its "
            f"{len(load)} steps are from {load.min():g} to {load.max():g}.",
        )
    return chosen


def _scale(quantity: str, run: RunCurve) -> float:
    """What makes a quantity dimensionless."""
    return run.unit / (1.0 if quantity == "P" else run.R)


@dataclass(frozen=True)
class Calibration:
    """Fits to P(delta) of each run, and the one to all ``scenes`` together, each on its finest
    mesh."""

    each: tuple[CurveFit, ...]
    joint: CurveFit
    scenes: tuple[Refined, ...]

    def law(self) -> FittedLaw:
        """The law for the joint of the first scene, with k and c of all scenes."""
        run = self.scenes[0].run
        found = self.joint.estimates
        parts = self.joint.residuals
        numbers = {name: getattr(run, name) for name in ("E_star", "R", "dR", "plane")}
        if not run.sigY:
            found.pop("c", None)
        for name, estimate in found.items():
            numbers |= {name: estimate.value, f"{name}_error": estimate.error}
        loads = np.concatenate([part.load for part in parts])
        units = run.scene.units
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
            f"--range {low:g} {high:g}: must be two displacements in clearances, 0 or more and "
            "rising."
        )
    check_compatible(runs)
    scenes = group(runs)
    finest = {id(scene.run): scene for scene in scenes}
    each = tuple(fit_curve([finest.get(id(run), Refined(run))], load_range) for run in runs)
    return Calibration(each, fit_curve(scenes, load_range), tuple(scenes))


def check_compatible(runs: list[RunCurve]) -> None:
    """Raise `InputError` for runs that have no such law, or none in common."""
    for run in runs:
        _check_alone(run)
    first = runs[0]
    for run in runs[1:]:
        fault = _difference(run, first)
        if fault:
            raise InputError(run.name, f"{fault}; {_SEPARATELY}")
    yielding = [(run.name, LawJoint.from_scene(run.scene).yielding) for run in runs]
    yielding = [(name, bodies) for name, bodies in yielding if bodies != "none"]
    for name, bodies in yielding[1:]:
        like, others = yielding[0]
        if bodies != others:
            said = f"yield stresses ({bodies}) do not fit: {like} has them otherwise ({others})"
            raise InputError(name, f"{said}; {_SEPARATELY}")


def _check_alone(run: RunCurve) -> None:
    """Raise `InputError` for a run whose kind of joint has no law to fit."""
    scene = run.scene
    model = scene.joint.model
    if not scene.joint.is_block:
        raise InputError(run.name, f'joint.model = "{model}" has no law to fit; only "block" has.')
    friction = scene.analysis.friction
    if friction:
        raise InputError(
            run.name,
            f"analysis.friction = {friction:g} does not fit: the law is for contact "
            f"without friction; {_OWN_TABLE}",
        )
    for body, solid in (("pin", scene.pin), ("block", scene.block)):
        if solid.perfectly_plastic:
            continue
        key = "hardening"
        if solid.back_stresses and solid.hardening == 0:
            key = "back_stresses"
        elif isinstance(solid.hardening, float) and solid.hardening:
            key = f"hardening = {solid.hardening:g}"
        raise InputError(
            run.name,
            f"{body}.{key} does not fit: the law is for perfect plasticity, "
            f"hardening = 0; {_OWN_TABLE}",
        )


def _difference(run: RunCurve, first: RunCurve) -> str:
    """Why one law cannot be for ``run`` and for the ``first`` run; empty if it can."""
    analysis = run.scene.analysis
    own = LawJoint.from_scene(run.scene)
    wanted = LawJoint.from_scene(first.scene)
    other = f"does not fit: {first.name} has the other"
    if own.plane != wanted.plane:
        return (
            f"analysis.plane = {run.plane!r} does not fit: {first.name} is in plane {first.plane}"
        )
    if not np.allclose(_elasticity(own), _elasticity(wanted), rtol=1e-6, atol=1e-9):
        return f"the Poisson's ratios or the ratio of the moduli differ from {first.name}"
    if own.large_strain != wanted.large_strain:
        return f"analysis.strain = {analysis.strain!r} {other}"
    if own.fixed_pairs != wanted.fixed_pairs:
        return f"analysis.kinematics = {analysis.kinematics!r} {other}"
    if own.whole != wanted.whole:
        return f"pin.whole = {str(own.whole).lower()} {other}"
    softer = abs(own.softer[0] - wanted.softer[0])
    if softer <= _LIKE:
        return ""
    size, first_size = (f"{each.scene.joint.W / each.R:.4g} R" for each in (run, first))
    return (
        f"joint.block_size is {size} and in {first.name} {first_size}, by which their P "
        f"differs by about {softer:.1%}"
    )


def _elasticity(joint: LawJoint) -> tuple[float, float, float]:
    """The pin's share of the compliance, and Poisson's ratios of block and pin."""
    return joint.pin_share, joint.nu or 0.0, joint.pin_nu or 0.0
