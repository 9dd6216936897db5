"""What the costs of the scaling benchmark say: goals, tables, an extrapolation, and a picture."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
SERIAL = ("start-up", "mesh", "output", REST)  # done by rank 0 alone, or by every rank in full
PARALLEL = tuple(part for part in PARTS if part not in SERIAL)
TOLD = (2, 4, 8, 16, 32, 64)  # ranks of the extrapolation
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
    """The power of ``dofs`` with which ``values`` grow: slope of a least-squares line through their logarithms; nan for
    fewer than two."""
    if len(dofs) < 2:
        return float("nan")
    return float(np.polynomial.Polynomial.fit(np.log(dofs), np.log(values), 1).convert().coef[1])


def serial_fraction(one: float, several: float, ranks: int) -> float:
    """The share of Amdahl's law, ``T(r) = T(1) (s + (1 - s)/r)``, that explains the seconds on 1 and on ``ranks``
    ranks; between 0 and 1."""
    return float(np.clip((ranks * several / one - 1) / (ranks - 1), 0.0, 1.0)) if one > 0 else 1.0


def extrapolated(one: Cost, several: Cost, ranks: int) -> dict[str, float]:
    """Seconds by part on ``ranks`` ranks, if each part goes on as it was measured from 1 to several ranks.

    `SERIAL` parts stay what they were on several ranks; every other one follows Amdahl's law with its own measured
    serial fraction. Nothing here knows of networks, of memory that ranks share, or of the fronts of an elimination
    tree that are too few for many ranks: the law is kind to large numbers.
    """
    out = {name: several.seconds[name] for name in SERIAL}
    for name in PARALLEL:
        s = serial_fraction(one.seconds[name], several.seconds[name], several.setting.ranks)
        out[name] = one.seconds[name] * (s + (1 - s) / ranks)
    return out


def goals(costs: Costs) -> list[tuple[str, str, bool]]:
    """What is asked for, what was measured, and whether that meets it; without what was not measured."""
    said: list[tuple[str, str, bool]] = []
    serial = costs.series(1)
    for name, values, limit in (
        ("time", [c.total for c in serial], TIME_EXPONENT),
        ("memory", [c.peak for c in serial], MEMORY_EXPONENT),
    ):
        power = exponent([c.dofs for c in serial], values)
        if len(serial) > 1:
            said.append((f"{name} grows at most like N^{limit:g}", f"N^{power:.2f}", power <= limit))
    for one, two in costs.strong():
        if two.setting.ranks == 2 and one.setting.dofs == SPEED_UP_AT:
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
    for title, text in (
        ("Cost over size, 1 rank", _cost(costs.series(1))),
        ("Strong scaling", _strong(costs)),
        ("Weak scaling", _weak(costs)),
        ("Elastic-plastic, 1 rank", _cost(costs.series(1, plastic=True))),
        ("What a coarse start saves, 1 rank", _guided(costs)),
        ("Extrapolation", _extrapolation(costs)),
    ):
        if text:
            parts += [f"**{title}**\n", text]
    if faults := costs.faults():
        parts += ["Faults:\n", "".join(f"- {fault}\n" for fault in faults)]
    return "\n".join(parts)


def _table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """As Markdown; empty without rows."""
    table = Table(*headings, rows=rows)
    return table.markdown() if table.rows else ""


def _cost(series: list[Cost]) -> str:
    """A line per size, and the powers of N with which the columns grow: over all, and since the size before."""
    rows = []
    for k, c in enumerate(series):
        before = series[k - 1]
        power = f"{exponent([before.dofs, c.dofs], [before.total, c.total]):.2f}" if k else ""
        rows.append(
            (
                c.dofs, c.iterations, c.coarse_iterations, c.factorisations, f"{c.total:.1f}",
                f"{c.seconds['linear solve']:.1f}", f"{c.each_factor:.3f}",
                f"{c.seconds['mesh'] + c.seconds['setup']:.1f}", f"{c.contact_share:.1%}",
                f"{c.share_around_factors:.0%}", f"{c.peak / _MEGA:.0f}", power,
            )
        )  # fmt: skip
    headings = ("dofs N", "iterations", "on coarser meshes", "factorisations", "seconds", "linear solve [s]",
                "per factorisation and its solves [s]", "mesh and setup [s]", "contact",
                "contact, assembly and return map in the solve", "peak memory [MB]",
                "power of N since the line before")  # fmt: skip
    text, dofs = _table(headings, rows), [c.dofs for c in series]
    if len(series) > 1:
        grown: dict[str, Sequence[float]] = {
            "time": [c.total for c in series],
            "linear solve": [c.seconds["linear solve"] for c in series],
            "one factorisation": [c.each_factor for c in series],
            "memory": [c.peak for c in series],
        }
        fitted = ", ".join(f"{what} N^{exponent(dofs, values):.2f}" for what, values in grown.items())
        text += f"\nLeast squares over these {len(series)} sizes: {fitted}.\n"
    return text


def _strong(costs: Costs) -> str:
    rows = []
    for one in costs.series(1):
        several = [c for first, c in costs.strong() if first is one]
        for c in [one, *several] if several else []:
            parts = (f"{c.seconds[part]:.2f}" for part in _ALL_PARTS)
            memory = ", ".join(f"{memory / _MEGA:.0f}" for memory in c.memory)
            faster = f"{one.total / c.total:.2f}"
            rows.append((c.dofs, c.setting.ranks, *parts, f"{c.total:.1f}", faster, f"{c.contact_share:.1%}", memory))
    parts = (f"{part} [s]" for part in _ALL_PARTS)
    return _table(("dofs", "ranks", *parts, "total [s]", "times faster", "contact", "peak memory per rank [MB]"), rows)


def _weak(costs: Costs) -> str:
    """About one size per rank. A direct solver's work grows faster than its mesh, and finer meshes take more
    iterations, so an efficiency of 1 is not to be had: that of one factorisation stands beside it."""
    rows = (
        (
            one.dofs, several.dofs, several.setting.ranks, f"{one.total:.1f}", f"{several.total:.1f}",
            f"{one.total / several.total:.2f}", f"{one.each_factor / several.each_factor:.2f}",
            f"{one.peak / _MEGA:.0f}", f"{several.peak / _MEGA:.0f}",
        )
        for one, several in costs.weak()
    )  # fmt: skip
    headings = ("dofs on 1 rank", "dofs", "ranks", "seconds on 1 rank", "seconds", "efficiency",
                "of one factorisation and its solves", "peak memory on 1 rank [MB]", "per rank [MB]")  # fmt: skip
    return _table(headings, rows)


def _guided(costs: Costs) -> str:
    """Runs with and without a coarse start side by side."""
    rows = (
        (
            c.setting.material, c.dofs, alone.iterations, c.iterations, c.coarse_iterations, f"{alone.total:.1f}",
            f"{c.total:.1f}", f"{alone.total / c.total:.2f}", f"{abs(alone.force / c.force - 1):.1e}",
        )
        for c, alone in costs.unguided()
    )  # fmt: skip
    headings = ("material", "dofs", "iterations without", "with", "on coarser meshes", "seconds without", "with",
                "times faster", "difference of P")  # fmt: skip
    return _table(headings, rows)


def _extrapolation(costs: Costs) -> str:
    """The largest mesh on more ranks than there are, by Amdahl's law for each part."""
    if not costs.strong():
        return ""
    one, several = costs.strong()[-1]
    measured = several.setting.ranks
    fractions = ", ".join(
        f"{part} {serial_fraction(one.seconds[part], several.seconds[part], measured):.2f}" for part in PARALLEL
    )
    rows = []
    for ranks in (r for r in TOLD if r >= measured):
        seconds = extrapolated(one, several, ranks)
        total, serial = sum(seconds.values()), sum(seconds[part] for part in SERIAL)
        shown = (f"{value:.1f}" for value in (*(seconds[part] for part in PARALLEL), serial, total))
        rows.append((ranks, *shown, f"{one.total / total:.2f}", f"{seconds['contact'] / total:.1%}"))
    parts = (f"{part} [s]" for part in PARALLEL)
    return (
        f"Not measured: {one.dofs} dofs on more ranks, from the parts measured on 1 and {measured} ranks. "
        f"{', '.join(SERIAL[:-1])} and what no timer covers stay what they were on {measured} ranks; every "
        f"other part follows Amdahl's law, T(r) = T(1) (s + (1 - s)/r), with its own measured s: {fractions}. The law "
        "knows no network, no shared memory bandwidth and no elimination tree that is too narrow for many ranks, all "
        "of which would make it slower.\n\n"
    ) + _table(("ranks", *parts, "serial [s]", "total [s]", "times faster", "contact"), rows)


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
