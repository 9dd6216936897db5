"""``archord fit SWEEP``: k and c of every case of a sweep, and the compact model of both."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from archord.output.folder import is_sweep
from archord.postprocess.convergence import group
from archord.postprocess.laws.calibrated import CalibratedModel, shipped_model
from archord.postprocess.laws.calibration import check_compatible
from archord.postprocess.laws.joint import LawJoint
from archord.postprocess.laws.study import TooFewError, error_table, shipped_errors, study
from archord.postprocess.laws.study_cases import Cases, case_table, fit_case, read_cases, stored, usable
from archord.postprocess.run import Run
from archord.report.version import VERSION
from archord.scene.errors import InputError
from archord.studies.cases import read_sweep
from archord.studies.sweep import FILE, of_case, result_of

_BLOCKS = "small blocks"
_SOFTER = 0.01  # share of P that a block may cost without a word
LeftOut = list[tuple[str, str]]  # runs with the reason


@dataclass(frozen=True)
class SweepFit:
    """The fitted ``cases`` of a sweep, ``notes`` on where they are from, the runs ``left_out``, and the ``model`` of k
    and c, None where the cases are ``too_few``."""

    cases: Cases
    notes: dict[str, str]
    left_out: LeftOut
    model: CalibratedModel | None
    too_few: str

    def __str__(self) -> str:
        """The cases, the errors of their model, and of archord's law where that is another one."""
        parts = [f"left out: {name}: {reason}" for name, reason in self.left_out]
        parts += [f"{_BLOCKS}: {self.notes[_BLOCKS]}"] if _BLOCKS in self.notes else []
        tables = []
        if self.model is None:
            parts.append(f"model: {self.too_few}; the table stands alone.")
        else:
            fitted, held = (self.model.data["provenance"][name] for name in ("fitted", "held out"))
            parts.append(f"model: from {fitted} of {len(self.cases)} cases; {held} held out until the end")
            tables.append(error_table(self.model.data["errors"]).markdown())
        found = shipped_errors(usable(self.cases)[0])
        if found and (self.model is None or self.model.data["elastic"] != shipped_model().data["elastic"]):
            tables.append("archord law calibrated on these cases, as far as they are in its range:\n")
            tables.append(error_table({"archord's law": found}).markdown())
        return "\n".join([str(case_table(self.cases)), "", *parts, "", *tables])


def fit_sweep(path: Path, load_range: tuple[float, float]) -> SweepFit:
    """Fit the sweep in the folder ``path``, or take the stored table ``path``; then a model. Raises `InputError`."""
    cases, notes, left_out = _solved(path, load_range) if is_sweep(path) else (*read_cases(path), [])
    used, unfit = usable(cases)
    try:
        return SweepFit(cases, notes, left_out + unfit, study(used, provenance=notes), "")
    except TooFewError as error:
        return SweepFit(cases, notes, left_out + unfit, None, str(error))


def _solved(folder: Path, load_range: tuple[float, float]) -> tuple[Cases, dict[str, str], LeftOut]:
    """Fit k and c to every distinct case, on its finest mesh; the first three of `SweepFit`."""
    distinct = read_sweep(folder / FILE).distinct
    of: dict[str, str] = {}  # the names of the cases by those of their curves
    runs, fitted, left_out = [], [], LeftOut()
    for case in distinct:
        result = result_of(case, folder)
        try:
            if result.status not in ("done", "stopped") or not result.steps:
                raise InputError(f"{result.status}: {result.message}" if result.message else result.status)
            curve = Run(of_case(case, folder)).curve.loading()
            check_compatible([curve])
            runs.append(curve)
            of[curve.name] = case.run
        except InputError as error:
            left_out.append((case.run, str(error)))
    for refined in group(runs):
        name = of[refined.run.name]
        left_out += [(of[run.name], f"{name} is the same joint on a finer mesh") for run in refined.coarser]
        try:
            fitted.append(fit_case(refined, load_range, name))
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
        notes[_BLOCKS] = f"P up to about {softer:.1%} smaller than in a wide block, and k, which a model does not know"
    return *stored(fitted, notes), left_out
