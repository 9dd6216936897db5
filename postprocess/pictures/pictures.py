"""Pictures as files: of a run, and of runs over each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from archord.materials.material import Array
from archord.output.user_file import save_figure
from archord.postprocess.comparison import curves_of
from archord.postprocess.curve import first_loading
from archord.postprocess.pictures import joint, problems, solids
from archord.postprocess.probes.probe import Probe
from archord.postprocess.run import Run
from archord.presets.views import JointView, ProblemView
from archord.report.errors import InputError
from archord.report.figure import new_figure

_WIDER = 1.5  # panel of bodies in space over the others
_FEW = 10  # runs that get a name in the legend
# what draws the fields, the contact and the forces of a kind of runs
_PANELS = {
    ProblemView: (problems.field_panel, problems.contact_panel, problems.load_panel),
    JointView: (joint.field_panel, joint.arc_panel, joint.force_panel),
}


def draw_run(
    run: Run,
    target: Path | str,
    *,
    steps: int | Sequence[int] = (),
    field: str = "",
    edges: Sequence[str] = (),
    cut: str = "",
) -> Path:
    """Draw the field, the contact pressure and the forces of a run.

    Parameters
    ----------
    run : Run
        The run. Its field is drawn if the run wrote fields.
    target : str or Path
        The picture, .png, .svg or .pdf.
    steps : int or sequence of int
        The steps of the pressure; the field is drawn at the first of them. By default it is drawn
        at the last step, or of an unloaded run at the step with the largest load.
    field : str
        The field, by default PEEQ or von Mises stress.
    edges : sequence of str
        Edges of the mesh that take the place of the contact pressure: along them the ``field``, or
        the hoop stress, is drawn at all ``steps``. Not in space.
    cut : str
        Of bodies in space: a plane as "z=5", beyond which no cells are drawn.

    Returns
    -------
    Path
        The picture.

    Raises
    ------
    InputError
        For a step, a field or an edge that the run does not have, and for a file that cannot be
        written.

    Examples
    --------
    >>> import archord
    >>> joint = {"radius": 10.0, "clearance": 0.1, "relative_element_size": 0.2}
    >>> steel = {"E": 210e3, "nu": 0.3}
    >>> load = {"displacement": 0.5, "steps": 1}
    >>> output = {"fields": False}
    >>> scene = archord.Scene(joint=joint, pin=steel, block=steel, load=load, output=output)
    >>> run = archord.solve(scene, "runs/doctest", force=True)
    >>> archord.draw_run(run, "joint.svg").name
    'joint.svg'
    """
    chosen = [steps] if isinstance(steps, int | np.integer) else steps
    draws = panels_of(run, steps=chosen, field=field, edges=edges, cut=cut)
    widths = [1.0] * len(draws)
    if run.kinematics.dimension == 3:
        widths[0] = _WIDER
    figure = new_figure(5.0 * sum(widths), 4.4)
    panels = np.atleast_1d(figure.subplots(1, len(draws), width_ratios=widths))
    for axes, draw in zip(panels, draws, strict=True):
        draw(axes)
    return save_figure(figure, Path(target))


def panels_of(
    run: Run,
    *,
    steps: Sequence[int] = (),
    field: str = "",
    edges: Sequence[str] = (),
    cut: str = "",
) -> list[Callable[[Any], None]]:
    """What `draw_run` draws, a function of the axes each. Raises `InputError` for a step that the
    run does not have."""
    run.number(None)
    numbers = [run.number(step) for step in steps]
    draw_fields, draw_contact, draw_forces = _PANELS[type(run.view)]
    if run.kinematics.dimension == 3:
        if edges:
            said = "has no edges to draw a field along; archord probe --along draws it along a line"
            raise InputError(run.folder, f"is in space, and {said}.")
        draw_fields = partial(solids.field_panel, cut=cut)
        draw_contact = solids.contact_panel
    elif cut:
        raise InputError(run.folder, "is in a plane, where there is nothing to cut.")
    draws = []
    of_body = "" if edges and field in problems.OF_EDGES else field
    if run.scene.output.fields or of_body:
        first = numbers[0] if numbers else None
        draws.append(lambda axes: draw_fields(axes, run, first, of_body))
    if edges:
        draws.append(lambda axes: problems.edge_panel(axes, run, edges, field, numbers))
    elif run.has_profiles:
        draws.append(lambda axes: draw_contact(axes, run, numbers))
    draws.append(lambda axes: draw_forces(axes, run))
    return draws


def draw_probe(probe: Probe, target: Path) -> Path:
    """Write ``probe`` as ``target``, a table if its name ends in .csv, else a picture; returns the
    file. Raises `InputError`."""
    if target.suffix == ".csv":
        from archord.postprocess.arrays.frames import write_frame

        return write_frame(probe.frame(), target)
    figure = new_figure(6.0, 4.4)
    style = {"label": f"{probe.place}, step {probe.step}"}
    problems.draw_probes(figure.subplots(), [probe], [style])
    return save_figure(figure, target)


def draw_runs(runs: Sequence[Run], names: Sequence[str], target: Path) -> Path:
    """Draw ``runs`` with their ``names`` over each other as ``target``; returns the file.

    The first three of `curves_of` over the load, but of joints that wrote contact.h5 the pressure
    on the arc at the last common displacement for p0. The colour runs with the order, which more
    than ten have in place of a legend. Raises `InputError` if the file cannot be written or a run's
    contact cannot be read.
    """
    from matplotlib import colormaps

    tables, labels, scales = curves_of(runs)
    quantities = list(labels)[1:4]
    figure = new_figure(5.0 * len(quantities), 4.6)
    panels = np.atleast_1d(figure.subplots(1, len(quantities)))
    rising = [table["load"][first_loading(table["load"])] for table in tables]
    last = min(float(load[-1]) for load in rising)
    have_profiles = all(run.has_profiles for run in runs)
    colours = colormaps["viridis"](np.linspace(0, 0.9, len(runs)))
    for axes, quantity in zip(panels, quantities, strict=True):
        on_arc = quantity == "p0" and have_profiles
        axes.set(xlabel=labels["load"], ylabel=labels[quantity])
        axes.grid(alpha=0.3)
        for k, (run, table, name) in enumerate(zip(runs, tables, names, strict=True)):
            x = table["load"]
            y = table[quantity]
            if on_arc:
                angle, pressure = _pressure_at(run, rising[k], last)
                x = np.degrees(angle)
                y = pressure / scales[k]
            axes.plot(x, y, lw=1.3, ls="--" if k else "-", color=colours[k], label=name)
        if on_arc:
            pressure_label = labels["p0"].replace("p0", "p")
            axes.set(xlabel="angle from the contact axis [°]", ylabel=pressure_label)
            title = f"contact pressure at {labels['load']} = {last:.4g}"
            axes.set(xlim=(0, None), ylim=(0, None), title=title)
    if len(runs) <= _FEW:
        named = axes.get_legend_handles_labels()
        figure.legend(*named, loc="outside upper center", ncols=2, frameon=False)
    return save_figure(figure, target)


def _pressure_at(run: Run, delta: Array, wanted: float) -> tuple[Array, Array]:
    """Angle and mean pressure of each facet of the hole (of the pin, if that alone is integrated)
    where the rising ``delta`` of the first steps is ``wanted``, linearly between two steps; before
    the first, that step."""
    place = float(np.interp(wanted, delta, np.arange(len(delta))))
    angle, before = run.arc(int(np.floor(place)) + 1).facet_means()
    _, after = run.arc(int(np.ceil(place)) + 1).facet_means()
    return angle, before + (place % 1) * (after - before)
