"""Calibration of the plastic-Winkler law on runs, each alone and all together: fits to P and p0, and the plateau of the
contact pressure, which is measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from archord.postprocess.arc import plateau_pressure
from archord.postprocess.convergence import Refined, group
from archord.postprocess.curve import RunCurve
from archord.postprocess.laws.curve_fit import CurveFit, Residual, fit, fit_curve, joint_of, selected
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.joint import LawJoint
from archord.scene.errors import InputError

_LIKE = 0.01  # share of P by which the blocks of runs of one fit may change it


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
    hold_k: float | None = None

    def law(self, run: RunCurve | None = None) -> FittedLaw:
        """The law for the joint of ``run`` (by default the first), with k and c from P(delta) of all scenes."""
        run = run or self.joint.runs[0]
        k, c = self.joint.P.k, self.joint.P.c
        if k is None:
            raise InputError(f"{run.name}: P(delta) does not determine k; widen --range.")
        if run.sigY is None:
            c = None
        loads = np.concatenate([r.load for r in self.joint.P.residuals])
        return FittedLaw(
            k=k.value,
            E_star=run.E_star,
            R=run.R,
            dR=run.dR,
            k_error=k.error,
            c=c.value if c else None,
            sigY=run.sigY if c else None,
            c_error=c.error if c else None,
            fitted_range=(float(loads.min()), float(loads.max())),
            plane=run.plane,
            length_unit=run.scene.units.length,
            force_unit=run.scene.units.force,
            fitted_to=tuple(r.name for r in self.joint.runs),
        )


def calibrate(
    runs: list[RunCurve],
    load_range: tuple[float, float] = (0.0, np.inf),
    confidence: float = 0.95,
    hold_k: float | None = None,
) -> Calibration:
    """Fit the law to each of ``runs`` and to all scenes together, over ``load_range`` of ``delta/dR``.

    Runs of one scene on several meshes give the error of the mesh; the finest of them enters the joint fit. With
    ``hold_k`` only c is fitted. Raises `InputError` where the range, the steps or the runs do not allow a fit.
    """
    low, high = load_range
    if not 0 <= low < high:
        raise InputError(f"--range {low:g} {high:g}: must be two displacements in clearances, 0 or more and rising.")
    if not 0.5 <= confidence < 1:
        raise InputError(f"--confidence {confidence:g}: must be at least 0.5 and below 1.")
    if hold_k is not None and not 0 < hold_k < np.inf:
        raise InputError(f"--hold-k {hold_k:g}: must be a number greater than 0.")
    check_compatible(runs)
    groups = group(runs)
    of = {id(r): g for g in groups for r in (g.run, *g.coarser)}
    each = []
    for run in runs:
        g = of[id(run)]
        alone = g if g.run is run else Refined(run)
        each.append(_fits([alone], load_range, confidence, hold_k, None if g.run is run else g.run.name))
    one = [f for f in each if f.finer is None]
    together = _fits(groups, load_range, confidence, hold_k) if len(groups) > 1 else one[0]
    if hold_k is not None and together.P.c is None:
        raise InputError(f"--hold-k {hold_k:g}: leaves nothing to fit: no two steps of the range are past yield.")
    return Calibration(tuple(each), together, load_range, confidence, hold_k)


def check_compatible(runs: list[RunCurve]) -> None:
    """Raise `InputError` for runs that have no such law, or none in common."""
    if not runs:
        raise InputError("no run to fit.")
    first = runs[0]
    for run in runs:
        if run.scene.joint.model != "block":
            model = run.scene.joint.model
            raise InputError(f'{run.name}: joint.model = "{model}" has no law to fit; only "block" has.')
        for body, solid in (("pin", run.scene.pin), ("block", run.scene.block)):
            if solid.hardening > 0:
                raise InputError(f"{run.name}: {body}.hardening = {solid.hardening:g} does not fit: the law is for "
                                 "perfect plasticity, hardening = 0.")  # fmt: skip
        own, other = (LawJoint.from_scene(each.scene) for each in (run, first))
        if own.plane != other.plane:
            raise InputError(f"{run.name}: analysis.plane = {run.plane!r} does not fit: {first.name} is in plane "
                             f"{first.plane}; fit the planes separately.")  # fmt: skip
        ours, theirs = ((joint.dundurs_alpha, joint.nu or 0.0, joint.pin_nu or 0.0) for joint in (own, other))
        if not np.allclose(ours, theirs, rtol=1e-6, atol=1e-9):
            raise InputError(f"{run.name}: the Poisson's ratios or the ratio of the moduli are not those of "
                             f"{first.name}; one k is for one pair of materials, fit them separately.")  # fmt: skip
        softer = abs(own.softer[0] - other.softer[0])
        if softer > _LIKE:
            raise InputError(f"{run.name}: joint.block_size is {run.scene.joint.W / run.R:.4g} R and that of "
                             f"{first.name} {first.scene.joint.W / first.R:.4g} R, by which their P differs by about "
                             f"{softer:.1%}; fit them separately.")  # fmt: skip


def _fits(
    groups: list[Refined],
    load_range: tuple[float, float],
    confidence: float,
    hold_k: float | None,
    finer: str | None = None,
) -> Fits:
    force, peak = (fit_curve(curve, groups, load_range, confidence, hold_k) for curve in ("P", "p0"))
    plateau = fit_plateau(force, groups, load_range, confidence)
    return Fits(tuple(g.run for g in groups), force, peak, plateau, finer)


def fit_plateau(
    force: CurveFit, groups: list[Refined], load_range: tuple[float, float], confidence: float
) -> CurveFit | None:
    """Mean of (median pressure)/sigY over the steps whose plateau, by the fit to P, covers half of the chord.

    That is where ``s = sqrt(1 - delta0/delta) > 1/2``, ``delta > 4/3 delta0``. None with fewer than two such steps.
    """
    if force.k is None or force.c is None:
        return None
    residuals, shifted, flat, orders = [], [], [], []
    for g in groups:
        run = g.run
        if run.sigY is None or run.folder is None:
            continue
        wide = run.delta > 4 / 3 * joint_of(run, force.k.value, force.c.value).first_yield
        rows = selected(run, load_range) & wide
        if not rows.any():
            continue
        median, flatness = plateau_pressure(run)
        values = median[rows] / run.sigY
        shift: np.ndarray = np.zeros(len(values))
        if g.coarser:
            curves = [median, *(plateau_pressure(coarse)[0] for coarse in g.coarser)]
            shift = g.shift(curves)[rows] / run.sigY
            orders.append((run.name, g.order(curves)))
        residuals.append(Residual(run.name, run.delta[rows] / run.dR, values, values))
        shifted.append(values + shift)
        flat.append(flatness[rows])
    if sum(len(r.data) for r in residuals) < 2:
        return None
    data = np.concatenate([r.data for r in residuals])
    mean = fit(lambda v: np.full(len(data), v[0]), [[float(data.mean())]], data)
    error = abs(float(np.concatenate(shifted).mean() - data.mean())) if orders else None
    residuals = [Residual(r.name, r.load, r.data, np.full(len(r.data), mean.parameters[0])) for r in residuals]
    flats = np.concatenate(flat)
    c, limits = mean.estimate(0, confidence, error), (float(flats.min()), float(flats.max()))
    return CurveFit("plateau", None, c, mean.r2, mean.dof, tuple(residuals), len(orders), limits, tuple(orders))
