"""The tables of a sweep, gathered from its run folders: sweep.csv and sweep.h5 (a row per case and step), cases.csv (a
row per case)."""

from __future__ import annotations

import csv
import fcntl
import io
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from archord.output.disk import replace_file
from archord.scene.keys import toml_value
from archord.scene.scene import Scene
from archord.studies.cases import Case, Sweep

CASES = "cases"  # the folder of all run folders
FAILURE = "failure.txt"  # what raised in a case that failed: a sentence, and the traceback
ENDED = ("done", "stopped", "failed")
_PER_STEP = ("step", "iterations", "cutbacks", "seconds [s]")  # of history.csv; cases.csv has sums of them
Row = list[Any]


@dataclass(frozen=True)
class Result:
    """How a case ended: ``status`` is "done", "stopped" (no equilibrium, or a file that cannot be written), "failed"
    (an error), "interrupted", "busy" (another process solves it) or "open" (not solved to its end).

    ``seconds`` are those of this process.
    """

    run: str
    status: str
    message: str = ""
    seconds: float = 0.0
    steps: int = 0
    signal: int = 0

    @property
    def ended(self) -> bool:
        """Whether solving it again would give the same."""
        return self.status in ENDED


def report_of(folder: Path) -> dict[str, Any]:
    """The run.json of a case; empty if it has none that can be read."""
    try:
        report = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return report if isinstance(report, dict) else {}


def result_of(folder: Path, report: dict[str, Any] | None = None) -> Result:
    """What the run folder of a case says about it; ``report`` is its run.json, if it was read already."""
    try:
        first = (folder / FAILURE).read_text(encoding="utf-8").partition("\n")[0]
        return Result(folder.name, "failed", first)
    except OSError:
        pass
    report = report_of(folder) if report is None else report
    status = report.get("status")
    steps = len(report.get("steps", []))
    if status in ("done", "stopped", "interrupted"):
        return Result(folder.name, status, report.get("message", ""), steps=steps)
    return Result(folder.name, "open", steps=steps)


@dataclass
class Tables:
    """Headings and rows of both tables; a number is a number, text is text, and None is no value."""

    steps: list[str] = field(default_factory=list)
    step_rows: list[Row] = field(default_factory=list)
    cases: list[str] = field(default_factory=list)
    case_rows: list[Row] = field(default_factory=list)
    results: list[Result] = field(default_factory=list)  # of the distinct cases


def gather(sweep: Sweep, folder: Path, failed: Mapping[str, Result] | None = None) -> Tables:
    """Both tables, from what is in the run folders of ``sweep`` below ``folder`` now.

    ``failed`` are results, by run, that could perhaps not be written there.
    """
    tables, found = Tables(), {}
    for case in sweep.distinct:
        run = folder / CASES / case.run
        report = report_of(run)
        result = result_of(run, report)
        if not result.ended:
            result = (failed or {}).get(case.run, result)
        found[case.run] = result, report, _history(run)
        tables.results.append(result)
    history = next((heading for _, _, (heading, _) in found.values() if heading), [])
    final = [name for name in history if name not in _PER_STEP]
    keys = [heading(key, sweep.cases[0].scene) for key in sweep.keys]
    head = ["case", "run", "status", *keys]
    tables.steps = head + history
    tables.cases = [*head, "message", "steps", "seconds [s]", "iterations", "cutbacks", "cells", "dofs", *final]
    for case in sweep.cases:
        result, report, (_, rows) = found[case.run]
        first = [case.number, case.run, result.status, *(entry(case.value(key)) for key in sweep.keys)]
        tables.step_rows += [[*first, *row] for row in rows]
        last = dict(zip(history, rows[-1], strict=True)) if rows else {}
        tables.case_rows.append([*first, *_cost(result, report), *(last.get(name) for name in final)])
    return tables


def write(sweep: Sweep, folder: Path, failed: Mapping[str, Result] | None = None) -> Tables:
    """Gather and write sweep.csv, sweep.h5 and cases.csv, each in one move; of several processes one after the other.

    Raises `OSError`.
    """
    with alone(folder):
        tables = gather(sweep, folder, failed)
        replace_file(folder / "sweep.csv", _csv(tables.steps, tables.step_rows))
        replace_file(folder / "cases.csv", _csv(tables.cases, tables.case_rows))
        replace_file(folder / "sweep.h5", _hdf5(tables))
    return tables


def heading(key: str, scene: Scene) -> str:
    """The dotted ``key`` with its unit: ``joint.clearance [mm]``."""
    section, _, name = key.partition(".")
    info = type(getattr(scene, section)).model_fields[name]
    extra = info.json_schema_extra
    kind = extra.get("unit") if isinstance(extra, dict) else None
    return f"{key} [{getattr(scene.units, str(kind))}]" if kind else key


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Wait until no other process is here with this ``folder``: the last one to end gathers what all have done."""
    descriptor = os.open(folder / CASES, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _history(run: Path) -> tuple[list[str], list[list[float | int]]]:
    """Headings and rows of history.csv; none if there is none."""
    try:
        text = (run / "history.csv").read_text(encoding="utf-8")
    except OSError:
        return [], []
    first, *rows = csv.reader(io.StringIO(text[: text.rfind("\n") + 1], newline="")) or [[]]
    return first, [[_number(entry) for entry in row] for row in rows]


def _number(text: str) -> float | int:
    return int(text) if text.lstrip("-").isdigit() else float(text)


def entry(value: Any) -> Any:
    """A varied value as a table has it: lists as TOML."""
    return toml_value(value) if isinstance(value, list) else value


def _cost(result: Result, report: dict[str, Any]) -> Row:
    totals, mesh = report.get("totals", {}), report.get("mesh", {})
    seconds = report.get("seconds", {}).get("total")
    counts = [totals.get("newton_iterations"), totals.get("cutbacks"), mesh.get("cells"), mesh.get("dofs")]
    return [result.message, result.steps, seconds, *counts]


def _csv(headings: list[str], rows: list[Row]) -> str:
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(headings)
    writer.writerows([_text(value) for value in row] for row in rows)
    return text.getvalue()


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def _hdf5(tables: Tables) -> bytes:
    """Both tables as compound datasets, ``steps`` and ``cases``, whose fields are the headings of the CSV files."""
    import h5py

    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        for name, headings, rows in (
            ("steps", tables.steps, tables.step_rows),
            ("cases", tables.cases, tables.case_rows),
        ):
            file[name] = _records(headings, rows)
    return memory.getvalue()


def _records(headings: list[str], rows: list[Row]) -> np.ndarray:
    """Rows as a structured array: whole numbers, numbers (nan where there is none) or text."""
    import h5py

    columns = list(zip(*rows, strict=True)) if rows else [()] * len(headings)
    kinds: list[Any] = []
    for column in columns:
        if any(isinstance(value, (str, bool)) for value in column):
            kinds.append(h5py.string_dtype())
        else:
            kinds.append("i8" if column and all(isinstance(value, int) for value in column) else "f8")
    records = np.zeros(len(rows), dtype=list(zip(headings, kinds, strict=True)))
    for name, kind, column in zip(headings, kinds, columns, strict=True):
        if kind == "f8":
            records[name] = [np.nan if value is None else value for value in column]
        else:
            records[name] = list(column) if kind == "i8" else [_text(value) for value in column]
    return records


def of_case(case: Case, folder: Path) -> Path:
    """The run folder of ``case`` in the sweep's ``folder``."""
    return folder / CASES / case.run
