"""A sweep's folder: sweep.toml and cases/, with a run folder for each case; how they ended, what is
left and what it costs, and the tables gathered from the run folders: sweep.csv (a row per case and
step), cases.csv (a row per case)."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from archord.output.files.disk import replace_file
from archord.output.finished import fault_of_run
from archord.output.folder import occupied, report_of
from archord.report.doubts import of_cases
from archord.report.errors import InputError
from archord.report.readable import require_file
from archord.scene.sections.errors import toml_value
from archord.studies.cases import Case, Sweep

FILE = "sweep.toml"
CASES = "cases"  # the folder of all run folders
FAILURE = "failure.txt"  # what raised in a case that failed: a sentence, and the traceback
_COST = ("message", "steps", "seconds [s]", "iterations", "cutbacks", "cells", "dofs")
_PER_STEP = (
    "step",
    "iterations",
    "cutbacks",
    "seconds [s]",
)  # of history.csv; cases.csv has sums of them
Row = list[str]


@dataclass(frozen=True)
class Result:
    """How a case ended: ``status`` is "done", "stopped" (no equilibrium, or a file that cannot be
    written), "failed" (an error), "interrupted", "busy" (another process solves it) or "open", also
    where files of a finished case are ``damaged``, as ``message`` says; ``seconds`` are of
    this process."""

    run: str
    status: str
    message: str = ""
    steps: int = 0
    seconds: float = 0.0
    damaged: bool = False


def of_case(case: Case, folder: Path) -> Path:
    """The run folder of ``case`` in the sweep's ``folder``."""
    return folder / CASES / case.run


def result_of(case: Case, folder: Path) -> Result:
    """What the run folder of ``case`` in the sweep's ``folder`` says about it."""
    run = of_case(case, folder)
    with suppress(OSError):
        return Result(
            case.run, "failed", (run / FAILURE).read_text(encoding="utf-8").partition("\n")[0]
        )
    report = report_of(run)
    status = report.get("status")
    steps = len(report.get("steps", []))
    between_meshes = (
        case.scene.analysis.accuracy is not None and status == "done" and "accuracy" not in report
    )
    if status in ("done", "stopped", "interrupted") and not between_meshes:
        fault = fault_of_run(run, case.scene, report)
        if fault:
            return Result(case.run, "open", f"{run}: {fault}", damaged=True)
        return Result(case.run, status, report.get("message", ""), steps)
    return Result(case.run, "open", steps=steps)


def claim(sweep: Sweep, folder: Path) -> None:
    """Make ``folder`` ready for the sweep, or go on in it, and write the resolved sweep file.
    Raises `InputError` if it cannot be used or holds something else; a sweep that shares a case is
    taken for an earlier state of this one."""
    try:
        if folder.is_dir() and any(folder.iterdir()) and not (folder / FILE).exists():
            raise InputError(
                folder, "is not empty and holds no sweep; choose another folder with -o."
            )
        (folder / CASES).mkdir(parents=True, exist_ok=True)
        with occupied(folder / CASES, wait=True):
            held = {run.name for run in (folder / CASES).iterdir()}
            if held and held.isdisjoint(case.run for case in sweep.cases):
                raise InputError(
                    folder,
                    f"holds another sweep, which has no case in common with "
                    f"{sweep.path}; choose another folder with -o, or remove this one.",
                )
            replace_file(folder / FILE, sweep.file.resolved())
    except OSError as error:
        raise InputError(folder, f"cannot be used for a sweep: {error.strerror}.") from None


def part_of(cases: list[Case], part: str) -> list[Case]:
    """Part "I/N" of ``cases`` for a job array: every N-th, the longest first, so that all parts
    take about as long. Raises `InputError`."""
    found = re.fullmatch(r"(\d+)/(\d+)", part)
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise InputError(f"--array {part}: must be I/N, with I from 1 to N.")
    longest = sorted(cases, key=lambda case: -case.scene.expected_seconds)
    return longest[int(found[1]) - 1 :: int(found[2])]


def open_cases(
    cases: list[Case], folder: Path, *, retry: bool = False, force: bool = False
) -> tuple[list[Result], list[Case], list[Result]]:
    """What of ``cases`` has ended already, those that are left, and the damaged ones among them;
    with ``retry`` those that stopped or failed are left, too, with ``force`` all."""
    over = ("done",) if retry else ("done", "stopped", "failed")
    if force:
        return [], cases, []
    results = [result_of(case, folder) for case in cases]
    left = [case for case, result in zip(cases, results, strict=True) if result.status not in over]
    damaged = [result for result in results if result.damaged]
    return [result for result in results if result.status in over], left, damaged


def write_tables(sweep: Sweep, folder: Path, results: Iterable[Result] = ()) -> dict[str, Result]:
    """Write both tables, from what is in the run folders now, several processes one after the
    other; returns how each run ended. ``results`` of this process hold where a run folder says
    nothing. Raises `InputError`."""
    own = {result.run: result for result in results}
    try:
        with occupied(folder / CASES, wait=True):
            found = {case.run: result_of(case, folder) for case in sweep.distinct}
            found |= {
                run: own[run]
                for run, result in found.items()
                if result.status == "open" and run in own
            }
            for name, rows in zip(
                ("sweep.csv", "cases.csv"), _rows(sweep, folder, found), strict=True
            ):
                text = io.StringIO(newline="")
                csv.writer(text).writerows(rows)
                replace_file(folder / name, text.getvalue())
            (folder / "sweep.h5").unlink(
                missing_ok=True
            )  # version 0.1 had a third table: it would be out of date
    except OSError as error:
        raise InputError(f"{error.filename} cannot be written: {error.strerror}.") from None
    return found


def warnings_of(sweep: Sweep, folder: Path) -> list[str]:
    """Each kind of warning of the runs in the sweep's ``folder`` once, with the first case that has
    it and how many more have."""
    of_runs = ((case.number, report_of(of_case(case, folder))) for case in sweep.distinct)
    return of_cases((number, report.get("warnings", [])) for number, report in of_runs)


def _rows(sweep: Sweep, folder: Path, found: dict[str, Result]) -> tuple[list[Row], list[Row]]:
    """Headings and rows of both tables."""
    histories = {run: [] if found[run].damaged else _history(folder / CASES / run) for run in found}
    headings = sorted((rows[0] for rows in histories.values() if rows), key=len, reverse=True)
    history = list(
        dict.fromkeys(name for names in headings for name in names)
    )  # of all: some bodies cannot yield
    last = [i for i, name in enumerate(history) if name not in _PER_STEP]
    varied = sweep.headings
    head = ["case", "run", "status", *varied]
    steps = [[*head, *history]]
    cases = [[*head, *_COST, *(history[i] for i in last)]]
    for case in sweep.cases:
        result = found[case.run]
        (own, *rows) = histories[case.run] or [[]]
        named = (dict(zip(own, row, strict=False)) for row in rows)
        rows = [[values.get(name, "") for name in history] for values in named]
        own_values = case.values(sweep.keys)
        values_of_keys = [shown(own_values.get(heading)) for heading in varied]
        first = [str(case.number), case.run, result.status, *values_of_keys]
        steps += [[*first, *row] for row in rows]
        report = report_of(of_case(case, folder))
        totals, mesh, seconds = (report.get(name, {}) for name in ("totals", "mesh", "seconds"))
        costs = [
            result.steps,
            seconds.get("total"),
            totals.get("newton_iterations"),
            totals.get("cutbacks"),
        ]
        costs += [mesh.get("cells"), mesh.get("dofs")]
        final = [rows[-1][i] if rows else "" for i in last]
        cases.append([*first, result.message, *map(shown, costs), *final])
    return steps, cases


def _history(run: Path) -> list[Row]:
    """Heading and rows of history.csv; none if there is none."""
    with (
        suppress(OSError),
        require_file(run / "history.csv").open(encoding="utf-8", newline="") as file,
    ):
        return list(csv.reader(file))
    return []


def shown(value: Any) -> str:
    """A value as a table has it: nothing for None, lists as TOML."""
    if value is None or isinstance(value, str):
        return value or ""
    return f"{value:.12g}" if isinstance(value, float) else toml_value(value)
