"""The lines of the stability benchmark as CSV, as Markdown and as a heat map."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib import colormaps

from archord.benchmarks.stability.run import Check, Line
from archord.report.figure import new_figure, save
from archord.report.files import write_report
from archord.report.table import Table

_COLUMNS = ("iterations\na step", "cutbacks", "forces", "energy", "expected")
_PANEL = 40  # rows of the heat map side by side with others
_WHITE = (1.0, 1.0, 1.0, 1.0)


def row(line: Line) -> dict[str, object]:
    """The entries of a line by heading; what is not there is empty."""
    case, result, worst = line.case, line.result, line.worst
    energy = result.energy if result.energy and result.energy.allowed < math.inf else None
    return {
        "group": case.group,
        "case": case.name,
        "status": result.status,
        "steps": result.steps,
        "iterations": result.iterations,
        "cutbacks": result.cutbacks,
        "force balance": f"{result.forces.error:.0e}" if result.forces else "",
        "energy error": f"{energy.error:.0e}" if energy else "",
        "quantity": worst.expected.quantity if worst else "",
        "value": f"{worst.value:.8g}" if worst else "",
        "expected": f"{worst.reference:.8g}" if worst else "",
        "by": worst.expected.source if worst else "",
        "deviation": f"{worst.error:.1e}" if worst else "",
        "seconds": f"{result.seconds:.1f}",
        "verdict": line.verdict,
    }


def markdown(lines: list[Line]) -> str:
    """How many are as they should be, the table, and the sentences of the runs that stopped."""
    converged = sum(line.result.status == "done" for line in lines)
    solvable = sum(not line.case.stops for line in lines)
    seconds = sum(line.result.seconds for line in lines)
    said = "".join(f"- {line.case.name}: {line.result.message}.\n" for line in lines if line.result.message)
    return (
        f"{len(lines)} scenes in {seconds:.0f} s: {converged} converged of the {solvable} that have a solution, "
        f"{len(lines) - solvable} must stop with a sentence; {sum(bool(line.faults) for line in lines) or 'none'} of "
        f"all not as they should be.\n\n{Table.of([*map(row, lines)]).markdown()}"
        + (f"\nWhat the runs that stopped said:\n\n{said}" if said else "")
    )


def write(lines: list[Line], folder: Path) -> list[Path]:
    """Write stability.csv, stability.md and stability.png into ``folder``; returns the files."""
    return write_report(folder, "stability", [*map(row, lines)], markdown(lines), lambda file: draw(lines, file))


def draw(lines: list[Line], file: Path) -> Path:
    """Draw the heat map: a row per case; iterations per step, cutbacks, and each check as error over limit."""
    panels = np.array_split(np.arange(len(lines)), 1 + len(lines) // _PANEL)
    figure = new_figure(5.2 * len(panels), 1.2 + 0.17 * len(panels[0]))
    for ax, panel in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        some = [lines[i] for i in panel]
        cells = [_cells(line) for line in some]
        ax.imshow([[colour for colour, _ in entries] for entries in cells], aspect="auto")
        for i, entries in enumerate(cells):
            for j, (_, text) in enumerate(entries):
                ax.text(j, i, text, ha="center", va="center", fontsize=5.5)
        ax.set_yticks(range(len(some)), [line.case.name for line in some], fontsize=6.5)
        for label, line in zip(ax.get_yticklabels(), some, strict=True):
            label.set_color("firebrick" if line.faults else "steelblue" if line.case.stops else "black")
        ax.set_xticks(range(len(_COLUMNS)), _COLUMNS, fontsize=6.5)
        ax.xaxis.tick_top()
        ax.tick_params(length=0)
    return save(figure, file)


def _cells(line: Line) -> list[tuple[tuple[float, ...], str]]:
    """Colour and text of every column."""
    result = line.result
    a_step = result.iterations / max(1, result.steps)  # failed attempts included
    costs = [(a_step, f"{a_step:.0f}"), (3 * (1 + result.cutbacks), str(result.cutbacks or ""))]
    blue = [(colormaps["Blues"](0.75 * min(1, math.log10(max(cost, 3) / 3) / 2)), text) for cost, text in costs]
    return [*blue, *(_checked(check) for check in (result.forces, result.energy, line.worst))]


def _checked(check: Check | None) -> tuple[tuple[float, ...], str]:
    """From green (error a millionth of the limit) to yellow (at it), red beyond; white where there is none."""
    if check is None or math.isinf(check.allowed):
        return _WHITE, ""
    green_to_yellow = 0.1 + 0.55 * (1 + math.log10(max(check.share, 1e-6)) / 6)
    return colormaps["RdYlGn_r"](green_to_yellow) if check.share <= 1 else (0.8, 0.1, 0.1, 1.0), f"{check.error:.0e}"
