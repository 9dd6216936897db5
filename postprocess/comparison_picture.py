"""A picture of runs over each other: force, contact angle, and pressure at the last common displacement."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from archord.postprocess.run_pictures import new_figure, save
from archord.postprocess.run_result import Run
from archord.solver.output_file import check_output
from archord.solver.scene import SceneError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FEW = 10  # runs that get a colour of their own and a name in the legend


def draw_comparison(
    runs: Sequence[Run], names: Sequence[str], target: Path, *, absolute: bool, dimensionless: bool
) -> Path:
    """Draw ``runs`` with their ``names`` as ``target``, in the scene's units, in ``dimensionless`` form, or both below
    each other; returns the file. Raises `SceneError` if it cannot be written or a run's contact cannot be read."""
    figure = new_figure(15, 4.6 * (absolute + dimensionless))
    formats = figure.canvas.get_supported_filetypes()
    if target.suffix[1:].lower() not in formats:
        raise SceneError(f"{target}: must end in one of {', '.join('.' + name for name in sorted(formats))}.")
    check_output(target)
    rows = figure.subplots(absolute + dimensionless, 3, squeeze=False)
    for scaled, axes in zip([False] * absolute + [True] * dimensionless, rows, strict=True):
        _row(axes, runs, names, scaled)
    return save(figure, target)


def _row(axes: Sequence[Axes], runs: Sequence[Run], names: Sequence[str], scaled: bool) -> None:
    force, pressure, angle = axes
    units = runs[0].scene.units
    curves = [run.curve for run in runs]
    last = min(float((c.delta / c.dR if scaled else c.delta).max()) for c in curves)
    for k, (run, curve, name) in enumerate(zip(runs, curves, names, strict=True)):
        style = {"color": colour(k, len(runs)), "lw": 1.3, "ls": "-" if k == 0 or len(runs) > _FEW else "--"}
        E, R, dR = curve.E_star, curve.R, curve.dR
        load = curve.delta / (dR if scaled else 1.0)
        force.plot([0, *load], [0, *(curve.P / (E * dR if scaled else 1.0))], ".", ls=style["ls"], ms=4, lw=1.3,
                   color=style["color"], label=name)  # fmt: skip
        angle.plot(load, np.degrees(curve.eps), label=name, **style)
        step = int(np.abs(load - last).argmin()) + 1
        arc = list(run.contact(step).values())[-1]
        phi, p = arc.facet_means()
        at = f"{name}, δ = {load[step - 1]:.4g}{' ΔR' if scaled else f' {units.length}'}"
        pressure.plot(np.degrees(phi), p / (E * dR / R if scaled else 1.0), label=at, **style)
    length, stress = units.length, units.stress
    x = "δ / ΔR" if scaled else f"δ [{length}]"
    force.set(xlabel=x, ylabel="P / (E* ΔR)" if scaled else f"P [{units.force}]", title="force of the joint")
    pressure.set(xlabel="angle from the contact axis [°]", ylabel="p R / (E* ΔR)" if scaled else f"p [{stress}]")
    pressure.set(title="contact pressure on the hole, nearest step to the last common δ", xlim=(0, None), ylim=(0, None))
    angle.set(xlabel=x, ylabel="contact semi-angle [°]", title="contact angle", ylim=(0, None))
    for one in axes:
        one.grid(alpha=0.3)
        if len(runs) <= _FEW:
            one.legend(frameon=False, fontsize="small")


def colour(k: int, n: int) -> str | tuple[float, float, float, float]:
    """Colour of run ``k`` of ``n``: one of its own, or where they are many a shade by its place."""
    if n <= _FEW:
        return f"C{k}"
    from matplotlib import colormaps

    return colormaps["viridis"](k / (n - 1))
