"""A run as tables for people: joint, state, history, peaks, cost, warnings."""

from __future__ import annotations

import math

from rich.table import Table

from archord.postprocess.run_result import Run
from archord.postprocess.run_warnings import first_of_each_kind
from archord.scene.scene import Pin, Scene, Solid

MOST_ROWS = 40  # of a history
_ROUND_OFF = 1e-12


def plain_table(*headings: str, left: int = 0) -> Table:
    """A table without lines; all columns but the first ``left`` hold numbers."""
    table = Table(box=None, pad_edge=False, header_style="")
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="left" if k < left else "right", no_wrap=True)
    return table


def paragraph(lines: dict[str, list[str]]) -> str:
    """Names on the left and their lines on the right."""
    width = max(map(len, lines), default=0)
    rows = [(name if k == 0 else "", text) for name, texts in lines.items() for k, text in enumerate(texts)]
    return "\n".join(f"{name:{width}}  {text}" for name, text in rows)


def number(value: float, largest: float, digits: int = 6) -> str:
    """``value`` with so many digits; what is round-off beside the ``largest`` of its kind is 0."""
    return f"{0.0 if abs(value) < _ROUND_OFF * abs(largest) else value:.{digits}g}"


def state_line(run: Run) -> str:
    """Folder, status and how far the run came."""
    total = len(run.scene.targets)
    said = {"running": "running, or killed (if no archord works there, --restart continues it)"}
    text = f"{run.folder}: {said.get(run.status, run.status)}; {run.steps} of {total} steps"
    return f"{text}: {run.message}" if run.message else text


def joint_lines(run: Run) -> dict[str, list[str]]:
    """The joint, its bodies and its mesh."""
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


def shown_rows(n: int, most: int = MOST_ROWS) -> list[int]:
    """Up to ``most`` of ``n`` rows, evenly spaced, first and last included."""
    if n <= most:
        return list(range(n))
    return sorted({round(k * (n - 1) / (most - 1)) for k in range(most)})


def history_table(run: Run, most: int = MOST_ROWS) -> Table:
    """The steps: load, force, pressure, angle, plastic strain, cost."""
    unit, h = run.scene.units, run.columns
    largest = {name: max(map(abs, values), default=0.0) for name, values in h.items()}
    table = plain_table("step", f"delta [{unit.length}]", "delta/dR", f"P [{unit.force}]", "P/(E* R)",
                        f"p0 [{unit.stress}]", "p0/E*", "eps [°]", "PEEQ max", "iterations", "cutbacks",
                        "seconds")  # fmt: skip
    for k in shown_rows(run.steps, most):
        table.add_row(
            f"{h['step'][k]:g}",
            *(number(h[name][k], largest[name]) for name in ("delta", "delta/dR", "P", "P/(E* R)", "p0", "p0/E*")),
            f"{math.degrees(h['eps'][k]):.2f}",
            f"{h['peeq_max'][k]:.2e}",
            *(f"{h[name][k]:g}" for name in ("iterations", "cutbacks")),
            f"{h['seconds'][k]:.2f}",
        )
    return table


def peak_lines(run: Run) -> dict[str, list[str]]:
    """Largest values over the run, and where it first yielded."""
    unit, h, scene = run.scene.units, run.columns, run.scene
    R, E = scene.joint.radius, scene.E_star
    named = (
        ("P", unit.force, 1.0, f"{{:.5g}} E* R, {{:.5g}} E* {_gap(run)}", (E * R, E * abs(scene.joint.dR))),
        ("p0", unit.stress, 1.0, "{:.5g} E*", (E,)),
        ("eps", "°", 180 / math.pi, "{:.5g} rad", (1.0,)),
    )
    lines = []
    for name, its_unit, factor, words, divisors in named:
        k = max(range(run.steps), key=lambda k, name=name: h[name][k])  # type: ignore[misc]
        value = h[name][k]
        other = words.format(*(value / divisor for divisor in divisors))
        space = "" if its_unit == "°" else " "
        lines.append(f"{name} = {value * factor:.6g}{space}{its_unit} = {other} at {_at(run, k)}")
    first = next((k for k, peeq in enumerate(h["peeq_max"]) if peeq > 0), None)
    if first is not None:
        k = max(range(run.steps), key=lambda k: h["peeq_max"][k])
        lines.append(f"PEEQ = {h['peeq_max'][k]:.3g} at {_at(run, k)}; first seen at {_at(run, first)}")
    elif scene.plastic:
        lines.append("PEEQ = 0: nothing has yielded")
    return {"largest": lines}


def _at(run: Run, k: int) -> str:
    load = run.columns["delta"][k] / abs(run.scene.joint.dR)
    return f"step {run.columns['step'][k]:g} (delta = {load:.4g} {_gap(run)})"


def _gap(run: Run) -> str:
    """The clearance; where it is an interference its size."""
    return "dR" if run.scene.joint.dR > 0 else "|dR|"


def cost_lines(run: Run) -> dict[str, list[str]]:
    """Iterations, errors, seconds by part, memory, versions, warnings."""
    report, n = run.summary, max(1, run.steps)
    totals, errors = report["totals"], report.get("error_estimates", {})
    count = totals.get("newton_iterations", 0)
    cuts = totals.get("cutbacks", 0)
    most = max(run.columns.get("iterations") or [0])
    solver = [
        f"{count} Newton iterations ({count / n:.1f} a step, {most:g} at most), {cuts} "
        f"cutback{'s' if cuts != 1 else ''}, {totals.get('factorisations', 0)} factorisations, "
        f"{totals.get('residual_evaluations', 0)} residuals"
    ]
    if errors:
        known = {name.replace("_", " "): value for name, value in errors.items() if value is not None}
        solver.append(", ".join(f"{name} {value:.1e}" for name, value in known.items()))
    seconds = dict(report["seconds"])
    total = seconds.pop("total", 0.0)
    parts = sorted(seconds.items(), key=lambda item: -item[1])[:5]
    memory = report.get("peak_memory") or []
    cost = [f"{total:.1f} in all: {', '.join(f'{name} {value:.1f}' for name, value in parts)}"]
    if memory:
        cost.append(f"{max(memory) / 1e6:.0f} MB of memory at most{' on a rank' if len(memory) > 1 else ''}")
    shown = first_of_each_kind(run.warnings)
    warnings = [f"{w}." for w in shown] or ["none"]
    if len(run.warnings) > len(shown):
        warnings.append(f"({len(run.warnings)} in all; run.json has them)")
    restarts = [f"{r['when']} after step {r['after_step'] - 1}" for r in report.get("restarts", [])]
    made = f"{report.get('started', '?')}; {', '.join(f'{name} {v}' for name, v in report['versions'].items())}"
    lines = {"solver": solver, "seconds": cost, "made": [made], "warnings": warnings}
    return lines | ({"restarts": restarts} if restarts else {})
