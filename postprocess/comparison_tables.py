"""A comparison of runs as tables for people."""

from __future__ import annotations

import numpy as np
from rich.table import Table

from archord.postprocess.comparison import Compared, Comparison, differing_keys, first_loading
from archord.postprocess.run_result import Run
from archord.postprocess.run_tables import number, plain_table, shown_rows

_ROWS = 20  # of a table
_LONGEST = 40  # characters of a value


def quantity_table(compared: Compared, names: list[str]) -> Table:
    """One row a load: the quantity of each run, and its relative difference to the first; ~ marks interpolated
    values. Of many rows some 20, with those of the largest differences."""
    unit = f" [{compared.unit}]" if compared.unit else ""
    headings = [compared.load_name, f"{compared.quantity}{unit}: {names[0]}"]
    for name in names[1:]:
        headings += [name, "difference"]
    table = plain_table(*headings)
    relative, largest = compared.relative, np.abs(compared.values).max(initial=0.0)
    worst = [int(np.nanargmax(sizes)) for sizes in np.abs(relative[1:]) if np.isfinite(sizes).any()]
    rows = sorted({*shown_rows(len(compared.load), _ROWS), *worst})
    for k in rows:
        row = [f"{compared.load[k]:.6g}"]
        for r, value in enumerate(compared.values[:, k]):
            row.append(("~" if compared.interpolated[r, k] else "") + number(value, largest))
            row += [percent(relative[r, k])] if r else []
        table.add_row(*row)
    row = ["" if len(rows) == len(compared.load) else f"{len(rows)} of {len(compared.load)}", "largest difference"]
    for size in compared.largest[1:]:
        row += ["", percent(size, sign=False)]
    table.add_row(*row)
    return table


def percent(relative: float, sign: bool = True) -> str:
    """A relative difference in percent, with three digits; "-" where there is none."""
    if np.isnan(relative):
        return "-"
    if relative == 0:
        return "0 %"
    return f"{100 * relative:{'+' if sign else ''}.3g} %"


def notes(comparison: Comparison) -> list[str]:
    """What the reader of the tables must know, a sentence each."""
    said = []
    if comparison.step_by_step:
        said.append("compared step by step: all runs went through the same delta/dR.")
    elif any(len(first_loading(run.curve).delta) < run.steps for run in comparison.runs):
        said.append("compared up to the first unloading: the runs went different ways, on which the rest depends.")
    if any(part.interpolated.any() for part in comparison.compared):
        said.append("~: interpolated between steps by a monotone cubic.")
    if not comparison.absolute:
        units = {f"{run.scene.units.length}, {run.scene.units.stress}" for run in comparison.runs}
        reason = f"units differ ({'; '.join(sorted(units))})" if len(units) > 1 else "no displacement is common to all"
        said.append(f"compared in dimensionless form alone: {reason}.")
    unfinished = [n for n, run in zip(comparison.names, comparison.runs, strict=True) if run.status != "done"]
    if unfinished:
        said.append(f"not finished: {', '.join(unfinished)}.")
    return said


def scene_table(comparison: Comparison) -> Table | None:
    """Keys in which the scenes differ; None if they do not."""
    rows = differing_keys([run.scene for run in comparison.runs])
    if not rows:
        return None
    table = plain_table("key", *comparison.names, left=1 + len(comparison.names))
    for key, values in rows.items():
        table.add_row(key, *(_shortened(value) or "-" for value in values))
    return table


def run_table(comparison: Comparison) -> Table:
    """State, size, iterations, seconds and versions of every run; of versions those in which they differ."""
    table = plain_table("", *comparison.names, left=1)
    for name, get in _ROWS_OF_RUNS.items():
        table.add_row(name, *(get(run) for run in comparison.runs))
    versions = [run.summary["versions"] for run in comparison.runs]
    for name in dict.fromkeys(name for one in versions for name in one):
        values = [str(one.get(name, "-")) for one in versions]
        if name == "archord" or len(set(values)) > 1:
            table.add_row(name, *values)
    return table


def _memory(run: Run) -> str:
    peak = run.summary.get("peak_memory")
    return f"{max(peak) / 1e6:.0f}" if peak else "-"


_ROWS_OF_RUNS = {
    "status": lambda run: run.status,
    "steps": lambda run: f"{run.steps} of {len(run.scene.targets)}",
    "dofs": lambda run: str(run.summary.get("mesh", {}).get("dofs", "-")),
    "ranks": lambda run: str(run.summary.get("ranks", "-")),
    "iterations": lambda run: str(run.summary["totals"].get("newton_iterations", "-")),
    "cutbacks": lambda run: str(run.summary["totals"].get("cutbacks", "-")),
    "seconds": lambda run: f"{run.summary['seconds'].get('total', float('nan')):.1f}",
    "MB per rank": _memory,
    "warnings": lambda run: str(len(run.warnings)),
}


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 12]} ... {text[-7:]}"
