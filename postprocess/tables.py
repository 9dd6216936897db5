"""Runs, sweeps and comparisons as text for people: tables, with a line above or below where one
needs it."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from archord.postprocess.comparison import COMMON, COMPARED, Comparison, differing_keys
from archord.postprocess.probes.probe import Probe
from archord.postprocess.run import Run
from archord.postprocess.sweep import Sweep, shown
from archord.report.by_name import Words
from archord.report.doubts import kind, of_cases
from archord.report.table import Table

_MOST = 40  # rows of a table
_LONG = 100_000  # characters of a line, where no terminal breaks it
_NARROW = 30  # the least of a wrapped line
_CELL = 60  # of a key of a scene in a table
_OF_A_JOINT = ("delta/dR", "P", "P/(E* R)", "p0", "p0/E*", "eps", "peeq_max", "contact peeq_max")
_OF_A_PART = (" displacement", *COMMON)  # ends of names
_COSTS = ("steps", "iterations", "cutbacks", "seconds")
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
    room = width or _LONG
    words = {"running": "running, or killed (if no archord works there, --restart continues it)"}
    status = words.get(run.status, run.status)
    said = [f"{status}; {run.steps} of {len(run.scene.targets)} steps"]
    if run.message:
        said.append(run.message)
    state = ": ".join([str(run.folder), *said])
    facts = _named(facts_of(run), room)
    parts = [*_lines(state, room), "", facts]
    if run.steps:
        history = _thinned(history_table(run), run.folder / "history.csv", width)
        peaks = _lines(peaks_of(run), room)
        parts += ["", history, "", *peaks]
    cost = _named(cost_of(run), room)
    return "\n".join([*parts, "", cost])


def sweep_text(sweep: Sweep) -> str:
    """Cases of a sweep by status, what was varied, where they ended, why some did not, and each
    kind of their warnings once."""
    cases = sweep.cases
    plural = "s" if len(sweep) != 1 else ""
    lines = [f"{sweep.folder}: {len(sweep)} case{plural}: {sweep.states}"]
    fixed = [key for key in sweep.keys if key not in sweep.moving]
    if fixed:
        said = [f"{key} = {shown(cases[key].iloc[0], '-')}" for key in fixed]
        lines.append(f"in all cases: {', '.join(said)}")
    ends = [name for name in shown_columns(cases) if name != "delta"]
    names = ["case", "run", *sweep.moving, "status", *ends]
    table = _table_of(cases[names])
    lines += ["", _thinned(table, sweep.folder / "cases.csv")]
    for case, message in zip(cases["case"], cases["message"], strict=True):
        if message:
            lines.append(f"case {case}: {message}")
    for case, fault in sweep.unread.items():
        lines.append(f"case {case} is left out: {fault}")
    warnings = of_cases((case, run.warnings) for case, run in sweep.runs.items())
    lines += [f"warning: {warning}" for warning in warnings]
    return "\n".join(lines)


def comparison_text(comparison: Comparison) -> str:
    """Quantities of all runs at common loads, the keys in which the scenes differ, and how the runs
    went."""
    runs = comparison.runs
    names = names_of(runs)
    parts = [
        _thinned(_differences(comparison, name, names), "history.csv") for name in comparison.values
    ]
    rows = differing_keys([run.scene for run in runs])
    for name, get in _OF_A_RUN.items():
        rows[name] = [str(get(run)) for run in runs]
    table = Table("", *names, left=1 + len(names))
    for key, values in rows.items():
        wrapped = [_lines(value, _CELL) or ["-"] for value in values]
        for line in itertools.zip_longest([key], *wrapped, fillvalue=""):
            table.add(*line)
    return "\n\n".join([*parts, _note(comparison), str(table)])


def probe_text(probe: Probe, angles: Iterable[float]) -> str:
    """A quantity along an edge or a line, its largest and smallest value and where they are, and
    its values at ``angles``."""
    unit = f" {probe.unit}".rstrip()
    table = _thinned(_table_of(probe.frame()), "-o FILE.csv")
    force = f"{probe.by or 'force'} = {probe.force:.6g} {probe.per}"
    what = f"{probe.quantity} along {probe.place}, step {probe.step}, {force}"
    lines = [table, "", what]
    extremes = {"largest": probe.largest, "smallest": probe.smallest}
    for name, k in extremes.items():
        lines.append(f"{name}: {probe.values[k]:.6g}{unit} {probe.where(k)}")
    for angle in angles:
        lines.append(f"at {angle:g}°: {probe.at(angle):.6g}{unit}")
    return "\n".join(lines)


def names_of(runs: Iterable[Run]) -> list[str]:
    """Names of the runs' folders; their paths where two of the names are the same."""
    names = [run.folder.resolve().name for run in runs]
    are_different = len(set(names)) == len(names)
    return names if are_different else [str(run.folder) for run in runs]


def first_of_each_kind(warnings: list[str]) -> list[str]:
    """Each kind of warning once, at the first step that gave it; kinds differ in more than their
    numbers."""
    first: Words = {}
    for warning in warnings:
        first.setdefault(kind(warning), warning)
    return list(first.values())


def shown_columns(there: Iterable[str]) -> list[str]:
    """The columns that a table of steps shows, of those that are ``there``: loads and forces,
    pressures, angle, plastic strain, cost."""
    known = list(there)
    of_parts = []
    if "load_factor" in known:
        of_parts = [name for name in known if name.endswith(_OF_A_PART)]
    names = ["step", "load_factor", *of_parts, "delta", *_OF_A_JOINT, *_COSTS]
    chosen = [
        column for name in names for column in known if column.partition(" [")[0] == name
    ]  # with its unit, where a sweep has several
    return list(dict.fromkeys(chosen))


def spread(table: Table, most: int) -> int:
    """Keep up to ``most`` rows of the ``table``, evenly spaced, first and last included; returns
    how many it had."""
    n = len(table.rows)
    if n > most:
        kept = np.linspace(0, n - 1, most)
        table.rows = [table.rows[round(k)] for k in kept]
    return n


def named_table(
    rows: Iterable[tuple[str, str]], room: int, longest: int = _LONG, *, cut: bool = False
) -> Table:
    """Text behind names of up to ``longest`` characters, wrapped to ``room`` characters; long words
    are ``cut`` on request."""
    table = Table("", "", left=2)
    for name, text in rows:
        lines = textwrap.wrap(text, room, break_long_words=cut, break_on_hyphens=cut)
        first, *more = lines or [""]
        table.add(name[:longest], first)
        for line in more:
            table.add("", line)
    return table


def _table_of(frame: Any) -> Table:
    from archord.postprocess.arrays.frames import with_headings  # with pandas

    headings = with_headings(frame)
    rows = frame.itertuples(index=False)
    return Table(*headings, rows=([shown(value, "-") for value in row] for row in rows))


def _named(rows: Iterable[tuple[str, str]], width: int) -> str:
    """Text behind names, wrapped to lines no longer than ``width``."""
    pairs = list(rows)
    longest = max(len(name) for name, _ in pairs)
    room = max(_NARROW, width - 2 - longest)
    return str(named_table(pairs, room))


def _lines(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False)


def _thinned(table: Table, whole: object, width: int = 0) -> str:
    """Up to 40 rows of the ``table``, and where the ``whole`` of it is; in blocks of columns where
    a ``width`` is given."""
    n = spread(table, _MOST)
    text = table.within(width) if width else str(table)
    if n <= _MOST:
        return text
    return f"{text}\n{_MOST} of {n} rows; {whole} has all of them"


def facts_of(run: Run) -> Iterator[tuple[str, str]]:
    """What was solved: the joint, or the parts of a general scene; and on what mesh."""
    yield from run.view.facts()
    mesh = run.summary.get("mesh", {})
    cells = f"{mesh.get('cells', '?')} {mesh.get('kind', 'cells')}"
    counts = f"{cells} of degree {run.scene.analysis.degree}, {mesh.get('dofs', '?')} dofs"
    yield "mesh", f"{counts}; ranks: {run.summary.get('ranks', '?')}"
    if worst := mesh.get("worst_cells"):
        yield "worst cells", ", ".join(f"{name} {value:.2f}" for name, value in worst.items())


def history_table(run: Run) -> Table:
    """The `shown_columns` of all steps."""
    names = shown_columns(run.columns)
    headings = map(run.heading, names)
    columns = ([f"{value:.6g}" for value in run.columns[name]] for name in names)
    return Table(*headings, rows=zip(*columns, strict=True))


def peaks_of(run: Run) -> str:
    """Largest values over the run, and where it first yielded."""
    steps = run.columns["step"]
    columns = {
        name: np.nan_to_num(values)
        for name, values in run.columns.items()
        if name in (*COMPARED, "peeq_max") or name.endswith(COMMON)
    }
    said = []
    for name, values in columns.items():
        k = int(np.argmax(np.abs(values)))
        unit = run.units.get(name, "")
        peak = f"{name} = {run.columns[name][k]:.6g} {unit}".rstrip()
        said.append(f"{peak} at step {steps[k]:g}{_where(run, name, k)}")
    peeq = [values for name, values in columns.items() if name.endswith("peeq_max")]
    yielded = np.flatnonzero(sum(peeq))
    if len(yielded):
        said.append(f"plastic strain first at step {steps[yielded[0]]:g}")
    return f"largest: {', '.join(said)}"


def _where(run: Run, name: str, k: int) -> str:
    """The place of a body's largest PEEQ; nothing of another column, and where no place is
    known."""
    if not name.endswith(" peeq_max"):
        return ""
    before = name.replace("peeq_max", "at ")  # and x and y, or r and z
    place = {
        axis.removeprefix(before): values[k]
        for axis, values in run.columns.items()
        if axis.startswith(before)
    }
    if not any(place.values()):
        return ""
    return "".join(f", {axis} = {value:.4g}" for axis, value in place.items())


def cost_of(run: Run) -> Iterator[tuple[str, str]]:
    """Iterations, errors, seconds by part, memory, versions, warnings."""
    for name in ("totals", "error_estimates", "seconds"):
        known = run.summary.get(name, {}).items()
        values = [f"{key} {value:.3g}" for key, value in known if value is not None]
        yield name.replace("_", " "), ", ".join(values).replace("_", " ")
    memory = run.summary.get("peak_memory")
    if memory:  # none before the end of a run
        yield "memory", f"{max(memory) / 1e6:.0f} MB at most on a rank"
    versions = run.summary["versions"].items()
    yield "versions", ", ".join(f"{key} {value}" for key, value in versions)
    for warning in first_of_each_kind(run.warnings):
        yield "warning", warning


def _differences(comparison: Comparison, quantity: str, names: list[str]) -> Table:
    """One row a load: the quantity of each run, and its relative difference to the first; ~ marks
    interpolated values."""
    headings = [f"{comparison.labels[quantity]}: {names[0]}"]
    for name in names[1:]:
        headings += [name, "difference"]
    table = Table(comparison.labels["load"], *headings)
    relative = comparison.relative(quantity)
    values = comparison.values[quantity]
    for k, load in enumerate(comparison.load):
        cells = [f"{load:.6g}"]
        for r in range(len(names)):
            mark = "~" if comparison.interpolated[r, k] else ""
            cells.append(f"{mark}{values[r, k]:.6g}")
            if r:
                cells.append(_percent(relative[r, k]))
        table.add(*cells)
    last = ["", "largest difference"]
    sizes = np.abs(np.nan_to_num(relative[1:]))
    for largest in sizes.max(axis=1):
        last += ["", _percent(largest)]
    table.add(*last)
    return table


def _percent(relative: Any) -> str:
    """A relative difference in percent, with three digits; "-" where there is none."""
    return "-" if np.isnan(relative) else f"{100 * relative:.3g} %"


def _note(comparison: Comparison) -> str:
    """How the runs were compared."""
    note = "compared over the first loading of all runs, at the loads of the first"
    if comparison.step_by_step:
        note = "compared step by step: all runs went through the same loads"
    if comparison.unlike:
        loads = " and ".join(map(repr, comparison.unlike))
        note = f"compared at equal load factors, at which {loads} differs from run to run"
    if comparison.interpolated.any():
        note += "; ~: between steps, by a monotone cubic"
    return f"{note}."
