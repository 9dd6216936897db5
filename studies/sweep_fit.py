"""``archord fit SWEEP``: k and c of every case of a sweep, as a table and as SWEEP/fit.csv."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from archord.postprocess.judgement.convergence import Refined, group, twins
from archord.postprocess.laws.calibration import POOR, check_compatible, fit_curve
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.run import Run
from archord.report.by_name import Words
from archord.report.errors import InputError
from archord.report.table import Table
from archord.report.version import VERSION
from archord.studies.cases import read_sweep
from archord.studies.sweep import FILE, of_case, result_of

_SOFTER = 0.01  # share of P that a block may cost without a word
_FORMS = dict.fromkeys(("E1/E2", "nu1", "nu2", "dR/R", "sigY/E*", "h/R"), ".4g")
_FORMS |= {
    f"{name}{of}": form
    for name in "kc"
    for of, form in (("", ".4f"), (" s.e.", ".1e"), (" mesh", ".1e"))
}
_FORMS |= {"rms": ".1%", "largest": "+.1%"}
Row = dict[
    str, Any
]  # of a case: run, plane, yielding, and the numbers of `_FORMS`, nan where there is none


@dataclass(frozen=True)
class SweepFit:
    """A row for each fitted case of a sweep, ``notes`` on where they are from, and the runs
    ``left_out`` with the reason."""

    rows: list[Row]
    notes: Words
    left_out: list[tuple[str, str]]

    def __str__(self) -> str:
        """The table, without empty columns, and what its reader must know."""
        shown = {
            name: form
            for name, form in _FORMS.items()
            if any(math.isfinite(row[name]) for row in self.rows)
        }
        table = Table("run", "plane", "yielding", *shown, left=3)
        for row in self.rows:
            numbers = [
                format(row[name], form) if math.isfinite(row[name]) else "-"
                for name, form in shown.items()
            ]
            table.add(row["run"], row["plane"], row["yielding"], *numbers)
        said = [f"left out: {name}: {reason}" for name, reason in self.left_out]
        said += [
            f"{name}: {note}"
            for name, note in self.notes.items()
            if name in ("small blocks", "rms")
        ]
        return "\n".join([str(table), "", *said])

    def as_csv(self) -> str:
        """The rows as CSV, seven digits, below the notes."""
        text = io.StringIO()
        text.writelines(f"# {name}: {note}\n" for name, note in self.notes.items())
        writer = csv.DictWriter(text, list(self.rows[0]), lineterminator="\n")
        writer.writeheader()
        for row in self.rows:
            written = {name: "" if math.isnan(row[name]) else f"{row[name]:.7g}" for name in _FORMS}
            writer.writerow(row | written)
        return text.getvalue()


def fit_sweep(folder: Path, load_range: tuple[float, float]) -> SweepFit:
    """Fit k and c to P(delta) of every distinct case of the sweep in ``folder``, on its finest
    mesh, over ``load_range`` in clearances. Raises `InputError` where no case can be fitted."""
    distinct = read_sweep(folder / FILE).distinct
    of = {}  # the names of the cases by the names of their curves
    runs = []
    rows = []
    left_out = []
    for case in distinct:
        result = result_of(case, folder)
        try:
            if result.status not in ("done", "stopped") or not result.steps:
                raise InputError(
                    result.status, f"{result.message}" if result.message else result.status
                )
            curve = Run(of_case(case, folder)).curve.loading()
            check_compatible([curve])
            runs.append(curve)
            of[curve.name] = case.run
        except InputError as error:
            left_out.append((case.run, str(error)))
    again = {run.name: of[first.name] for run, first in twins(runs)}
    left_out += [
        (of[run], f"{first} is the same joint on the same mesh") for run, first in again.items()
    ]
    for refined in group([run for run in runs if run.name not in again]):
        name = of[refined.run.name]
        left_out += [
            (of[run.name], f"{name} is the same joint on a finer mesh") for run in refined.coarser
        ]
        try:
            rows.append(fit_case(refined, load_range, name))
        except InputError as error:
            left_out.append((name, str(error)))
    if not rows:
        said = "; ".join(f"{name}: {reason}" for name, reason in left_out[:1])
        raise InputError(folder, f"holds no case that can be fitted{f' ({said})' if said else ''}.")
    notes = {
        "archord": VERSION,
        "sweep": f"{folder.name}, sha256 "
        f"{hashlib.sha256((folder / FILE).read_bytes()).hexdigest()[:16]}",
        "distinct cases": str(len(distinct)),
    }
    softer = max(LawJoint.from_scene(run.scene).softer[0] for run in runs)
    if softer > _SOFTER:
        notes["small blocks"] = (
            f"P up to about {softer:.1%} smaller than in a wide block, and k with it"
        )
    if poor := sum(row["rms"] > POOR for row in rows):
        notes["rms"] = (
            f"above {POOR:.0%} in {poor} of {len(rows)} cases: P of these has another shape than "
            "the law"
        )
    return SweepFit(rows, notes, left_out)


def fit_case(refined: Refined, load_range: tuple[float, float], name: str) -> Row:
    """The row of a joint, a case ``name``. Raises `InputError` where the range or the steps do not
    allow a fit."""
    run = refined.run
    if run.scene.pin.whole:
        raise InputError(
            run.name, "pin.whole = true does not fit: k and c of a sweep are for half a pin."
        )
    fit = fit_curve([refined], load_range)
    pin = run.scene.pin
    block = run.scene.block
    row: Row = {
        "run": name,
        "plane": run.plane,
        "yielding": LawJoint.from_scene(run.scene).yielding,
    }
    row |= dict.fromkeys(_FORMS, math.nan) | {
        "E1/E2": math.inf if pin.E is None else pin.E / block.E,
        "nu1": math.nan if pin.nu is None else pin.nu,
        "nu2": block.nu,
        "dR/R": run.dR / run.R,
        "sigY/E*": math.inf if run.sigY is None else run.sigY / run.E_star,
        "h/R": run.scene.joint.h / run.R,
    }
    for of, found in fit.estimates.items():
        mesh = math.nan if found.discretisation_error is None else found.discretisation_error
        row |= {of: found.value, f"{of} s.e.": found.standard_error, f"{of} mesh": mesh}
    _, rms, largest, _ = fit.quality
    return row | {"rms": rms, "largest": largest}
