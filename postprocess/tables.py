"""Runs, sweeps and comparisons as text for people: tables, with a line above or below where one
needs it."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Iterable
from typing import Any

import numpy as np

from archord.postprocess.comparison import COMMON, COMPARED, Comparison, differing_keys
from archord.postprocess.probe import Probe
from archord.postprocess.run import Run
from archord.postprocess.sweep import Sweep
from archord.report.doubts import kind
from archord.report.table import Table

_MOST = 40  # rows of a table
_LONG = 100_000  # characters of a line, where no terminal breaks it
_NARROW = 30  # the least of a wrapped line
_CELL = 60  # of a key of a scene in a table
_OF_A_JOINT = ("delta/dR", "P", "P/(E* R)", "p0", "p0/E*", "eps", "peeq_max", "contact peeq_max")
_SHOWN = (
    "step",
    "load_factor",
    "delta",
    *_OF_A_JOINT,
    "steps",
    "iterations",
    "cutbacks",
    "seconds",
)
_OF_A_RUN = {  # what a comparison tells of each run
    "status": lambda run: run.status,
    "steps": lambda run: f"{run.steps} of {len(run.scene.targets)}",
    "dofs": lambda run: run.summary.get("mesh", {}).get("dofs", "-"),
    "ranks": lambda run: run.summary.get("ranks", "-"),
    "iterations": lambda run: run.summary["totals"].get("newton_iterations", "-"),
    "seconds": lambda run: run.summary["seconds"].get("total", "-"),
    "archord": lambda run: run.summary["versions"].get("archord", "-"),
}


def run_text(run: Run, width: int = 0) -> str:
    """State, joint, history, peaks, cost and warnings of a run, in lines no longer than ``width``
    if that is given."""
    words = {"running": "running, or killed (if no archord works there, --restart continues it)"}
    state = f"{run.folder}: {words.get(run.status, run.status)}; {run.steps} of {len(run.scene.targets)} steps"
    state = f"{state}: {run.message}" if run.message else state
    parts = [*_lines(state, width or _LONG), "", _named(facts_of(run), width)]
    if run.steps:
        history = _thinned(history_table(run), run.folder / "history.csv", width)
        parts += ["", history, "", *_lines(peaks_of(run), width or _LONG)]
    return "\n".join((*parts, "", _named(cost_of(run), width)))


def sweep_text(sweep: Sweep) -> str:
    """Cases of a sweep by status, what was varied, where they ended, and why some did not."""
    lines = [f"{sweep.folder}: {len(sweep)} case{'s' if len(sweep) != 1 else ''}: {sweep.states}"]
    cases = sweep.cases
    if same := [
        f"{key} = {_cell(cases[key].iloc[0])}" for key in sweep.keys if key not in sweep.moving
    ]:
        lines += [f"in all cases: {', '.join(same)}"]
    ends = [name for name in _SHOWN if name in cases and name != "delta"]
    if "load_factor" in cases:
        ends[1:1] = [name for name in cases if name.endswith((" displacement", *COMMON))]
    names = ["case", "run", *sweep.moving, "status", *ends]
    lines += ["", _thinned(_table_of(cases[names]), sweep.folder / "cases.csv")]
    said = zip(cases["case"], cases["message"], strict=True)
    lines += [f"case {case}: {message}" for case, message in said if message]
    return "\n".join(
        [*lines, *(f"case {case} is left out: {fault}" for case, fault in sweep.unread.items())]
    )


def comparison_text(comparison: Comparison) -> str:
    """Quantities of all runs at common loads, the keys in which the scenes differ, and how the runs
    went."""
    names = names_of(comparison.runs)
    parts = [
        _thinned(_differences(comparison, name, names), "history.csv") for name in comparison.values
    ]
    rows = differing_keys([run.scene for run in comparison.runs])
    rows |= {name: [str(get(run)) for run in comparison.runs] for name, get in _OF_A_RUN.items()}
    table = Table("", *names, left=1 + len(names))
    for key, values in rows.items():
        wrapped = (_lines(value, _CELL) or ["-"] for value in values)
        for line in itertools.zip_longest([key], *wrapped, fillvalue=""):
            table.add(*line)
    return "\n\n".join(map(str, (*parts, _note(comparison), table)))


def probe_text(probe: Probe, angles: Iterable[float]) -> str:
    """A quantity along an edge or a line, its largest and smallest value and where they are, and
    its values at ``angles``."""
    unit = f" {probe.unit}".rstrip()
    force = f"step {probe.step}, {probe.by or 'force'} = {probe.force:.6g} per unit thickness"
    lines = [
        _thinned(_table_of(probe.frame()), "-o FILE.csv"),
        "",
        f"{probe.quantity} along {probe.place}, {force}",
    ]
    for name, k in (("largest", probe.largest), ("smallest", probe.smallest)):
        lines.append(f"{name}: {probe.values[k]:.6g}{unit} {probe.where(k)}")
    return "\n".join([*lines, *(f"at {angle:g}°: {probe.at(angle):.6g}{unit}" for angle in angles)])


def names_of(runs: Iterable[Run]) -> list[str]:
    """Names of the runs' folders; their paths where two of the names are the same."""
    names = [run.folder.resolve().name for run in runs]
    return names if len(set(names)) == len(names) else [str(run.folder) for run in runs]


def first_of_each_kind(warnings: list[str]) -> list[str]:
    """Each kind of warning once, at the first step that gave it; kinds differ in more than their
    numbers."""
    first: dict[str, str] = {}
    for warning in warnings:
        first.setdefault(kind(warning), warning)
    return list(first.values())


def _table_of(frame: Any) -> Table:
    from archord.postprocess.frames import with_headings  # with pandas

    return Table(
        *with_headings(frame), rows=(map(_cell, row) for row in frame.itertuples(index=False))
    )


def _named(rows: Iterable[tuple[str, str]], width: int) -> str:
    """Text behind names, wrapped to lines no longer than ``width`` (or `_LONG`)."""
    pairs = list(rows)
    room = max(_NARROW, (width or _LONG) - 2 - max(len(name) for name, _ in pairs))
    table = Table("", "", left=2)
    for name, text in pairs:
        first, *more = _lines(text, room) or [""]
        table.add(name, first)
        for line in more:
            table.add("", line)
    return str(table)


def _lines(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False)


def _thinned(table: Table, whole: object, width: int = 0) -> str:
    """Up to 40 rows of the ``table``, evenly spaced, first and last included, and where the
    ``whole`` of it is; in blocks of columns where a ``width`` is given."""
    n = len(table.rows)
    if n > _MOST:
        table.rows = [table.rows[round(k)] for k in np.linspace(0, n - 1, _MOST)]
    text = table.within(width) if width else str(table)
    if n <= _MOST:
        return text
    return f"{text}\n{_MOST} of {n} rows; {whole} has all of them"


def facts_of(run: Run) -> Iterable[tuple[str, str]]:
    """What was solved: the joint, or the parts of a general scene; and on what mesh."""
    scene, mesh, plane = run.scene, run.summary.get("mesh", {}), f"plane {run.scene.analysis.plane}"
    if run.is_joint:
        g, length = scene.joint, scene.units.length
        yield (
            "joint",
            f"{g.model}, R = {g.radius:g} {length}, dR = {g.dR:g} {length}, dR/R = {g.dR / g.radius:g}",
        )
        yield (
            "",
            f"{plane}, contact {scene.analysis.kinematics}, E* = {scene.E_star:g} {scene.units.stress}",
        )
        parts = [("pin", scene.pin), ("block", scene.block)]
    else:
        yield "problem", f"{plane}, {scene.loading}"
        kinds = ("body", "interaction", "coupling", "support", "load")
        parts = [(f"{kind} {part.name}", part) for kind in kinds for part in getattr(scene, kind)]
    for name, part in parts:
        keys = part.model_dump(exclude_none=True, exclude={"name"}).items()
        given = (
            f"{key} = {value}"
            for key, value in keys
            if value is not False and value not in ("", [])
        )
        yield name, ", ".join(given)
    counts = (
        f"{mesh.get('cells', '?')} {mesh.get('kind', 'cells')} of degree {scene.analysis.degree}"
    )
    yield "mesh", f"{counts}, {mesh.get('dofs', '?')} dofs; ranks: {run.summary.get('ranks', '?')}"


def history_table(run: Run) -> Table:
    """The steps: loads and forces, pressures, angle, plastic strain, cost."""
    names = [name for name in _SHOWN if name in run.columns]
    if not run.is_joint:
        names[-3:-3] = [name for name in run.columns if name.endswith((" displacement", *COMMON))]
    columns = ([f"{value:.6g}" for value in run.columns[name]] for name in names)
    return Table(*map(run.heading, names), rows=zip(*columns, strict=True))


def peaks_of(run: Run) -> str:
    """Largest values over the run, and where it first yielded."""
    h, said = run.columns, []
    names = [name for name in h if name in (*COMPARED, "peeq_max") or name.endswith(COMMON)]
    for name in names:
        k = int(np.argmax(np.abs(np.nan_to_num(h[name]))))
        place = [
            h[name.replace("peeq_max", f"at {axis}")][k]
            for axis in "xy"
            if name.endswith(" peeq_max")
        ]
        where = f", x = {place[0]:.4g}, y = {place[1]:.4g}" if any(place) else ""
        said.append(
            f"{name} = {h[name][k]:.6g} {run.units.get(name, '')}".rstrip()
            + f" at step {h['step'][k]:g}{where}"
        )
    yielded = np.flatnonzero(
        sum(np.nan_to_num(h[name]) for name in names if name.endswith("peeq_max"))
    )
    said += [f"plastic strain first at step {h['step'][yielded[0]]:g}"] if len(yielded) else []
    return f"largest: {', '.join(said)}"


def cost_of(run: Run) -> Iterable[tuple[str, str]]:
    """Iterations, errors, seconds by part, memory, versions, warnings."""
    for name in ("totals", "error_estimates", "seconds"):
        values = (
            f"{key} {value:.3g}"
            for key, value in run.summary.get(name, {}).items()
            if value is not None
        )
        yield name.replace("_", " "), ", ".join(values).replace("_", " ")
    if memory := run.summary.get("peak_memory"):  # none before the end of a run
        yield "memory", f"{max(memory) / 1e6:.0f} MB at most on a rank"
    yield "versions", ", ".join(f"{key} {value}" for key, value in run.summary["versions"].items())
    for warning in first_of_each_kind(run.warnings):
        yield "warning", warning


def _differences(comparison: Comparison, quantity: str, names: list[str]) -> Table:
    """One row a load: the quantity of each run, and its relative difference to the first; ~ marks
    interpolated values."""
    others = [heading for name in names[1:] for heading in (name, "difference")]
    table = Table(comparison.labels["load"], f"{comparison.labels[quantity]}: {names[0]}", *others)
    relative, marks = comparison.relative(quantity), np.where(comparison.interpolated, "~", "")
    for k, load in enumerate(comparison.load):
        pairs = zip(marks[:, k], comparison.values[quantity][:, k], relative[:, k], strict=True)
        cells = [
            cell for mark, value, off in pairs for cell in (f"{mark}{value:.6g}", _percent(off))
        ]
        table.add(f"{load:.6g}", cells[0], *cells[2:])
    largest = np.abs(np.nan_to_num(relative[1:])).max(axis=1)
    table.add(
        "", "largest difference", *(cell for size in largest for cell in ("", _percent(size)))
    )
    return table


def _percent(relative: Any) -> str:
    """A relative difference in percent, with three digits; "-" where there is none."""
    return "-" if np.isnan(relative) else f"{100 * relative:.3g} %"


def _note(comparison: Comparison) -> str:
    """How the runs were compared."""
    if comparison.step_by_step:
        return "compared step by step: all runs went through the same loads."
    note = "compared over the first loading of all runs, at the loads of the first"
    return (
        f"{note}; ~: between steps, by a monotone cubic."
        if comparison.interpolated.any()
        else f"{note}."
    )


def _cell(value: object) -> str:
    """A value of a table; "-" where there is none."""
    if isinstance(value, float):
        return "-" if math.isnan(value) else f"{value:.6g}"
    return str(value)
