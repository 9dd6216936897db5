"""Calibration of the plastic-Winkler law on runs: k and c from P(delta), from p0(delta), and c from the plateau.

Every curve is fitted in the form that depends on ``delta/dR`` alone where the joint is elastic, ``P/(E* dR)`` and ``p0
R/(E* dR)``, so runs of different clearance weigh alike and units do not matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from archord.geometry.basis import Array
from archord.postprocess.fitted_law import FittedLaw
from archord.postprocess.least_squares import Estimate, LeastSquares, fit
from archord.postprocess.plateau import plateau_pressure
from archord.postprocess.refinement import Refined, group
from archord.postprocess.run_curve import RunCurve
from archord.postprocess.winkler import elastic_force, onset, peak_pressure, plastic_force, plastic_peak_pressure
from archord.solver.scene import SceneError

_STARTS_OF_C = (0.7, 1.0, 1.5, 2.5)  # p0 has a kink at the onset: one start may miss the best side of it


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
    """A fit to one curve of one or more runs; ``k`` or ``c`` is None where the curve does not determine it."""

    quantity: str
    k: Estimate | None
    c: Estimate | None
    r2: float
    dof: int
    residuals: tuple[Residual, ...]
    refined: int  # of the scenes, how many have a second mesh
    flatness: tuple[float, float] | None = None  # plateau only: smallest and largest median over peak pressure

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


@dataclass(frozen=True)
class Fits:
    """All fits to one run, or to several together; ``plateau`` is None where nothing has yielded far enough."""

    runs: tuple[RunCurve, ...]
    P: CurveFit
    p0: CurveFit
    plateau: CurveFit | None
    finer: str | None = None  # name of the run of the same scene that the joint fit takes instead

    @property
    def curves(self) -> list[CurveFit]:
        """P, p0 and, if there is one, the plateau."""
        return [self.P, self.p0, *([self.plateau] if self.plateau else [])]


@dataclass(frozen=True)
class Calibration:
    """Fits to each run, and the one to all scenes together, each on its finest mesh."""

    each: tuple[Fits, ...]
    joint: Fits
    load_range: tuple[float, float]
    confidence: float

    def law(self, run: RunCurve | None = None) -> FittedLaw:
        """The law for the joint of ``run`` (by default the first), with k and c from P(delta) of all scenes."""
        run = run or self.joint.runs[0]
        k, c = self.joint.P.k, self.joint.P.c
        if k is None:
            raise SceneError(f"{run.name}: P(delta) does not determine k; widen --range.")
        plastic = c is not None and run.sigY is not None
        loads = np.concatenate([r.load for r in self.joint.P.residuals])
        return FittedLaw(
            k=k.value,
            E_star=run.E_star,
            R=run.R,
            dR=run.dR,
            k_error=k.error,
            c=c.value if c and plastic else None,
            sigY=run.sigY if plastic else None,
            c_error=c.error if c and plastic else None,
            fitted_range=(float(loads.min()), float(loads.max())),
            plane=run.plane,
            length_unit=run.scene.units.length,
            force_unit=run.scene.units.force,
            fitted_to=tuple(r.name for r in self.joint.runs),
        )


def calibrate(
    runs: list[RunCurve], load_range: tuple[float, float] = (0.0, np.inf), confidence: float = 0.95
) -> Calibration:
    """Fit the law to each of ``runs`` and to all scenes together, over ``load_range`` of ``delta/dR``.

    Runs of one scene on several meshes give the error of the mesh; the finest of them enters the joint fit. Raises
    `SceneError` where the range, the steps or the runs do not allow a fit.
    """
    low, high = load_range
    if not 0 <= low < high:
        raise SceneError(f"--range {low:g} {high:g}: must be two displacements in clearances, 0 or more and rising.")
    if not 0.5 <= confidence < 1:
        raise SceneError(f"--confidence {confidence:g}: must be at least 0.5 and below 1.")
    _check_compatible(runs)
    groups = group(runs)
    of = {id(r): g for g in groups for r in (g.run, *g.coarser)}
    each = []
    for run in runs:
        g = of[id(run)]
        alone = g if g.run is run else Refined(run)
        each.append(_fits([alone], load_range, confidence, None if g.run is run else g.run.name))
    together = [_fits(groups, load_range, confidence)] if len(groups) > 1 else [f for f in each if f.finer is None]
    return Calibration(tuple(each), together[0], load_range, confidence)


def _check_compatible(runs: list[RunCurve]) -> None:
    if not runs:
        raise SceneError("no run to fit.")
    first = runs[0]
    for run in runs:
        for body, solid in (("pin", run.scene.pin), ("block", run.scene.block)):
            if solid.hardening > 0:
                raise SceneError(f"{run.name}: {body}.hardening = {solid.hardening:g} does not fit: the law is for "
                                 "perfect plasticity, hardening = 0.")  # fmt: skip
        if run.plane != first.plane:
            raise SceneError(f"{run.name}: analysis.plane = {run.plane!r} does not fit: {first.name} is in plane "
                             f"{first.plane}; fit the planes separately.")  # fmt: skip
        if not np.allclose(_elastic_pair(run), _elastic_pair(first), rtol=1e-6, atol=1e-9):
            raise SceneError(f"{run.name}: the Poisson's ratios or the ratio of the moduli are not those of "
                             f"{first.name}; one k is for one pair of materials, fit them separately.")  # fmt: skip


def _elastic_pair(run: RunCurve) -> tuple[float, float, float]:
    """Poisson's ratios, and the pin's share of the compliance (0: rigid)."""
    pin, block = run.scene.pin, run.scene.block
    return (0.0, block.nu, 0.0) if pin.E is None else (pin.nu or 0.0, block.nu, 1 / (1 + pin.E / block.E))


def _fits(groups: list[Refined], load_range: tuple[float, float], confidence: float, finer: str | None = None) -> Fits:
    force = fit_curve("P", groups, load_range, confidence)
    peak = fit_curve("p0", groups, load_range, confidence)
    plateau = _fit_plateau(force, groups, load_range, confidence)
    return Fits(tuple(g.run for g in groups), force, peak, plateau, finer)


def _scale(quantity: str, run: RunCurve) -> float:
    """What makes a quantity dimensionless."""
    return {"P": run.E_star * run.dR, "p0": run.E_star * run.dR / run.R}.get(quantity) or run.sigY or 1.0


def dimensionless_law(quantity: str, run: RunCurve, delta: Array, k: float, c: float | None) -> Array:
    """``P/(E* dR)`` or ``p0 R/(E* dR)`` of ``run``'s joint ``(n,)``; elastic if ``c`` or its yield stress is None."""
    if quantity == "P":
        elastic = elastic_force(delta, k, run.E_star, run.R, run.dR)
        plastic = plastic_force(delta, k, c, run.E_star, run.R, run.dR, run.sigY) if c and run.sigY else elastic
    else:
        elastic = peak_pressure(delta, k, run.E_star, run.R)
        plastic = plastic_peak_pressure(delta, k, c, run.E_star, run.R, run.sigY) if c and run.sigY else elastic
    return plastic / _scale(quantity, run)


def _selected(run: RunCurve, load_range: tuple[float, float]) -> Array:
    load, slack = run.delta / run.dR, 1e-9
    chosen = (load >= load_range[0] * (1 - slack)) & (load <= load_range[1] * (1 + slack))
    chosen &= (run.P > 0) & (run.p0 > 0)
    if not chosen.any():
        raise SceneError(
            f"{run.name}: has no step with contact from {load_range[0]:g} to {load_range[1]:g} clearances; "
            f"its {len(load)} steps are from {load.min():g} to {load.max():g}."
        )
    return chosen


def fit_curve(
    quantity: str, groups: list[Refined], load_range: tuple[float, float] = (0.0, np.inf), confidence: float = 0.95
) -> CurveFit:
    """Fit ``k``, and ``c`` where two steps or more lie on the plateau, to the curve "P" or "p0" of all ``groups``.

    Where some scenes have a second mesh, the fit is repeated with their data extrapolated to vanishing element size;
    the change of a parameter is its discretisation error. Raises `SceneError` where too few steps are in the range.
    """
    runs = [g.run for g in groups]
    chosen = [_selected(run, load_range) for run in runs]
    deltas = [run.delta[rows] for run, rows in zip(runs, chosen, strict=True)]
    data = [getattr(run, quantity)[rows] / _scale(quantity, run) for run, rows in zip(runs, chosen, strict=True)]
    shifted = []
    for g, rows, values in zip(groups, chosen, data, strict=True):
        if g.coarser:
            shift = g.shift(getattr(g.run, quantity), getattr(g.coarser[0], quantity))
            values = values + shift[rows] / _scale(quantity, g.run)
        shifted.append(values)

    def predict(v: Array) -> Array:
        c = v[1] if len(v) > 1 else None
        return np.concatenate([dimensionless_law(quantity, r, d, v[0], c) for r, d in zip(runs, deltas, strict=True)])

    def solve(values: list[Array], parameters: int) -> LeastSquares:
        k = float(np.median([v[0] / dimensionless_law(quantity, r, d[:1], 1.0, None)[0]
                             for r, d, v in zip(runs, deltas, values, strict=True)]))  # fmt: skip
        starts = [[k]] if parameters == 1 else [[k, c] for c in _STARTS_OF_C]
        try:
            return fit(predict, starts, np.concatenate(values))
        except ValueError as error:
            names = ", ".join(run.name for run in runs)
            what = "k" if parameters == 1 else "k and c"
            raise SceneError(f"{names}: {what} cannot be fitted to {quantity}: {error}; widen --range.") from None

    plastic = solve(data, 2) if any(run.sigY for run in runs) else None
    if plastic and np.isfinite(plastic.standard_errors[1]) and _on_plateau(runs, chosen, *plastic.parameters) >= 2:
        best = plastic
    else:
        best = solve(data, 1)
    m = len(best.parameters)
    refined = sum(bool(g.coarser) for g in groups)
    mesh: list[float | None] = [None] * m
    if refined:
        mesh = [float(e) for e in np.abs(solve(shifted, m).parameters - best.parameters)]
    estimates = [
        best.estimate(i, confidence, mesh[i]) if np.isfinite(best.standard_errors[i]) else None for i in range(m)
    ]
    law = np.split(predict(best.parameters), np.cumsum([len(d) for d in deltas])[:-1])
    residuals = tuple(Residual(r.name, d / r.dR, v, p) for r, d, v, p in zip(runs, deltas, data, law, strict=True))
    return CurveFit(quantity, estimates[0], estimates[1] if m > 1 else None, best.r2, best.dof, residuals, refined)


def _on_plateau(runs: list[RunCurve], chosen: list[Array], k: float, c: float) -> int:
    """Number of steps past the onset of the plateau that have yielded indeed.

    A falling slope alone is no plateau: that of an elastic p0(delta) falls too.
    """
    return sum(
        int(((r.delta > onset(k, c, r.E_star, r.R, r.sigY)) & (r.peeq_max > 0))[rows].sum())
        for r, rows in zip(runs, chosen, strict=True)
        if r.sigY
    )


def _fit_plateau(
    force: CurveFit, groups: list[Refined], load_range: tuple[float, float], confidence: float
) -> CurveFit | None:
    """Mean of (median pressure)/sigY over the steps whose plateau, by the fit to P, covers half of the chord.

    That is where ``s = sqrt(1 - delta0/delta) > 1/2``, ``delta > 4/3 delta0``. None with fewer than two such steps.
    """
    if force.k is None or force.c is None:
        return None
    residuals, shifted, flat, refined = [], [], [], 0
    for g in groups:
        run = g.run
        if run.sigY is None or run.folder is None:
            continue
        wide = run.delta > 4 / 3 * onset(force.k.value, force.c.value, run.E_star, run.R, run.sigY)
        rows = _selected(run, load_range) & wide
        if not rows.any():
            continue
        median, flatness = plateau_pressure(run)
        values = median[rows] / run.sigY
        shift = np.zeros(len(values))
        if g.coarser:
            shift = g.shift(median, plateau_pressure(g.coarser[0])[0])[rows] / run.sigY
            refined += 1
        residuals.append(Residual(run.name, run.delta[rows] / run.dR, values, values))
        shifted.append(values + shift)
        flat.append(flatness[rows])
    if sum(len(r.data) for r in residuals) < 2:
        return None
    data = np.concatenate([r.data for r in residuals])
    mean = fit(lambda v: np.full(len(data), v[0]), [[float(data.mean())]], data)
    error = abs(float(np.concatenate(shifted).mean() - data.mean())) if refined else None
    residuals = [Residual(r.name, r.load, r.data, np.full(len(r.data), mean.parameters[0])) for r in residuals]
    flats = np.concatenate(flat)
    c, limits = mean.estimate(0, confidence, error), (float(flats.min()), float(flats.max()))
    return CurveFit("plateau", None, c, mean.r2, mean.dof, tuple(residuals), refined, limits)
