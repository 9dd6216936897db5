"""``archord fit SWEEP``: k and c of every case of a sweep, and the compact model of both."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import archord
from archord.output.user_file import check_target, writing
from archord.postprocess.convergence import Refined, group
from archord.postprocess.curve import RunCurve, read_run
from archord.postprocess.laws import study_report
from archord.postprocess.laws.calibrated import JSON_BEGINS, CalibratedModel, shipped_model
from archord.postprocess.laws.calibration import fit_plateau
from archord.postprocess.laws.curve_fit import fit_curve
from archord.postprocess.laws.joint import LawJoint
from archord.postprocess.laws.study import (
    CSV_BEGINS,
    Cases,
    Study,
    TooFewError,
    read_cases,
    rounded,
    shipped_rows,
    study,
    table_of,
    usable,
    write_cases,
)
from archord.report.table import Table
from archord.scene.errors import InputError
from archord.studies.cases import Case, read_sweep
from archord.studies.tables import entry, heading, of_case, report_of, result_of

FILE, TABLE = "sweep.toml", "fit.csv"
BLOCKS = "small blocks"
_SOFTER = 0.01  # share of P that a block may cost without a word


@dataclass(frozen=True)
class SweepFit:
    """The fitted ``cases`` of a sweep, their ``table`` with what they vary, ``notes`` on where they are from, the runs
    ``left_out`` with the reason, and the ``study`` of a model over them, None where the cases are ``too_few``."""

    cases: Cases
    table: Table
    notes: dict[str, str]
    left_out: list[tuple[str, str]]
    study: Study | None
    too_few: str

    @property
    def model(self) -> CalibratedModel | None:
        """The model of k and c, if there is one."""
        return self.study.model if self.study else None

    def text(self) -> str:
        """The cases, the model and its errors; of another sweep than archord's own also those of archord's law."""
        parts = [str(self.table), "", *(f"left out: {name}: {reason}" for name, reason in self.left_out)]
        if self.study is None:
            parts.append(f"model: {self.too_few}; the table stands alone.")
        else:
            parts.append(study_report.model_text(self.study, len(self.cases)))
        if BLOCKS in self.notes:
            said = f"{self.notes[BLOCKS]}; k is smaller in them, which a model does not know."
            parts.append(f"\n{BLOCKS}: {said}\n")
        if self.notes.get("sweep") != shipped_model().data["provenance"].get("sweep"):
            rows = shipped_rows(usable(self.cases)[0])
            if rows:
                table = study_report.error_table(rows).markdown()
                parts.append(f"\narchord law calibrated on these cases, as far as they are in its range:\n\n{table}")
        return "\n".join(parts)

    def write(self, csv: Path | None, law: Path | None, json: Path | None, picture: Path | None) -> None:
        """Write those files that are named: cases, model, everything, a picture. Raises `InputError` where the cases
        give no model for ``law``, and ValueError for a picture of unknown format."""
        if law and self.study is None:
            raise InputError(f"{law}: no law to write: {self.too_few}.")
        if csv:
            write_cases(self.cases, self.notes, csv)
        if law and self.model:
            with writing(law):
                law.write_text(self.model.to_json(), encoding="utf-8")
        if json:
            with writing(json):
                text = study_report.as_json(self.cases, self.notes, self.left_out, self.model)
                json.write_text(text, encoding="utf-8")
        if picture:
            study_report.draw_study(self.cases, self.model, picture)


def is_sweep(path: Path) -> bool:
    """Whether ``path`` is the folder of a sweep, or a table of its fitted cases."""
    return (path / FILE).is_file() or (path.suffix == ".csv" and not path.is_dir())


def check_files(
    path: Path, csv: Path | None, law: Path | None, json: Path | None, picture: Path | None, force: bool
) -> None:
    """Raise `InputError` for files that `SweepFit.write` may not write: the sweep ``path`` itself, and, without
    ``force``, files that do not begin like such output."""
    kinds = {csv: CSV_BEGINS, law: JSON_BEGINS, json: study_report.JSON_BEGINS}
    for file in (csv, law, json, picture):
        if file:
            check_target(file, [path, path / FILE], force=force or file == picture, begins=kinds.get(file))


def fit_sweep(path: Path, load_range: tuple[float, float], confidence: float, held_out: float) -> SweepFit:
    """Fit the sweep in the folder ``path``, or take the stored table ``path``; then a model, with a share ``held_out``
    to judge it by. Raises `InputError`."""
    if not 0 <= held_out <= 0.5:
        raise InputError(f"--held-out {held_out:g}: must be a share from 0 to 0.5.")
    if path.suffix == ".csv":
        cases, notes = read_cases(path)
        if not len(cases):
            raise InputError(f"{path}: holds no case.")
        numbers = range(1, len(cases) + 1)
        left_out: list[tuple[str, str]] = []
        table = study_report.case_table(numbers, cases, study_report.numbers_of(cases))
    else:
        cases, table, notes, left_out = _solved(path, load_range, confidence)
    used, unfit = usable(cases)
    left_out += unfit
    try:
        result, too_few = study(used, held_out, provenance=notes), ""
    except TooFewError as error:
        result, too_few = None, str(error)
    return SweepFit(cases, table, notes, left_out, result, too_few)


def _solved(
    folder: Path, load_range: tuple[float, float], confidence: float
) -> tuple[Cases, Table, dict[str, str], list[tuple[str, str]]]:
    """Fit k and c to every distinct case, on its finest mesh; the first four of `SweepFit`."""
    design = read_sweep(folder / FILE)
    of: dict[str, Case] = {}
    runs, fitted, left_out = [], [], list[tuple[str, str]]()
    for case in design.distinct:
        try:
            run = _run(case, folder)
        except InputError as error:
            left_out.append((case.run, str(error)))
        else:
            runs.append(run)
            of[run.name] = case
    for refined in group(runs):
        case = of[refined.run.name]
        left_out += [(of[run.name].run, f"{case.run} is the same joint on a finer mesh") for run in refined.coarser]
        try:
            fitted.append((case, fit_case(refined, load_range, confidence, case.run)))
        except InputError as error:
            left_out.append((case.run, str(error)))
    if not fitted:
        said = "; ".join(f"{name}: {reason}" for name, reason in left_out[:1])
        raise InputError(f"{folder}: holds no case that can be fitted{f' ({said})' if said else ''}.")
    cases = rounded(table_of(found for _, found in fitted))
    varied = {heading(key, fitted[0][0].scene): [_shown(entry(case.value(key))) for case, _ in fitted]
              for key in design.keys}  # fmt: skip
    table = study_report.case_table([case.number for case, _ in fitted], cases, varied)
    return cases, table, _notes(folder, design.distinct, cases), left_out


def fit_case(refined: Refined, load_range: tuple[float, float], confidence: float, name: str) -> dict[str, Any]:
    """Fit k and c to P(delta) of a joint, over ``load_range`` in clearances: a case called ``name``.

    Raises `InputError` where the range or the steps do not allow a fit.
    """
    run = refined.run
    force = fit_curve("P", [refined], load_range, confidence)
    plateau = fit_plateau(force, [refined], load_range, confidence)
    pin, block, k, c = run.scene.pin, run.scene.block, force.k, force.c
    case = {
        "run": name,
        "plane": run.plane,
        "yielding": "none" if run.sigY is None else LawJoint.from_scene(run.scene).yielding,
        "ratio": math.inf if pin.E is None else pin.E / block.E,
        "pin_nu": pin.nu,
        "nu": block.nu,
        "clearance": run.dR / run.R,
        "strength": math.inf if run.sigY is None else run.sigY / run.E_star,
        "mesh": run.scene.joint.h / run.R,
        "k": k and k.value,
        "k_error": k and k.standard_error,
        "k_mesh": k and k.discretisation_error,
        "c": c and c.value,
        "c_error": c and c.standard_error,
        "c_mesh": c and c.discretisation_error,
        "plateau": plateau and plateau.c and plateau.c.value,
        "rms": force.rms,
        "largest": force.largest,
        "load": force.residuals[0].load,
        "P": force.residuals[0].data,
    }
    return {column: math.nan if value is None else value for column, value in case.items()}


def _shown(value: Any) -> str:
    return "-" if value is None else f"{value:.9g}" if isinstance(value, float) else str(value)


def _run(case: Case, folder: Path) -> RunCurve:
    """The curve of a ``case``. Raises `InputError` if it is not solved, or its joint has no such law."""
    run = of_case(case, folder)
    status = result_of(run)
    if status.status not in ("done", "stopped") or not status.steps:
        raise InputError(f"{status.status}: {status.message}" if status.message else status.status)
    if case.scene.joint.model != "block":
        raise InputError(f'joint.model = "{case.scene.joint.model}" has no such law')
    if case.scene.pin.hardening > 0 or case.scene.block.hardening > 0:
        raise InputError("hardening: the law is for perfect plasticity")
    return read_run(run).loading()


def _notes(folder: Path, distinct: list[Case], cases: Cases) -> dict[str, str]:
    """Where the fitted cases are from."""
    reports = [report for case in distinct if (report := report_of(of_case(case, folder)))]
    days = sorted({str(report.get("started", ""))[:10] for report in reports} - {""})
    command = [str(word) for word in (reports[0].get("command", []) if reports else [])]
    seconds = sum(report.get("seconds", {}).get("total", 0.0) for report in reports)
    meshes = sorted({f"{mesh:.3g}" for mesh in cases.mesh})
    notes = {
        "archord": archord.__version__,
        "sweep": f"{folder.name}, sha256 {hashlib.sha256((folder / FILE).read_bytes()).hexdigest()[:16]}",
        "command": " ".join([Path(command[0]).name, *command[1:]]) if command else "unknown",
        "solved": " to ".join(dict.fromkeys((days[0], days[-1]))) if days else "unknown",
        "distinct cases": str(len(distinct)),
        "mesh": f"elements of {' and '.join(meshes)} R on the arcs",
        "cost": f"{seconds:.0f} s on one rank, on a machine that did other work besides",
    }
    joints = [(case.scene.joint, LawJoint.from_scene(case.scene)) for case in distinct]
    widths = {g.W / g.radius: joint.softer[0] for g, joint in joints if g.model == "block"}
    softer = {width: share for width, share in widths.items() if share > _SOFTER}
    if softer:
        notes[BLOCKS] = f"block_size from {min(softer):.4g} R on, P about {max(softer.values()):.1%} smaller there"
    return notes
