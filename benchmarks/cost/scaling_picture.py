"""Time over dofs on one rank and on several, with slopes: the picture of ``archord benchmark
scaling``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from archord.output.user_file import save_figure
from archord.report.figure import new_figure

_COLOURS = {"elastic": "#0072B2", "plastic": "#D55E00"}
_DASHES = {1: "-", 2: "--", 4: ":"}
_TEXT = 13  # points


def draw(costs: Sequence[Mapping[str, Any]], file: Path) -> None:
    """Draw the seconds of ``costs``, of runs with "material", "ranks", "dofs" and "total"."""
    figure = new_figure(7.5, 5)
    ax = figure.subplots()
    series: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for cost in costs:
        key = cost["material"], cost["ranks"]
        series.setdefault(key, []).append((cost["dofs"], cost["total"]))
    for (material, ranks), points in series.items():
        dofs, seconds = np.transpose(sorted(points))
        said = f"{material}, {ranks} rank{'s' if ranks > 1 else ''}"
        ax.loglog(
            dofs,
            seconds,
            marker="o",
            linestyle=_DASHES.get(ranks, "-."),
            color=_COLOURS[material],
            label=said,
        )
    dofs = [cost["dofs"] for cost in costs]
    if min(dofs) < max(dofs):
        _draw_slope(ax, (min(dofs), max(dofs)), max(cost["total"] for cost in costs), 1.0)
    ax.set_xlabel("degrees of freedom", fontsize=_TEXT)
    ax.set_ylabel("seconds, whole process", fontsize=_TEXT)
    ax.tick_params(labelsize=_TEXT - 1)
    ax.grid(True, linewidth=0.4)
    ax.legend(fontsize=_TEXT - 1)
    save_figure(figure, file)


def _draw_slope(ax: Axes, ends: tuple[float, float], top: float, power: float) -> None:
    """A triangle whose long side rises with this ``power``, at the right below the curves."""
    right = ends[1]
    left = right / (ends[1] / ends[0]) ** 0.25
    low = top / (right / left) ** (2 * power)
    high = low * (right / left) ** power
    ax.loglog([left, right, right, left], [low, low, high, low], color="0.3", linewidth=1)
    ax.annotate(
        f" {power:g}", (right, np.sqrt(low * high)), fontsize=_TEXT - 2, va="center", color="0.3"
    )
