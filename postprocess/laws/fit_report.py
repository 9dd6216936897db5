"""A calibration as tables for people and as JSON for programs."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Any

from rich.table import Table

from archord.postprocess.laws.calibration import Calibration, Fits
from archord.postprocess.laws.curve_fit import CurveFit
from archord.postprocess.laws.least_squares import Estimate

_BENT = 0.5  # serial correlation that noise in ten steps or more hardly ever reaches


def summary_table(calibration: Calibration) -> Table:
    """One row per fitted parameter: value, errors, interval, quality of the fit."""
    percent = f"{100 * calibration.confidence:g} %"
    table = Table(box=None, pad_edge=False, header_style="")
    for heading in (
        "run",
        "fit to",
        "of",
        "value",
        "s.e.",
        "mesh",
        f"{percent} interval",
        "R2",
        "rms",
        "largest",
        "steps",
    ):
        table.add_column(heading, justify="left" if heading in ("run", "fit to", "of") else "right", no_wrap=True)
    for fits in calibration.each:
        _add_rows(table, fits, fits.runs[0].name)
    if len(calibration.joint.runs) > 1:
        _add_rows(table, calibration.joint, "all together")
    return table


def residual_table(fit: CurveFit) -> Table:
    """One row per step: run, ``delta/dR``, the dimensionless data, the law, and ``law/data - 1``."""
    label = {"P": "P/(E* dR)", "p0": "p0 R/(E* dR)", "plateau": "median p/sigY"}[fit.quantity]
    table = Table(box=None, pad_edge=False, header_style="")
    table.add_column("run")
    for heading in ("delta/dR", label, "law", "law/run - 1"):
        table.add_column(heading, justify="right", no_wrap=True)
    for part in fit.residuals:
        for load, data, law, relative in zip(part.load, part.data, part.law, part.relative, strict=True):
            table.add_row(part.name, f"{load:.6g}", f"{data:.6g}", f"{law:.6g}", f"{100 * relative:+.2f} %")
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
    if refined:
        said += [f"mesh: order of convergence of {name}: {words}." for name, words in _orders(joint).items()]
    if calibration.hold_k is not None:
        said.append(f"k: held at {calibration.hold_k:g}, not fitted; the errors of c do not count an error of k.")
    for fits in calibration.each:
        if fits.finer:
            said.append(f"mesh: {fits.runs[0].name} serves to estimate the discretisation error of {fits.finer}.")
    bent = [fit for fit in joint.curves if fit.serial_correlation > _BENT]
    if bent:
        values = ", ".join(f"{fit.quantity} {fit.serial_correlation:.2f}" for fit in bent)
        said.append(
            f"s.e.: residuals of neighbouring steps are correlated ({values}): the law's shape differs from the runs', "
            "and errors and intervals, which take residuals as independent, are too small."
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


def _orders(fits: Fits) -> dict[str, str]:
    """By run, the orders taken for its curves, in words."""
    found: dict[str, dict[str, list[str]]] = {}
    for fit in fits.curves:
        for name, order in fit.orders:
            found.setdefault(name, {}).setdefault(order.words, []).append(fit.quantity)
    return {
        name: ", ".join(f"{' and '.join(curves)} {words}" for words, curves in orders.items())
        for name, orders in found.items()
    }


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
    return {
        "runs": [run.name for run in fits.runs],
        "finer": fits.finer,
        **{fit.quantity: _curve(fit) for fit in fits.curves},
    }


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
            {
                "run": part.name,
                "delta/dR": part.load.tolist(),
                "data": part.data.tolist(),
                "law": part.law.tolist(),
                "relative": part.relative.tolist(),
            }
            for part in fit.residuals
        ],
    }


def _add_rows(table: Table, fits: Fits, name: str) -> None:
    for fit in fits.curves:
        shown = [(parameter, estimate) for parameter, estimate in (("k", fit.k), ("c", fit.c)) if estimate]
        for i, (parameter, estimate) in enumerate(shown):
            quality = ["", "", "", ""]
            if i == 0:
                steps = sum(len(part.load) for part in fit.residuals)
                r2 = "" if fit.k is None else f"{fit.r2:.5f}"
                quality = [r2, f"{100 * fit.rms:.2f} %", f"{100 * fit.largest:+.2f} %", str(steps)]
            numbers = _numbers(estimate)
            if parameter == "k" and fit.k_held:
                numbers = [numbers[0], "held", "", ""]
            table.add_row(name, fit.quantity, parameter, *numbers, *quality)
            name = ""


def _numbers(estimate: Estimate) -> list[str]:
    mesh = "unknown" if estimate.discretisation_error is None else f"{estimate.discretisation_error:.1e}"
    return [
        f"{estimate.value:.5f}",
        f"{estimate.standard_error:.1e}",
        mesh,
        f"{estimate.low:.4f} .. {estimate.high:.4f}",
    ]
