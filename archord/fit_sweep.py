"""``archord fit SWEEP``: k and c of every case of a sweep, and the compact model of both."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from archord.postprocess.laws.fitted_cases import FittedCase
    from archord.studies.cases import Case

FILE = "sweep.toml"
TABLE = "fit.csv"
BLOCKS = "small blocks"


@dataclass
class Found:
    """The fitted ``cases`` of a sweep with their ``numbers``, what they vary, where they are ``from_``, and the cases
    ``left_out`` with the reason."""

    cases: list[FittedCase]
    numbers: list[int]
    varied: dict[str, list[str]]
    notes: dict[str, str]
    left_out: list[tuple[str, str]] = field(default_factory=list)


def is_sweep(path: Path) -> bool:
    """Whether ``path`` is the folder of a sweep, or a table that `fit_sweep` wrote."""
    return (path / FILE).is_file() or (path.suffix == ".csv" and not path.is_dir())


def fit_sweep(
    path: Path,
    load_range: tuple[float, float],
    confidence: float,
    held_out: float,
    csv_file: Path | None,
    law_file: Path | None,
    json_file: Path | None,
    picture: Path | None,
    force: bool = False,
) -> int:
    """Fit the sweep in the folder ``path``, or the stored table ``path``; print all, and write what is asked for.

    Files that are there and do not begin like such output are overwritten only with ``force``.
    """
    from rich.console import Console

    from archord.output.output_file import check_target, writing
    from archord.postprocess.laws.calibrated_fit import TooFewError
    from archord.postprocess.laws.calibrated_model import JSON_BEGINS as LAW_BEGINS
    from archord.postprocess.laws.calibrated_report import JSON_BEGINS, case_table
    from archord.postprocess.laws.calibrated_study import study, usable
    from archord.postprocess.laws.fitted_cases import CSV_BEGINS, write_cases
    from archord.scene.errors import InputError

    if not 0 <= held_out <= 0.5:
        raise InputError(f"--held-out {held_out:g}: must be a share from 0 to 0.5.")
    files = [file for file in (csv_file, law_file, json_file, picture) if file]
    if len({file.resolve() for file in files}) < len(files):
        raise InputError("--csv, --law, --json, --picture: must be different files.")
    table = path / TABLE if csv_file is None and path.is_dir() else csv_file
    kinds = {table: CSV_BEGINS, law_file: LAW_BEGINS, json_file: JSON_BEGINS}
    for file in (table, law_file, json_file, picture):
        if file:
            check_target(file, [path, path / FILE], force=force or file == picture, begins=kinds.get(file))
    found = _stored(path) if path.suffix == ".csv" else _solved(path, load_range, confidence)
    used, unfit = usable(found.cases)
    found.left_out += [(case.run, reason) for case, reason in unfit]
    try:
        result, too_few = study(used, held_out), ""
    except TooFewError as error:
        result, too_few = None, str(error)
    if law_file and result is None:
        raise InputError(f"{law_file}: no law to write: {too_few}.")
    if table:
        write_cases(found.cases, found.notes, table)
        if csv_file is None:
            files.append(table)
    model = None
    if result:
        from dataclasses import replace

        provenance: dict[str, Any] = {**found.notes, "fitted": len(result.used), "held out": len(result.held)}
        model = replace(result.model, provenance=provenance)
    if law_file and model:
        with writing(law_file):
            law_file.write_text(model.to_json(), encoding="utf-8")
    if json_file:
        from archord.postprocess.laws.calibrated_report import as_json

        with writing(json_file):
            json_file.write_text(as_json(found.cases, found.notes, found.left_out, model), encoding="utf-8")
    if picture:
        from archord.postprocess.laws.calibrated_picture import draw_calibrated

        draw_calibrated(found.cases, model, picture)
    Console(highlight=False, width=60 + 24 * (len(found.varied) + 6)).print(
        case_table(found.numbers, found.cases, found.varied)
    )
    print()
    for name, reason in found.left_out:
        print(f"left out: {name}: {reason}")
    if result is None:
        print(f"model: {too_few}; the table stands alone.")
    else:
        _print_model(result, len(found.cases))
    if BLOCKS in found.notes:
        print(f"\n{BLOCKS}: {found.notes[BLOCKS]}; k is smaller in them, which a model does not know.\n")
    _print_shipped(used, found.notes)
    for file in files:
        print(file)
    return 0


def _print_shipped(cases: list[FittedCase], notes: dict[str, str]) -> None:
    """How good the law that comes with archord is on the ``cases`` of another sweep than its own."""
    from archord.postprocess.laws.calibrated_law import shipped_model
    from archord.postprocess.laws.calibrated_report import error_lines
    from archord.postprocess.laws.calibrated_study import shipped_rows

    if notes.get("sweep") == shipped_model().provenance.get("sweep"):
        return
    rows = shipped_rows(cases)
    if rows:
        print("\narchord law calibrated on these cases, as far as they are in its range:\n")
        for line in error_lines(rows):
            print(line)
        print()


def _print_model(result, total: int) -> None:
    from archord.postprocess.laws.calibrated_report import error_lines, formulas, worst_line

    model, used, held = result.model, result.used, result.held
    print(
        f"model: {model.numbers} coefficients from {len(used)} of {total} cases; {len(held)} held out until the end\n"
    )
    for line in formulas(model):
        print(f"    {line}")
    print()
    for line in error_lines(result.rows):
        print(line)
    print()
    for line in error_lines(result.simpler):
        print(line)
    print()
    for what, plane, yielding, found in result.rows:
        said = "" if yielding == "all" else f", plane {plane}, {yielding}"
        print(f"largest {what}{said}: {worst_line(found, used + held)}")


def _stored(path: Path) -> Found:
    from archord.postprocess.laws.calibrated_report import numbers_of
    from archord.postprocess.laws.fitted_cases import read_cases
    from archord.scene.errors import InputError

    cases, notes = read_cases(path)
    if not cases:
        raise InputError(f"{path}: holds no case.")
    return Found(cases, list(range(1, len(cases) + 1)), numbers_of(cases), notes)


def _solved(folder: Path, load_range: tuple[float, float], confidence: float) -> Found:
    """Fit k and c to every distinct case, on its finest mesh."""
    from archord.postprocess.convergence import group
    from archord.postprocess.laws.fitted_cases import fit_case, rounded
    from archord.scene.errors import InputError
    from archord.studies.cases import read_sweep
    from archord.studies.tables import entry, heading

    design = read_sweep(folder / FILE)
    runs, left_out = _runs(design.distinct, folder)
    of = {run.name: case for case, run in runs}
    cases, numbers, fitted = [], [], []
    for refined in group([run for _, run in runs]):
        case = of[refined.run.name]
        left_out += [(of[run.name].run, f"{case.run} is the same joint on a finer mesh") for run in refined.coarser]
        try:
            cases.append(fit_case(refined, load_range, confidence, case.run))
        except InputError as error:
            left_out.append((case.run, str(error)))
        else:
            numbers.append(case.number)
            fitted.append(case)
    if not cases:
        said = "; ".join(f"{name}: {reason}" for name, reason in left_out[:1])
        raise InputError(f"{folder}: holds no case that can be fitted{f' ({said})' if said else ''}.")
    varied = {heading(key, case.scene): [_shown(entry(one.value(key))) for one in fitted] for key in design.keys}
    return Found(rounded(cases), numbers, varied, _notes(folder, design.distinct, cases), left_out)


def _shown(value: Any) -> str:
    return "-" if value is None else f"{value:.9g}" if isinstance(value, float) else str(value)


def _runs(distinct: list[Case], folder: Path) -> tuple[list[tuple[Case, Any]], list[tuple[str, str]]]:
    """The curves of the cases whose joint has such a law, and the others with the reason."""
    from archord.postprocess.curve import read_run
    from archord.scene.errors import InputError
    from archord.studies.case_run import standing
    from archord.studies.tables import of_case

    runs, left_out = [], []
    for case in distinct:
        run = of_case(case, folder)
        status = standing(run)
        reason = ""
        if status.status not in ("done", "stopped") or not status.steps:
            reason = f"{status.status}: {status.message}" if status.message else status.status
        elif case.scene.joint.model != "block":
            reason = f'joint.model = "{case.scene.joint.model}" has no such law'
        elif case.scene.pin.hardening > 0 or case.scene.block.hardening > 0:
            reason = "hardening: the law is for perfect plasticity"
        else:
            try:
                runs.append((case, read_run(run).loading()))
            except InputError as error:
                reason = str(error)
        if reason:
            left_out.append((case.run, reason))
    return runs, left_out


def _softer(case: Case) -> float:
    """The share of P that the block of a ``case`` costs, 0 in a ring, which is not fitted."""
    from archord.postprocess.laws.law_joint import LawJoint

    return LawJoint.from_scene(case.scene).softer[0] if case.scene.joint.model == "block" else 0.0


def _notes(folder: Path, distinct: list[Case], cases: list[FittedCase]) -> dict[str, str]:
    """Where the fitted cases are from."""
    import hashlib

    from archord import __version__
    from archord.studies.case_run import report_of
    from archord.studies.tables import of_case

    reports = [report for case in distinct if (report := report_of(of_case(case, folder)))]
    days = sorted({str(report.get("started", ""))[:10] for report in reports} - {""})
    command = [str(word) for word in (reports[0].get("command", []) if reports else [])]
    seconds = sum(report.get("seconds", {}).get("total", 0.0) for report in reports)
    widths = {case.scene.joint.W / case.scene.joint.radius: _softer(case) for case in distinct}
    softer = {width: share for width, share in widths.items() if share > 0.01}
    meshes = sorted({f"{case.mesh:.3g}" for case in cases})
    notes = {
        "archord": __version__,
        "sweep": f"{folder.name}, sha256 {hashlib.sha256((folder / FILE).read_bytes()).hexdigest()[:16]}",
        "command": " ".join([Path(command[0]).name, *command[1:]]) if command else "unknown",
        "solved": " to ".join(dict.fromkeys((days[0], days[-1]))) if days else "unknown",
        "distinct cases": str(len(distinct)),
        "mesh": f"elements of {' and '.join(meshes)} R on the arcs",
        "cost": f"{seconds:.0f} s on one rank, on a machine that did other work besides",
    }
    if softer:
        notes[BLOCKS] = f"block_size from {min(softer):.4g} R on, P about {max(softer.values()):.1%} smaller there"
    return notes
