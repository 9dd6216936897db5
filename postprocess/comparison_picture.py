"""A picture of runs over each other: force, contact angle, and pressure at the last common displacement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.basis import Array
from archord.output.output_file import check_output
from archord.postprocess.comparison import first_loading
from archord.postprocess.panels import gap_name
from archord.postprocess.run_curve import RunCurve
from archord.postprocess.run_pictures import new_figure, save
from archord.postprocess.run_result import Run
from archord.scene.errors import InputError

_LEGEND_WIDTH = 190  # characters
FEW = 10  # runs that get a colour of their own and a name in the legend


@dataclass(frozen=True)
class Shades:
    """What the colours of many runs mean: a value for each of them."""

    label: str
    values: list[float]


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
    """Draw ``runs`` with their ``names`` as ``target``, in the scene's units, in ``dimensionless`` form, or both below
    each other; returns the file.

    ``shades`` colour the runs, instead of a colour and a name for each. ``dashed`` are all but the first, so that
    curves below each other can be seen. Raises `InputError` if the file cannot be written or a run's contact cannot be
    read.
    """
    figure = new_figure(15, 4.6 * (absolute + dimensionless))
    formats = figure.canvas.get_supported_filetypes()
    if target.suffix[1:].lower() not in formats:
        raise InputError(f"{target}: must end in one of {', '.join('.' + name for name in sorted(formats))}.")
    check_output(target)
    rows = figure.subplots(absolute + dimensionless, 3, squeeze=False)
    for scaled, axes in zip([False] * absolute + [True] * dimensionless, rows, strict=True):
        _row(axes, runs, names, scaled, shades, dashed)
    if shades is None and len(runs) <= FEW:
        columns = max(1, min(len(runs), _LEGEND_WIDTH // (max(map(len, names)) + 8)))
        figure.legend(*rows[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=columns, frameon=False)
    return save(figure, target)


def _row(
    axes: Sequence[Any], runs: Sequence[Run], names: Sequence[str], scaled: bool, shades: Shades | None, dashed: bool
) -> None:
    force, pressure, angle = axes
    units, many = runs[0].scene.units, shades is not None or len(runs) > FEW
    colours = _colours(len(runs), shades)
    curves = [run.curve for run in runs]
    last = min(float(loads(first_loading(c), scaled).max()) for c in curves)
    for k, (run, curve, name) in enumerate(zip(runs, curves, names, strict=True)):
        style = {"color": colours[k], "lw": 1.3, "ls": "--" if dashed and k > 0 and not many else "-", "label": name}
        stress = curve.E_star * abs(curve.dR) / curve.R if scaled else 1.0
        load, P = loads(curve, scaled), curve.P / (stress * curve.R if scaled else 1.0)
        force.plot([0, *load], [0, *P], marker="" if many else ".", ms=4, **style)
        angle.plot(load, np.degrees(curve.eps), **style)
        phi, p = pressure_at(run, loads(first_loading(curve), scaled), last)
        pressure.plot(np.degrees(phi), p / stress, **style)
    gap = gap_name([curve.dR for curve in curves])
    x = f"δ / {gap}" if scaled else f"δ [{units.length}]"
    force.set(xlabel=x, ylabel=f"P / (E* {gap})" if scaled else f"P [{units.force}]", title="force of the joint")
    pressure.set(xlabel="angle from the contact axis [°]", xlim=(0, None), ylim=(0, None))
    pressure.set_ylabel(f"p R / (E* {gap})" if scaled else f"p [{units.stress}]")
    pressure.set_title(f"contact pressure at δ = {last:.4g} {gap if scaled else units.length}")
    angle.set(xlabel=x, ylabel="contact semi-angle [°]", title="contact angle", ylim=(0, None))
    for one in axes:
        one.grid(alpha=0.3)
    if shades is not None:
        from matplotlib.cm import ScalarMappable

        mappable = ScalarMappable(_norm(shades), "viridis")
        angle.get_figure().colorbar(mappable, ax=angle, label=shades.label)


def loads(curve: RunCurve, scaled: bool) -> Array:
    """Displacements ``(n,)``, over the clearance if ``scaled``."""
    return curve.delta / (abs(curve.dR) if scaled else 1.0)


def pressure_at(run: Run, load: Array, wanted: float) -> tuple[Array, Array]:
    """Angle and mean pressure of each facet of the hole (of the pin, if that alone is integrated) where the rising
    ``load`` of the first steps is ``wanted``, linearly between two steps; before the first, that step."""
    n = len(load)
    above = min(int(np.searchsorted(load, wanted * (1 - 1e-12))), n - 1)
    below = max(above - 1, 0)
    (phi, p), (_, q) = (list(run.contact(k + 1).values())[-1].facet_means() for k in (above, below))
    share = 0.0 if above == below else np.clip((load[above] - wanted) / (load[above] - load[below]), 0.0, 1.0)
    return phi, p + share * (q - p)


def _colours(n: int, shades: Shades | None) -> list:
    """Colours of ``n`` runs: shades, or one of its own for each."""
    from matplotlib import colormaps

    if shades is not None:
        return [colormaps["viridis"](value) for value in _norm(shades)(np.array(shades.values))]
    return [f"C{k}" for k in range(n)] if n <= FEW else [colormaps["viridis"](k / (n - 1)) for k in range(n)]


def _norm(shades: Shades):
    """From values to the range of colours; logarithmic where they span decades."""
    from matplotlib.colors import LogNorm, Normalize

    low, high = min(shades.values), max(shades.values)
    return LogNorm(low, high) if low > 0 and high > 30 * low else Normalize(low, high)
