"""Runs, sweeps and comparisons as text for people: tables, with a line above or below where one needs it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

import numpy as np

from archord.postprocess.comparison import COMPARED, Comparison, differing_keys
from archord.postprocess.run import Run
from archord.postprocess.sweep import Sweep
from archord.report.table import Table
from archord.scene.sections import Pin, Solid

_MOST = 40  # rows of a table
_LONGEST = 40  # characters of a value
_PARTS = 5  # parts of a run's time that are told
_LAST = ("delta/dR", "P", "P/(E* R)", "p0", "p0/E*", "eps", "peeq_max", "steps", "iterations", "cutbacks", "seconds")
# what `comparison_text` says of each run
_OF_A_RUN = {
    "status": lambda run: run.status,
    "steps": lambda run: f"{run.steps} of {len(run.scene.targets)}",
    "dofs": lambda run: run.summary.get("mesh", {}).get("dofs", "-"),
    "ranks": lambda run: run.summary.get("ranks", "-"),
    "iterations": lambda run: run.summary["totals"].get("newton_iterations", "-"),
    "seconds": lambda run: f"{run.summary['seconds'].get('total', math.nan):.1f}",
    "archord": lambda run: run.summary["versions"].get("archord", "-"),
}


def run_text(run: Run) -> str:
    """State, joint, history, peaks, cost and warnings of a run."""
    words = {"running": "running, or killed (if no archord works there, --restart continues it)"}
    state = f"{run.folder}: {words.get(run.status, run.status)}; {run.steps} of {len(run.scene.targets)} steps"
    parts = [f"{state}: {run.message}" if run.message else state, _named(_joint(run))]
    if run.steps:
        parts += [
            _thinned(_history(run), run.folder / "history.csv"),
            _named([("largest", peak) for peak in _peaks(run)]),
        ]
    return "\n\n".join([*parts, _named(_cost(run))])


def sweep_text(sweep: Sweep) -> str:
    """Cases of a sweep by status, what was varied, where they ended, and why some did not."""
    lines = [f"{sweep.folder}: {len(sweep)} case{'s' if len(sweep) != 1 else ''}: {sweep.states}"]
    cases, units = sweep.cases, sweep.cases.attrs["units"]
    if same := [f"{key} = {_cell(cases[key].iloc[0])}" for key in sweep.keys if key not in sweep.moving]:
        lines += [f"in all cases: {', '.join(same)}"]
    names = ["case", "run", *sweep.moving, "status", *(name for name in _LAST if name in cases)]
    table = Table(*(f"{name} [{units[name]}]" if name in units else name for name in names))
    for row in cases[names].itertuples(index=False):
        table.add(*map(_cell, row))
    lines += ["", _thinned(table, sweep.folder / "cases.csv")]
    said = zip(cases["case"], cases["message"], strict=True)
    return "\n".join([*lines, *(f"case {case}: {message}" for case, message in said if message)])


def comparison_text(comparison: Comparison) -> str:
    """Each quantity of all runs at common loads, the keys in which the scenes differ, and what the runs cost."""
    names = names_of(comparison.runs)
    parts = [_thinned(_differences(comparison, name, names), "history.csv") for name in COMPARED]
    rows = differing_keys([run.scene for run in comparison.runs])
    keys = ([key, *(_shortened(value) or "-" for value in values)] for key, values in rows.items())
    scenes = Table("key", *names, rows=keys, left=1 + len(names)) if rows else "scenes: the same in every key"
    runs = Table("", *names, rows=([n, *map(get, comparison.runs)] for n, get in _OF_A_RUN.items()), left=1)
    return "\n\n".join(map(str, (*parts, _note(comparison), scenes, runs)))


def names_of(runs: Iterable[Run]) -> list[str]:
    """Names of the runs' folders; their paths where two of the names are the same."""
    names = [run.folder.resolve().name for run in runs]
    return names if len(set(names)) == len(names) else [str(run.folder) for run in runs]


def first_of_each_kind(warnings: list[str]) -> list[str]:
    """Each kind of warning once, at the first step that gave it; kinds differ in more than their numbers."""
    first: dict[str, str] = {}
    for warning in warnings:
        first.setdefault(re.sub(r"[0-9.e+-]+", "#", warning.partition(": ")[2]), warning)
    return list(first.values())


def _named(lines: Iterable[tuple[str, str]]) -> str:
    """Names on the left, each only once, and their lines on the right."""
    table, last = Table("", "", left=2), ""
    for name, text in lines:
        table.add("" if name == last else name, text)
        last = name
    return str(table)


def _thinned(table: Table, whole: object) -> str:
    """Up to 40 rows of the ``table``, evenly spaced, first and last included, and where the ``whole`` of it is."""
    n = len(table.rows)
    if n <= _MOST:
        return str(table)
    table.rows = [table.rows[round(k)] for k in np.linspace(0, n - 1, _MOST)]
    return f"{table}\n{_MOST} of {n} rows; {whole} has all of them"


def _joint(run: Run) -> Iterable[tuple[str, str]]:
    scene, mesh, ranks = run.scene, run.summary.get("mesh", {}), run.summary.get("ranks", 1)
    g, a, length, stress = scene.joint, scene.analysis, scene.units.length, scene.units.stress
    yield "joint", f"{g.model}, R = {g.radius:g} {length}, dR = {g.dR:g} {length}, dR/R = {g.dR / g.radius:g}"
    yield "joint", f"plane {a.plane}, contact {a.kinematics}, E* = {scene.E_star:g} {stress}"
    yield "pin", _body(scene.pin, stress)
    yield "block", f"{_body(scene.block, stress)}, size {g.W:g} {length}"
    size = f"{mesh.get('cells', '?')} curved triangles of degree {a.degree}, {mesh.get('dofs', '?')} dofs"
    yield "mesh", f"{size}, {ranks} rank{'s' if ranks != 1 else ''}"


def _body(body: Pin | Solid, stress: str) -> str:
    if isinstance(body, Pin) and body.rigid:
        return "rigid"
    text = f"E = {body.E:g} {stress}, nu = {body.nu:g}"
    if body.yield_stress is None:
        return f"{text}, elastic"
    return f"{text}, yield stress {body.yield_stress:g} {stress}, hardening {body.hardening or 0:g} {stress}"


def _history(run: Run) -> Table:
    """The steps: load, force, pressure, angle, plastic strain, cost."""
    unit, h = run.scene.units, run.columns
    table = Table("step", f"delta [{unit.length}]", "delta/dR", f"P [{unit.force}]", "P/(E* R)", f"p0 [{unit.stress}]",
                  "p0/E*", "eps [°]", "PEEQ max", "iterations", "cutbacks", "seconds")  # fmt: skip
    for k in range(run.steps):
        table.add(
            f"{h['step'][k]:g}",
            *(f"{h[name][k]:.6g}" for name in ("delta", "delta/dR", "P", "P/(E* R)", "p0", "p0/E*")),
            f"{math.degrees(h['eps'][k]):.2f}",
            f"{h['peeq_max'][k]:.2e}",
            *(f"{h[name][k]:g}" for name in ("iterations", "cutbacks")),
            f"{h['seconds'][k]:.2f}",
        )
    return table


def _peaks(run: Run) -> Iterable[str]:
    """Largest values over the run, and where it first yielded."""
    unit, h = run.scene.units, run.columns
    for name, of in {"P": unit.force, "p0": unit.stress, "eps": "rad", "peeq_max": ""}.items():
        k = int(np.argmax(h[name]))
        yield f"{name} = {h[name][k]:.6g} {of}".rstrip() + f" at step {h['step'][k]:g}"
    if any(h["peeq_max"]):
        yield f"plastic strain first at step {h['step'][np.flatnonzero(h['peeq_max'])[0]]:g}"


def _cost(run: Run) -> Iterable[tuple[str, str]]:
    """Iterations, errors, seconds by part, memory, versions, warnings."""
    report, totals = run.summary, run.summary["totals"]
    counts = [f"{value:g} {name.replace('_', ' ')}" for name, value in totals.items() if isinstance(value, int)]
    yield "solver", ", ".join(counts)
    known = {name: value for name, value in report.get("error_estimates", {}).items() if value is not None}
    if known:
        yield "errors", ", ".join(f"{name.replace('_', ' ')} {value:.1e}" for name, value in known.items())
    seconds = dict(report["seconds"])
    total, parts = seconds.pop("total", 0.0), sorted(seconds.items(), key=lambda item: -item[1])[:_PARTS]
    yield "seconds", f"{total:.1f} in all: {', '.join(f'{name} {value:.1f}' for name, value in parts)}"
    if memory := report.get("peak_memory"):
        yield "memory", f"{max(memory) / 1e6:.0f} MB at most on a rank"
    yield "made", f"{report.get('started', '?')}; {', '.join(f'{name} {v}' for name, v in report['versions'].items())}"
    for restart in report.get("restarts", []):
        yield "restarts", f"{restart['when']} after step {restart['after_step'] - 1}"
    for warning in first_of_each_kind(run.warnings) or ["none"]:
        yield "warnings", warning


def _differences(comparison: Comparison, quantity: str, names: list[str]) -> Table:
    """One row a load: the quantity of each run, and its relative difference to the first; ~ marks interpolated
    values."""
    others = [heading for name in names[1:] for heading in (name, "difference")]
    table = Table(comparison.labels["delta"], f"{comparison.labels[quantity]}: {names[0]}", *others)
    relative, marks = comparison.relative(quantity), np.where(comparison.interpolated, "~", "")
    for k, load in enumerate(comparison.delta):
        first, *values = (
            f"{mark}{v:.6g}" for mark, v in zip(marks[:, k], comparison.values[quantity][:, k], strict=True)
        )
        pairs = zip(values, map(_percent, relative[1:, k]), strict=True)
        table.add(f"{load:.6g}", first, *(cell for pair in pairs for cell in pair))
    largest = np.abs(np.nan_to_num(relative[1:])).max(axis=1)
    table.add("", "largest difference", *(cell for size in largest for cell in ("", _percent(size))))
    return table


def _percent(relative: float) -> str:
    """A relative difference in percent, with three digits; "-" where there is none."""
    return "-" if np.isnan(relative) else f"{100 * relative:.3g} %"


def _note(comparison: Comparison) -> str:
    """How the runs were compared."""
    if comparison.step_by_step:
        return "compared step by step: all runs went through the same displacements."
    note = "compared over the first loading of all runs, at displacements of the first"
    return f"{note}; ~: between steps, by a monotone cubic." if comparison.interpolated.any() else f"{note}."


def _cell(value: object) -> str:
    """A value of a table; "-" where there is none."""
    if isinstance(value, float):
        return "-" if math.isnan(value) else f"{value:.6g}"
    return str(value)


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 12]} ... {text[-7:]}"
