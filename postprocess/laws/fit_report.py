"""A calibration for people and programs: a table, notes, a picture, and JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from archord.output.user_file import save_figure
from archord.postprocess.laws.calibration import POOR, Calibration, dimensionless_law
from archord.report.by_name import ByName
from archord.report.figure import new_figure
from archord.report.table import Table

_BENT = 0.5  # serial correlation that noise in ten steps or more hardly ever reaches
_COLUMNS = ("run", "of", "value", "s.e.", "mesh", "95 % interval", "R2", "rms", "largest", "steps")


def parameters(calibration: Calibration) -> list[ByName]:
    """One row per fitted parameter, in numbers: value, errors (None where the mesh's is
    unknown), interval, quality of the fit."""
    rows = []
    named = [(fit.residuals[0].name, fit) for fit in calibration.each]
    named += [("all together", calibration.joint)] if len(calibration.scenes) > 1 else []
    for run, fit in named:
        for name, found in fit.estimates.items():
            errors = (found.value, found.standard_error, found.discretisation_error, found.interval)
            rows.append(dict(zip(_COLUMNS, (run, name, *errors, *fit.quality), strict=True)))
    return rows


def summary_table(calibration: Calibration) -> Table:
    """`parameters` for people."""
    table = Table(*_COLUMNS, left=2)
    for *words, value, error, mesh, (low, high), r2, rms, largest, steps in map(
        dict.values, parameters(calibration)
    ):
        errors = (
            f"{error:.1e}",
            "unknown" if mesh is None else f"{mesh:.1e}",
            f"{low:.4f} .. {high:.4f}",
        )
        table.add(
            *words,
            f"{value:.5f}",
            *errors,
            f"{r2:.5f}",
            f"{100 * rms:.2f} %",
            f"{100 * largest:+.2f} %",
            steps,
        )
    return table


def notes(calibration: Calibration) -> list[str]:
    """What the reader of the table must know about this calibration, one sentence each, and the
    law."""
    said = []
    joint = calibration.joint
    scenes = calibration.scenes
    if not joint.orders:
        said.append(
            "mesh: the discretisation error is unknown, no scene was given on a second mesh."
        )
    elif len(joint.orders) < len(scenes):
        said.append(
            f"mesh: {len(joint.orders)} of {len(scenes)} scenes were given on a second mesh; the "
            "joint fit counts no other."
        )
    said += [
        f"mesh: order of convergence of {name}: {order.words}." for name, order in joint.orders
    ]
    for scene in scenes:
        said += [
            f"mesh: {run.name} serves to estimate the discretisation error of {scene.run.name}."
            for run in scene.coarser
        ]
    if joint.serial_correlation > _BENT:
        correlation = f"{joint.serial_correlation:.2f}"
        said.append(
            f"s.e.: residuals of neighbouring steps are correlated ({correlation}): the law's "
            "shape differs from the runs', and errors and intervals, which take residuals as "
            "independent, are too small."
        )
    if joint.c is None and any(scene.run.sigY for scene in scenes):
        said.append("c: too few steps past yield in the range; elastic law.")
    if scenes[0].run.scene.pin.whole:
        said.append(
            "pin.whole: k and c are of a whole pin; archord law and the paper have them of "
            "half a pin."
        )
    law = calibration.law()
    threshold = "" if law.c is None else f", c = {law.c:.5f}"
    low, high = law.fitted_range
    return [
        *said,
        f"law: k = {law.k:.5f}{threshold}, from P(delta), delta = {low:g} to {high:g} dR",
    ]


def doubts(calibration: Calibration) -> list[str]:
    """A sentence where the law misses the runs by more than `POOR`."""
    _, rms, largest, _ = calibration.joint.quality
    if rms <= POOR:
        return []
    return [
        f"the law misses P of its own runs by {rms:.1%} rms, {largest:+.1%} at worst: theirs has "
        "another shape"
    ]


def as_json(calibration: Calibration) -> str:
    """The law (see `FittedLaw.from_json`), all fitted parameters, and notes as JSON."""
    data = {
        "law": calibration.law().model_dump(),
        "fits": parameters(calibration),
        "notes": notes(calibration),
    }
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def draw_fit(calibration: Calibration, target: Path) -> Path:
    """Draw P(delta) of all scenes, the law, and its residuals as ``target``; returns the file.
    Raises ValueError for an unknown format."""
    figure = new_figure(9, 4.2)
    fit = calibration.joint
    force, residuals = figure.subplots(1, 2)
    for i, (scene, part) in enumerate(zip(calibration.scenes, fit.residuals, strict=True)):
        load = np.linspace(0, part.load.max(), 400)
        values = [found.value for found in fit.estimates.values()]
        law = dimensionless_law("P", scene.run, load * scene.run.dR, *values)
        force.plot(part.load, part.data, "o", ms=4, mfc="none", color=f"C{i}", label=part.name)
        force.plot(load, law, "-", lw=1.4, color=f"C{i}")
        residuals.plot(part.load, 100 * (part.law / part.data - 1), "o-", ms=3, lw=1, color=f"C{i}")
    residuals.axhline(0, color="black", lw=0.8)
    force.set(ylabel="P / (E* ΔR)", ylim=(0, None))
    force.set_title(
        ", ".join(f"{name} = {x.value:.3f} ± {x.error:.3f}" for name, x in fit.estimates.items())
    )
    force.legend(frameon=False, fontsize="small")
    residuals.set(ylabel="law / run - 1 [%]", title="residuals")
    for axis in figure.axes:
        axis.set(xlabel="δ / ΔR", xlim=(0, None))
        axis.grid(alpha=0.3)
    return save_figure(figure, target)
