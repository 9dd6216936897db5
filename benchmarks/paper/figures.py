"""The paper's figures from our runs: for each a table, written as CSV, and a picture as
figures.toml says.

Hu et al., figures 2 to 5 and 7 to 9 (6 is a sketch). Everything is in the paper's dimensionless
groups.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from archord.benchmarks.paper.runs import FULL_YIELD, JOINTS, MILD_YIELD, PLANES, Runs
from archord.geometry.basis import Array
from archord.materials.material import Arrays, Plane
from archord.output.user_file import save_figure
from archord.postprocess.arrays.arc import read_contact
from archord.postprocess.chord import arc_angle, read_chord_pressure
from archord.postprocess.curve import RunCurve
from archord.postprocess.laws.elastic_laws import hertz, persson_load, persson_pressure
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.laws import find_law
from archord.postprocess.pictures.joint import field_panel
from archord.report.by_name import ByName
from archord.report.figure import new_figure
from archord.report.files import toml_beside, write_rows

Part = dict[str, Any]  # columns by heading; a number or a text holds for all rows
X = "delta/dR"
Y = "P/(E* dR)"
STAGES = (
    1.25,
    1.6,
    2.0,
)  # A, B and C in clearances: just after the paper's first yield, and on to its end
MARKS: dict[str, Part] = {
    "strain": {"marker": "o", "ms": 6, "mfc": "none"},
    "stress": {"marker": "x", "ms": 4},
}
LINES = ("-", ":", "--", "-.")
LAYOUTS: dict[str, dict] = toml_beside(__file__, "figures.toml")


def columns(parts: list[Part], **where: object) -> Arrays:
    """The columns of the ``parts`` in which these entries have these values, one below the
    other."""
    chosen = [part for part in parts if where.items() <= scalars(part).items()]
    return {
        name: np.concatenate([part[name] for part in chosen])
        for name in parts[0].keys() - scalars(parts[0])
    }


def scalars(part: Part) -> Part:
    """What holds for all rows."""
    return {name: value for name, value in part.items() if not isinstance(value, np.ndarray)}


def write(parts: list[Part], folder: Path, name: str) -> list[Path]:
    """Write ``name``.csv and ``name``.png into ``folder``; returns them. The parts have the same
    headings."""
    table = folder / f"{name}.csv"
    rows = [row for part in parts for row in rows_of(part)]
    write_rows(rows, table)
    canvas = new_figure(9, 4.5)
    draw(canvas, parts, LAYOUTS[name])
    return [table, save_figure(canvas, folder / f"{name}.png")]


def rows_of(part: Part) -> Iterator[Part]:
    """The rows of a ``part`` as they are written, with ten digits."""
    values = [np.asarray(value, dtype=object) for value in part.values()]
    columns = np.broadcast_arrays(*values)
    for cells in zip(*columns, strict=True):
        row = zip(part, cells, strict=True)
        yield {key: f"{v:.10g}" if isinstance(v, float) else v for key, v in row}


def draw(canvas: Any, parts: list[Part], layout: ByName) -> None:
    """Draw those of the ``parts`` that the ``layout`` asks for: marks for ours, lines for laws."""
    axes = canvas.subplots()
    x = layout["x"]
    y = layout["y"]
    lines = layout.get("lines", [])
    laws = layout.get("laws", [])
    where = layout.get("where", {})
    drawn = [part for part in parts if where.items() <= scalars(part).items()]
    kinds = list(dict.fromkeys(kind_of(part) for part in drawn))
    for part in drawn:
        colour = f"C{kinds.index(kind_of(part))}"
        axes.plot(part[x], part[y], ls="", color=colour, **MARKS[part["plane"]])
        for line in lines:
            axes.plot(part[x], part[line], "-", lw=1, color=colour)
    for plane in dict.fromkeys(part["plane"] for part in drawn):
        axes.plot([], [], ls="", color="black", label=f"ours, plane {plane}", **MARKS[plane])
    grey = "C0" if len(kinds) == 1 else "0.5"
    for line in lines:
        axes.plot([], [], "-", lw=1, color=grey, label=line)
    first = drawn[0]
    for law, style in zip(laws, LINES, strict=False):
        axes.plot(first[x], first[law], style, lw=1, color="black", label=law)
    if len(kinds) > 1:
        for k, kind in enumerate(kinds):
            axes.plot([], [], "s", ms=6, color=f"C{k}", label=kind)
    axes.set(xlabel=x, ylabel=y, title=layout["title"])
    canvas.legend(loc="outside right upper", frameon=False)
    axes.grid(alpha=0.3)


def kind_of(part: Part) -> str:
    """What tells a part from others beside its plane, as the legend says it."""
    named = []
    for key, value in scalars(part).items():
        name, per_cent, _ = key.partition(" [%]")
        if name != "plane":
            named.append(f"{name} = {value}{' %' if per_cent else ''}")
    return ", ".join(named)


def law_force(name: str, run: RunCurve, delta: Array | None = None) -> Array:
    """P of a law at ``delta`` (the run's) over the unit E* dR of the run's joint; nan beyond
    the law's limit."""
    law = find_law(name)
    joint = LawJoint.from_scene(run.scene)
    delta = run.delta if delta is None else delta
    inside = delta <= law.limit(joint) * (1 + 1e-9)
    force = np.full(len(delta), np.nan)
    force[inside] = law.force(joint, delta[inside]) / run.unit
    return force


def curve(run: RunCurve) -> Part:
    """P over delta."""
    return {"plane": run.plane, X: run.x, Y: run.P / run.unit}


def strength(run: RunCurve) -> float:
    """The yield stress of a joint that has one."""
    assert run.sigY is not None
    return run.sigY


def chord_profile(run: RunCurve, step: int) -> tuple[float, Array, Array]:
    """``eps``, ``x/l`` and chord pressure of the hole at ``step``: means of facets, as within
    plastic ones the pressure scatters, without those beyond the edge."""
    assert run.folder is not None
    chord = read_chord_pressure(run.folder, step, "hole")
    points = read_contact(run.folder, run.scene, step)["hole"].angle.shape[1]
    whole = len(chord.x) // points * points
    at_points = (chord.weight, chord.x_over_l, chord.py)
    weight, x, py = (values[:whole].reshape(-1, points) for values in at_points)
    of_facet = weight.sum(axis=1)
    x_mean = (weight * x).sum(axis=1) / of_facet
    py_mean = (weight * py).sum(axis=1) / of_facet
    return chord.eps, x_mean, py_mean


def fig2(runs: Runs, plane: Plane) -> list[Part]:
    """Chord pressure over x/l: ours, Persson's at the same angle, the parabola and Hertz's
    ellipse."""
    run = runs.curve("elastic", plane)
    parts = []
    for fraction in (2.0, 1.5, 1.0, 0.5):
        off = np.abs(run.x - fraction)
        k = int(np.argmin(off))
        eps, x, py = chord_profile(run, k + 1)
        along_chord = 2 * np.sin(eps / 2) * x
        phi = arc_angle(along_chord, eps, 1.0)
        stretch = np.cos(eps / 2) / np.cos(phi - eps / 2) ** 2
        joint = LawJoint.from_scene(run.scene)
        pressure = persson_pressure(joint, run.P[k], np.array(eps), phi)
        shape = np.where(x < 1, 1 - x**2, 0.0)
        projected = pressure * np.cos(phi) / stretch
        p0 = run.p0[k]
        ratios = {"py/p0": py / p0, "Persson": projected / p0}
        parts.append(
            {
                "plane": plane,
                X: fraction,
                "x/l": x,
                **ratios,
                "parabola": shape,
                "ellipse": shape**0.5,
            }
        )
    return parts


def fig3(runs: Runs, plane: Plane) -> list[Part]:
    """Peak pressure over delta: ours, Winkler with k = 0.85, Johnson."""
    run = runs.curve("elastic", plane)
    joint = LawJoint.from_scene(run.scene)
    unit = run.unit
    force = law_force("johnson", run) * unit
    johnson = hertz(joint, force).peak_pressure / unit
    ours = run.p0 * run.R / unit
    paper = find_law("paper").at_displacement(joint, run.delta)
    winkler = paper.peak_pressure / unit
    laws = {
        "Winkler, k = 0.85": winkler,
        "Johnson": johnson,
        "p0 R/(E* delta)": ours * run.dR / run.delta,
    }
    return [{"plane": plane, X: run.x, "p0 R/(E* dR)": ours, **laws}]


def fig4(runs: Runs, plane: Plane) -> list[Part]:
    """Force over delta: ours, eq. 9, Johnson and Radzimovsky as printed and with the limit that the
    paper states."""
    run = runs.curve("elastic", plane)
    laws = {name: law_force(name, run) for name in LAYOUTS["fig4"]["laws"]}
    return [curve(run) | laws]


def fig5(runs: Runs, plane: Plane) -> list[Part]:
    """Pressure over the yield stress along arc and chord at 2 dR."""
    run = runs.curve(FULL_YIELD, plane)
    eps, x, py = chord_profile(run, len(run.delta))
    hole = runs.run(FULL_YIELD, plane).arc(side="hole")
    angle, pressure = (means[: len(x)] for means in hole.facet_means())
    sides = ("arc", angle / eps, pressure), ("chord", x, py)
    return [
        {"plane": plane, "on": side, "phi/eps or x/l": at, "p/sigY": p / strength(run)}
        for side, at, p in sides
    ]


def fig5b(runs: Runs, plane: Plane) -> list[Part]:
    """The mean pressure over the projected area A over delta."""
    run = runs.curve(FULL_YIELD, plane)
    mean = run.P / (2 * run.R * np.sin(run.eps))
    return [{"plane": plane, X: run.x, "P/(A sigY)": mean / strength(run)}]


def fig7(runs: Runs, plane: Plane) -> list[Part]:
    """Force over delta of all pairs: ours and eqs 11, 12."""
    parts = []
    for joint in LAYOUTS["fig7"]["joints"]:
        run = runs.curve(joint, plane)
        unit = run.R * strength(run)
        law = law_force("paper-plastic", run) * run.unit
        named: Part = {
            "dR/R [%]": JOINTS[joint][0],
            "sigY/E* [%]": JOINTS[joint][1],
            "plane": plane,
        }
        forces = {"P/(R sigY)": run.P / unit, "eq. 12": law / unit, "P/P(eq. 12)": run.P / law}
        parts.append(named | {X: run.x} | forces)
    return parts


def fig8(runs: Runs, plane: Plane) -> list[Part]:
    """Force over delta: ours, ours without yielding, eq. 12."""
    run, elastic = (runs.curve(joint, plane) for joint in LAYOUTS["fig8"]["joints"])
    laws = {"elastic P/(E* dR)": curve(elastic)[Y], "eq. 12": law_force("paper-plastic", run)}
    return [curve(run) | laws | {"PEEQ max": run.peeq_max}]


def fig9(runs: Runs, plane: Plane) -> list[Part]:
    """Force over the contact angle: ours, Persson, eqs 9 and 12 with eq. 5 for the angle."""
    parts = []
    for kind, joint, name in (
        ("elastic", "elastic", "paper"),
        ("plastic", FULL_YIELD, "paper-plastic"),
    ):
        run = runs.curve(joint, plane)
        persson = persson_load(LawJoint.from_scene(run.scene), run.eps) / run.unit
        delta = run.dR * (1 / np.cos(np.minimum(run.eps, 1.5)) - 1)  # eq. 5
        laws = {"Persson": persson, "eq. 9 or 12 at the same angle": law_force(name, run, delta)}
        parts.append({"joint": kind, "tan(eps/2)": np.tan(run.eps / 2)} | curve(run) | laws)
    return parts


_MAKERS: tuple[Callable[[Runs, Plane], list[Part]], ...] = (
    fig2,
    fig3,
    fig4,
    fig5,
    fig5b,
    fig7,
    fig8,
    fig9,
)
FIGURES = dict(zip(LAYOUTS, _MAKERS, strict=True))


def draw_zones(runs: Runs, file: Path) -> Path:
    """Draw figure 8's plastic zones at the stages A, B, C, in plane strain above and in plane
    stress below."""
    figure = new_figure(15, 9.5)
    for plane, row in zip(PLANES, figure.subplots(len(PLANES), len(STAGES)), strict=True):
        run = runs.run(MILD_YIELD, plane)
        for stage, axes in zip(STAGES, row, strict=True):
            field_panel(axes, run, int(np.argmin(np.abs(run.curve.x - stage))) + 1)
            axes.set_title(f"plane {plane}, {axes.get_title()}", fontsize="medium")
    return save_figure(figure, file)
