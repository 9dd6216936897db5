"""What the costs of the scaling benchmark say: goals, tables and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from archord.benchmarks.cost.scaling import PARTS, REST, SPEED_UP_AT, Cost, Costs
from archord.report.figure import new_figure, save
from archord.report.files import write_report
from archord.report.table import Table

SPEED_UP = 1.6  # on 2 ranks at `SPEED_UP_AT` dofs
CONTACT_SHARE = 0.1  # on 2 ranks
AROUND_FACTORS = 0.25  # of the solve, at every size
TIME_EXPONENT, MEMORY_EXPONENT = 1.3, 1.1
_ALL_PARTS = (*PARTS, REST)
_MEGA = 1e6


def write(costs: Costs, folder: Path) -> list[Path]:
    """Write scaling.csv, scaling.md and scaling.png into ``folder``; returns the files."""
    rows = [row(cost) for cost in costs.all]
    return write_report(folder, "scaling", rows, markdown(costs), lambda file: draw(costs, file))


def row(cost: Cost) -> dict[str, object]:
    """The entries of a run by heading; what it does not have is empty."""
    setting, finished = cost.setting, not cost.fault
    return {
        "case": setting.name,
        "material": setting.material,
        "ranks": setting.ranks,
        "dofs": cost.dofs or "",
        "iterations": cost.iterations or "",
        "coarse iterations": cost.coarse_iterations or "",
        "factorisations": cost.factorisations or "",
        "evaluations": cost.evaluations or "",
        "P/(E* R)": f"{cost.force:.10g}" if finished else "",
        "seconds": f"{cost.total:.3f}" if finished else "",
        **{f"{part} [s]": f"{cost.seconds[part]:.3f}" if finished else "" for part in _ALL_PARTS},
        "contact share": f"{cost.contact_share:.4f}" if finished else "",
        "peak memory per rank [MB]": " ".join(f"{memory / _MEGA:.0f}" for memory in cost.memory),
        "fault": cost.fault,
    }


def exponent(dofs: Sequence[float], values: Sequence[float]) -> float:
    """The power of ``dofs``, at least two, with which ``values`` grow: slope of a least-squares line through their
    logarithms."""
    return float(np.polynomial.Polynomial.fit(np.log(dofs), np.log(values), 1).convert().coef[1])


def _power(costs: Sequence[Cost], key: str) -> float:
    """The power of N with which the attribute ``key`` of ``costs`` grows."""
    return exponent([c.dofs for c in costs], [getattr(c, key) for c in costs])


def goals(costs: Costs) -> list[tuple[str, str, bool]]:
    """What is asked for, what was measured, and whether that meets it; without what was not measured."""
    said: list[tuple[str, str, bool]] = []
    serial = costs.series(1)
    for name, key, limit in (("time", "total", TIME_EXPONENT), ("memory", "peak", MEMORY_EXPONENT)):
        if len(serial) > 1:
            power = _power(serial, key)
            said.append((f"{name} grows at most like N^{limit:g}", f"N^{power:.2f}", power <= limit))
    for one, several in costs.strong():
        for two in (c for c in several if c.setting.ranks == 2 and c.setting.dofs == SPEED_UP_AT):
            text, factor = f"{SPEED_UP:g} times faster on 2 ranks at {one.dofs} dofs", one.total / two.total
            said.append((text, f"{factor:.2f}", factor >= SPEED_UP))
    if shares := [c.contact_share for c in costs.series(2)]:
        text = f"contact below {CONTACT_SHARE:.0%} of the time on 2 ranks"
        said.append((text, f"at most {max(shares):.1%}", max(shares) < CONTACT_SHARE))
    if parts := [c.share_around_factors for plastic in (False, True) for c in costs.series(1, plastic=plastic)]:
        text = f"contact search, assembly and return map at most {AROUND_FACTORS:.0%} of the solve at every size"
        said.append((text, f"at most {max(parts):.0%}", max(parts) <= AROUND_FACTORS))
    done = sum(not c.fault for c in costs.all)
    text = "every mesh finishes, plastic ones included"
    return [*said, (text, f"{done} of {len(costs.all)} runs", done == len(costs.all))]


def markdown(costs: Costs) -> str:
    """What is asked for and what was measured, then the tables behind it."""
    judged = ((asked, measured, "yes" if met else "no") for asked, measured, met in goals(costs))
    parts = [Table("asked for", "measured", "met", rows=judged).markdown()]
    tables = {
        "Cost over size, 1 rank": _cost(costs.series(1)),
        "Strong scaling": _strong(costs),
        "Elastic-plastic, 1 rank": _cost(costs.series(1, plastic=True)),
    }
    parts += [f"**{title}**\n\n{text}" for title, text in tables.items() if text]
    if faults := costs.faults():
        parts += ["Faults:\n", "".join(f"- {fault}\n" for fault in faults)]
    return "\n".join(parts)


def _cost(series: list[Cost]) -> str:
    """A line per size, and the powers of N with which the columns grow: over all, and since the size before."""
    if not series:
        return ""
    rows = [
        {
            "dofs N": c.dofs,
            "iterations": c.iterations,
            "on coarser meshes": c.coarse_iterations,
            "factorisations": c.factorisations,
            "seconds": f"{c.total:.1f}",
            "linear solve [s]": f"{c.linear_solve:.1f}",
            "per factorisation and its solves [s]": f"{c.each_factor:.3f}",
            "mesh and setup [s]": f"{c.seconds['mesh'] + c.seconds['setup']:.1f}",
            "contact": f"{c.contact_share:.1%}",
            "contact, assembly and return map in the solve": f"{c.share_around_factors:.0%}",
            "peak memory [MB]": f"{c.peak / _MEGA:.0f}",
            "power of N since the line before": f"{_power([before, c], 'total'):.2f}" if before else "",
        }
        for before, c in zip([None, *series], series, strict=False)
    ]
    text = Table.of(rows).markdown()
    if len(series) > 1:
        grown = {"time": "total", "linear solve": "linear_solve", "one factorisation": "each_factor", "memory": "peak"}
        fitted = ", ".join(f"{what} N^{_power(series, key):.2f}" for what, key in grown.items())
        text += f"\nLeast squares over these {len(series)} sizes: {fitted}.\n"
    return text


def _strong(costs: Costs) -> str:
    """A line for every number of ranks on which a size was solved that was solved on several."""
    rows = [
        {
            "dofs": c.dofs,
            "ranks": c.setting.ranks,
            **{f"{part} [s]": f"{c.seconds[part]:.2f}" for part in _ALL_PARTS},
            "total [s]": f"{c.total:.1f}",
            "times faster": f"{one.total / c.total:.2f}",
            "contact": f"{c.contact_share:.1%}",
            "peak memory per rank [MB]": ", ".join(f"{memory / _MEGA:.0f}" for memory in c.memory),
        }
        for one, several in costs.strong()
        for c in (one, *several)
    ]
    return Table.of(rows).markdown() if rows else ""


def draw(costs: Costs, file: Path) -> None:
    """Draw seconds by part and peak memory per rank over the number of dofs, both logarithmic."""
    figure = new_figure(11, 4.4)
    time, memory = figure.subplots(1, 2)
    for i, ranks in enumerate(costs.ranks):
        series, style = costs.series(ranks), ("-", "--", ":", "-.")[i % 4]
        dofs, on = [c.dofs for c in series], f"{ranks} rank{'s' if ranks > 1 else ''}"
        time.loglog(dofs, [c.total for c in series], style, marker="o", color="black", label=f"total, {on}")
        for k, part in enumerate(part for part in PARTS if part != "start-up"):
            seconds, label = [max(c.seconds[part], 1e-3) for c in series], part if i == 0 else None
            time.loglog(dofs, seconds, style, marker=".", color=f"C{k}", label=label)
        memory.loglog(dofs, [c.peak / _MEGA for c in series], style, marker="o", color="black", label=f"elastic, {on}")
    if plastic := costs.series(1, plastic=True):
        dofs = [c.dofs for c in plastic]
        time.loglog(dofs, [c.total for c in plastic], "s-", color="tab:red", label="total, plastic, 5 steps, 1 rank")
        memory.loglog(dofs, [c.peak / _MEGA for c in plastic], "s-", color="tab:red", label="plastic, 1 rank")
    time.set(xlabel="dofs", ylabel="seconds", title="time")
    memory.set(xlabel="dofs", ylabel="MB", title="peak memory of the largest rank")
    for axes in (time, memory):
        axes.grid(alpha=0.3, which="both")
        axes.legend(frameon=False, fontsize=7)
    save(figure, file)
