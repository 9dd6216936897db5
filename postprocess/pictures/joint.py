"""What a run of a joint looks like, a panel each: field on the deformed joint, pressure on the
arcs, force over displacement."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from archord.materials.material import Array
from archord.postprocess.arrays.fields import BODIES, Fields
from archord.postprocess.curve import gap_name
from archord.postprocess.pictures.problems import (
    draw_field,
    draw_outline,
    frame,
    shown_step,
    shown_steps,
)
from archord.postprocess.run import Run
from archord.report.by_name import ByName
from archord.scene.presets.joint import Scene

_BEFORE: ByName = {"color": "0.55", "lw": 0.9}
_VISIBLE = 0.1  # clearance over R, as drawn
_FARTHEST = 0.2  # displacement and clearance over R, as drawn
_NEAR = 3.0  # radii within which displacements count


def magnification(scene: Scene, fields: Fields) -> float:
    """Factor 1, 2, 3, 5, 10, ... that makes the clearance of ``scene`` visible and leaves the shape
    recognisable."""
    R = scene.joint.radius
    dR = abs(scene.joint.dR)
    near = np.hypot(*fields.coordinates.T) < _NEAR * R
    largest = float(np.abs(fields.displacement[near]).max())
    moved = max(largest, abs(fields.delta))
    visible = _VISIBLE * R / dR
    recognisable = _FARTHEST * R / (dR + moved)
    wanted = max(1.0, min(visible, recognisable))
    decade = 10.0 ** math.floor(math.log10(wanted))
    steps = [step * decade for step in (1, 2, 3, 5)]
    return max(step for step in steps if step <= wanted * (1 + 1e-9))


def magnified(scene: Scene, fields: Fields, factor: float, displaced: bool = True) -> Array:
    """Points ``(n, 2)`` at which the nodes are drawn; of the joint before it is loaded, if not
    ``displaced``.

    Bodies that touch would overlap if displacements alone were magnified. So ``factor`` times the
    displacement is drawn from the joint without clearance, in which both arcs are the circle of
    radius R around the origin: a gap is as many times as wide, and what touches touches, but for
    ``(factor s)^2/(2 R)`` where one body slid by s along the other.
    """
    X = fields.coordinates
    pin = fields.body_of_node == BODIES["pin"]
    distance = np.maximum(np.hypot(*X.T), scene.joint.radius / 2)
    inward = 1 - scene.joint.dR / distance
    start = X * inward[:, None]
    start[pin] = X[pin] + [0.0, scene.joint.pin_depth]
    now = fields.deformed if displaced else X
    return start + factor * (now - start)


def _load(scene: Scene, delta: float) -> str:
    dR = scene.joint.dR
    return f"δ = {delta / abs(dR):.4g} {gap_name(dR, 'ΔR')}"


def _over(divisor: float) -> ByName:
    """Of a second axis with the numbers of the first over the ``divisor``."""
    return {"functions": (lambda x: np.asarray(x) / divisor, lambda x: np.asarray(x) * divisor)}


def force_panel(axes: Any, run: Run) -> None:
    """P over delta in the scene's units, with P/(E* R) and delta/dR opposite; where yielding began
    is marked."""
    scene = run.scene
    delta = [0.0, *run.columns["delta"]]
    P = [0.0, *run.columns["P"]]
    axes.plot(delta, P, ".-", color="tab:blue", ms=5)
    yielded = np.flatnonzero(run.columns["peeq_max"])
    if len(yielded):
        first = int(yielded[0]) + 1
        ring = {"ms": 8, "mfc": "none", "color": "tab:red"}
        axes.plot(delta[first], P[first], "o", label="first plastic strain", **ring)
        axes.legend(frameon=False, loc="upper left")
    axes.set(
        xlabel=f"δ [{scene.units.length}]",
        ylabel=f"P [{run.units['P']}]",
        title="force of the joint",
        xlim=(min(delta), None),
        ylim=(min(P), None),
    )
    axes.grid(alpha=0.3)
    dR = scene.joint.dR
    in_clearances = axes.secondary_xaxis("top", **_over(abs(dR)))
    in_clearances.set_xlabel(f"δ / {gap_name(dR, 'ΔR')}")
    stiffness = scene.E_star * scene.joint.radius * scene.thickness
    without_unit = axes.secondary_yaxis("right", **_over(stiffness))
    without_unit.set_ylabel("P / (E* R)")


def arc_panel(axes: Any, run: Run, steps: Sequence[int] = ()) -> None:
    """Mean contact pressure of each facet over the angle from the contact axis, at ``steps`` (up to
    four): of the hole, and dashed of the pin."""
    scene = run.scene
    both = False
    for i, step in enumerate(steps or shown_steps(run)):
        arcs = run.contact(step)
        both = len(arcs) > 1
        load = _load(scene, run.path[step - 1])
        for side, arc in arcs.items():
            angle, pressure = arc.facet_means()
            style = {"ls": "-", "label": load}
            if both and side == "pin":
                style = {"ls": "--"}
            axes.plot(np.degrees(angle), pressure, color=f"C{i}", lw=1.4, **style)
    reach = round(np.degrees(scene.joint.arc_end))
    sides = " (hole solid, pin dashed)" if both else ""
    axes.set(
        xlabel="angle from the contact axis [°]",
        ylabel=f"p [{scene.units.stress}]",
        xlim=(0, reach),
        ylim=(0, None),
        title=f"contact pressure on the arc{sides}",
    )
    axes.set_xticks(np.arange(0, reach + 1, reach / 6))
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    without_unit = axes.secondary_yaxis("right", **_over(scene.E_star))
    without_unit.set_ylabel("p / E*")


def field_panel(axes: Any, run: Run, step: int | None = None, field: str = "") -> None:
    """`draw_field` at ``step`` (see `shown_step`) on the deformed joint near the contact, with its
    outline before (grey) and after; displacement and clearance are magnified by the factor in the
    title."""
    scene = run.scene
    ring = scene.joint.is_ring
    R = scene.joint.radius
    fields = run.fields(step or shown_step(run))
    factor = magnification(scene, fields)
    x = magnified(scene, fields, factor)
    gap = max(0.0, factor * scene.joint.dR)
    right = min(1.6 * R + gap, scene.joint.W)
    low = -min(1.9 * R + gap, scene.joint.W)
    high = right if ring or scene.pin.whole else 0.06 * R
    corners = fields.cells[:, :3]
    above = (x[corners].max(axis=1) > [0, low]).all(axis=1)
    below = (x[corners].min(axis=1) < [right, high]).all(axis=1)
    # in a ring the core on which the load acts does not count for the range of colours
    core = R / 2 if ring else 0
    middles = fields.coordinates[corners].mean(axis=1)
    away = np.hypot(*middles.T) > core
    draw_field(axes, run, fields, x, above & below, away, field)
    draw_outline(axes, fields, magnified(scene, fields, factor, displaced=False), **_BEFORE)
    draw_outline(axes, fields, x, color="black", lw=1.1)
    if scene.pin.rigid:
        angle = np.linspace(0, np.pi / 2)
        centre = -factor * (fields.delta + scene.joint.pin_depth)
        across = [0, *R * np.sin(angle)]
        along = [centre, *centre - R * np.cos(angle)]
        axes.fill(across, along, fc="0.85", ec="black", zorder=0)
    frame(axes, run)
    axes.set(xlim=(0, right), ylim=(low, high))
    what = "not magnified" if factor == 1 else f"displacement and clearance × {factor:g}"
    axes.set_title(f"step {fields.step}, {_load(scene, fields.delta)}\n{what}", fontsize="medium")
