"""Every problem of others beside the published values, as a table with verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from archord.benchmarks.case import matches, write_table
from archord.benchmarks.outside import eyebar, kratos, nafems, others
from archord.benchmarks.outside.problem import Outside
from archord.benchmarks.timing import Said
from archord.report.files import Row

PROBLEMS = (*nafems.PROBLEMS, *others.PROBLEMS, *kratos.PROBLEMS, *eyebar.PROBLEMS)


def chosen(pattern: str) -> Sequence[Outside]:
    """The problems whose names contain the ``pattern``, or match it."""
    return [problem for problem in PROBLEMS if matches(pattern, problem.name)]


def run(problems: Sequence[Outside], say: Said) -> list[Row]:
    """Solve ``problems``; a row for each published value."""
    rows = []
    for problem in problems:
        rows += problem.rows()
        say(problem.name)
    return rows


def write(
    rows: Sequence[Row], problems: Sequence[Outside], folder: Path
) -> tuple[str, Sequence[Path]]:
    """Write the table of the ``rows``, with the verdicts on the ``problems`` below; the text and
    the files."""
    said = "\n".join(f"- **{p.name}** ({p.source}): {p.verdict}" for p in problems)
    return write_table(folder, "outside", rows, f"\n{said}\n")
