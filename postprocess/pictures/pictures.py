"""Pictures as files: of a run, and of runs over each other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.materials.material import Array
from archord.output.user_file import writing
from archord.postprocess.comparison import comparable, compare_runs
from archord.postprocess.pictures import joint, problems
from archord.postprocess.probe import Probe
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
    """Draw field, if the run wrote it, contact pressure and forces of ``run`` as ``target``; returns the file. Raises
    `InputError`."""
    run.number(None)
    draws: list[Any] = [problems.field_panel, problems.contact_panel, problems.load_panel]
    if run.is_joint:
        draws = [joint.field_panel, joint.arc_panel, joint.force_panel]
    draws = list(compress(draws, (run.scene.output.fields, run.has_contact, True)))
    widths = [1.0, 1.2, 1.1] if len(draws) == 3 else [1.2, 1.1][-len(draws) :]
    figure = new_figure(5.0 * len(widths), 4.4)
    for axes, draw in zip(np.atleast_1d(figure.subplots(1, len(widths), width_ratios=widths)), draws, strict=True):
        draw(axes, run)
    return save_figure(figure, target)


def draw_probe(probe: Probe, target: Path) -> Path:
    """Write ``probe`` as ``target``, a table if its name ends in .csv, else a picture; returns the file. Raises
    `InputError`."""
    if target.suffix == ".csv":
        from archord.postprocess.frames import with_headings

        with writing(target):
            with_headings(probe.frame()).to_csv(target, index=False, float_format="%.12g", lineterminator="\n")
        return target
    figure = new_figure(6.0, 4.4)
    problems.draw_probes(figure.subplots(), [probe], [f"{probe.place}, step {probe.step}"])
    return save_figure(figure, target)


def draw_runs(runs: Sequence[Run], names: Sequence[str], target: Path) -> Path:
    """Draw ``runs`` with their ``names`` over each other as ``target``; returns the file.

    Of joints force, pressure at the last common displacement and contact angle, in the form of `comparable`; of more
    than ten the colour runs with the order instead. Of general runs the first three quantities that all share, over the
    load factor. Raises `InputError` if the file cannot be written or a run's contact cannot be read.
    """
    from matplotlib import colormaps

    if not runs[0].is_joint:
        return _draw_problems(runs, names, target)
    many = len(runs) > _FEW
    figure = new_figure(15, 4.6)
    force, pressure, angle = panels = figure.subplots(1, 3)
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
    for axes in panels:
        axes.grid(alpha=0.3)
    if not many:
        figure.legend(*force.get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False)
    return save_figure(figure, target)


def _draw_problems(runs: Sequence[Run], names: Sequence[str], target: Path) -> Path:
    compared = list(compare_runs(list(runs)).labels.items())[1:4]
    figure = new_figure(5.0 * len(compared), 4.4)
    for axes, (column, label) in zip(np.atleast_1d(figure.subplots(1, len(compared))), compared, strict=True):
        for run, name in zip(runs, names, strict=True):
            axes.plot(run.path, run.columns[column], ".-", lw=1.3, label=name)
        axes.set(xlabel="load factor", ylabel=label)
        axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return save_figure(figure, target)


def _pressure_at(run: Run, delta: Array, wanted: float) -> tuple[Array, Array]:
    """Angle and mean pressure of each facet of the hole (of the pin, if that alone is integrated) where the rising
    ``delta`` of the first steps is ``wanted``, linearly between two steps; before the first, that step."""
    place = float(np.interp(wanted, delta, np.arange(len(delta))))
    below, above = (run.arc(int(k) + 1).facet_means() for k in (np.floor(place), np.ceil(place)))
    return below[0], below[1] + (place % 1) * (above[1] - below[1])
