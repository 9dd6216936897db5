"""The paper's figures from our runs: for each a table, written as CSV, and a picture laid out like the paper's.

Hu et al., figures 2 to 5 and 7 to 9 (6 is a sketch). Everything is in the paper's dimensionless groups.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.benchmarks.paper.first_yield import first_yields
from archord.benchmarks.paper.runs import FULL_YIELD, MILD_YIELD, PAIRS, PLANES, Runs, plastic
from archord.geometry.basis import Array
from archord.postprocess.arc import read_arcs
from archord.postprocess.chord import arc_angle, read_chord_pressure
from archord.postprocess.curve import RunCurve
from archord.postprocess.fields import SUBTRIANGLES, read_fields
from archord.postprocess.laws.elastic_laws import hertz_pressure, persson_load, persson_pressure
from archord.postprocess.laws.joint import LawJoint
from archord.postprocess.laws.laws import find_law
from archord.report.figure import new_figure, save
from archord.report.files import write_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

Part = dict[str, Any]  # columns by heading; a number or a text holds for all rows
COLOURS = {"strain": "tab:blue", "stress": "tab:red"}
LABELS = {"strain": "plane strain", "stress": "plane stress"}
STAGES = (1.25, 1.6, 2.0)  # A, B and C in clearances: just after the paper's first yield, and on to its end
X, Y = "delta/dR", "P/(E* dR)"


@dataclass(frozen=True)
class Figure:
    """A figure: the ``parts`` of its table, which have the same headings, how it is drawn, and its size in inches."""

    parts: list[Part]
    draw: Callable[[Canvas], None]
    size: tuple[float, float] = (6.5, 4.5)

    def columns(self, **where: object) -> dict[str, Array]:
        """The columns of the parts in which these entries have these values, one below the other."""
        chosen = [part for part in self.parts if all(part[name] == value for name, value in where.items())]
        arrays = [name for name, value in self.parts[0].items() if isinstance(value, np.ndarray)]
        return {name: np.concatenate([part[name] for part in chosen]) for name in arrays}

    def rows(self) -> list[dict[str, object]]:
        """The table, row by row."""
        rows: list[dict[str, object]] = []
        for part in self.parts:
            length = max(len(value) for value in part.values() if isinstance(value, np.ndarray))
            for k in range(length):
                entries = {name: value[k] if isinstance(value, np.ndarray) else value for name, value in part.items()}
                rows.append({name: f"{v:.10g}" if isinstance(v, float) else v for name, v in entries.items()})
        return rows

    def write(self, folder: Path, name: str) -> list[Path]:
        """Write ``name``.csv and ``name``.png into ``folder``; returns them."""
        table, picture = folder / f"{name}.csv", folder / f"{name}.png"
        write_rows(self.rows(), table)
        canvas = new_figure(*self.size)
        self.draw(canvas)
        for axes in canvas.axes:
            if axes.get_legend_handles_labels()[1]:
                axes.legend(frameon=False, fontsize=8)
                axes.grid(alpha=0.3)
        return [table, save(canvas, picture)]


def law_force(name: str, run: RunCurve, delta: np.ndarray | None = None) -> Array:
    """P of a law at ``delta`` (those of the run) over the unit E* dR of the run's joint; nan beyond the law's limit."""
    law, joint = find_law(name), LawJoint.from_scene(run.scene)
    delta = run.delta if delta is None else delta
    inside = delta <= law.limit(joint) * (1 + 1e-9)
    force = np.full(len(delta), np.nan)
    force[inside] = law.force(joint, delta[inside]) / (run.E_star * run.dR)
    return force


def _curve(run: RunCurve) -> Part:
    return {"plane": run.plane, X: run.delta / run.dR, Y: run.P / (run.E_star * run.dR)}


def _plot_ours(axes: Axes, parts: list[Part], x: str, y: str, size: float = 4) -> None:
    for part in parts:
        label, colour = f"ours, {LABELS[part['plane']]}", COLOURS[part["plane"]]
        axes.plot(part[x], part[y], "o", ms=size, label=label, color=colour)


def chord_profile(run: RunCurve, step: int) -> tuple[float, Array, Array]:
    """``eps``, ``x/l`` and chord pressure over facet means of the hole at ``step``; facets beyond the edge left out.

    Means, because the pressure within plastic facets scatters.
    """
    assert run.folder is not None
    chord = read_chord_pressure(run.folder, step, "hole")
    points = read_arcs(run, step)["hole"].angle.shape[1]
    whole = len(chord.x) // points * points
    weight, x, py = (v[:whole].reshape(-1, points) for v in (chord.weight, chord.x_over_l, chord.py))
    return chord.eps, (weight * x).sum(1) / weight.sum(1), (weight * py).sum(1) / weight.sum(1)


def fig2(runs: Runs) -> Figure:
    """Chord pressure over x/l: ours, Persson's at the same angle, the parabola and Hertz's ellipse."""
    parts: list[Part] = []
    for plane in PLANES:
        run = runs.curve("elastic", plane)
        joint = LawJoint.from_scene(run.scene)
        for fraction in (0.5, 1.0, 1.5, 2.0):
            k = int(np.argmin(np.abs(run.delta / run.dR - fraction)))
            eps, x, py = chord_profile(run, k + 1)
            phi = arc_angle(2 * np.sin(eps / 2) * x, eps, 1.0)
            stretch = np.cos(eps / 2) / np.cos(phi - eps / 2) ** 2
            persson = persson_pressure(joint, run.P[k], np.array(eps), phi) * np.cos(phi) / stretch
            shape = np.where(x < 1, 1 - x**2, 0.0)
            ratios = {"py/p0": py / run.p0[k], "Persson": persson / run.p0[k]}
            parts.append({"plane": plane, X: fraction, "x/l": x, **ratios, "parabola": shape, "ellipse": shape**0.5})

    def draw(figure: Canvas) -> None:
        axes, x = figure.subplots(), np.linspace(0, 1, 200)
        axes.plot(x, 1 - x**2, "k-", label="parabola (eq. 3)")
        axes.plot(x, np.sqrt(1 - x**2), "k:", label="Hertz's ellipse (eq. 2)")
        for i, part in enumerate(p for p in parts if p["plane"] == "strain"):
            axes.plot(part["x/l"], part["py/p0"], "o", ms=3, color=f"C{i}", label=f"ours, δ = {part[X]} ΔR")
            axes.plot(part["x/l"], part["Persson"], "-", lw=1, color=f"C{i}")
        axes.set(xlabel="x / l", ylabel="$p_y$ / $p_0$", title="chord pressure (lines: Persson)", xlim=(0, 1.1))

    return Figure(parts, draw)


def fig3(runs: Runs) -> Figure:
    """Peak pressure over delta: ours, Winkler with k = 0.85, Johnson."""
    parts: list[Part] = []
    for plane in PLANES:
        run = runs.curve("elastic", plane)
        joint, unit = LawJoint.from_scene(run.scene), run.E_star * run.dR
        johnson = law_force("johnson", run)
        known = np.isfinite(johnson)
        johnson[known] = hertz_pressure(joint, johnson[known] * unit) / unit
        ours = run.p0 * run.R / unit
        winkler = find_law("paper").at_displacement(joint, run.delta).peak_pressure / unit
        curves = {"p0 R/(E* dR)": ours, "Winkler, k = 0.85": winkler, "Johnson": johnson}
        parts.append({"plane": plane, X: run.delta / run.dR, **curves, "p0 R/(E* delta)": ours * run.dR / run.delta})

    def draw(figure: Canvas) -> None:
        axes, x = figure.subplots(), parts[0][X]
        _plot_ours(axes, parts, X, "p0 R/(E* dR)")
        axes.plot(x, parts[0]["Winkler, k = 0.85"], "k-", label="Winkler, k = 0.85 (eq. 6)")
        axes.plot(x, parts[0]["Johnson"], "k:", label="Johnson")
        axes.set(xlabel="δ / ΔR", ylabel="$p_0$ R / (E* ΔR)", title="peak pressure")

    return Figure(parts, draw)


def fig4(runs: Runs) -> Figure:
    """Force over delta: ours, eq. 9, Johnson and Radzimovsky as printed and with the limit that the paper states."""
    laws = ("paper", "johnson", "radzimovsky", "radzimovsky-2.41")
    curves = [runs.curve("elastic", plane) for plane in PLANES]
    parts = [_curve(run) | {name: law_force(name, run) for name in laws} for run in curves]

    def draw(figure: Canvas) -> None:
        axes, run = figure.subplots(), curves[0]
        _plot_ours(axes, parts, X, Y)
        for name, line in zip(laws, ("k-", "k:", "k--", "k-."), strict=True):
            law = find_law(name)
            delta = np.linspace(1e-6, min(2 * run.dR, law.limit(LawJoint.from_scene(run.scene))), 200)
            axes.plot(delta / run.dR, law_force(name, run, delta), line, lw=1, label=law.title)
        axes.set(xlabel="δ / ΔR", ylabel="P / (E* ΔR)", title="force of the elastic joint")

    return Figure(parts, draw)


def fig5(runs: Runs) -> Figure:
    """Pressure over the yield stress along arc and chord at 2 dR, and the mean pressure over delta."""
    profiles: list[Part] = []
    means: list[Part] = []
    for plane in PLANES:
        run = runs.curve(plastic(FULL_YIELD), plane)
        assert run.sigY is not None
        eps, x, py = chord_profile(run, len(run.delta))
        angle, pressure = (v[: len(x)] for v in read_arcs(run, len(run.delta))["hole"].facet_means())
        arc = {"phi/eps": angle / eps, "p/sigY on the arc": pressure / run.sigY}
        chord = {"x/l": x, "py/sigY on the chord": py / run.sigY}
        profiles.append({"plane": plane, "what": "profile at 2 dR", **arc, **chord})
        mean = run.P / (2 * run.R * np.sin(run.eps)) / run.sigY
        # under the same headings as the profiles
        values = ("P/(A sigY) over delta/dR", run.delta / run.dR, mean, "", "")
        means.append(dict(zip(profiles[0], (plane, *values), strict=True)))

    def draw(figure: Canvas) -> None:
        left, right = figure.subplots(1, 2)
        for part, mean in zip(profiles, means, strict=True):
            colour, name = COLOURS[part["plane"]], LABELS[part["plane"]]
            left.plot(part["phi/eps"], part["p/sigY on the arc"], "-", label=f"arc, {name}", color=colour)
            left.plot(part["x/l"], part["py/sigY on the chord"], "--", label=f"chord, {name}", color=colour)
            right.plot(mean["phi/eps"], mean["p/sigY on the arc"], "o-", ms=3, label=name, color=colour)
        for one in (left, right):
            one.axhline(1, color="k", lw=0.8, ls=":")
        left.set(xlabel="φ/ε, x/l", ylabel="p / σY", title="pressure at δ = 2 ΔR", xlim=(0, 1.1))
        right.set(xlabel="δ / ΔR", ylabel="P / (A σY)", title="mean pressure over the projected area")

    return Figure(profiles + means, draw, (11, 4.5))


def fig7(runs: Runs) -> Figure:
    """Force over delta of all pairs: ours and eqs 11, 12."""
    parts: list[Part] = []
    for pair in PAIRS:
        for plane in PLANES:
            run = runs.curve(plastic(pair), plane)
            assert run.sigY is not None
            ours, law = run.P / (run.R * run.sigY), law_force("paper-plastic", run) * run.E_star * run.dR
            named = {"dR/R [%]": pair[0], "sigY/E* [%]": pair[1], "plane": plane}
            forces = {"P/(R sigY)": ours, "eq. 12": law / (run.R * run.sigY), "P/P(eq. 12)": run.P / law}
            parts.append(named | {X: run.delta / run.dR} | forces)

    def draw(figure: Canvas) -> None:
        axes = figure.subplots()
        for k, part in enumerate(parts):
            mark, colour = "ox"[k % 2], f"C{k // 2}"
            label = f"{part['dR/R [%]']} %, {part['sigY/E* [%]']} %" if mark == "o" else None
            axes.plot(part[X], part["P/(R sigY)"], mark, ms=4, color=colour, label=label)
            axes.plot(part[X], part["eq. 12"], "-", lw=1, color=colour)
        title = "o plane strain, x plane stress, lines eq. 12 (ΔR/R, σY/E*)"
        axes.set(xlabel="δ / ΔR", ylabel="P / (R σY)", title=title)

    return Figure(parts, draw)


def fig8(runs: Runs) -> Figure:
    """Force over delta with the stages A, B, C, and the plastic zone at each of them."""
    curves = [runs.curve(plastic(MILD_YIELD), plane) for plane in PLANES]
    parts = [
        _curve(run)
        | {"elastic P/(E* dR)": runs.curve("elastic_0.1", plane).P / (run.E_star * run.dR)}
        | {"eq. 12": law_force("paper-plastic", run), "PEEQ max": run.peeq_max}
        for plane, run in zip(PLANES, curves, strict=True)
    ]

    def draw(figure: Canvas) -> None:
        yields = first_yields(runs)
        for row, run, part, (plane, found) in zip(figure.subplots(2, 4), curves, parts, yields.items(), strict=True):
            x, y = part[X], part[Y]
            row[0].plot(x, y, "o", ms=3, label="ours", color=COLOURS[plane])
            row[0].plot(x, part["elastic P/(E* dR)"], "-", lw=1, color="gray", label="ours, elastic")
            row[0].plot(x, part["eq. 12"], "k-", lw=1, label="eqs 9, 12")
            row[0].axvline(found.delta, color="k", ls=":", lw=1, label=f"first yield, {found.delta:.2f}")
            row[0].set(xlabel="δ / ΔR", ylabel="P / (E* ΔR)", title=LABELS[plane])
            for name, stage, axes in zip("ABC", STAGES, row[1:], strict=True):
                k = int(np.argmin(np.abs(x - stage)))
                row[0].plot(x[k], y[k], "kx")
                row[0].annotate(name, (x[k], y[k]), (5, -8), textcoords="offset points")
                _draw_zone(figure, axes, run, k + 1)
                axes.set_title(f"{name}: δ = {x[k]:.3g} ΔR")

    return Figure(parts, draw, (17, 8))


def _draw_zone(figure: Canvas, axes: Axes, run: RunCurve, step: int) -> None:
    """PEEQ on the deformed shape near the contact."""
    assert run.folder is not None
    fields = read_fields(run.folder, run.scene, step)
    assert fields.peeq is not None
    x = fields.deformed / run.R
    near = np.abs(x[fields.cells[:, :3]]).max(axis=(1, 2)) < 3
    drawn = axes.tripcolor(
        *x.T, fields.cells[near][:, SUBTRIANGLES].reshape(-1, 3),
        facecolors=np.repeat(100 * fields.peeq[near], len(SUBTRIANGLES)), cmap="inferno_r",
    )  # fmt: skip
    figure.colorbar(drawn, ax=axes, label="equivalent plastic strain [%]", shrink=0.85)
    axes.set(xlim=(0, 1.5), ylim=(-1.9, 0.05), aspect="equal", xlabel="x / R", ylabel="y / R")


def fig9(runs: Runs) -> Figure:
    """Force over the contact angle: ours, Persson, eqs 9 and 12 with eq. 5 for the angle."""
    parts: list[Part] = []
    at_angle, t = "eq. 9 or 12 at the same angle", "tan(eps/2)"
    for plane in PLANES:
        for kind, joint, name in (("elastic", "elastic", "paper"), ("plastic", plastic(FULL_YIELD), "paper-plastic")):
            run = runs.curve(joint, plane)
            persson = persson_load(LawJoint.from_scene(run.scene), run.eps) / (run.E_star * run.dR)
            delta = run.dR * (1 / np.cos(np.minimum(run.eps, 1.5)) - 1)  # eq. 5
            forces = {Y: run.P / (run.E_star * run.dR), "Persson": persson, at_angle: law_force(name, run, delta)}
            parts.append({"plane": plane, "joint": kind, t: np.tan(run.eps / 2), **forces})

    def draw(figure: Canvas) -> None:
        axes, (elastic, yielding) = figure.subplots(), parts[:2]
        for part in parts:
            mark = "o" if part["joint"] == "elastic" else "x"
            label = f"ours, {part['joint']}, {LABELS[part['plane']]}"
            axes.plot(part[t], part[Y], mark, ms=4, label=label, color=COLOURS[part["plane"]])
        axes.plot(elastic[t], elastic["Persson"], "k-", lw=1, label="Persson")
        axes.plot(elastic[t], elastic[at_angle], "k--", lw=1, label="eq. 9")
        axes.plot(yielding[t], yielding[at_angle], "k:", lw=1, label="eq. 12")
        axes.set(xlabel="tan(ε/2)", ylabel="P / (E* ΔR)", title="force over the contact angle", ylim=(0, 4))

    return Figure(parts, draw)
