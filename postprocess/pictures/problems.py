"""What a run of any problem looks like, a panel each: field on the bodies, pressure on surfaces, force of the loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from archord.postprocess.probe import Probe, probe_edge
from archord.postprocess.run import Run

_MAGNIFIED = 0.05  # largest displacement over the size of the bodies, as drawn, where nothing touches
_EDGE = np.array([[1.0, 0.0, 0.0], [0.375, 0.75, -0.125], [0.0, 1.0, 0.0], [-0.125, 0.75, 0.375], [0.0, 0.0, 1.0]])


def field_panel(axes: Any, run: Run, step: int | None = None) -> None:
    """PEEQ, or von Mises stress where nothing has yielded, at ``step`` (the last) on the deformed bodies, with their
    outlines; displacements are magnified by the factor in the title, and not where bodies may touch, as they would
    then overlap."""
    from matplotlib.collections import LineCollection

    fields, length = run.fields(step), run.scene.units.length
    size, farthest = np.ptp(fields.coordinates, axis=0).max(), np.abs(fields.displacement).max()
    free = not run.has_contact and farthest > 0
    factor = max(float(f"{_MAGNIFIED * size / farthest:.0e}"), 1.0) if free else 1.0
    x = fields.coordinates + factor * fields.displacement
    values, label, cmap = fields.von_mises, f"von Mises stress [{run.scene.units.stress}]", "viridis"
    if fields.peeq is not None and fields.peeq.any():
        values, label, cmap = 100 * fields.peeq, "equivalent plastic strain [%]", "inferno_r"
    triangles = fields.triangles.reshape(-1, 3)
    shown = {"facecolors": np.repeat(values, fields.triangles.shape[1])}
    drawn = axes.tripcolor(*x.T, triangles, cmap=cmap, vmin=0, vmax=values.max() or None, **shown)
    axes.figure.colorbar(drawn, ax=axes, label=label, shrink=0.85)
    axes.add_collection(LineCollection(list(_EDGE @ x[fields.outline()]), color="black", lw=0.8))
    axes.set(aspect="equal", xlabel=f"x [{length}]", ylabel=f"y [{length}]")
    what = "not magnified" if factor == 1 else f"displacement × {factor:g}"
    axes.set_title(f"step {fields.step}, load factor {fields.delta:.4g}\n{what}", fontsize="medium")


def contact_panel(axes: Any, run: Run) -> None:
    """Mean contact pressure of each facet at the last step, over the angle where all surfaces are arcs."""
    probes = [probe_edge(run, name, "facet_pressure", run.number(None)) for name in run.contact()]
    draw_probes(axes, probes, [probe.place for probe in probes])
    axes.set(title=f"contact pressure, step {run.steps}", ylim=(0, None))


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
    axes.grid(alpha=0.3)
