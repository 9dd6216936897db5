"""A map of the cases of the stability benchmark: one square a case, coloured by what happened."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.patches import Patch, Rectangle

from archord.output.user_file import save_figure
from archord.report.figure import new_figure

# what happened, and its colour (ColorBrewer's blues and orange, which colour-blind readers tell
# apart)
_EASY = "up to 6 iterations a step", "#c6dbef"
_HARDER = "up to 20", "#6baed6"
_HARD = "more", "#08519c"
_STOPS = "no solution: stops and says why", "#bdbdbd"
_WRONG = "not as it should be", "#e6550d"
_KINDS = (_EASY, _HARDER, _HARD, _STOPS, _WRONG)
_SQUARE = 0.24  # inches
_NAMES = 2.8  # inches, of the groups
_LEAST = 7.5  # inches
_LEGEND = 0.9


def what_happened(row: Mapping[str, object]) -> tuple[str, str]:
    """The kind of a ``row`` of the benchmark's table, in words, and its colour."""
    if row["verdict"] not in ("converges", "stops, as it must"):
        return _WRONG
    if row["status"] != "done":
        return _STOPS
    iterations = float(str(row["iterations"])) / max(int(str(row["steps"])), 1)
    if iterations <= 6:
        return _EASY
    return _HARDER if iterations <= 20 else _HARD


def draw(rows: Sequence[Mapping[str, object]], file: Path) -> None:
    """Draw the map of the ``rows``, one line a group, in their order."""
    groups: dict[str, list[str]] = {}
    for row in rows:
        groups.setdefault(str(row["group"]), []).append(what_happened(row)[1])
    widest = max(len(colours) for colours in groups.values())
    width = max(_SQUARE * widest + _NAMES, _LEAST)
    figure = new_figure(width, _SQUARE * len(groups) + _LEGEND)
    ax = figure.subplots()
    ax.set(xlim=(0, widest), ylim=(len(groups), 0), aspect="equal", xticks=[])
    ax.set_yticks(np.arange(len(groups)) + 0.5, list(groups), fontsize=11)
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    for line, colours in enumerate(groups.values()):
        for j, colour in enumerate(colours):
            ax.add_patch(Rectangle((j + 0.1, line + 0.1), 0.8, 0.8, color=colour))
    figure.legend(
        handles=[Patch(color=colour, label=said) for said, colour in _KINDS],
        loc="outside upper left",
        ncols=2,
        frameon=False,
        fontsize=11,
    )
    save_figure(figure, file)
