"""A sweep as a table for people: its cases, what was varied, and where they ended."""

from __future__ import annotations

import math

from rich.table import Table

from archord.postprocess.run_tables import plain_table, shown_rows
from archord.postprocess.sweep_result import Sweep, short

MOST_ROWS = 60
_COST = ("steps", "iterations", "cutbacks", "seconds [s]")


def state_line(sweep: Sweep) -> str:
    """Folder, and number of cases by status."""
    states = [row["status"] for row in sweep.rows]
    counted = ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))
    return f"{sweep.folder}: {len(sweep)} case{'s' if len(sweep) != 1 else ''}: {counted}"


def constant_line(sweep: Sweep) -> str:
    """The varied keys that are the same in all cases; empty if there are none."""
    same = [f"{heading} = {sweep.rows[0][heading] or '-'}" for heading in sweep.varied if heading not in sweep.moving]
    return f"in all cases: {', '.join(same)}" if same else ""


def messages(sweep: Sweep) -> list[str]:
    """Why cases stopped or cannot be read, a line each."""
    stopped = [f"case {row['case']}: {row['message']}" for row in sweep.rows if row["message"]]
    return stopped + [f"case {case}: {fault}" for case, fault in sweep.unreadable.items()]


def case_table(sweep: Sweep, k: dict[str, float] | None = None) -> Table:
    """One row a case: varied keys, status, the last step's load, force, pressure, angle and strain, and the cost; of
    runs that have one the Winkler coefficient ``k``."""
    wanted = ("delta/dR", "P", "P/(E* R)", "p0", "p0/E*", "eps", "peeq_max")
    values = [h for name in wanted for h in sweep.headings if h.partition(" [")[0] == name]
    moving = sweep.moving
    varied = [short(heading) for heading in moving]
    titles = [{"eps [rad]": "eps [°]", "peeq_max": "PEEQ max"}.get(h, h) for h in values]
    cost = [name for name in _COST if name in sweep.headings]
    fit = ["k"] if k else []
    table = plain_table("case", "run", *varied, "status", *titles, *fit, *(name.split(" [")[0] for name in cost))
    for n in shown_rows(len(sweep), MOST_ROWS):
        row = sweep.rows[n]
        shown = [_shown(heading, row[heading]) for heading in values]
        fitted = [f"{k[row['run']]:.4f}" if row["run"] in k else "-"] if k else []
        table.add_row(
            row["case"], row["run"], *(row[heading] or "-" for heading in moving), row["status"], *shown,
            *fitted, *(_shown(name, row[name]) for name in cost),
        )  # fmt: skip
    return table


def _shown(heading: str, text: str) -> str:
    if not text:
        return "-"
    value = float(text)
    if heading == "eps [rad]":
        return f"{math.degrees(value):.2f}"
    return f"{value:.3g}" if heading in ("peeq_max", "seconds [s]") else f"{value:.6g}"
