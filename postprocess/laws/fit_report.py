"""A calibration for people and programs: tables, notes, a picture, and JSON."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.output.user_file import writing
from archord.postprocess.laws.calibration import Calibration, Fits
from archord.postprocess.laws.curve_fit import CurveFit, dimensionless_law
from archord.report.figure import new_figure, save
from archord.report.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BENT = 0.5  # serial correlation that noise in ten steps or more hardly ever reaches
_LABELS = {"P": "P/(E* dR)", "p0": "p0 R/(E* dR)", "plateau": "median p/sigY"}


def summary_table(calibration: Calibration) -> Table:
    """One row per fitted parameter: value, errors, interval, quality of the fit."""
    interval = f"{100 * calibration.confidence:g} % interval"
    table = Table(
        "run", "fit to", "of", "value", "s.e.", "mesh", interval, "R2", "rms", "largest", "steps", left=3
    )  # fmt: skip
    named = [(fits.runs[0].name, fits) for fits in calibration.each]
    if len(calibration.joint.runs) > 1:
        named.append(("all together", calibration.joint))
    for name, fits in named:
        for fit in fits.curves:
            r2 = "" if fit.k is None else f"{fit.r2:.5f}"
            steps = sum(len(part.load) for part in fit.residuals)
            quality = [r2, f"{100 * fit.rms:.2f} %", f"{100 * fit.largest:+.2f} %", str(steps)]
            for parameter, found in (("k", fit.k), ("c", fit.c)):
                if found is None:
                    continue
                mesh = "unknown" if found.discretisation_error is None else f"{found.discretisation_error:.1e}"
                errors = [f"{found.standard_error:.1e}", mesh, f"{found.low:.4f} .. {found.high:.4f}"]
                if parameter == "k" and fit.k_held:
                    errors = ["held", "", ""]
                table.add(name, fit.quantity, parameter, f"{found.value:.5f}", *errors, *quality)
                name, quality = "", ["", "", "", ""]
    return table


def residual_table(fit: CurveFit) -> Table:
    """One row per step: run, ``delta/dR``, the dimensionless data, the law, and ``law/data - 1``."""
    table = Table("run", "delta/dR", _LABELS[fit.quantity], "law", "law/run - 1", left=1)
    for part in fit.residuals:
        for *numbers, relative in zip(part.load, part.data, part.law, part.relative, strict=True):
            table.add(part.name, *(f"{value:.6g}" for value in numbers), f"{100 * relative:+.2f} %")
    return table


def notes(calibration: Calibration) -> list[str]:
    """What the reader of the table must know about this calibration, one sentence each."""
    said = []
    joint = calibration.joint
    scenes, refined = len(joint.runs), joint.P.refined
    if refined == 0:
        said.append("mesh: the discretisation error is unknown, no scene was given on a second mesh.")
    elif refined < scenes:
        said.append(f"mesh: {refined} of {scenes} scenes were given on a second mesh; the joint fit counts no other.")
    orders: dict[str, dict[str, list[str]]] = {}  # the curves by run and order in words
    for fit in joint.curves if refined else ():
        for name, order in fit.orders:
            orders.setdefault(name, {}).setdefault(order.words, []).append(fit.quantity)
    for name, found in orders.items():
        words = ", ".join(f"{' and '.join(curves)} {order}" for order, curves in found.items())
        said.append(f"mesh: order of convergence of {name}: {words}.")
    if calibration.hold_k is not None:
        said.append(f"k: held at {calibration.hold_k:g}, not fitted; the errors of c do not count an error of k.")
    for fits in calibration.each:
        if fits.finer:
            said.append(f"mesh: {fits.runs[0].name} serves to estimate the discretisation error of {fits.finer}.")
    bent = [f"{f.quantity} {f.serial_correlation:.2f}" for f in joint.curves if f.serial_correlation > _BENT]
    if bent:
        said.append(
            f"s.e.: residuals of neighbouring steps are correlated ({', '.join(bent)}): the law's shape differs from "
            "the runs', and errors and intervals, which take residuals as independent, are too small."
        )
    if any(r.sigY for r in joint.runs):
        if joint.P.c is None:
            said.append("c: too few steps past yield in the range; elastic law.")
        elif joint.plateau and joint.plateau.flatness:
            low, high = joint.plateau.flatness
            levels = [v for part in joint.plateau.residuals for v in part.data]
            said.append(
                f"plateau: p/sigY from {min(levels):.3f} to {max(levels):.3f} over its steps; "
                f"median over peak {low:.2f} to {high:.2f} (flat: 1, parabola: 0.75)."
            )
    return said


JSON_BEGINS = '{\n  "law": {\n    "k": '  # by which a file of `as_json` is known


def as_json(calibration: Calibration) -> str:
    """Everything as JSON: the law (see `FittedLaw.from_json`), its variant per run, fits, residuals, notes."""
    low, high = calibration.load_range
    data: dict[str, Any] = {
        "law": asdict(calibration.law()),
        "laws": [asdict(calibration.law(run)) for run in calibration.joint.runs],
        "range": [low, high if math.isfinite(high) else None],
        "confidence": calibration.confidence,
        "hold_k": calibration.hold_k,
        "each": [_fits(fits) for fits in calibration.each],
        "joint": _fits(calibration.joint),
        "notes": notes(calibration),
    }
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _fits(fits: Fits) -> dict[str, Any]:
    curves = {fit.quantity: _curve(fit) for fit in fits.curves}
    return {"runs": [run.name for run in fits.runs], "finer": fits.finer, **curves}


def _curve(fit: CurveFit) -> dict[str, Any]:
    return {
        "k": fit.k and asdict(fit.k),
        "c": fit.c and asdict(fit.c),
        "r2": fit.r2 if math.isfinite(fit.r2) else None,
        "degrees_of_freedom": fit.dof,
        "k_held": fit.k_held,
        "scenes_with_second_mesh": fit.refined,
        "orders": {name: asdict(order) for name, order in fit.orders},
        "flatness": fit.flatness,
        "rms_residual": fit.rms,
        "largest_residual": fit.largest,
        "serial_correlation": fit.serial_correlation,
        "residuals": [
            {"run": part.name, "delta/dR": part.load.tolist(), "data": part.data.tolist(), "law": part.law.tolist(),
             "relative": part.relative.tolist()} for part in fit.residuals
        ],
    }  # fmt: skip


def draw_fit(calibration: Calibration, target: str | Path) -> Path:
    """Draw P(delta) and p0(delta) of the fit to all scenes, and its residuals, as ``target``; returns the file. Raises
    ValueError for an unknown format."""
    target, figure, fits = Path(target), new_figure(13, 4.2), calibration.joint
    axes = figure.subplots(1, 3)
    _draw_curve(axes[0], fits, fits.P, "P / (E* ΔR)", "force")
    _draw_curve(axes[1], fits, fits.p0, "p0 R / (E* ΔR)", "peak pressure")
    for fit, style in ((fits.P, "o-"), (fits.p0, "s--")):
        for i, part in enumerate(fit.residuals):
            label = f"{fit.quantity}: {part.name}"
            axes[2].plot(part.load, 100 * part.relative, style, ms=3, lw=1, color=f"C{i}", label=label)
    axes[2].axhline(0, color="black", lw=0.8)
    axes[2].set(ylabel="law / run - 1 [%]", title="residuals")
    for axis in axes:
        axis.set(xlabel="δ / ΔR", xlim=(0, None))
        axis.legend(frameon=False, fontsize="small")
        axis.grid(alpha=0.3)
    with writing(target):
        return save(figure, target)


def _draw_curve(axis: Axes, fits: Fits, fit: CurveFit, label: str, what: str) -> None:
    for i, (run, part) in enumerate(zip(fits.runs, fit.residuals, strict=True)):
        axis.plot(part.load, part.data, "o", ms=4, mfc="none", color=f"C{i}", label=part.name)
        if fit.k:
            load, c = np.linspace(0, part.load.max(), 400), fit.c.value if fit.c else None
            law = dimensionless_law(fit.quantity, run, load * run.dR, fit.k.value, c)
            axis.plot(load, law, "-", lw=1.4, color=f"C{i}")
    found = [f"{name} = {value.value:.3f} ± {value.error:.3f}" for name, value in (("k", fit.k), ("c", fit.c)) if value]
    axis.set(ylabel=label, ylim=(0, None))
    axis.set_title(f"{what}: {', '.join(found)}", fontsize="medium")
