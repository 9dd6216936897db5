"""Pictures of a run, a file each: force, pressure, field and iterations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from archord.output.output_file import check_output, writing
from archord.postprocess import panels
from archord.postprocess.run_result import Run

DOTS = 110  # per inch


def new_figure(width: float, height: float) -> Any:
    """A figure so wide and high in inches that belongs to no window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Any, target: Path) -> Path:
    """Write ``figure`` as ``target``; returns it. Raises `InputError` if it cannot be written."""
    with writing(target):
        figure.savefig(target, dpi=DOTS)
    return target


def draw_run(run: Run, folder: Path) -> tuple[list[Path], list[str]]:
    """Draw ``run`` into the existing ``folder``; the files, and a sentence for each picture that is left out.

    Raises `InputError` if the run has no accepted step, a file of it is damaged, or one cannot be written.
    """
    run.number(None)
    drawings: dict[str, Callable[[Any, Run], None]] = {"force.png": _force, "pressure.png": _pressure}
    left_out = []
    if run.scene.output.fields:
        drawings["field.png"] = _field
    else:
        left_out.append("no picture of the field: the run was solved with output.fields = false.")
    drawings["iterations.png"] = _iterations
    for name in drawings:
        check_output(folder / name)
    figures = {}
    for name, draw in drawings.items():
        figures[name] = new_figure(*_SIZES[name])
        if name == "field.png" and run.scene.joint.model == "ring":
            figures[name].set_figwidth(5.2)
        draw(figures[name], run)
    return [save(figure, folder / name) for name, figure in figures.items()], left_out


_SIZES = {"force.png": (6.4, 4.8), "pressure.png": (12, 4.8), "field.png": (6.4, 6), "iterations.png": (6.4, 3.6)}


def _force(figure: Any, run: Run) -> None:
    panels.force_panel(figure.subplots(), run)


def _pressure(figure: Any, run: Run) -> None:
    arc, chord = figure.subplots(1, 2)
    panels.arc_panel(arc, run)
    panels.chord_panel(chord, run)


def _field(figure: Any, run: Run) -> None:
    panels.field_panel(figure, figure.subplots(), run)


def _iterations(figure: Any, run: Run) -> None:
    panels.iterations_panel(figure.subplots(), run)
