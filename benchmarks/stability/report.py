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

_PANEL = 40  # rows of the heat map side by side with others


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
        f"{len(lines) - solvable} must stop with a sentence; {sum(bool(line.faults) for line in lines)} not as they "
        f"should be.\n\n{Table.of([*map(row, lines)]).markdown()}"
        + (f"\nWhat the runs that stopped said:\n\n{said}" if said else "")
    )


def write(lines: list[Line], folder: Path) -> tuple[str, list[Path]]:
    """Write stability.csv, stability.md and stability.png into ``folder``; returns the Markdown and the files."""
    text = markdown(lines)
    return text, write_report(folder, "stability", [*map(row, lines)], text, lambda file: draw(lines, file))


def draw(lines: list[Line], file: Path) -> Path:
    """Draw the heat map: a row per case, and in it each check's error over what is allowed."""
    panels = np.array_split(np.arange(len(lines)), 1 + len(lines) // _PANEL)
    figure = new_figure(4.5 * len(panels), 1.2 + 0.17 * len(panels[0]))
    # green: a millionth of what is allowed; orange: all of it
    colours = colormaps["RdYlGn_r"].with_extremes(over="firebrick", bad="white")
    for ax, panel in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        some = [lines[i] for i in panel]
        checks = [[line.result.forces, line.result.energy, line.worst] for line in some]
        known = [[check if check and check.allowed < math.inf else None for check in row] for row in checks]
        shares = np.array([[math.log10(max(c.share, 1e-6)) if c else math.nan for c in row] for row in known])
        ax.imshow(np.where(shares > 0, 9.0, shares), colours, aspect="auto", vmin=-8, vmax=4)
        for (i, j), _ in np.ndenumerate(shares):
            check = known[i][j]
            ax.text(j, i, f"{check.error:.0e}" if check else "", ha="center", va="center", fontsize=5.5)
        ax.set_yticks(range(len(some)), [line.case.name for line in some], fontsize=6.5)
        for label, line in zip(ax.get_yticklabels(), some, strict=True):
            label.set_color("firebrick" if line.faults else "steelblue" if line.case.stops else "black")
        ax.set_xticks(range(3), ["forces", "energy", "expected"], fontsize=6.5)
        ax.tick_params(length=0)
    return save(figure, file)
