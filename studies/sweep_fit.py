"""``archord fit SWEEP``: k and c of every case of a sweep, and the compact model of both."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from archord.output.user_file import check_target, writing
from archord.postprocess.convergence import Refined, group
from archord.postprocess.curve import RunCurve
from archord.postprocess.laws import study_report
from archord.postprocess.laws.calibrated import JSON_BEGINS, CalibratedModel, shipped_model
from archord.postprocess.laws.calibration import check_compatible, fit_plateau
from archord.postprocess.laws.curve_fit import fit_curve
from archord.postprocess.laws.joint import LawJoint
from archord.postprocess.laws.study import (
    CSV_BEGINS,
    Cases,
    TooFewError,
    as_csv,
    from_csv,
    read_cases,
    shipped_errors,
    study,
    table_of,
    usable,
)
from archord.postprocess.run import Run
from archord.report.version import VERSION
from archord.scene.errors import InputError
from archord.studies.cases import Case, read_sweep
from archord.studies.tables import of_case, result_of

FILE, TABLE = "sweep.toml", "fit.csv"
BLOCKS = "small blocks"
_SOFTER = 0.01  # share of P that a block may cost without a word


@dataclass(frozen=True)
class SweepFit:
    """The fitted ``cases`` of a sweep, ``notes`` on where they are from, the runs ``left_out`` with the reason, and the
    ``model`` of k and c, None where the cases are ``too_few``."""

    cases: Cases
    notes: dict[str, str]
    left_out: list[tuple[str, str]]
    model: CalibratedModel | None
    too_few: str

    def text(self) -> str:
        """The cases, the errors of their model, and of archord's law where that is another one."""
        tables = [str(study_report.case_table(self.cases))]
        parts = [f"left out: {name}: {reason}" for name, reason in self.left_out]
        parts += [f"{BLOCKS}: {self.notes[BLOCKS]}"] if BLOCKS in self.notes else []
        if self.model is None:
            parts.append(f"model: {self.too_few}; the table stands alone.")
        else:
            fitted, held = (self.model.data["provenance"][name] for name in ("fitted", "held out"))
            parts.append(f"model: from {fitted} of {len(self.cases)} cases; {held} held out until the end")
            tables.append(study_report.error_table(self.model.data["errors"]).markdown())
        found = shipped_errors(usable(self.cases)[0])
        if found and (self.model is None or self.model.data["elastic"] != shipped_model().data["elastic"]):
            tables.append("archord law calibrated on these cases, as far as they are in its range:\n")
            tables.append(study_report.error_table({"archord's law": found}).markdown())
        return "\n".join([tables[0], "", *parts, "", *tables[1:]])

    def write(self, csv: Path | None, law: Path | None, json: Path | None, picture: Path | None) -> None:
        """Write those files that are named: cases, model, everything, a picture. Raises `InputError` where the cases
        give no model for ``law`` or ``picture``, and ValueError for a picture of unknown format."""
        if (law or picture) and self.model is None:
            raise InputError(f"{law or picture}: no law to {'write' if law else 'draw'}: {self.too_few}.")
        everything = study_report.as_json(self.cases, self.notes, self.left_out, self.model)
        model = self.model.to_json() if self.model else ""
        for file, text in ((csv, as_csv(self.cases, self.notes)), (law, model), (json, everything)):
            if file:
                with writing(file):
                    file.write_text(text, encoding="utf-8", newline="")
        if picture and self.model:
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


def fit_sweep(path: Path, load_range: tuple[float, float], confidence: float) -> SweepFit:
    """Fit the sweep in the folder ``path``, or take the stored table ``path``; then a model. Raises `InputError`."""
    left_out: list[tuple[str, str]] = []
    if path.suffix == ".csv":
        cases, notes = read_cases(path)
        if not len(cases):
            raise InputError(f"{path}: holds no case.")
    else:
        cases, notes, left_out = _solved(path, load_range, confidence)
    used, unfit = usable(cases)
    try:
        model, too_few = study(used, provenance=notes), ""
    except TooFewError as error:
        model, too_few = None, str(error)
    return SweepFit(cases, notes, left_out + unfit, model, too_few)


def _solved(
    folder: Path, load_range: tuple[float, float], confidence: float
) -> tuple[Cases, dict[str, str], list[tuple[str, str]]]:
    """Fit k and c to every distinct case, on its finest mesh; the first three of `SweepFit`."""
    distinct = read_sweep(folder / FILE).distinct
    of: dict[str, str] = {}  # the names of the cases by those of their curves
    runs, fitted, left_out = [], [], list[tuple[str, str]]()
    for case in distinct:
        try:
            runs.append(_run(case, folder))
            of[runs[-1].name] = case.run
        except InputError as error:
            left_out.append((case.run, str(error)))
    for refined in group(runs):
        name = of[refined.run.name]
        left_out += [(of[run.name], f"{name} is the same joint on a finer mesh") for run in refined.coarser]
        try:
            fitted.append(fit_case(refined, load_range, confidence, name))
        except InputError as error:
            left_out.append((name, str(error)))
    if not fitted:
        said = "; ".join(f"{name}: {reason}" for name, reason in left_out[:1])
        raise InputError(f"{folder}: holds no case that can be fitted{f' ({said})' if said else ''}.")
    meshes = sorted({f"{case['mesh']:.3g}" for case in fitted})
    notes = {
        "archord": VERSION,
        "sweep": f"{folder.name}, sha256 {hashlib.sha256((folder / FILE).read_bytes()).hexdigest()[:16]}",
        "distinct cases": str(len(distinct)),
        "mesh": f"elements of {' and '.join(meshes)} R on the arcs",
    }
    softer = max(LawJoint.from_scene(run.scene).softer[0] for run in runs)
    if softer > _SOFTER:
        notes[BLOCKS] = f"P up to about {softer:.1%} smaller than in a wide block, and k, which a model does not know"
    return *from_csv(as_csv(table_of(fitted), notes)), left_out  # the digits of the file, whether it is read or not


def fit_case(refined: Refined, load_range: tuple[float, float], confidence: float, name: str) -> dict[str, Any]:
    """Fit k and c to P(delta) of a joint, over ``load_range`` in clearances: a case called ``name``.

    Raises `InputError` where the range or the steps do not allow a fit.
    """
    run = refined.run
    force = fit_curve("P", [refined], load_range, confidence)
    plateau = fit_plateau(force, [refined], load_range, confidence)
    pin, block = run.scene.pin, run.scene.block
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
        "plateau": plateau and plateau.c and plateau.c.value,
        "rms": force.rms,
        "largest": force.largest,
        "load": force.residuals[0].load,
        "P": force.residuals[0].data,
    }
    for parameter, found in (("k", force.k), ("c", force.c)):
        if found:
            errors = {"_error": found.standard_error, "_mesh": found.discretisation_error}
            case |= {parameter: found.value} | {parameter + kind: error for kind, error in errors.items()}
    return case


def _run(case: Case, folder: Path) -> RunCurve:
    """The curve of a ``case``. Raises `InputError` if it is not solved, or its joint has no such law."""
    status = result_of(case, folder)
    if status.status not in ("done", "stopped") or not status.steps:
        raise InputError(f"{status.status}: {status.message}" if status.message else status.status)
    curve = Run(of_case(case, folder)).curve.loading()
    check_compatible([curve])
    return curve
