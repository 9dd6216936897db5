"""The paper's figures from our runs: for each a table, written as CSV, and a picture laid out like the paper's.

Hu et al., figures 2 to 5 and 7 to 9 (6 is a sketch). Everything is in the paper's dimensionless groups.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from archord.benchmarks.paper.runs import PAIRS, PLANES, Case, Plane, plastic
from archord.geometry.basis import Array
from archord.postprocess.arc import read_arcs
from archord.postprocess.chord import ChordPressure, arc_angle, read_chord_pressure
from archord.postprocess.curve import RunCurve, read_run
from archord.postprocess.laws.elastic_laws import hertz_pressure, persson_load, persson_pressure
from archord.postprocess.laws.joint import LawJoint
from archord.postprocess.laws.laws import find_law

STYLES: dict[str, dict] = {"strain": {"color": "tab:blue"}, "stress": {"color": "tab:red"}}
LABELS = {"strain": "plane strain", "stress": "plane stress"}
FULL_YIELD, MILD_YIELD = (0.5, 0.2), (0.1, 0.1)  # the pairs of figures 5 and 8


@dataclass(frozen=True)
class Table:
    """Columns of a figure's CSV: heading and values, all of one length."""

    columns: dict[str, Array | list]

    def write(self, path: Path) -> None:
        """Write as CSV."""
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(self.columns)
            rows = zip(*self.columns.values(), strict=True)
            writer.writerows([f"{v:.10g}" if isinstance(v, float) else v for v in row] for row in rows)


def stacked(parts: list[dict[str, Array | list | str | float]]) -> Table:
    """One table from several with the same headings; numbers and texts hold for all rows of their part."""
    columns: dict[str, list] = {heading: [] for heading in parts[0]}
    for part in parts:
        length = max(len(v) for v in part.values() if isinstance(v, (list, np.ndarray)))
        for heading, values in part.items():
            filled = list(values) if isinstance(values, (list, np.ndarray)) else [values] * length
            columns[heading] += [v.item() if isinstance(v, np.generic) else v for v in filled]
    return Table(dict(columns))


@dataclass(frozen=True)
class Runs:
    """The finished runs in ``folder``."""

    folder: Path

    def path(self, scene: str, plane: Plane, mesh: str = "fine") -> Path:
        """Run folder of a case."""
        return self.folder / Case(scene, plane, mesh).name

    def curve(self, scene: str, plane: Plane, mesh: str = "fine") -> RunCurve:
        """P and p0 over delta of a case."""
        return read_run(self.path(scene, plane, mesh))


def facet_means(chord: ChordPressure, facets: int) -> tuple[Array, Array]:
    """``x/l`` and ``py`` averaged over each of the ``facets``: the pressure within plastic facets scatters."""
    weight = chord.weight.reshape(facets, -1)
    mean = [(weight * v.reshape(facets, -1)).sum(1) / weight.sum(1) for v in (chord.x_over_l, chord.py)]
    return mean[0], mean[1]


def chord_profile(run: RunCurve, step: int) -> tuple[float, Array, Array]:
    """``eps``, ``x/l`` and chord pressure over facet means of the hole at ``step``; facets beyond the edge left out."""
    assert run.folder is not None
    chord = read_chord_pressure(run.folder, step, "hole")
    points = read_arcs(run, step)["hole"].angle.shape[1]
    whole = len(chord.x) // points * points
    cut = ChordPressure(chord.x[:whole], chord.py[:whole], chord.weight[:whole], chord.eps, chord.R)
    x, py = facet_means(cut, whole // points)
    return chord.eps, x, py


def fig2(runs: Runs) -> tuple[Table, Callable]:
    """Chord pressure over x/l: ours, Persson's at the same angle, the parabola and Hertz's ellipse."""
    parts = []
    for plane in PLANES:
        run = runs.curve("elastic", plane)
        joint = LawJoint.from_scene(run.scene)
        for fraction in (0.5, 1.0, 1.5, 2.0):
            step = int(np.argmin(np.abs(run.delta / run.dR - fraction))) + 1
            eps, x, py = chord_profile(run, step)
            phi = arc_angle(2 * np.sin(eps / 2) * x, eps, 1.0)
            stretch = np.cos(eps / 2) / np.cos(phi - eps / 2) ** 2
            persson = persson_pressure(joint, np.array(run.P[step - 1]), np.array(eps), phi) * np.cos(phi) / stretch
            p0 = run.p0[step - 1]
            inside = x < 1
            shape = np.where(inside, 1 - x**2, 0.0)
            parts.append(
                {
                    "plane": plane,
                    "delta/dR": fraction,
                    "x/l": x,
                    "py/p0": py / p0,
                    "Persson": persson / p0,
                    "parabola": shape,
                    "ellipse": np.sqrt(shape),
                }
            )

    def draw(figure) -> None:
        axes = figure.subplots()
        x = np.linspace(0, 1, 200)
        axes.plot(x, 1 - x**2, "k-", label="parabola (eq. 3)")
        axes.plot(x, np.sqrt(1 - x**2), "k:", label="Hertz's ellipse (eq. 2)")
        for i, part in enumerate(p for p in parts if p["plane"] == "strain"):
            axes.plot(part["x/l"], part["py/p0"], "o", ms=3, color=f"C{i}", label=f"ours, δ = {part['delta/dR']} ΔR")
            axes.plot(part["x/l"], part["Persson"], "-", lw=1, color=f"C{i}")
        axes.set(xlabel="x / l", ylabel="$p_y$ / $p_0$", title="chord pressure (lines: Persson)", xlim=(0, 1.1))

    return stacked(parts), draw


def fig3(runs: Runs) -> tuple[Table, Callable]:
    """Peak pressure over delta: ours, Winkler with k = 0.85, Johnson."""
    parts = []
    for plane in PLANES:
        run = runs.curve("elastic", plane)
        joint = LawJoint.from_scene(run.scene)
        paper, johnson = find_law("paper"), find_law("johnson")
        inside = run.delta <= johnson.limit(joint)
        load = np.full(len(run.delta), np.nan)
        load[inside] = johnson.force(joint, run.delta[inside])
        hertz = np.full(len(run.delta), np.nan)
        hertz[inside] = hertz_pressure(joint, load[inside])
        parts.append(
            {
                "plane": plane,
                "delta/dR": run.delta / run.dR,
                "p0 R/(E* dR)": run.p0 * run.R / (run.E_star * run.dR),
                "Winkler, k = 0.85": paper.at_displacement(joint, run.delta).peak_pressure / (joint.E_star * run.dR),
                "Johnson": hertz / (joint.E_star * run.dR),
                "p0 R/(E* delta)": run.p0 * run.R / (run.E_star * run.delta),
            }
        )

    def draw(figure) -> None:
        axes = figure.subplots()
        for part in parts:
            style = STYLES[part["plane"]]
            axes.plot(
                part["delta/dR"], part["p0 R/(E* dR)"], "o", ms=4, label=f"ours, {LABELS[part['plane']]}", **style
            )
        axes.plot(parts[0]["delta/dR"], parts[0]["Winkler, k = 0.85"], "k-", label="Winkler, k = 0.85 (eq. 6)")
        axes.plot(parts[0]["delta/dR"], parts[0]["Johnson"], "k:", label="Johnson")
        axes.set(xlabel="δ / ΔR", ylabel="$p_0$ R / (E* ΔR)", title="peak pressure")

    return stacked(parts), draw


def fig4(runs: Runs) -> tuple[Table, Callable]:
    """Force over delta: ours, eq. 9, Johnson and Radzimovsky as printed and with the limit that the paper states."""
    laws = ("paper", "johnson", "radzimovsky", "radzimovsky-2.41")
    parts = []
    for plane in PLANES:
        run = runs.curve("elastic", plane)
        joint = LawJoint.from_scene(run.scene)
        part: dict = {"plane": plane, "delta/dR": run.delta / run.dR, "P/(E* dR)": run.P / (run.E_star * run.dR)}
        for name in laws:
            law, values = find_law(name), np.full(len(run.delta), np.nan)
            inside = run.delta <= law.limit(joint) * (1 + 1e-9)
            values[inside] = law.force(joint, run.delta[inside]) / (run.E_star * run.dR)
            part[name] = values
        parts.append(part)

    def draw(figure) -> None:
        axes = figure.subplots()
        for part in parts:
            style = STYLES[part["plane"]]
            axes.plot(part["delta/dR"], part["P/(E* dR)"], "o", ms=4, label=f"ours, {LABELS[part['plane']]}", **style)
        joint = LawJoint.from_scene(runs.curve("elastic", "strain").scene)
        for name, line in zip(laws, ("k-", "k:", "k--", "k-."), strict=True):
            law = find_law(name)
            delta = np.linspace(1e-6, min(2 * joint.clearance, law.limit(joint)), 200)
            axes.plot(delta / joint.clearance, law.force(joint, delta) / joint.clearance, line, lw=1, label=law.title)
        axes.set(xlabel="δ / ΔR", ylabel="P / (E* ΔR)", title="force of the elastic joint")

    return stacked(parts), draw


def fig5(runs: Runs) -> tuple[Table, Callable]:
    """Pressure over the yield stress along arc and chord at 2 dR, and the mean pressure over delta."""
    profiles, curves = [], []
    for plane in PLANES:
        run = runs.curve(plastic(FULL_YIELD), plane)
        assert run.sigY is not None
        eps, x, py = chord_profile(run, len(run.delta))
        arc = read_arcs(run, len(run.delta))["hole"]
        mean = (arc.weight * arc.pressure).sum(1) / arc.weight.sum(1)
        angle = (arc.weight * arc.angle).sum(1) / arc.weight.sum(1)
        n = len(x)
        profiles.append(
            {
                "plane": plane,
                "what": "profile at 2 dR",
                "phi/eps": angle[:n] / eps,
                "p/sigY on the arc": mean[:n] / run.sigY,
                "x/l": x,
                "py/sigY on the chord": py / run.sigY,
            }
        )
        curves.append((plane, run.delta / run.dR, run.P / (2 * run.R * np.sin(run.eps)) / run.sigY))
    rows = stacked(profiles).columns
    for plane, delta, mean in curves:
        for d, m in zip(delta, mean, strict=True):
            for heading, value in zip(
                rows, (plane, "P/(A sigY) over delta/dR", float(d), float(m), "", ""), strict=True
            ):
                rows[heading].append(value)  # type: ignore[union-attr]

    def draw(figure) -> None:
        left, right = figure.subplots(1, 2)
        for part, (_, delta, mean) in zip(profiles, curves, strict=True):
            style, name = STYLES[part["plane"]], LABELS[part["plane"]]
            left.plot(part["phi/eps"], part["p/sigY on the arc"], "-", label=f"arc, {name}", **style)
            left.plot(part["x/l"], part["py/sigY on the chord"], "--", label=f"chord, {name}", **style)
            right.plot(delta, mean, "o-", ms=3, label=name, **style)
        for one in (left, right):
            one.axhline(1, color="k", lw=0.8, ls=":")
        left.set(xlabel="φ/ε, x/l", ylabel="p / σY", title="pressure at δ = 2 ΔR", xlim=(0, 1.1))
        right.set(xlabel="δ / ΔR", ylabel="P / (A σY)", title="mean pressure over the projected area")

    return Table(rows), draw


def fig7(runs: Runs) -> tuple[Table, Callable]:
    """Force over delta of all pairs: ours and eqs 11, 12."""
    parts = []
    for pair in PAIRS:
        for plane in PLANES:
            run = runs.curve(plastic(pair), plane)
            assert run.sigY is not None
            joint, scale = LawJoint.from_scene(run.scene), run.R * run.sigY
            law = find_law("paper-plastic").force(joint, run.delta)
            parts.append(
                {
                    "dR/R [%]": pair[0],
                    "sigY/E* [%]": pair[1],
                    "plane": plane,
                    "delta/dR": run.delta / run.dR,
                    "P/(R sigY)": run.P / scale,
                    "eq. 12": law / scale,
                    "P/P(eq. 12)": run.P / law,
                }
            )

    def draw(figure) -> None:
        axes = figure.subplots()
        for part in parts:
            i = PAIRS.index((part["dR/R [%]"], part["sigY/E* [%]"]))
            mark = "o" if part["plane"] == "strain" else "x"
            label = f"{part['dR/R [%]']} %, {part['sigY/E* [%]']} %" if mark == "o" else None
            axes.plot(part["delta/dR"], part["P/(R sigY)"], mark, ms=4, color=f"C{i}", label=label)
            axes.plot(part["delta/dR"], part["eq. 12"], "-", lw=1, color=f"C{i}")
        axes.set(
            xlabel="δ / ΔR", ylabel="P / (R σY)", title="o plane strain, x plane stress, lines eq. 12 (ΔR/R, σY/E*)"
        )

    return stacked(parts), draw


def fig9(runs: Runs) -> tuple[Table, Callable]:
    """Force over the contact angle: ours, Persson, eqs 9 and 12 with eq. 5 for the angle."""
    parts = []
    for plane in PLANES:
        for scene in ("elastic", plastic(FULL_YIELD)):
            run = runs.curve(scene, plane)
            joint, scale = LawJoint.from_scene(run.scene), run.E_star * run.dR
            persson = persson_load(joint, run.eps) / scale
            delta = run.dR * (1 / np.cos(np.minimum(run.eps, 1.5)) - 1)  # eq. 5
            law = find_law("paper" if scene == "elastic" else "paper-plastic")
            values = np.full(len(delta), np.nan)
            inside = delta <= 2 * run.dR
            values[inside] = law.force(joint, delta[inside]) / scale
            parts.append(
                {
                    "plane": plane,
                    "joint": "elastic" if scene == "elastic" else "plastic",
                    "tan(eps/2)": np.tan(run.eps / 2),
                    "P/(E* dR)": run.P / scale,
                    "Persson": persson,
                    "eq. 9 or 12 at the same angle": values,
                }
            )

    def draw(figure) -> None:
        axes = figure.subplots()
        for part in parts:
            mark = "o" if part["joint"] == "elastic" else "x"
            label = f"ours, {part['joint']}, {LABELS[part['plane']]}"
            axes.plot(part["tan(eps/2)"], part["P/(E* dR)"], mark, ms=4, label=label, **STYLES[part["plane"]])
        elastic, yielding = parts[0], parts[1]
        axes.plot(elastic["tan(eps/2)"], elastic["Persson"], "k-", lw=1, label="Persson")
        axes.plot(elastic["tan(eps/2)"], elastic["eq. 9 or 12 at the same angle"], "k--", lw=1, label="eq. 9")
        axes.plot(yielding["tan(eps/2)"], yielding["eq. 9 or 12 at the same angle"], "k:", lw=1, label="eq. 12")
        axes.set(xlabel="tan(ε/2)", ylabel="P / (E* ΔR)", title="force over the contact angle", ylim=(0, 4))

    return stacked(parts), draw
