"""The lines of the stability benchmark as CSV, as Markdown and as a heat map."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib import colormaps

from archord.benchmarks.stability.run import Line
from archord.report.figure import new_figure, save
from archord.report.files import write_report
from archord.report.table import Table

_PANELS = 3
_COLUMNS = ("iterations\na step", "cutbacks", "forces", "energy", "expected")
_NOTHING = ("check", None, "")
_PRINTED = ("case", "status", "steps", "iterations", "cutbacks", "force balance", "energy error", "quantity", "value",
            "expected", "by", "deviation", "seconds", "verdict")  # fmt: skip


def row(line: Line) -> dict[str, str]:
    """The entries of a line by heading; what is not there is empty."""
    case, result = line.case, line.result
    first, solved = line.worst, result.steps > 0
    energy_known = solved and math.isfinite(result.energy_limit)
    return {
        "case": case.name,
        "group": case.group,
        "status": result.status,
        "steps": str(result.steps),
        "iterations": str(result.iterations),
        "iterations/step": f"{line.iterations_per_step:.1f}",
        "cutbacks": str(result.cutbacks),
        "dofs": str(result.dofs),
        "force balance": f"{result.balance:.0e}" if solved else "",
        "allowed balance": f"{result.balance_limit:.0e}" if solved else "",
        "energy error": f"{result.energy:.0e}" if energy_known else "",
        "allowed energy error": f"{result.energy_limit:.0e}" if energy_known else "",
        "quantity": first.expected.quantity if first else "",
        "value": f"{first.value:.8g}" if first else "",
        "expected": f"{first.reference:.8g}" if first else "",
        "by": first.expected.source if first else "",
        "deviation": f"{first.deviation:.1e}" if first else "",
        "tolerance": f"{first.expected.tolerance:g}" if first else "",
        "not finite": ", ".join(result.not_finite),
        "seconds": f"{result.seconds:.1f}",
        "verdict": line.verdict,
        "message": result.message,
        "warnings": " | ".join(result.warnings),
    }


def summary(lines: list[Line]) -> str:
    """One sentence: how many are as they should be."""
    converged = sum(line.result.status == "done" for line in lines)
    must_stop = sum(bool(line.case.stops) for line in lines)
    wrong = sum(bool(line.faults) for line in lines)
    seconds = sum(line.result.seconds for line in lines)
    return (
        f"{len(lines)} scenes in {seconds:.0f} s: {converged} converged of the {len(lines) - must_stop} that have a "
        f"solution, {must_stop} must stop with a sentence; {wrong or 'none'} {'is' if wrong == 1 else 'are'} not as "
        "they should be."
    )


def markdown(lines: list[Line]) -> str:
    """The table, group by group, and the sentences of the runs that stopped."""
    parts = [f"{summary(lines)}\n"]
    for group in dict.fromkeys(line.case.group for line in lines):
        rows = [row(line) for line in lines if line.case.group == group]
        table = Table(*_PRINTED, rows=[[entries[name] for name in _PRINTED] for entries in rows])
        parts += [f"**{group}**\n", table.markdown()]
    said = "".join(f"- {line.case.name}: {line.result.message}.\n" for line in lines if line.result.message)
    return "\n".join([*parts, *(["What the runs that stopped said:\n", said] if said else [])])


def write(lines: list[Line], folder: Path) -> list[Path]:
    """Write stability.csv, stability.md and stability.png into ``folder``; returns the files."""
    rows = [row(line) for line in lines]
    return write_report(folder, "stability", rows, markdown(lines), lambda file: draw(lines, file))


def draw(lines: list[Line], file: Path) -> Path:
    """Draw the heat map: a row per case; iterations per step, cutbacks, and each check as error over limit."""
    panels = np.array_split(np.arange(len(lines)), _PANELS if len(lines) >= 10 * _PANELS else 1)
    figure = new_figure(5.2 * len(panels), 1.2 + 0.17 * len(panels[0]))
    for ax, panel in zip(np.atleast_1d(figure.subplots(1, len(panels))), panels, strict=True):
        some = [lines[i] for i in panel]
        cells = [_cells(line) for line in some]
        ax.imshow([[_colour(scale, value) for scale, value, _ in entries] for entries in cells], aspect="auto")
        for i, entries in enumerate(cells):
            for j, (_, _, text) in enumerate(entries):
                ax.text(j, i, text, ha="center", va="center", fontsize=5.5)
        ax.set_yticks(range(len(some)), [line.case.name for line in some], fontsize=6.5)
        for label, line in zip(ax.get_yticklabels(), some, strict=True):
            label.set_color("firebrick" if line.faults else "steelblue" if line.case.stops else "black")
        ax.set_xticks(range(len(_COLUMNS)), _COLUMNS, fontsize=6.5)
        ax.xaxis.tick_top()
        ax.tick_params(length=0)
        for i in range(1, len(some)):
            if some[i].case.group != some[i - 1].case.group:
                ax.axhline(i - 0.5, color="black", linewidth=0.8)
        ax.spines[:].set_visible(False)
    return save(figure, file)


def _colour(scale: str, value: float | None) -> tuple[float, ...]:
    """White for nothing, blue for cost, from green (error a millionth of the limit) to yellow (at it), red beyond."""
    if value is None:
        return (1.0, 1.0, 1.0, 1.0)
    if scale == "cost":
        return colormaps["Blues"](0.75 * min(1.0, math.log10(max(value, 3.0) / 3) / 2))
    if not value <= 1:
        return (0.8, 0.1, 0.1, 1.0)
    return colormaps["RdYlGn_r"](0.1 + 0.55 * (1 + math.log10(max(value, 1e-6)) / 6))


def _cells(line: Line) -> list[tuple[str, float | None, str]]:
    """Per column: its scale ("cost", or "check": the error over what is allowed), the value on it, and the words."""
    result, worst = line.result, line.worst
    known = result.steps > 0 and 0 < result.energy_limit < math.inf
    return [
        ("cost", line.iterations_per_step, f"{line.iterations_per_step:.0f}"),
        ("cost", 3.0 * (1 + result.cutbacks), str(result.cutbacks or "")),
        ("check", result.balance / result.balance_limit, f"{result.balance:.0e}") if result.steps else _NOTHING,
        ("check", result.energy / result.energy_limit, f"{result.energy:.0e}") if known else _NOTHING,
        ("check", worst.share, f"{worst.deviation:.0e}") if worst else _NOTHING,
    ]
