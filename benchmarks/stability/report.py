"""The lines of the stability benchmark as CSV, as Markdown and as a heat map."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np

from archord.benchmarks.report_files import markdown_table, write_files
from archord.benchmarks.stability.stability import Comparison, Line

_PANELS = 3
_COLUMNS = ("iterations\na step", "cutbacks", "forces", "energy", "expected")
_NOTHING = ("check", None, "")


def row(line: Line) -> dict[str, str]:
    """The entries of a line by heading; what is not there is empty."""
    case, result = line.case, line.result
    first = _worst(line)
    solved = result.steps > 0
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
        "energy error": f"{result.energy:.0e}" if solved and math.isfinite(result.energy_limit) else "",
        "allowed energy error": f"{result.energy_limit:.0e}" if solved and math.isfinite(result.energy_limit) else "",
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


def write_report(lines: list[Line], folder: Path) -> list[Path]:
    """Write stability.csv, stability.md and stability.png into ``folder``; returns the files."""
    rows = [row(line) for line in lines]
    return write_files(folder, "stability", rows, markdown(lines), lambda file: draw(lines, file))


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
    headings = ("case", "status", "steps", "iterations", "cutbacks", "force balance", "energy error", "quantity",
                "value", "expected", "by", "deviation", "seconds", "verdict")  # fmt: skip
    out = [summary(lines)]
    for group in dict.fromkeys(line.case.group for line in lines):
        entries = [row(line) for line in lines if line.case.group == group]
        cells = [[entry[name] for name in headings] for entry in entries]
        out += ["", f"**{group}**", "", *markdown_table(headings, cells)]
    said = [f"- {line.case.name}: {line.result.message}." for line in lines if line.result.message]
    return "\n".join([*out, *(["", "What the runs that stopped said:", "", *said] if said else []), ""])


def draw(lines: list[Line], file: Path) -> None:
    """Draw the heat map: a row per case; iterations per step, cutbacks, and each check as error over limit."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    panels = np.array_split(np.arange(len(lines)), _PANELS if len(lines) >= 10 * _PANELS else 1)
    figure = Figure(figsize=(5.2 * len(panels), 1.2 + 0.17 * len(panels[0])), layout="constrained")
    FigureCanvasAgg(figure)
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
    # a palette makes the file a third as large as matplotlib's own
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=110)
    Image.open(buffer).convert("RGB").quantize(64).save(file, optimize=True)


def _colour(scale: str, value: float | None) -> tuple[float, ...]:
    """White for nothing, blue for cost, from green (error a millionth of the limit) to yellow (at it), red beyond."""
    from matplotlib import colormaps

    if value is None:
        return (1.0, 1.0, 1.0, 1.0)
    if scale == "cost":
        return colormaps["Blues"](0.75 * min(1.0, math.log10(max(value, 3.0) / 3) / 2))
    if not value <= 1:
        return (0.8, 0.1, 0.1, 1.0)
    return colormaps["RdYlGn_r"](0.1 + 0.55 * (1 + math.log10(max(value, 1e-6)) / 6))


def _cells(line: Line) -> list[tuple[str, float | None, str]]:
    """Per column: its scale ("cost", or "check": the error over what is allowed), the value on it, and the words."""
    result = line.result
    known = result.steps > 0 and 0 < result.energy_limit < math.inf
    worst = _worst(line)
    return [
        ("cost", line.iterations_per_step, f"{line.iterations_per_step:.0f}"),
        ("cost", 3.0 * (1 + result.cutbacks), str(result.cutbacks or "")),
        ("check", result.balance / result.balance_limit, f"{result.balance:.0e}") if result.steps else _NOTHING,
        ("check", result.energy / result.energy_limit, f"{result.energy:.0e}") if known else _NOTHING,
        ("check", worst.share, f"{worst.deviation:.0e}") if worst else _NOTHING,
    ]


def _worst(line: Line) -> Comparison | None:
    return max(line.comparisons, key=lambda c: c.share) if line.comparisons else None
