"""Pictures as files: of a run, of runs over each other, and of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.materials.material import Array
from archord.output.user_file import make_folder, writing
from archord.postprocess import panels
from archord.postprocess.comparison import same_size, same_units, scaled
from archord.postprocess.curve import gap_name
from archord.postprocess.run import Run
from archord.postprocess.sweep import Sweep, short
from archord.report.figure import new_figure, save
from archord.scene.errors import InputError

if TYPE_CHECKING:
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

_LEGEND_WIDTH = 190  # characters
_FEW = 10  # runs that get a colour of their own and a name in the legend
_MOST = 200  # runs of a sweep that are drawn


def save_figure(figure: Figure, target: Path) -> Path:
    """Write ``figure`` as ``target``; returns it. Raises `InputError` if that cannot be written."""
    try:
        with writing(target):
            return save(figure, target)
    except ValueError as error:
        raise InputError(str(error)) from None


def draw(folder: str | Path, target: str | Path | None = None) -> Path:
    """Draw field, pressure and P(delta) of the run in ``folder`` as ``target`` (by default ``picture.png`` in it);
    returns the file.

    Raises `InputError` if the folder holds no accepted step of a run or no fields, or ``target`` cannot be written.
    """
    run = Run(folder)
    target = Path(target) if target else run.folder / "picture.png"
    figure = new_figure(15, 4.4)
    field, arc, force = figure.subplots(1, 3, width_ratios=[1.0, 1.2, 1.1])
    panels.field_panel(figure, field, run)
    panels.arc_panel(arc, run)
    panels.force_panel(force, run)
    return save_figure(figure, target)


def draw_run(run: Run, folder: Path) -> tuple[list[Path], list[str]]:
    """Draw force, pressure, field and iterations of ``run`` into ``folder``, which is made if it is not there; the
    files, and a sentence for each picture that is left out.

    Raises `InputError` if the run has no accepted step, a file of it is damaged, or one cannot be written.
    """
    sizes = {"force.png": (6.4, 4.8), "pressure.png": (12, 4.8), "field.png": (6.4, 6), "iterations.png": (6.4, 3.6)}
    left_out = []
    if run.scene.joint.model == "ring":
        sizes["field.png"] = (5.2, 6)
    if not run.scene.output.fields:
        del sizes["field.png"]
        left_out.append("no picture of the field: the run was solved with output.fields = false.")
    figures = {name: new_figure(*size) for name, size in sizes.items()}
    panels.force_panel(figures["force.png"].subplots(), run)
    arc, chord = figures["pressure.png"].subplots(1, 2)
    panels.arc_panel(arc, run)
    panels.chord_panel(chord, run)
    if field := figures.get("field.png"):
        panels.field_panel(field, field.subplots(), run)
    panels.iterations_panel(figures["iterations.png"].subplots(), run)
    make_folder(folder)
    return [save_figure(figure, folder / name) for name, figure in figures.items()], left_out


@dataclass(frozen=True)
class Shades:
    """What the colours of many runs mean: a value for each of them, and its name, if it is worth a bar of colours."""

    label: str
    values: list[float]

    def norm(self) -> Normalize:
        """From values to the range of colours; logarithmic where they span decades."""
        from matplotlib.colors import LogNorm, Normalize

        low, high = min(self.values), max(self.values)
        return LogNorm(low, high) if low > 0 and high > 30 * low else Normalize(low, high)

    def colours(self) -> list:
        """A colour for each value."""
        from matplotlib import colormaps

        return list(colormaps["viridis"](self.norm()(np.array(self.values))))


def draw_comparison(
    runs: Sequence[Run],
    names: Sequence[str],
    target: Path,
    *,
    absolute: bool,
    dimensionless: bool,
    shades: Shades | None = None,
    dashed: bool = True,
) -> Path:
    """Draw force, pressure at the last common displacement and contact angle of ``runs`` with their ``names`` as
    ``target``, in the scene's units, in ``dimensionless`` form, or both below each other; returns the file.

    ``shades`` colour the runs, instead of a colour and a name for each. ``dashed`` are all but the first, so that
    curves below each other can be seen. Raises `InputError` if the file cannot be written or a run's contact cannot be
    read.
    """
    if shades is None and len(runs) > _FEW:
        shades = Shades("", [float(k) for k in range(len(runs))])
    figure = new_figure(15, 4.6 * (absolute + dimensionless))
    rows = figure.subplots(absolute + dimensionless, 3, squeeze=False)
    for relative, axes in zip([False] * absolute + [True] * dimensionless, rows, strict=True):
        _row(axes, runs, names, relative, shades, dashed)
    if shades is None:
        columns = max(1, min(len(runs), _LEGEND_WIDTH // (max(map(len, names)) + 8)))
        figure.legend(*rows[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=columns, frameon=False)
    return save_figure(figure, target)


def _row(
    axes: Sequence[Any], runs: Sequence[Run], names: Sequence[str], relative: bool, shades: Shades | None, dashed: bool
) -> None:
    force, pressure, angle = axes
    units = runs[0].scene.units
    colours = shades.colours() if shades else [f"C{k}" for k in range(len(runs))]
    curves = [run.curve for run in runs]
    rising = [scaled(curve.first_loading(), "delta", relative) for curve in curves]
    last = min(float(load.max()) for load in rising)
    for k, (run, curve, name) in enumerate(zip(runs, curves, names, strict=True)):
        style = {"color": colours[k], "lw": 1.3, "ls": "--" if dashed and k > 0 and not shades else "-", "label": name}
        load, P = (scaled(curve, quantity, relative) for quantity in ("delta", "P"))
        force.plot([0, *load], [0, *P], marker="" if shades else ".", ms=4, **style)
        angle.plot(load, np.degrees(curve.eps), **style)
        phi, p = _pressure_at(run, rising[k], last)
        stress = curve.E_star * abs(curve.dR) / curve.R if relative else 1.0
        pressure.plot(np.degrees(phi), p / stress, **style)
    gap = gap_name(min(curve.dR for curve in curves), "ΔR")
    x = f"δ / {gap}" if relative else f"δ [{units.length}]"
    force.set(xlabel=x, ylabel=f"P / (E* {gap})" if relative else f"P [{units.force}]", title="force of the joint")
    pressure.set(xlabel="angle from the contact axis [°]", xlim=(0, None), ylim=(0, None))
    pressure.set_ylabel(f"p R / (E* {gap})" if relative else f"p [{units.stress}]")
    pressure.set_title(f"contact pressure at δ = {last:.4g} {gap if relative else units.length}")
    angle.set(xlabel=x, ylabel="contact semi-angle [°]", title="contact angle", ylim=(0, None))
    for one in axes:
        one.grid(alpha=0.3)
    if shades and shades.label:
        from matplotlib.cm import ScalarMappable

        angle.get_figure().colorbar(ScalarMappable(shades.norm(), "viridis"), ax=angle, label=shades.label)


def _pressure_at(run: Run, load: Array, wanted: float) -> tuple[Array, Array]:
    """Angle and mean pressure of each facet of the hole (of the pin, if that alone is integrated) where the rising
    ``load`` of the first steps is ``wanted``, linearly between two steps; before the first, that step."""
    n = len(load)
    above = min(int(np.searchsorted(load, wanted * (1 - 1e-12))), n - 1)
    below = max(above - 1, 0)
    (phi, p), (_, q) = (run.arc(k + 1).facet_means() for k in (above, below))
    share = 0.0 if above == below else np.clip((load[above] - wanted) / (load[above] - load[below]), 0.0, 1.0)
    return phi, p + share * (q - p)


def draw_sweep(sweep: Sweep, target: Path) -> tuple[Path, str]:
    """Draw the runs of ``sweep`` over each other as ``target``, coloured by what was varied, and below in dimensionless
    form if R, dR or E* are not the same in all; returns the file, and a sentence if runs are left out, or nothing.

    The folder of ``target`` is made if it is not there. Raises `InputError` if no case has an accepted step, or the
    file cannot be written.
    """
    runs = sweep.runs
    if not runs:
        raise InputError(f"{sweep.folder}: no case has an accepted step to draw.")
    make_folder(target.parent)
    chosen = [list(runs)[k] for k in sorted({round(k) for k in np.linspace(0, len(runs) - 1, min(len(runs), _MOST))})]
    rows = {int(row["case"]): row for row in sweep.rows}
    names = [", ".join(_value(h, rows[c][h]) for h in sweep.moving) or f"case {c}" for c in chosen]
    shades = None
    if len(chosen) > _FEW:
        heading = next((h for h in sweep.moving if all(_is_number(rows[c][h]) for c in chosen)), None)
        values = [float(rows[c][heading]) if heading else float(c) for c in chosen]
        shades = Shades(short(heading) if heading else "case", values)
    scenes = [runs[c].scene for c in chosen]
    draw_comparison([runs[c] for c in chosen], names, target, absolute=same_units(scenes),
                    dimensionless=not same_size(scenes), shades=shades, dashed=False)  # fmt: skip
    return target, f"{len(chosen)} of {len(runs)} runs are drawn." if len(chosen) < len(runs) else ""


def _value(heading: str, text: str) -> str:
    """A varied key and its value: "clearance = 0.05 mm"."""
    name, _, unit = short(heading).partition(" [")
    return f"{name} = {text} {unit.removesuffix(']')}".rstrip() if text else f"no {name}"


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False
