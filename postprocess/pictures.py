"""Pictures as files: of a run, and of runs over each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from archord.materials.material import Array
from archord.output.user_file import writing
from archord.postprocess import panels
from archord.postprocess.comparison import comparable
from archord.postprocess.run import Run
from archord.report.figure import new_figure, save
from archord.scene.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_FEW = 10  # runs that get a colour of their own and a name in the legend


def save_figure(figure: Figure, target: Path) -> Path:
    """Write ``figure`` as ``target``; returns it. Raises `InputError` if that cannot be written."""
    try:
        with writing(target):
            return save(figure, target)
    except ValueError as error:
        raise InputError(str(error)) from None


def draw_run(run: Run, target: Path) -> Path:
    """Draw field, if the run wrote it, pressure and P(delta) of ``run`` as ``target``; returns the file.

    Raises `InputError` if the run has no accepted step, a file of it is damaged, or ``target`` cannot be written.
    """
    run.number(None)
    widths = [1.0, 1.2, 1.1] if run.scene.output.fields else [1.2, 1.1]
    figure = new_figure(5.0 * len(widths), 4.4)
    *field, arc, force = figure.subplots(1, len(widths), width_ratios=widths)
    for axes in field:
        panels.field_panel(axes, run)
    panels.arc_panel(arc, run)
    panels.force_panel(force, run)
    return save_figure(figure, target)


def draw_runs(runs: Sequence[Run], names: Sequence[str], target: Path) -> Path:
    """Draw force, pressure at the last common displacement and contact angle of ``runs`` with their ``names`` as
    ``target``, in the form of `comparable`; returns the file. Of more than ten the colour runs with the order instead.

    Raises `InputError` if the file cannot be written or a run's contact cannot be read.
    """
    from matplotlib import colormaps

    many = len(runs) > _FEW
    figure = new_figure(15, 4.6)
    force, pressure, angle = figure.subplots(1, 3)
    curves, labels, scales = comparable(runs)
    last = min(float(curve.first_loading().delta[-1]) for curve in curves)
    for k, (run, curve, name) in enumerate(zip(runs, curves, names, strict=True)):
        colour = colormaps["viridis"](k / (len(runs) - 1)) if many else f"C{k}"
        style = {"color": colour, "lw": 1.3, "ls": "--" if k and not many else "-", "label": name}
        force.plot([0, *curve.delta], [0, *curve.P], **style)
        angle.plot(curve.delta, np.degrees(curve.eps), **style)
        phi, p = _pressure_at(run, curve.first_loading().delta, last)
        pressure.plot(np.degrees(phi), p / scales[k], **style)
    force.set(xlabel=labels["delta"], ylabel=labels["P"], title="force of the joint")
    pressure.set(xlabel="angle from the contact axis [°]", ylabel=labels["p0"].replace("p0", "p"), xlim=(0, None))
    pressure.set(ylim=(0, None), title=f"contact pressure at {labels['delta']} = {last:.4g}")
    angle.set(xlabel=labels["delta"], ylabel="contact semi-angle [°]", title="contact angle", ylim=(0, None))
    for axes in (force, pressure, angle):
        axes.grid(alpha=0.3)
    if not many:
        figure.legend(*force.get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False)
    return save_figure(figure, target)


def _pressure_at(run: Run, delta: Array, wanted: float) -> tuple[Array, Array]:
    """Angle and mean pressure of each facet of the hole (of the pin, if that alone is integrated) where the rising
    ``delta`` of the first steps is ``wanted``, linearly between two steps; before the first, that step."""
    place = float(np.interp(wanted, delta, np.arange(len(delta))))
    below, above = (run.arc(int(k) + 1).facet_means() for k in (np.floor(place), np.ceil(place)))
    return below[0], below[1] + (place % 1) * (above[1] - below[1])
