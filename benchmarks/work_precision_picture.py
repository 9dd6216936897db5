"""Error of P over the wall time of a whole process, one line a code: a picture and a short table,
made from the CSV tables of ``archord benchmark work-precision``.

    python3 -m archord.benchmarks.work_precision_picture docs/data

draws the picture of the tables of a folder there, and prints the short tables.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, StrMethodFormatter

from archord.output.user_file import save_figure
from archord.report.figure import new_figure
from archord.report.table import Table

STEM = "work_precision_"  # of the CSV tables; a case follows
LEVELS = (1e-2, 1e-3, 1e-4, 1e-5)
# colours that colour-blind readers tell apart (Okabe, Ito 2008), and markers
_STYLES = {
    "archord": ("#0072B2", "o"),
    "CalculiX": ("#D55E00", "v"),
    "scikit-fem": ("#009E73", "s"),
    "GetFEM": ("#CC79A7", "D"),
    "NGSolve": ("#E69F00", "^"),
    "Kratos": ("#000000", "P"),
    "asimov-contact": ("#56B4E9", "X"),
}
_OTHER = ("0.4", "x")
_TEXT = 14  # points, to be read on a telephone
_PANEL = (4.2, 3.8)  # inches
_COLUMNS = 2  # of panels


def cases(folder: Path) -> dict[str, pd.DataFrame]:
    """The tables of ``folder`` by case, of the points that found P.

    A column ``kept`` is added, the error from a mesh on: as large as any on a finer mesh of the
    same series, since an error that passes through zero on one mesh proves nothing of the method.
    """
    found = {}
    for file in sorted(folder.glob(f"{STEM}*.csv")):
        table = pd.read_csv(file)
        errors = table.groupby(["code", "series"])["error of P"]
        table["kept"] = errors.transform(lambda errors: errors[::-1].cummax()[::-1])
        found[file.stem.removeprefix(STEM).replace("_", " ")] = table
    return found


def front(points: pd.DataFrame) -> pd.DataFrame:
    """Those of the ``points`` of a code that no other beats in both seconds and ``kept`` error, in
    the order of their seconds."""
    ordered = points.dropna(subset=["seconds", "kept"]).sort_values(["seconds", "kept"])
    best_before = ordered["kept"].cummin().shift(fill_value=np.inf)
    return ordered[ordered["kept"] < best_before]


def short_table(table: pd.DataFrame) -> str:
    """Per code and error the cheapest point: seconds, dofs and memory; and what failed."""
    short = Table("code", *(f"error {level:g}" for level in LEVELS), "smallest error", "failed")
    for code, points in table.groupby("code", sort=False):
        kept = front(points)
        cells = [_cheapest(kept[kept["kept"] <= level]) for level in LEVELS]
        smallest = f"{kept['kept'].min():.1e}" if len(kept) else "none"
        failed = points[points["failure"].notna()]
        said = [f"{p.series}, {p.mesh}: {p.failure}" for p in failed.itertuples()]
        short.add(code, *cells, smallest, "; ".join(said))
    return short.markdown()


def _cheapest(reached: pd.DataFrame) -> str:
    """The first of the points that reach an error, in words."""
    if reached.empty:
        return "never"
    first = reached.iloc[0]
    return f"{first['seconds']:.3g} s, {first['dofs']:.0f} dofs, {first['MB']:.0f} MB"


def draw(tables: dict[str, pd.DataFrame], file: Path) -> None:
    """Draw the cases of ``tables`` side by side: the front of each code, its points faint behind,
    and grey what the reference does not know."""
    wide, high = _PANEL
    columns = min(len(tables), _COLUMNS)
    rows = -(-len(tables) // columns)
    figure = new_figure(wide * columns, high * rows)
    grid = figure.subplots(rows, columns, squeeze=False)
    panels = grid.ravel()[: len(tables)]
    spare = grid.ravel()[len(tables) :]
    for unused in spare:
        unused.set_axis_off()
    for ax, (case, table) in zip(panels, tables.items(), strict=True):
        for code, points in table.groupby("code", sort=False):
            _draw_code(ax, str(code), points)
        unknown = table["error of the reference"].max()
        bottom = min(ax.get_ylim()[0], unknown / 2)
        ax.axhspan(bottom, unknown, color="0.88", zorder=0)
        ax.set_ylim(bottom=bottom)
        ax.set_title(case, fontsize=_TEXT + 2)
        ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.tick_params(labelsize=_TEXT - 2)
        ax.grid(True, linewidth=0.4)
    figure.supxlabel("seconds, whole process", fontsize=_TEXT)
    figure.supylabel("relative error of P", fontsize=_TEXT)
    shown = dict[str, Artist]()
    for ax in panels:
        lines, names = ax.get_legend_handles_labels()
        shown |= dict(zip(names, lines, strict=True))
    place = {"loc": "outside upper center", "ncols": min(len(shown), 3)}
    if len(spare):
        place = {"loc": "center", "ncols": 1}
    on = spare[0] if len(spare) else figure
    on.legend(shown.values(), shown.keys(), fontsize=_TEXT, frameon=False, **place)
    save_figure(figure, file)


def _draw_code(ax: Axes, code: str, points: pd.DataFrame) -> None:
    """The front of a code as a line, and all its points."""
    colour, marker = _STYLES.get(code, _OTHER)
    best = front(points)
    ax.loglog(
        points["seconds"], points["error of P"], marker, color=colour, alpha=0.25, markersize=5
    )
    width = 3.0 if code == "archord" else 1.8
    ax.loglog(
        best["seconds"], best["kept"], f"{marker}-", color=colour, label=code, linewidth=width
    )


def main(folder: Path) -> None:
    """Draw the picture of the tables of ``folder`` there, and print the short tables."""
    tables = cases(folder)
    for case, table in tables.items():
        print(f"**{case}**\n\n{short_table(table)}")
    draw(tables, folder / f"{STEM.rstrip('_')}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
