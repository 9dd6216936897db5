"""What a run looks like, a panel each: field on the deformed joint, pressure on the arcs, force
over displacement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from archord.postprocess.curve import gap_name
from archord.postprocess.fields import magnification, magnified
from archord.postprocess.pictures.problems import draw_field, draw_outline, shown_step, shown_steps
from archord.postprocess.run import Run
from archord.scene.scene import Scene

_BEFORE: dict[str, Any] = {"color": "0.55", "lw": 0.9}


def _load(scene: Scene, delta: float) -> str:
    return f"δ = {delta / abs(scene.joint.dR):.4g} {gap_name(scene.joint.dR, 'ΔR')}"


def _over(
    divisor: float,
) -> dict[str, Any]:  # of a second axis with the numbers of the first over the divisor
    return {
        "functions": (
            lambda value: np.asarray(value) / divisor,
            lambda value: np.asarray(value) * divisor,
        )
    }


def force_panel(axes: Any, run: Run) -> None:
    """P over delta in the scene's units, with P/(E* R) and delta/dR opposite; where yielding began
    is marked."""
    scene, history = run.scene, run.columns
    delta, P = ([0.0, *history[name]] for name in ("delta", "P"))
    axes.plot(delta, P, ".-", color="tab:blue", ms=5)
    if any(history["peeq_max"]):
        first = int(np.flatnonzero(history["peeq_max"])[0]) + 1
        axes.plot(
            delta[first],
            P[first],
            "o",
            ms=8,
            mfc="none",
            color="tab:red",
            label="first plastic strain",
        )
        axes.legend(frameon=False, loc="upper left")
    axes.set(
        xlabel=f"δ [{scene.units.length}]",
        ylabel=f"P [{run.units['P']}]",
        title="force of the joint",
    )
    axes.set(xlim=(min(delta), None), ylim=(min(P), None))
    axes.grid(alpha=0.3)
    axes.secondary_xaxis("top", **_over(abs(scene.joint.dR))).set_xlabel(
        f"δ / {gap_name(scene.joint.dR, 'ΔR')}"
    )
    unit = scene.E_star * scene.joint.radius * scene.thickness
    axes.secondary_yaxis("right", **_over(unit)).set_ylabel("P / (E* R)")


def arc_panel(axes: Any, run: Run, steps: Sequence[int] = ()) -> None:
    """Mean contact pressure of each facet over the angle from the contact axis, at ``steps`` (up to
    four): of the hole, and dashed of the pin."""
    scene = run.scene
    for i, step in enumerate(steps or shown_steps(run)):
        arcs = run.contact(step)
        for side, arc in arcs.items():
            angle, p = arc.facet_means()
            label = None if side == "pin" and len(arcs) > 1 else _load(scene, run.path[step - 1])
            axes.plot(
                np.degrees(angle), p, "-" if label else "--", color=f"C{i}", lw=1.4, label=label
            )
    reach = round(np.degrees(scene.joint.arc_end))
    axes.set(
        xlabel="angle from the contact axis [°]",
        ylabel=f"p [{scene.units.stress}]",
        xlim=(0, reach),
    )
    axes.set(
        ylim=(0, None),
        title=f"contact pressure on the arc{' (hole solid, pin dashed)' if len(arcs) > 1 else ''}",
    )
    axes.set_xticks(np.arange(0, reach + 1, reach / 6))
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    axes.secondary_yaxis("right", **_over(scene.E_star)).set_ylabel("p / E*")


def field_panel(axes: Any, run: Run, step: int | None = None, field: str = "") -> None:
    """`draw_field` at ``step`` (that of `shown_step`) on the deformed joint near the contact, with
    its outline before (grey) and after; displacement and clearance are magnified by the factor in
    the title."""
    scene, fields = run.scene, run.fields(step or shown_step(run))
    factor = magnification(scene, fields)
    x, ring, R = magnified(scene, fields, factor), scene.joint.is_ring, scene.joint.radius
    gap = max(0.0, factor * scene.joint.dR)
    right, low = min(1.6 * R + gap, scene.joint.W), -min(1.9 * R + gap, scene.joint.W)
    high = right if ring or scene.pin.whole else 0.06 * R
    corners = x[fields.cells[:, :3]]
    near = (corners.max(axis=1) > [0, low]).all(axis=1) & (corners.min(axis=1) < [right, high]).all(
        axis=1
    )
    # in a ring the core on which the load acts does not count for the range of colours
    away = np.hypot(*fields.coordinates[fields.cells[:, :3]].mean(axis=1).T) > (
        R / 2 if ring else 0
    )
    draw_field(axes, run, fields, x, near, away, field)
    draw_outline(axes, fields, magnified(scene, fields, factor, displaced=False), **_BEFORE)
    draw_outline(axes, fields, x, color="black", lw=1.1)
    if scene.pin.rigid:
        angle, centre = np.linspace(0, np.pi / 2), -factor * (fields.delta + scene.joint.pin_depth)
        axes.fill(
            [0, *R * np.sin(angle)],
            [centre, *centre - R * np.cos(angle)],
            fc="0.85",
            ec="black",
            zorder=0,
        )
    length = scene.units.length
    axes.set(
        xlim=(0, right),
        ylim=(low, high),
        aspect="equal",
        xlabel=f"x [{length}]",
        ylabel=f"y [{length}]",
    )
    what = "not magnified" if factor == 1 else f"displacement and clearance × {factor:g}"
    axes.set_title(f"step {fields.step}, {_load(scene, fields.delta)}\n{what}", fontsize="medium")
