"""What a run looks like, a panel each: force, pressure on arc and chord, field on the deformed joint, iterations."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from archord.postprocess.chord import chord_projection
from archord.postprocess.curve import gap_name
from archord.postprocess.fields import SUBTRIANGLES, Fields, magnification, magnified, rigid_arc
from archord.postprocess.run import Run
from archord.scene.scene import Scene

_EDGE_POINTS = 5  # along a curved edge
_MANY_STEPS = 60  # whose bars touch


def load_label(scene: Scene, delta: float) -> str:
    """A displacement over the clearance, in words."""
    return f"δ = {delta / abs(scene.joint.dR):.4g} {gap_name(scene.joint.dR, 'ΔR')}"


def second_axis(axes: Any, direction: str, divisor: float, label: str, opposite: str) -> None:
    """A second axis at the ``opposite`` side with the first one's numbers over ``divisor``; none if they are the
    same."""
    if math.isclose(divisor, 1.0, rel_tol=1e-12):
        return
    functions = (lambda value: np.asarray(value) / divisor, lambda value: np.asarray(value) * divisor)
    make = axes.secondary_xaxis if direction == "x" else axes.secondary_yaxis
    second = make(opposite, functions=functions)
    second.set_xlabel(label) if direction == "x" else second.set_ylabel(label)


def force_panel(axes: Any, run: Run) -> None:
    """P over delta in the scene's units, with P/(E* R) and delta/dR opposite; where yielding began is marked."""
    scene, history = run.scene, run.columns
    delta, P = ([0.0, *history[name]] for name in ("delta", "P"))
    axes.plot(delta, P, ".-", color="tab:blue", ms=5)
    first = next((k for k, peeq in enumerate(history.get("peeq_max", [])) if peeq > 0), None)
    if first is not None:
        axes.plot(delta[first + 1], P[first + 1], "o", ms=8, mfc="none", color="tab:red", label="first plastic strain")
        axes.legend(frameon=False, loc="upper left")
    axes.set(xlabel=f"δ [{scene.units.length}]", ylabel=f"P [{scene.units.force}]", title="force of the joint")
    axes.set(xlim=(min(delta), None), ylim=(min(P), None))
    axes.locator_params(axis="x", nbins=6)
    axes.grid(alpha=0.3)
    second_axis(axes, "x", abs(scene.joint.dR), f"δ / {gap_name(scene.joint.dR, 'ΔR')}", "top")
    second_axis(axes, "y", scene.E_star * scene.joint.radius, "P / (E* R)", "right")


def _shown_steps(run: Run, most: int = 4) -> dict[int, dict[str, Any]]:
    """Up to ``most`` steps to show, evenly through the run, the last one included, and the style of each."""
    steps = sorted({max(1, round(run.steps * k / most)) for k in range(1, most + 1)})
    deltas = (run.columns["delta"][step - 1] for step in steps)
    styles = ({"color": f"C{i}", "lw": 1.4, "label": load_label(run.scene, d)} for i, d in enumerate(deltas))
    return dict(zip(steps, styles, strict=True))


def arc_panel(axes: Any, run: Run) -> None:
    """Mean contact pressure of each facet over the angle from the contact axis, at up to four steps."""
    scene = run.scene
    for step, style in _shown_steps(run).items():
        *first, last = run.contact(step).values()
        for arc in first:
            angle, p = arc.facet_means()
            axes.plot(np.degrees(angle), p, **style | {"label": None, "ls": "--"})
        angle, p = last.facet_means()
        axes.plot(np.degrees(angle), p, **style)
    reach = round(np.degrees(scene.joint.arc_end))
    axes.set(xlabel="angle from the contact axis [°]", ylabel=f"p [{scene.units.stress}]", xlim=(0, reach))
    axes.set(ylim=(0, None), title=f"contact pressure on the arc{' (hole solid, pin dashed)' if first else ''}")
    axes.set_xticks(np.arange(0, reach + 1, reach / 6))
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    second_axis(axes, "y", scene.E_star, "p / E*", "right")


def chord_panel(axes: Any, run: Run) -> None:
    """Mean pressure of each facet projected onto the chord of the contact (see `chord`), at the steps of `arc_panel`.

    Steps without contact, or with one beyond a quarter circle, have no chord.
    """
    scene = run.scene
    for step, style in _shown_steps(run).items():
        side, arc = list(run.contact(step).items())[-1]
        try:
            chord = chord_projection(*arc.facet_means(), run.columns["eps"][step - 1], arc.radius,
                                     arc.weight.sum(axis=1))  # fmt: skip
        except ValueError:
            continue
        axes.plot(chord.x_over_l, chord.py, **style)
    axes.set(xlabel="x / l along the chord", ylabel=f"$p_y$ [{scene.units.stress}]", xlim=(0, 1.1), ylim=(0, None))
    axes.set_title(f"pressure on the chord, {side}")
    if axes.lines:
        axes.legend(frameon=False)
    else:
        axes.text(0.5, 0.5, "no step has a chord", transform=axes.transAxes, ha="center")
    axes.grid(alpha=0.3)
    second_axis(axes, "y", scene.E_star, "$p_y$ / E*", "right")


def field_panel(figure: Any, axes: Any, run: Run, step: int | None = None) -> None:
    """PEEQ, or von Mises stress where nothing can yield, on the deformed joint near the contact, with its outline
    before (dashed) and after; displacement and clearance are magnified by the factor in the title."""
    scene, fields = run.scene, run.fields(step)
    factor = magnification(scene, fields)
    x = magnified(scene, fields, factor)
    values, label = _shown(scene, fields)
    left, right, low, high = _window(scene, factor)
    corners = x[fields.cells[:, :3]]
    near = (corners.max(axis=1) > [left, low]).all(axis=1) & (corners.min(axis=1) < [right, high]).all(axis=1)
    triangles = fields.cells[near][:, SUBTRIANGLES].reshape(-1, 3)
    colours = np.repeat(values[near], len(SUBTRIANGLES))
    cmap = "viridis" if fields.peeq is None else "inferno_r"
    drawn = axes.tripcolor(*x.T, triangles, facecolors=colours, cmap=cmap, vmin=0, vmax=_largest(scene, fields, values))
    cut = "max" if colours.max() > drawn.norm.vmax else "neither"
    figure.colorbar(drawn, ax=axes, label=label, shrink=0.85, extend=cut)
    _outline(axes, scene, fields, factor)
    length = scene.units.length
    axes.set(xlim=(left, right), ylim=(low, high), aspect="equal", xlabel=f"x [{length}]", ylabel=f"y [{length}]")
    what = "not magnified" if factor == 1 else f"displacement and clearance × {factor:g}"
    axes.set_title(f"step {fields.step}, {load_label(scene, fields.delta)}\n{what}", fontsize="medium")


def _shown(scene: Scene, fields: Fields) -> tuple[np.ndarray, str]:
    if fields.peeq is not None:
        return 100 * fields.peeq, "equivalent plastic strain [%]"
    return fields.von_mises, f"von Mises stress [{scene.units.stress}]"


def _largest(scene: Scene, fields: Fields, values: np.ndarray) -> float | None:
    """Where the colours end: at the largest value, in a ring at that outside the core on which the load acts."""
    radius = np.hypot(*fields.coordinates[fields.cells[:, :3]].mean(axis=1).T)
    away = radius > (0.5 * scene.joint.radius if scene.joint.model == "ring" else 0.0)
    return float(values[away].max()) or None


def _window(scene: Scene, factor: float) -> tuple[float, float, float, float]:
    """Left, right, lower and upper end of what is drawn."""
    R, gap = scene.joint.radius, max(0.0, factor * scene.joint.dR)
    reach = min(1.6 * R + gap, scene.joint.W)
    return 0.0, reach, -min(1.9 * R + gap, scene.joint.W), reach if scene.joint.model == "ring" else 0.06 * R


def _outline(axes: Any, scene: Scene, fields: Fields, factor: float) -> None:
    """Draw the boundary before and after, edges as the parabolas that they are, and a rigid pin."""
    from matplotlib.collections import LineCollection

    t, R = np.linspace(0, 1, _EDGE_POINTS), scene.joint.radius
    shape = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=1)
    before: dict[str, Any] = {"color": "0.35", "lw": 0.9, "ls": (0, (4, 3))}
    for displaced, style in ((False, before), (True, {"color": "black", "lw": 1.1})):
        lines = list(shape @ magnified(scene, fields, factor, displaced)[fields.outline()])
        arc = rigid_arc(scene, fields.delta if displaced else 0.0, factor)
        axes.add_collection(LineCollection([*lines, *([arc] if scene.pin.rigid else [])], **style), autolim=False)
    if scene.pin.rigid:
        axes.fill(*np.concatenate([arc, [[0.0, arc[-1, 1]]]]).T, color="0.85", zorder=0)
        axes.text(0.35 * R, arc[-1, 1] - 0.35 * R, "rigid pin", ha="center")


def iterations_panel(axes: Any, run: Run) -> None:
    """Newton iterations of each step, with its cutbacks above it."""
    step, iterations, cutbacks = (np.array(run.columns[name]) for name in ("step", "iterations", "cutbacks"))
    axes.bar(step, iterations, color="tab:blue", width=0.8 if len(step) <= _MANY_STEPS else 1.0)
    for x, y, cuts in zip(step, iterations, cutbacks, strict=True):
        if cuts:
            axes.annotate(f"{cuts:g} cut", (x, y), ha="center", va="bottom", fontsize="small", color="tab:red")
    total = f"{iterations.sum():g} iterations, {cutbacks.sum():g} cutback{'s' if cutbacks.sum() != 1 else ''}"
    axes.set(xlabel="step", ylabel="Newton iterations", title=total)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.grid(alpha=0.3, axis="y")
