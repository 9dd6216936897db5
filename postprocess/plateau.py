"""The plateau of the contact pressure of a yielding joint."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.postprocess.arc_pressure import ArcPressure, read_arcs
from archord.postprocess.convergence import Refined
from archord.postprocess.laws.curve_fit import CurveFit, Residual, selected
from archord.postprocess.laws.least_squares import fit
from archord.postprocess.run_curve import RunCurve


def median_pressure(arc: ArcPressure) -> float:
    """The pressure exceeded on half of the contact: median of the facets' means, by their width across the load.

    Of a pressure that is cut off over more than half of that width it is the plateau itself, wherever the edge lies;
    of the parabola ``p0 (1 - x^2/l^2)`` it is ``3/4 p0``. 0 without contact.
    """
    width = arc.weight.sum(axis=1)
    mean = (arc.weight * arc.pressure).sum(axis=1) / width
    across = (arc.weight * np.cos(arc.angle)).sum(axis=1)
    pressed = mean > 0
    if not pressed.any():
        return 0.0
    order = np.argsort(mean[pressed])
    p, share = mean[pressed][order], across[pressed][order]
    middle = np.cumsum(share) - share / 2
    return float(np.interp(share.sum() / 2, middle, p))


def peak_facet_pressure(arc: ArcPressure) -> float:
    """Largest mean pressure of a facet."""
    return float(((arc.weight * arc.pressure).sum(axis=1) / arc.weight.sum(axis=1)).max())


def plateau_pressure(run: RunCurve) -> tuple[Array, Array]:
    """Median pressure and its ratio to the largest (1: flat; parabola: 3/4), each ``(n steps,)``, mean of the sides.

    Raises `InputError` if contact.h5 cannot be read.
    """
    rows = []
    for step in range(1, len(run.delta) + 1):
        arcs = list(read_arcs(run, step).values())
        rows.append([np.mean([f(arc) for arc in arcs]) for f in (median_pressure, peak_facet_pressure)])
    median, peak = np.array(rows).T
    return median, median / np.where(peak > 0, peak, 1.0)


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
        wide = run.delta > 4 / 3 * run.joint(force.k.value, force.c.value).first_yield
        rows = selected(run, load_range) & wide
        if not rows.any():
            continue
        median, flatness = plateau_pressure(run)
        values = median[rows] / run.sigY
        shift = np.zeros(len(values))
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
