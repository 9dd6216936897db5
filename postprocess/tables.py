"""Runs, sweeps and comparisons as text for people: tables, with a line above or below where one needs it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

import numpy as np

from archord.postprocess.comparison import Compared, Comparison, differing_keys
from archord.postprocess.curve import gap_name
from archord.postprocess.run import Run
from archord.postprocess.sweep import Sweep, short
from archord.report.table import Table
from archord.scene.scene import Scene
from archord.scene.sections import Pin, Solid

_MOST_STEPS, _MOST_CASES, _MOST_LOADS = 40, 60, 20  # rows of a table
_LONGEST = 40  # characters of a value
_ROUND_OFF = 1e-12


def run_text(run: Run) -> str:
    """State, joint, history, peaks, cost and warnings of a run."""
    said = {"running": "running, or killed (if no archord works there, --restart continues it)"}
    state = f"{run.folder}: {said.get(run.status, run.status)}; {run.steps} of {len(run.scene.targets)} steps"
    parts = [f"{state}: {run.message}" if run.message else state, _named(_joint(run))]
    if run.steps:
        parts += [f"{_history(run)}{_cut(_MOST_STEPS, run.steps, 'steps', run.folder / 'history.csv')}"]
        parts += [_named({"largest": _peaks(run)})]
    return "\n\n".join(map(str, (*parts, _named(_cost(run)))))


def sweep_text(sweep: Sweep, k: dict[str, float]) -> str:
    """Cases of a sweep by status, what was varied, where they ended, and why some did not; ``k`` is Winkler's
    coefficient by the name of the run, of those that have one."""
    cases = f"{len(sweep)} case{'s' if len(sweep) != 1 else ''}"
    lines = [f"{sweep.folder}: {cases}: {sweep.states}"]
    if same := [f"{h} = {sweep.rows[0][h] or '-'}" for h in sweep.varied if h not in sweep.moving]:
        lines += [f"in all cases: {', '.join(same)}"]
    table = f"{_cases(sweep, k)}{_cut(_MOST_CASES, len(sweep), 'cases', sweep.folder / 'cases.csv')}"
    lines += ["", table, *(f"case {row['case']}: {row['message']}" for row in sweep.rows if row["message"])]
    return "\n".join((*lines, *(f"case {case}: {fault}" for case, fault in sweep.unreadable.items())))


def comparison_text(comparison: Comparison) -> str:
    """Each quantity of all runs at common loads, the keys in which the scenes differ, and what the runs cost."""
    parts = [f"{_quantity(compared, comparison.names)}" for compared in comparison.compared]
    names, rows = comparison.names, differing_keys([run.scene for run in comparison.runs])
    keys = ([key, *(_shortened(value) or "-" for value in values)] for key, values in rows.items())
    scenes = Table("key", *names, rows=keys, left=1 + len(names)) if rows else "scenes: the same in every key"
    return "\n\n".join(map(str, (*parts, "\n".join(_notes(comparison)), scenes, _runs(comparison))))


def first_of_each_kind(warnings: list[str]) -> list[str]:
    """Each kind of warning once, at the first step that gave it; kinds differ in more than their numbers."""
    first: dict[str, str] = {}
    for warning in warnings:
        first.setdefault(re.sub(r"[0-9.e+-]+", "#", warning.partition(": ")[2]), warning)
    return list(first.values())


def _named(lines: dict[str, list[str]]) -> Table:
    """Names on the left and their lines on the right."""
    rows = ((name if k == 0 else "", text) for name, texts in lines.items() for k, text in enumerate(texts))
    return Table("", "", rows=rows, left=2)


def _shown(n: int, most: int) -> list[int]:
    """Up to ``most`` of ``n`` rows, evenly spaced, first and last included."""
    return list(range(n)) if n <= most else sorted({round(k * (n - 1) / (most - 1)) for k in range(most)})


def _cut(most: int, n: int, what: str, file: object) -> str:
    """A line below a table that shows ``most`` of ``n`` rows; nothing if it shows all."""
    return f"\n{most} of {n} {what}; {file} has all of them" if n > most else ""


def _number(value: float, largest: float) -> str:
    """``value`` with six digits; what is round-off beside the ``largest`` of its kind is 0."""
    return f"{0.0 if abs(value) < _ROUND_OFF * abs(largest) else value:.6g}"


def _joint(run: Run) -> dict[str, list[str]]:
    scene, mesh = run.scene, run.summary.get("mesh", {})
    g, a, unit = scene.joint, scene.analysis, scene.units
    facets = " + ".join(f"{n} on the {side}" for side, n in mesh.get("contact_facets", {}).items())
    ranks = run.summary.get("ranks", 1)
    return {
        "joint": [
            f"{g.model}, R = {g.radius:g} {unit.length}, dR = {g.dR:g} {unit.length}, dR/R = {g.dR / g.radius:g}, "
            f"{'outer radius' if g.model == 'ring' else 'block'} {g.W:g} {unit.length}",
            f"plane {a.plane}, contact {a.kinematics}, integrated on {a.integration}, E* = {scene.E_star:g} "
            f"{unit.stress}",
        ],
        "pin": [_body(scene.pin, scene)],
        "block": [_body(scene.block, scene)],
        "mesh": [
            f"{mesh.get('cells', '?')} curved triangles of degree {a.degree}, {mesh.get('dofs', '?')} dofs, "
            f"contact facets: {facets or '?'}; {ranks} rank{'s' if ranks != 1 else ''}"
        ],
    }


def _body(body: Pin | Solid, scene: Scene) -> str:
    if isinstance(body, Pin) and body.rigid:
        return "rigid"
    unit = scene.units.stress
    text = f"E = {body.E:g} {unit}, nu = {body.nu:g}"
    if body.yield_stress is None:
        return f"{text}, elastic"
    hardening = f"hardening {body.hardening:g} {unit}" if body.hardening else "perfectly plastic"
    return f"{text}, yield stress {body.yield_stress:g} {unit} ({body.yield_stress / scene.E_star:.3g} E*), {hardening}"


def _history(run: Run) -> Table:
    """The steps: load, force, pressure, angle, plastic strain, cost."""
    unit, h = run.scene.units, run.columns
    largest = {name: max(map(abs, values)) for name, values in h.items()}
    table = Table("step", f"delta [{unit.length}]", "delta/dR", f"P [{unit.force}]", "P/(E* R)", f"p0 [{unit.stress}]",
                  "p0/E*", "eps [°]", "PEEQ max", "iterations", "cutbacks", "seconds")  # fmt: skip
    for k in _shown(run.steps, _MOST_STEPS):
        table.add(
            f"{h['step'][k]:g}",
            *(_number(h[name][k], largest[name]) for name in ("delta", "delta/dR", "P", "P/(E* R)", "p0", "p0/E*")),
            f"{math.degrees(h['eps'][k]):.2f}",
            f"{h['peeq_max'][k]:.2e}",
            *(f"{h[name][k]:g}" for name in ("iterations", "cutbacks")),
            f"{h['seconds'][k]:.2f}",
        )
    return table


def _peaks(run: Run) -> list[str]:
    """Largest values over the run, and where it first yielded."""
    unit, h, scene = run.scene.units, run.columns, run.scene
    R, dR, E = scene.joint.radius, scene.joint.dR, scene.E_star
    gap = gap_name(dR)

    def at(k: int) -> str:
        return f"step {h['step'][k]:g} (delta = {h['delta'][k] / abs(dR):.4g} {gap})"

    (P, p0, eps, peeq), places = zip(*((max(h[n]), int(np.argmax(h[n]))) for n in ("P", "p0", "eps", "peeq_max")),
                                     strict=True)  # fmt: skip
    lines = [
        f"P = {P:.6g} {unit.force} = {P / (E * R):.5g} E* R, {P / (E * abs(dR)):.5g} E* {gap} at {at(places[0])}",
        f"p0 = {p0:.6g} {unit.stress} = {p0 / E:.5g} E* at {at(places[1])}",
        f"eps = {math.degrees(eps):.6g}° = {eps:.5g} rad at {at(places[2])}",
    ]
    if peeq > 0:
        first = next(k for k, value in enumerate(h["peeq_max"]) if value > 0)
        lines.append(f"PEEQ = {peeq:.3g} at {at(places[3])}; first seen at {at(first)}")
    elif scene.plastic:
        lines.append("PEEQ = 0: nothing has yielded")
    return lines


def _cost(run: Run) -> dict[str, list[str]]:
    """Iterations, errors, seconds by part, memory, versions, warnings."""
    report, totals = run.summary, run.summary["totals"]
    count, cuts = totals.get("newton_iterations", 0), totals.get("cutbacks", 0)
    solver = [
        f"{count} Newton iterations ({count / max(1, run.steps):.1f} a step, "
        f"{max(run.columns['iterations'], default=0):g} at most), {cuts} cutback{'s' if cuts != 1 else ''}, "
        f"{totals.get('factorisations', 0)} factorisations, {totals.get('residual_evaluations', 0)} residuals"
    ]
    known = {name: value for name, value in report.get("error_estimates", {}).items() if value is not None}
    if known:
        solver.append(", ".join(f"{name.replace('_', ' ')} {value:.1e}" for name, value in known.items()))
    seconds = dict(report["seconds"])
    total = seconds.pop("total", 0.0)
    parts = sorted(seconds.items(), key=lambda item: -item[1])[:5]
    cost = [f"{total:.1f} in all: {', '.join(f'{name} {value:.1f}' for name, value in parts)}"]
    if memory := report.get("peak_memory"):
        cost.append(f"{max(memory) / 1e6:.0f} MB of memory at most{' on a rank' if len(memory) > 1 else ''}")
    shown = first_of_each_kind(run.warnings)
    warnings = [f"{w}." for w in shown] or ["none"]
    if len(run.warnings) > len(shown):
        warnings.append(f"({len(run.warnings)} in all; run.json has them)")
    made = f"{report.get('started', '?')}; {', '.join(f'{name} {v}' for name, v in report['versions'].items())}"
    restarts = [f"{r['when']} after step {r['after_step'] - 1}" for r in report.get("restarts", [])]
    return {"solver": solver, "seconds": cost, "made": [made], "warnings": warnings, "restarts": restarts}


def _cases(sweep: Sweep, k: dict[str, float]) -> Table:
    """One row a case: varied keys, status, the last step's load, force, pressure, angle and strain, k, and the cost."""
    wanted = ("delta/dR", "P", "P/(E* R)", "p0", "p0/E*", "eps", "peeq_max")
    values = [h for name in wanted for h in sweep.headings if h.partition(" [")[0] == name]
    cost = [name for name in ("steps", "iterations", "cutbacks", "seconds [s]") if name in sweep.headings]
    titles = [{"eps [rad]": "eps [°]", "peeq_max": "PEEQ max"}.get(h, h) for h in values]
    headings = ["case", "run", *map(short, sweep.moving), "status", *titles, *(["k"] if k else [])]
    table = Table(*headings, *(name.split(" [")[0] for name in cost))
    for n in _shown(len(sweep), _MOST_CASES):
        row = sweep.rows[n]
        fitted = [f"{k[row['run']]:.4f}" if row["run"] in k else "-"] if k else []
        table.add(
            row["case"], row["run"], *(row[heading] or "-" for heading in sweep.moving), row["status"],
            *(_last(heading, row[heading]) for heading in values), *fitted, *(_last(name, row[name]) for name in cost),
        )  # fmt: skip
    return table


def _last(heading: str, text: str) -> str:
    if not text:
        return "-"
    if heading == "eps [rad]":
        return f"{math.degrees(float(text)):.2f}"
    return f"{float(text):.3g}" if heading in ("peeq_max", "seconds [s]") else f"{float(text):.6g}"


def _quantity(compared: Compared, names: list[str]) -> Table:
    """One row a load: the quantity of each run, and its relative difference to the first; ~ marks interpolated
    values. Of many rows some 20, with those of the largest differences."""
    unit = f" [{compared.unit}]" if compared.unit else ""
    others = [heading for name in names[1:] for heading in (name, "difference")]
    table = Table(compared.load_name, f"{compared.quantity}{unit}: {names[0]}", *others)
    relative, largest = compared.relative, np.abs(compared.values).max(initial=0.0)
    worst = [int(np.nanargmax(sizes)) for sizes in np.abs(relative[1:]) if np.isfinite(sizes).any()]
    rows = sorted({*_shown(len(compared.load), _MOST_LOADS), *worst})
    for k in rows:
        row = [f"{compared.load[k]:.6g}"]
        for r, value in enumerate(compared.values[:, k]):
            row.append(("~" if compared.interpolated[r, k] else "") + _number(float(value), largest))
            row += [_percent(relative[r, k], "+")] if r else []
        table.add(*row)
    shown = "" if len(rows) == len(compared.load) else f"{len(rows)} of {len(compared.load)}"
    table.add(shown, "largest difference", *(cell for size in compared.largest[1:] for cell in ("", _percent(size))))
    return table


def _percent(relative: float, sign: str = "") -> str:
    """A relative difference in percent, with three digits; "-" where there is none."""
    return "-" if np.isnan(relative) else f"{100 * relative:{sign}.3g} %" if relative else "0 %"


def _notes(comparison: Comparison) -> Iterable[str]:
    """What the reader of the tables must know, a sentence each."""
    if comparison.step_by_step:
        yield "compared step by step: all runs went through the same delta/dR."
    elif any(len(run.curve.first_loading().delta) < run.steps for run in comparison.runs):
        yield "compared up to the first unloading: the runs went different ways, on which the rest depends."
    if any(part.interpolated.any() for part in comparison.compared):
        yield "~: interpolated between steps by a monotone cubic."
    if not comparison.absolute:
        units = {f"{run.scene.units.length}, {run.scene.units.stress}" for run in comparison.runs}
        reason = f"units differ ({'; '.join(sorted(units))})" if len(units) > 1 else "no displacement is common to all"
        yield f"compared in dimensionless form alone: {reason}."
    unfinished = [n for n, run in zip(comparison.names, comparison.runs, strict=True) if run.status != "done"]
    if unfinished:
        yield f"not finished: {', '.join(unfinished)}."


def _runs(comparison: Comparison) -> Table:
    """State, size, iterations, seconds and versions of every run; of versions those in which they differ."""
    table = Table("", *comparison.names, left=1)
    for name, get in _ROWS_OF_RUNS.items():
        table.add(name, *(get(run) for run in comparison.runs))
    versions = [run.summary["versions"] for run in comparison.runs]
    for name in dict.fromkeys(name for one in versions for name in one):
        values = [str(one.get(name, "-")) for one in versions]
        if name == "archord" or len(set(values)) > 1:
            table.add(name, *values)
    return table


_ROWS_OF_RUNS = {
    "status": lambda run: run.status,
    "steps": lambda run: f"{run.steps} of {len(run.scene.targets)}",
    "dofs": lambda run: run.summary.get("mesh", {}).get("dofs", "-"),
    "ranks": lambda run: run.summary.get("ranks", "-"),
    "iterations": lambda run: run.summary["totals"].get("newton_iterations", "-"),
    "cutbacks": lambda run: run.summary["totals"].get("cutbacks", "-"),
    "seconds": lambda run: f"{run.summary['seconds'].get('total', math.nan):.1f}",
    "MB per rank": lambda run: f"{max(peak) / 1e6:.0f}" if (peak := run.summary.get("peak_memory")) else "-",
    "warnings": lambda run: len(run.warnings),
}


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 12]} ... {text[-7:]}"
