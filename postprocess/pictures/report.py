"""A run as a report of two or three pages: what was solved, how it went, what came of it, as a PDF
file."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.measures.energies import ENERGIES
from archord.output.user_file import check_target, writing
from archord.postprocess.arrays.fields import Fields
from archord.postprocess.pictures.pictures import panels_of
from archord.postprocess.pictures.problems import draw_outline, frame
from archord.postprocess.run import Run
from archord.postprocess.tables import (
    cost_of,
    facts_of,
    first_of_each_kind,
    history_table,
    named_table,
    peaks_of,
    spread,
)
from archord.report.by_name import ByName
from archord.report.errors import InputError
from archord.report.figure import new_figure
from archord.report.files import is_device
from archord.report.version import VERSION

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PAGE = (8.27, 11.69)  # A4, in inches
_MARGIN = 0.08  # of the page's width
_SMALL = 7.0  # points
_CHARACTERS = 112  # of a line of such text
_LINES = 84  # of a page of it
_LINES_BELOW = 58  # of a page below the mesh
_TITLE = 36  # characters of a panel's title
_ROWS = 30  # of the table of steps
_MOST_WARNINGS = 20

_BALANCES = ("force_balance", "energy_balance", "newton_residual")


def write_report(run: Run, target: Path, *, force: bool = False) -> Path:
    """Write the report of ``run`` as the PDF file ``target``; returns it. The file is written
    beside and moved. Raises `InputError` for a run without an accepted step, and if ``target`` is
    there and ``force`` is not given."""
    from matplotlib.backends.backend_pdf import PdfPages

    run.number(None)
    if target.suffix.lower() != ".pdf" and not is_device(target):
        raise InputError(target, "must end in .pdf, as a report is a PDF file.")
    check_target(target, force=force)
    # all is drawn before the file is begun: what a run lacks is told first
    figures = list(_pages_of(run))
    # in memory: on a full disk PdfPages fails once more as it closes, with an error of its own
    report = BytesIO()
    metadata = {"Title": f"archord: {run.folder}", "Creator": f"archord {VERSION}"}
    with PdfPages(report, metadata=metadata) as pages:
        for number, figure in enumerate(figures, 1):
            _foot(figure, run, number, len(figures))
            pages.savefig(figure)
    with writing(target) as new:
        new.write_bytes(report.getvalue())
    return target


def _text_of(run: Run) -> list[str]:
    """What was solved, what came of it, cost, versions, warnings, and the table of steps, in
    lines."""
    lines = [*_wrapped(run.message), *_listed(facts_of(run)), "", *_wrapped(peaks_of(run)), ""]
    lines += _listed(row for row in cost_of(run) if row[0] != "warning")
    warnings = first_of_each_kind(run.warnings)
    told = [("warning", warning) for warning in warnings[:_MOST_WARNINGS]]
    more = len(warnings) - len(told)
    if more:
        told.append(("", f"{more} more in {run.folder / 'run.json'}"))
    lines += ["", *_listed(told or [("warnings", "none")]), ""]
    table = history_table(run)
    n = spread(table, _ROWS)
    if n > _ROWS:
        lines += [f"{_ROWS} of {n} steps; {run.folder / 'history.csv'} has all of them", ""]
    return lines + table.within(_CHARACTERS).splitlines()


def _pages_of(run: Run) -> Iterator[Figure]:
    """The pages in their order; the text goes on behind the pictures where the first page is
    full."""
    lines = _text_of(run)
    figure = _page(
        f"{run.folder.resolve().name}: {run.status}, {run.steps} of {len(run.scene.targets)} steps"
    )
    room = _LINES
    text = figure
    if run.scene.output.fields and run.kinematics.dimension == 2:
        mesh, text = figure.subfigures(2, 1, height_ratios=[1, 2.2])
        _draw_mesh(mesh.subplots(), run, run.fields(run.number(None)))
        room = _LINES_BELOW
    _put(text, lines[:room])
    yield figure
    yield _results_page(run)
    for k in range(room, len(lines), _LINES):
        figure = _page("continued")
        _put(figure, lines[k : k + _LINES])
        yield figure


def _results_page(run: Run) -> Figure:
    """Field, contact pressure and forces, and how the solve converged."""
    figure = _page("results and convergence")
    panels = [*panels_of(run)]
    panels += [partial(draw, run) for draw in (_iterations_panel, _balance_panel, _energy_panel)]
    rows = (len(panels) + 1) // 2
    axes = figure.subplots(rows, 2, squeeze=False).ravel()
    for place, draw in zip(axes, panels, strict=False):
        draw(place)
        title = [textwrap.fill(line, _TITLE) for line in place.get_title().splitlines()]
        place.set_title("\n".join(title), fontsize="medium")
    for place in axes[len(panels) :]:
        place.set_axis_off()
    return figure


def _iterations_panel(run: Run, axes: Any) -> None:
    steps = run.columns["step"]
    axes.bar(steps, run.columns["iterations"], color="tab:blue", label="Newton iterations")
    if any(run.columns["cutbacks"]):
        axes.plot(steps, run.columns["cutbacks"], "o", color="tab:red", label="cutbacks")
    totals = run.summary["totals"]
    iterations = f"{totals.get('newton_iterations', 0):g} iterations"
    title = f"{iterations}, {totals.get('cutbacks', 0):g} cutbacks"
    axes.set(xlabel="step", ylabel="number", title=title)
    _finish(axes)


def _balance_panel(run: Run, axes: Any) -> None:
    steps = run.columns["step"]
    balance = np.abs(np.nan_to_num(run.columns.get("force_balance", [0.0] * run.steps)))
    residuals = [_last_residual(step) for step in run.summary["steps"]]
    curves = {"force balance": balance, "last residual": residuals[: run.steps]}
    for name, values in curves.items():
        shown = [value or np.nan for value in values]
        if np.isfinite(shown).any():
            axes.semilogy(steps[: len(shown)], shown, ".-", label=name)
    estimates = run.summary.get("error_estimates", {})
    known = {name: estimates.get(name) for name in _BALANCES}
    told = [
        f"{name.replace('_', ' ')} {value:.1e}"
        for name, value in known.items()
        if value is not None
    ]
    axes.set(xlabel="step", ylabel="relative error", title=", ".join(told))
    _finish(axes)


def _energy_panel(run: Run, axes: Any) -> None:
    for name in ("work", *ENERGIES):
        if name in run.columns:
            values = run.columns[name]
            axes.plot(run.columns["step"], values, ".-", label=name.replace("_", " "))
    unit = run.units.get("work", "-")
    axes.set(xlabel="step", ylabel=f"energy [{unit}]", title="energy balance")
    _finish(axes)


def _finish(axes: Any) -> None:
    if axes.get_legend_handles_labels()[1]:
        axes.legend(frameon=False, fontsize="small")
    axes.grid(alpha=0.3)


def _last_residual(step: ByName) -> float:
    """The residual with which the last solve of a step ended; NaN where none is known."""
    solves = [residuals for residuals in step.get("residuals", []) if residuals]
    last = solves[-1][-1] if solves else None
    return float("nan") if last is None else float(last)


def _draw_mesh(axes: Any, run: Run, fields: Fields) -> None:
    """The cells as they were drawn, each body in a tint, and the outline."""
    from matplotlib import colormaps
    from matplotlib.collections import PolyCollection

    corners = 3 if fields.cells.shape[1] == 6 else 4
    for k, (name, tag) in enumerate(fields.bodies.items()):
        cells = fields.coordinates[fields.cells[fields.body == tag][:, :corners]]
        style = {"edgecolors": "0.5", "linewidths": 0.2, "label": name}
        tint = colormaps["Pastel2"](k % 8)
        axes.add_collection(PolyCollection(cells, facecolors=[tint], **style))
    draw_outline(axes, fields, fields.coordinates, color="black", lw=0.8)
    axes.autoscale_view()
    frame(axes, run)
    axes.set(title="mesh")
    axes.legend(frameon=False, fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _page(title: str) -> Figure:
    figure = new_figure(*_PAGE)
    figure.get_layout_engine().set(rect=(0.03, 0.04, 0.94, 0.93), hspace=0.04, wspace=0.06)
    figure.suptitle(title, x=_MARGIN, ha="left", fontsize="large", fontweight="bold")
    return figure


def _foot(figure: Figure, run: Run, number: int, of: int) -> None:
    when = datetime.now(UTC).strftime("%Y-%m-%d")
    solved_by = run.summary["versions"].get("archord", "?")
    said = f"archord {solved_by}, report by {VERSION}, {when}; {run.folder}"
    figure.text(_MARGIN, 0.015, said, fontsize=_SMALL, color="0.4")
    figure.text(1 - _MARGIN, 0.015, f"{number} / {of}", fontsize=_SMALL, color="0.4", ha="right")


def _listed(rows: Iterable[tuple[str, str]]) -> list[str]:
    """Text behind names, wrapped."""
    return str(named_table(rows, _CHARACTERS - 26, 24, cut=True)).splitlines()


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, _CHARACTERS)


def _put(figure: Any, lines: Sequence[str]) -> None:
    """Lines of small text from the top of a page or its part."""
    text = "\n".join(lines)
    # not for mathtext: a dollar in a name is a dollar
    figure.text(
        _MARGIN,
        0.96,
        text,
        va="top",
        family="monospace",
        fontsize=_SMALL,
        parse_math=False,
        transform=figure.transSubfigure,
    )
