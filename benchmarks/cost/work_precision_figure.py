"""The log-log diagrams of the work-precision benchmark: relative error against wall time and against dofs."""

from __future__ import annotations

import io
from pathlib import Path

from archord.benchmarks.cost.work_precision import Line, series_of
from archord.benchmarks.cost.work_precision_cases import Case
from archord.benchmarks.cost.work_precision_codes import CALCULIX, OURS

_NAMES = {
    "P": "P",
    "p0": "p0",
    "eps": "contact angle",
    "profile": "pressure profile (L2)",
    "dissipation": "plastic dissipation",
}
_MARKERS = "os^Dvphx*"
_COLOURS = {OURS: "tab:red", CALCULIX: "tab:blue"}
_OTHERS = ("tab:green", "tab:purple", "tab:brown", "tab:olive", "tab:cyan", "tab:pink")
_FLOOR = 1e-9  # an error of zero has no place on a logarithmic axis


def draw(case: Case, lines: list[Line], path: Path) -> None:
    """Draw the diagram of ``case``: P above, the other quantities below; grey is what the reference does not know."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    others = [name for name in case.quantities if name != "P"]
    figure = Figure(figsize=(4.1 * max(len(others), 3), 11.5), layout="constrained")
    FigureCanvasAgg(figure)
    top, bottom = figure.subfigures(2, 1, height_ratios=(1.15, 1.6))
    above = top.subplots(1, 2)
    below = bottom.subplots(2, len(others), sharey="col", squeeze=False)
    styles = _styles(lines, case.name)
    for ax, against in zip(above, ("seconds", "dofs"), strict=True):
        _panel(ax, lines, case, "P", against, styles)
    for column, name in enumerate(others):
        for k, against in enumerate(("seconds", "dofs")):
            _panel(below[k, column], lines, case, name, against, styles)
    handles, labels = above[0].get_legend_handles_labels()
    top.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=8, frameon=False, title=case.title)
    # a palette makes the file a third as large as matplotlib's own
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=80)
    Image.open(buffer).convert("RGB").quantize(64).save(path, optimize=True)


def _styles(lines: list[Line], case: str) -> dict[tuple[str, str], dict]:
    """A colour for each code, a marker for each of its series."""
    styles: dict[tuple[str, str], dict] = {}
    count: dict[str, int] = {}
    strangers = iter(_OTHERS * 4)
    colours = dict(_COLOURS)
    for code, series in series_of(lines, case):
        if code not in colours:
            colours[code] = next(strangers)
        k = count[code] = count.get(code, -1) + 1
        marker = _MARKERS[k % len(_MARKERS)]
        styles[code, series] = {"color": colours[code], "marker": marker, "markersize": 5, "linewidth": 1.1}
        styles[code, series] |= {"linestyle": ("-", "--", ":", "-.")[k % 4], "label": f"{code}, {series}"}
    return styles


def _panel(ax, lines: list[Line], case: Case, quantity: str, against: str, styles: dict) -> None:
    for key, members in series_of(lines, case.name).items():
        points = [(_abscissa(line, against), line.errors[quantity]) for line in members if quantity in line.errors]
        if points:
            x, errors = zip(*points, strict=True)
            ax.loglog(x, [max(e, _FLOOR) for e in errors], **styles[key])
        elif quantity == "P":
            ax.loglog([], [], **styles[key])
    # a point of whatever code holds the errors of the reference of its kinematics
    unknown = max((line.reference.errors.get(quantity, 0.0) for line in lines if line.point.done), default=0.0)
    if unknown:
        bottom = min(ax.get_ylim()[0], unknown / 2)
        ax.axhspan(bottom, unknown, color="0.9", zorder=0)
        ax.set_ylim(bottom=bottom)
    ax.set_xlabel("wall time of the whole process [s]" if against == "seconds" else "degrees of freedom", fontsize=8)
    ax.set_title(f"relative error of {_NAMES[quantity]}", fontsize=9)
    ax.tick_params(labelsize=7, which="both")
    ax.grid(True, which="major", linewidth=0.4)


def _abscissa(line: Line, against: str) -> float:
    values = line.point.values
    return line.point.median if against == "seconds" or values is None else float(values.dofs)
