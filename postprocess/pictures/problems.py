"""What a run of any problem looks like, a panel each: field on the bodies, pressure on surfaces, force of the loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from archord.materials.material import Array
from archord.postprocess.fields import Fields
from archord.postprocess.probe import Probe
from archord.postprocess.run import Run

_MAGNIFIED = 0.05  # largest displacement over the size of the bodies, as drawn, where nothing touches
_ELASTIC = "0.93"  # grey of what has no plastic strain
_EDGE = np.array([[1.0, 0.0, 0.0], [0.375, 0.75, -0.125], [0.0, 1.0, 0.0], [-0.125, 0.75, 0.375], [0.0, 0.0, 1.0]])


def field_panel(axes: Any, run: Run, step: int | None = None) -> None:
    """`draw_cells` at ``step`` (the last) on the deformed bodies, with their outlines; displacements are magnified by
    the factor in the title, and not where bodies may touch, as they would then overlap."""
    fields, length = run.fields(step), run.scene.units.length
    size, farthest = np.ptp(fields.coordinates, axis=0).max(), np.abs(fields.displacement).max()
    free = not run.has_contact and farthest > 0
    factor = max(float(f"{_MAGNIFIED * size / farthest:.0e}"), 1.0) if free else 1.0
    x, everywhere = fields.coordinates + factor * fields.displacement, np.ones(len(fields.cells), dtype=bool)
    draw_cells(axes, run, fields, x, everywhere, everywhere)
    draw_outline(axes, fields, x, color="black", lw=0.8)
    axes.set(aspect="equal", xlabel=f"x [{length}]", ylabel=f"y [{length}]")
    what = "not magnified" if factor == 1 else f"displacement × {factor:g}"
    axes.set_title(f"step {fields.step}, load factor {fields.delta:.4g}\n{what}", fontsize="medium")


def draw_cells(axes: Any, run: Run, fields: Fields, x: Array, shown: np.ndarray, ranged: np.ndarray) -> None:
    """PEEQ, grey where there is none, or von Mises stress where nothing has yielded, in the ``shown`` cells ``(m,)``
    with the nodes at ``x``; the colours end at the largest of the ``ranged`` ones."""
    from matplotlib import colormaps

    values, label, cmap = fields.von_mises, f"von Mises stress [{run.scene.units.stress}]", "viridis"
    if fields.peeq is not None and fields.peeq.any():
        values, label, cmap = 100 * fields.peeq, "equivalent plastic strain [%]", "inferno_r"
    triangles, most = fields.triangles[shown], values[ranged].max() or None
    coloured = np.repeat(np.where(values > 0, values, np.nan)[shown], triangles.shape[1])
    colours = {"facecolors": coloured, "cmap": colormaps[cmap].with_extremes(bad=_ELASTIC)}
    drawn = axes.tripcolor(*x.T, triangles.reshape(-1, 3), vmin=0, vmax=most, **colours)
    cut = "max" if values[shown].max() > drawn.norm.vmax else "neither"
    axes.figure.colorbar(drawn, ax=axes, label=label, shrink=0.85, extend=cut)


def draw_outline(axes: Any, fields: Fields, x: Array, **style: Any) -> None:
    """The boundary of the bodies with the nodes at ``x``, every edge a parabola; it leaves the limits as they are."""
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(_EDGE @ x[fields.outline()]), **style), autolim=False)


def contact_panel(axes: Any, run: Run) -> None:
    """Mean contact pressure of each facet at the last step, over the angle where all surfaces are arcs."""
    probes = [run.probe(name, "facet_pressure") for name in run.contact()]
    draw_probes(axes, probes, [probe.place for probe in probes])
    pressure = f"pressure [{run.scene.units.stress}]"
    axes.set(title=f"contact pressure, step {run.steps}", ylabel=pressure, ylim=(0, None))


def draw_probes(axes: Any, probes: list[Probe], labels: list[str]) -> None:
    """Quantities over the angle, or over the arc length where one of the edges is no arc."""
    angles = [probe.angle for probe in probes if probe.angle is not None]
    arcs = len(angles) == len(probes)
    for k, (probe, label) in enumerate(zip(probes, labels, strict=True)):
        along = angles[k] if arcs else probe.s
        order = np.argsort(along, kind="stable")
        axes.plot(along[order], probe.values[order], lw=1.3, label=label)
    axes.set(xlabel="angle [°]" if arcs else "arc length", ylabel=f"{probes[0].quantity} [{probes[0].unit or '-'}]")
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)


def load_panel(axes: Any, run: Run) -> None:
    """Force over displacement of every load."""
    units = run.history.attrs["units"]
    for load in run.scene.load:
        q, force = (f"{load.name} {what}" for what in ("displacement", "force"))
        label = f"{load.name} [{units.get(force, '-')} over {units.get(q, '-')}]"
        axes.plot([0, *run.columns[q]], [0, *run.columns[force]], ".-", ms=5, label=label)
    axes.set(xlabel="displacement", ylabel="force", title="loads")
    axes.legend(frameon=False)
    axes.locator_params("x", nbins=6)
    axes.grid(alpha=0.3)
