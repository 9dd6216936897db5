"""Error against run time, archord's beside other codes' in one session: ``archord benchmark
work-precision``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from archord.benchmarks.cost.work_precision_codes import CASES, Point, points, profile_error
from archord.benchmarks.timing import Said, Timing, time_all
from archord.benchmarks.work_precision_picture import STEM, cases, draw, short_table
from archord.report.by_name import Amounts, ByName
from archord.report.files import write_rows, write_text

NAMES = ("P", "p0", "eps", "profile", "dissipation")


@dataclass(frozen=True)
class Line:
    """A point, timed, and what it found, empty if it failed."""

    point: Point
    timing: Timing

    @property
    def found(self) -> ByName:
        """The result of the last run."""
        return {} if self.timing.failure else self.timing.runs[-1].result

    @property
    def errors(self) -> Amounts:
        """Relative errors by quantity against the reference of the code's kinematics."""
        case = CASES[self.point.case]
        kinematics = self.found.get("kinematics", "current")
        exact = case[kinematics]
        errors = {
            name: abs(value / exact[name][0] - 1)
            for name, value in self.found.items()
            if name in exact
        }
        if "profile" in self.found:
            known = np.array(case["profile"][kinematics])
            errors["profile"] = profile_error(self.found["profile"], known)
        return errors


def run(folder: Path, only: Sequence[str], repeats: int, limit: float, said: Said) -> list[Line]:
    """Time the points that fit ``only`` below ``folder`` (see `time_all`), for ``limit`` seconds
    each at most."""
    chosen = points(only)
    timings = time_all([point.process(folder, limit) for point in chosen], repeats, said)
    return [Line(*pair) for pair in zip(chosen, timings, strict=True)]


def write(lines: Sequence[Line], folder: Path) -> tuple[str, list[Path]]:
    """Write the points of each case as CSV, and a short table and a picture of all cases of
    ``folder``; returns the table and the files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for case in CASES:
        rows = [row(line) for line in lines if line.point.case == case]
        if rows:
            files.append(folder / f"{STEM}{case}.csv")
            write_rows(rows, files[-1])
    tables = cases(folder)
    codes = dict.fromkeys(f"{line.point.code} {line.point.version}".strip() for line in lines)
    parts = [f"{', '.join(codes)}\n"]
    parts += [f"**{case}**\n\n{short_table(table)}" for case, table in tables.items()]
    text = "\n".join(parts)
    files += [folder / "work_precision.md", folder / "work_precision.png"]
    write_text(text, files[-2])
    draw(tables, files[-1])
    return text, files


def row(line: Line) -> dict[str, object]:
    """The entries of a point by heading; what is not known is empty."""
    point = line.point
    found = line.found
    errors = line.errors
    entries = {
        "code": point.code,
        "series": point.series,
        "mesh": f"{point.size:g} R",
        "dofs": found.get("dofs", ""),
        "steps": point.steps,
        "iterations": found.get("iterations", ""),
        "factorisations": found.get("factorisations", ""),
    }
    force = CASES[point.case].get("force", "P/(E* R)")
    entries |= dict.fromkeys(("seconds", "from - to", "MB", force), "")
    if found:
        runs = line.timing.runs
        seconds = sorted(run.seconds for run in runs)
        entries["seconds"] = f"{line.timing.median:.4g}"
        entries["from - to"] = f"{seconds[0]:.4g} - {seconds[-1]:.4g}"
        entries["MB"] = f"{max(run.memory for run in runs) / 1e6:.0f}"
    if "P" in found:
        entries[force] = f"{found['P']:.8g}"
    for name in quantities(point.case):
        entries[f"error of {name}"] = f"{errors[name]:.1e}" if name in errors else ""
    entries["error of the reference"] = CASES[point.case]["current"]["P"][1]
    return entries | {"failure": line.timing.failure}


def quantities(case: str) -> list[str]:
    """What ``case`` is judged by."""
    known = CASES[case].keys() | CASES[case]["current"].keys()
    return [name for name in NAMES if name in known]
