"""The lines of the work-precision benchmark as CSV, as Markdown and as log-log diagrams."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median

from PIL import Image

from archord.benchmarks.cost.work_precision import Line, Pairs, envelopes, own_limit, seconds_at, series_of
from archord.benchmarks.cost.work_precision_cases import CASES, QUANTITIES, JointCase, Kinematics
from archord.benchmarks.cost.work_precision_codes import CALCULIX, OURS, Values
from archord.benchmarks.cost.work_precision_reference import stored
from archord.report import files
from archord.report.figure import new_figure, save
from archord.report.table import Table

LEVELS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7)
NAMES = {"P": "P", "p0": "p0", "eps": "contact angle", "profile": "pressure profile (L2)",
         "dissipation": "plastic dissipation"}  # fmt: skip
_HEADINGS = ("code", "series", "mesh", "dofs", "steps", "iterations", "factorisations", "seconds", "from - to", "MB",
             "P/(E* R)")  # fmt: skip
_MARKERS = "os^Dvphx*"
_COLOURS = ("red", "blue", "green", "purple", "brown", "olive", "cyan", "pink")
_FLOOR = 1e-9  # an error of zero has no place on a logarithmic axis


def write(lines: Sequence[Line], folder: Path, warm: Mapping[str, Sequence[float]] | None = None) -> list[Path]:
    """Write work_precision.csv, with a row for every point, failed ones too, work_precision.md and a diagram for each
    case; returns the files. ``warm`` are seconds of solves within one process."""
    found = files.write_report(folder, "work_precision", [row(line) for line in lines], markdown(lines, warm))
    for case in CASES.values():
        if some := [line for line in lines if line.task.case == case.name]:
            found.append(folder / f"work_precision_{case.name}.png")
            draw(case, some, found[-1])
    return found


def row(line: Line) -> dict[str, object]:
    """The entries of a point by heading; what is not known is empty."""
    task, timing, values = line.task, line.timing, line.values or Values({})
    runs = timing.runs if line.values else []

    def known(value: float | None, form: str = "") -> str:
        return "" if value is None else format(value, form)

    entries: dict[str, object] = {
        "case": task.case,
        "code": task.code,
        "version": task.version,
        "series": task.series,
        "label": task.label,
        "status": "done" if timing.done else "failed",
        "dofs": known(values.dofs),
        "steps": task.steps,
        "iterations": known(values.iterations),
        "factorisations": known(values.factorisations),
        "seconds median": known(timing.median if runs else None, ".4g"),
        "seconds min": known(min((run.seconds for run in runs), default=None), ".4g"),
        "seconds max": known(max((run.seconds for run in runs), default=None), ".4g"),
        "repeats": len(timing.runs),
        "memory [MB]": known(max((run.memory / 1e6 for run in runs), default=None), ".0f"),
        "kinematics": values.kinematics if line.values else "",
    }
    entries |= {name: known(values.quantities.get(name), ".10g") for name in QUANTITIES if name != "profile"}
    entries |= {f"error of {name}": known(line.errors.get(name), ".3e") for name in QUANTITIES}
    for name in QUANTITIES:
        unsure = line.reference.errors.get(name) if name in line.errors else None
        entries[f"reference's error of {name}"] = known(unsure, ".1e")
    return entries | {"message": timing.failure}


def markdown(lines: Sequence[Line], warm: Mapping[str, Sequence[float]] | None = None) -> str:
    """Tables of the points and of the ratios, case by case."""
    repeats = max(len(line.timing.runs) for line in lines)
    codes = dict.fromkeys(f"{line.task.code} {line.task.version}".strip() for line in lines)
    processes = f"{repeats} whole process{'es' * (repeats != 1)}"
    parts = [f"{processor()}, one core, one thread; median of {processes}; {', '.join(codes)}.\n"]
    for case in CASES.values():
        if some := [line for line in lines if line.task.case == case.name]:
            parts += [f"**{case.title}**\n", _table(case, some), *_notes(case, some)]
            parts += ratio_table(envelopes(some))
    if warm:
        rows = [
            (name, f"{median(seconds):.3g}", f"{min(seconds):.3g} - {max(seconds):.3g}", len(seconds))
            for name, seconds in warm.items()
        ]
        table = Table("curve", "seconds, median", "from - to", "solves", rows=rows)
        parts += ["**within one process, after a first solve**\n", table.markdown()]
    return "\n".join(parts)


def processor() -> str:
    """The processor's name, as far as the system tells."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        return next(line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _table(case: JointCase, lines: Sequence[Line]) -> str:
    table = Table(*_HEADINGS, *(f"error of {name}" for name in case.quantities))
    for line in lines:
        e = row(line)
        cells = [e["code"], e["series"], e["label"]]
        if line.timing.failure:
            cells += [f"failed: {line.timing.failure}"] + [""] * (len(table.headings) - 4)
        else:
            cells += [e["dofs"], e["steps"], e["iterations"], e["factorisations"], e["seconds median"]]
            cells += [f"{e['seconds min']} - {e['seconds max']}", e["memory [MB]"]]
            cells += ["" if line.force is None else f"{line.force:.8f}"]
            cells += [f"{line.errors[name]:.1e}" if name in line.errors else "" for name in case.quantities]
        table.add(*cells)
    return table.markdown()


def _notes(case: JointCase, lines: Sequence[Line]) -> list[str]:
    """What the errors are against, and what CalculiX's own limit and its decks' export are."""
    out = []
    for kinematics, r in {line.values.kinematics: line.reference for line in lines if line.values}.items():
        values = ", ".join(
            (f"{name} = {r.values[name]:.9g}" if name != "profile" else name) + f" (known to {r.errors[name]:.0e})"
            for name in case.quantities
            if name in r.errors
        )
        out.append(f"Errors of codes with `{kinematics}` kinematics are against {values}.\n")
    for (code, series), members in series_of(lines).items():
        if limit := own_limit(code, members):
            out.append(
                f"{code}'s {series} extrapolates to P = {limit.value:.8f} by itself, with order {limit.order:.1f} "
                f"(moves by {limit.error:.0e} if a mesh is left out); its penalty is part of that.\n"
            )
    return out


def ratio_table(kept: Mapping[str, Pairs]) -> list[str]:
    """Seconds at equal errors of P, of archord, and in multiples of them of the other codes."""
    others = [code for code in kept if code != OURS]
    if OURS not in kept or not others:
        return []

    def cell(theirs: float | None, ours: float | None) -> str:
        if theirs is None:
            return "never"
        return f"takes {theirs / ours:.2g} times as long" if ours else f"{theirs:.1f} s"

    table = Table("error of P", f"{OURS} [s]", *others)
    for level in LEVELS:
        mine, times = seconds_at(level, kept[OURS]), [seconds_at(level, kept[code]) for code in others]
        if any(time is not None for time in (mine, *times)):
            table.add(f"{level:g}", f"{mine:.2f}" if mine else "never", *(cell(time, mine) for time in times))
    reached = ", ".join(f"{code} {kept[code][-1][1]:.1e}" for code in (OURS, *others))
    return [table.markdown(), f"Smallest errors of P reached: {reached}.\n"]


def reference_table(cases: Sequence[JointCase], kinematics: Sequence[Kinematics] = ("current", "reference")) -> Table:
    """The reference values, what they are known to, and the two extrapolations that they come from."""
    table = Table("case", "kinematics", "quantity", "value", "relative error", "first family", "second family")
    for case, way in ((case, way) for case in cases for way in kinematics):
        entry = stored()[case.name][way]
        for name, found in entry["quantities"].items():
            if "extrapolations" in found:
                limits = [f"{limit['value']:.9g} (order {limit['order']:.1f})" for limit in found["extrapolations"]]
            else:
                sizes = (", ".join(f"{run['element_size']:g}" for run in f["runs"]) for f in entry["families"])
                limits = [f"{f['name']}: {listed}" for f, listed in zip(entry["families"], sizes, strict=True)]
            value = f"{found['value']:.9g}" if found["value"] else ""
            table.add(case.name, way, name, value, f"{found['error']:.1e}", *limits)
    return table


def draw(case: JointCase, lines: Sequence[Line], path: Path) -> None:
    """Draw the diagram of ``case``: P above, the other quantities below; grey is what the reference does not know."""
    others = [name for name in case.quantities if name != "P"]
    figure = new_figure(4.1 * max(len(others), 3), 11.5)
    top, bottom = figure.subfigures(2, 1, height_ratios=(1.15, 1.6))
    above = top.subplots(1, 2)
    below = bottom.subplots(2, len(others), sharey="col", squeeze=False)
    styles = _styles(lines)
    for k, against in enumerate(("seconds", "dofs")):
        for ax, name in ((above[k], "P"), *zip(below[k], others, strict=True)):
            _panel(ax, lines, name, against, styles)
    handles, labels = above[0].get_legend_handles_labels()
    top.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=8, frameon=False, title=case.title)
    save(figure, path, dots=80)
    # a palette makes the file a third as large as matplotlib's own
    Image.open(path).convert("RGB").quantize(64).save(path, optimize=True)


def _styles(lines: Sequence[Line]) -> dict[tuple[str, str], dict]:
    """A colour for each code, a marker for each of its series."""
    styles: dict[tuple[str, str], dict] = {}
    codes = list(dict.fromkeys((OURS, CALCULIX, *(line.task.code for line in lines))))
    for code, series in series_of(lines):
        k = sum(known == code for known, _ in styles)
        styles[code, series] = {
            "color": f"tab:{_COLOURS[codes.index(code) % len(_COLOURS)]}", "marker": _MARKERS[k % len(_MARKERS)],
            "markersize": 5, "linewidth": 1.1, "linestyle": ("-", "--", ":", "-.")[k % 4], "label": f"{code}, {series}",
        }  # fmt: skip
    return styles


def _panel(ax, lines: Sequence[Line], quantity: str, against: str, styles: dict) -> None:
    for key, members in series_of(lines).items():
        known = [line for line in members if line.values and quantity in line.errors]
        if known or quantity == "P":
            x = [line.timing.median if against == "seconds" else line.values.dofs for line in known if line.values]
            ax.loglog(x, [max(line.errors[quantity], _FLOOR) for line in known], **styles[key])
    unknown = max((line.reference.errors.get(quantity, 0.0) for line in lines if line.timing.done), default=0.0)
    if unknown:
        bottom = min(ax.get_ylim()[0], unknown / 2)
        ax.axhspan(bottom, unknown, color="0.9", zorder=0)
        ax.set_ylim(bottom=bottom)
    ax.set_xlabel("wall time of the whole process [s]" if against == "seconds" else "degrees of freedom", fontsize=8)
    ax.set_title(f"relative error of {NAMES[quantity]}", fontsize=9)
    ax.tick_params(labelsize=7, which="both")
    ax.grid(True, which="major", linewidth=0.4)
