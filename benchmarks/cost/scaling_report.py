"""The costs of the scaling benchmark as CSV, as Markdown and as a picture."""

from __future__ import annotations

from pathlib import Path

from archord.benchmarks.cost.scaling import SERIAL, TOLD, Costs, exponent, extrapolated, goals, serial_fraction
from archord.benchmarks.cost.scaling_run import PARTS, REST, Cost
from archord.benchmarks.report_files import markdown_table, write_files

_MEGA = 1e6
_ALL_PARTS = (*PARTS, REST)


def write_report(costs: Costs, folder: Path) -> list[Path]:
    """Write scaling.csv, scaling.md and scaling.png into ``folder``; returns the files."""
    rows = [row(cost) for cost in costs.all]
    return write_files(folder, "scaling", rows, markdown(costs), lambda file: draw(costs, file))


def row(cost: Cost) -> dict[str, str]:
    """The entries of a run by heading; what it does not have is empty."""
    case, finished = cost.case, not cost.fault
    return {
        "case": case.name,
        "material": "plastic" if case.plastic else "elastic",
        "ranks": str(case.ranks),
        "dofs": str(cost.dofs or ""),
        "iterations": str(cost.iterations or ""),
        "coarse iterations": str(cost.coarse_iterations or ""),
        "factorisations": str(cost.factorisations or ""),
        "evaluations": str(cost.evaluations or ""),
        "P/(E* R)": f"{cost.force:.10g}" if finished else "",
        "seconds": f"{cost.total:.3f}" if finished else "",
        **{f"{part} [s]": f"{cost.seconds[part]:.3f}" if finished else "" for part in _ALL_PARTS},
        "contact share": f"{cost.contact_share:.4f}" if finished else "",
        "peak memory per rank [MB]": " ".join(f"{memory / _MEGA:.0f}" for memory in cost.memory),
        "fault": cost.fault,
    }


def markdown(costs: Costs) -> str:
    """What is asked for and what was measured, then the tables behind it."""
    judged = [(asked, measured, "yes" if met else "no") for asked, measured, met in goals(costs)]
    out = markdown_table(("asked for", "measured", "met"), judged)
    for title, lines in (
        ("Cost over size, 1 rank", _cost(costs.series(1))),
        ("Strong scaling", _strong(costs)),
        ("Weak scaling", _weak(costs)),
        ("Elastic-plastic, 1 rank", _cost(costs.series(1, plastic=True))),
        ("What a coarse start saves, 1 rank", _guided(costs)),
        ("Extrapolation", _extrapolation(costs)),
    ):
        if lines:
            out += ["", f"**{title}**", "", *lines]
    faults = costs.faults()
    return "\n".join([*out, *(["", "Faults:", "", *(f"- {fault}" for fault in faults)] if faults else []), ""])


def _cost(series: list[Cost]) -> list[str]:
    """A line per size, and the powers of N with which the columns grow: over all, and since the size before."""
    if not series:
        return []
    rows = []
    for before, c in zip([None, *series], series, strict=False):
        power = f"{exponent([before.dofs, c.dofs], [before.total, c.total]):.2f}" if before else ""
        linear = c.seconds["linear solve"]
        rows.append(
            [
                *(str(count) for count in (c.dofs, c.iterations, c.coarse_iterations, c.factorisations)),
                *(f"{seconds:.1f}" for seconds in (c.total, linear)),
                f"{linear / c.factorisations:.3f}",
                f"{c.seconds['mesh'] + c.seconds['setup']:.1f}",
                f"{c.contact_share:.1%}",
                f"{c.share_around_factors:.0%}",
                f"{c.peak / _MEGA:.0f}",
                power,
            ]
        )
    headings = ("dofs N", "iterations", "on coarser meshes", "factorisations", "seconds", "linear solve [s]",
                "per factorisation and its solves [s]", "mesh and setup [s]", "contact",
                "contact, assembly and return map in the solve", "peak memory [MB]",
                "power of N since the line before")  # fmt: skip
    lines = markdown_table(headings, rows)
    if len(series) > 1:
        n = [c.dofs for c in series]
        powers = {
            "time": exponent(n, [c.total for c in series]),
            "linear solve": exponent(n, [c.seconds["linear solve"] for c in series]),
            "one factorisation": exponent(n, [c.seconds["linear solve"] / c.factorisations for c in series]),
            "memory": exponent(n, [c.peak for c in series]),
        }
        fitted = ", ".join(f"{what} N^{power:.2f}" for what, power in powers.items())
        lines += ["", f"Least squares over these {len(series)} sizes: {fitted}."]
    return lines


def _strong(costs: Costs) -> list[str]:
    if not costs.strong():
        return []
    rows = []
    for one in costs.series(1):
        pairs = [several for first, several in costs.strong() if first is one]
        for c in [one, *pairs] if pairs else []:
            rows.append(
                [
                    *(str(count) for count in (c.dofs, c.case.ranks)),
                    *(f"{c.seconds[part]:.2f}" for part in _ALL_PARTS),
                    f"{c.total:.1f}",
                    f"{one.total / c.total:.2f}",
                    f"{c.contact_share:.1%}",
                    ", ".join(f"{memory / _MEGA:.0f}" for memory in c.memory),
                ]
            )
    headings = ("dofs", "ranks", *(f"{part} [s]" for part in _ALL_PARTS), "total [s]", "times faster", "contact",
                "peak memory per rank [MB]")  # fmt: skip
    return markdown_table(headings, rows)


def _weak(costs: Costs) -> list[str]:
    """About one size per rank. A direct solver's work grows faster than its mesh, and finer meshes take more
    iterations, so an efficiency of 1 is not to be had: that of one factorisation stands beside it."""
    rows = []
    for one, several in costs.weak():
        each = [c.seconds["linear solve"] / c.factorisations for c in (one, several)]
        rows.append(
            [
                *(str(count) for count in (one.dofs, several.dofs, several.case.ranks)),
                *(f"{c.total:.1f}" for c in (one, several)),
                f"{one.total / several.total:.2f}",
                f"{each[0] / each[1]:.2f}",
                *(f"{c.peak / _MEGA:.0f}" for c in (one, several)),
            ]
        )
    if not rows:
        return []
    headings = ("dofs on 1 rank", "dofs", "ranks", "seconds on 1 rank", "seconds", "efficiency",
                "of one factorisation and its solves", "peak memory on 1 rank [MB]", "per rank [MB]")  # fmt: skip
    return markdown_table(headings, rows)


def _guided(costs: Costs) -> list[str]:
    """Runs with and without a coarse start side by side."""
    rows = [
        [
            "plastic" if c.case.plastic else "elastic",
            *(str(count) for count in (c.dofs, alone.iterations, c.iterations, c.coarse_iterations)),
            *(f"{seconds:.1f}" for seconds in (alone.total, c.total)),
            f"{alone.total / c.total:.2f}",
            f"{abs(alone.force / c.force - 1):.1e}",
        ]
        for c, alone in costs.unguided()
    ]
    headings = ("material", "dofs", "iterations without", "with", "on coarser meshes", "seconds without", "with",
                "times faster", "difference of P")  # fmt: skip
    return markdown_table(headings, rows) if rows else []


def _extrapolation(costs: Costs) -> list[str]:
    """The largest mesh on more ranks than there are, by Amdahl's law for each part."""
    if not costs.strong():
        return []
    one, several = costs.strong()[-1]
    parallel = [part for part in PARTS if part not in SERIAL]
    fractions = ", ".join(
        f"{part} {serial_fraction(one.seconds[part], several.seconds[part], several.case.ranks):.2f}"
        for part in parallel
    )
    rows = []
    for ranks in (r for r in TOLD if r >= several.case.ranks):
        seconds = extrapolated(one, several, ranks)
        total = sum(seconds.values())
        serial = sum(seconds[part] for part in SERIAL)
        rows.append(
            [
                str(ranks),
                *(f"{value:.1f}" for value in (*(seconds[part] for part in parallel), serial, total)),
                f"{one.total / total:.2f}",
                f"{seconds['contact'] / total:.1%}",
            ]
        )
    headings = ("ranks", *(f"{part} [s]" for part in parallel), "serial [s]", "total [s]", "times faster", "contact")
    return [
        f"Not measured: {one.dofs} dofs on more ranks, from the parts measured on 1 and {several.case.ranks} ranks. "
        f"{', '.join(SERIAL[:-1])} and what no timer covers stay what they were on {several.case.ranks} ranks; every "
        f"other part follows Amdahl's law, T(r) = T(1) (s + (1 - s)/r), with its own measured s: {fractions}. The law "
        "knows no network, no shared memory bandwidth and no elimination tree that is too narrow for many ranks, all "
        "of which would make it slower.",
        "",
        *markdown_table(headings, rows),
    ]


def draw(costs: Costs, file: Path) -> None:
    """Draw seconds by part and peak memory per rank over the number of dofs, both logarithmic."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    time, memory = figure.subplots(1, 2)
    styles = ["-", "--", ":", "-."]
    for i, ranks in enumerate(costs.ranks):
        series, style = costs.series(ranks), styles[i % len(styles)]
        dofs, on = [c.dofs for c in series], f"{ranks} rank{'s' if ranks > 1 else ''}"
        time.loglog(dofs, [c.total for c in series], style, marker="o", color="black", label=f"total, {on}")
        for k, part in enumerate(part for part in PARTS if part != "start-up"):
            seconds, label = [max(c.seconds[part], 1e-3) for c in series], part if i == 0 else None
            time.loglog(dofs, seconds, style, marker=".", color=f"C{k}", label=label)
        memory.loglog(dofs, [c.peak / _MEGA for c in series], style, marker="o", color="black", label=f"elastic, {on}")
    plastic = costs.series(1, plastic=True)
    if plastic:
        dofs = [c.dofs for c in plastic]
        time.loglog(dofs, [c.total for c in plastic], "s-", color="tab:red", label="total, plastic, 5 steps, 1 rank")
        memory.loglog(dofs, [c.peak / _MEGA for c in plastic], "s-", color="tab:red", label="plastic, 1 rank")
    time.set(xlabel="dofs", ylabel="seconds", title="time")
    memory.set(xlabel="dofs", ylabel="MB", title="peak memory of the largest rank")
    for axes in (time, memory):
        axes.grid(alpha=0.3, which="both")
        axes.legend(frameon=False, fontsize=7)
    figure.savefig(file, dpi=110)
