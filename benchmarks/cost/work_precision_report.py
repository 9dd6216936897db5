"""The lines of the work-precision benchmark as CSV and as Markdown."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from pathlib import Path

from archord.benchmarks.cost.envelope import Pairs, seconds_at
from archord.benchmarks.cost.work_precision import Line, envelopes, own_limit
from archord.benchmarks.cost.work_precision_cases import CASES, QUANTITIES, Case, Kinematics
from archord.benchmarks.cost.work_precision_codes import CALCULIX, OURS
from archord.benchmarks.cost.work_precision_reference import stored
from archord.benchmarks.report_files import markdown_table, write_rows

LEVELS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7)
_HEADINGS = ("code", "series", "mesh", "dofs", "steps", "iterations", "factorisations", "seconds", "from - to", "MB",
             "P/(E* R)")  # fmt: skip


def row(line: Line) -> dict[str, str]:
    """The entries of a point by heading; what is not known is empty."""
    task, point, values = line.task, line.point, line.point.values if line.point.done else None
    timed = bool(point.seconds) and values is not None
    found = values.quantities if values else {}
    entries = {
        "case": task.case,
        "code": task.code,
        "version": task.version,
        "series": task.series,
        "label": task.label,
        "status": "done" if point.done else "failed",
        "dofs": str(values.dofs) if values else "",
        "steps": str(task.steps),
        "iterations": _whole(values.iterations if values else None),
        "factorisations": _whole(values.factorisations if values else None),
        "seconds median": f"{point.median:.4g}" if timed else "",
        "seconds min": f"{min(point.seconds):.4g}" if timed else "",
        "seconds max": f"{max(point.seconds):.4g}" if timed else "",
        "repeats": str(len(point.seconds)),
        "export seconds": f"{task.export:.3g}" if task.export else "",
        "memory [MB]": f"{point.memory / 1e6:.0f}" if timed else "",
        "kinematics": values.kinematics if values else "",
    }
    for name in QUANTITIES:
        if name != "profile":
            entries[name] = f"{found[name]:.10g}" if name in found else ""
    for name in QUANTITIES:
        entries[f"error of {name}"] = f"{line.errors[name]:.3e}" if name in line.errors else ""
    for name in QUANTITIES:
        known = name in line.errors and name in line.reference.errors
        entries[f"reference's error of {name}"] = f"{line.reference.errors[name]:.1e}" if known else ""
    return entries | {"message": point.failure}


def write_csv(lines: list[Line], path: Path) -> None:
    """Write a row for every point, failed ones too."""
    write_rows([row(line) for line in lines], path)


def markdown(lines: list[Line], warm: Mapping[str, Sequence[float]] | None = None) -> str:
    """Tables of the points and of the ratios, case by case; ``warm`` are seconds of solves within one process."""
    repeats = max(len(line.point.seconds) for line in lines)
    codes = dict.fromkeys(f"{line.task.code} {line.task.version}".strip() for line in lines)
    processes = f"{repeats} whole process{'es' * (repeats != 1)}"
    out = [f"{processor()}, one core, one thread; median of {processes}; {', '.join(codes)}."]
    for case in CASES.values():
        some = [line for line in lines if line.task.case == case.name]
        if some:
            out += ["", f"**{case.title}**", "", *_table(case, some), *_notes(case, some)]
            out += ["", *ratio_table(envelopes(some, case.name))]
    if warm:
        out += ["", *_warm_table(warm)]
    return "\n".join([*out, ""])


def processor() -> str:
    """The processor's name, as far as the system tells."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        return next(line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def reference_table(cases: Sequence[Case], kinematics: Sequence[Kinematics] = ("current", "reference")) -> list[str]:
    """The reference values, what they are known to, and the two extrapolations that they come from."""
    headings = ("case", "kinematics", "quantity", "value", "relative error", "first family", "second family")
    rows = []
    for case in cases:
        for way in kinematics:
            entry = stored(case.name, way)
            sizes = [", ".join(f"{run['element_size']:g}" for run in family["runs"]) for family in entry["families"]]
            for name, found in entry["quantities"].items():
                cells = [
                    case.name,
                    way,
                    name,
                    f"{found['value']:.9g}" if found["value"] else "",
                    f"{found['error']:.1e}",
                ]
                for limit, family, listed in zip(
                    found.get("extrapolations", (None, None)), entry["families"], sizes, strict=True
                ):
                    cells.append(
                        f"{limit['value']:.9g} (order {limit['order']:.1f})" if limit else f"{family['name']}: {listed}"
                    )
                rows.append(cells)
    return markdown_table(headings, rows)


def ratio_table(kept: Mapping[str, Pairs]) -> list[str]:
    """Seconds at equal errors of P, of archord, and in multiples of them of the other codes."""
    others = [code for code in kept if code != OURS]
    if OURS not in kept or not others:
        return []
    ours = kept[OURS]
    rows = []
    for level in LEVELS:
        mine = seconds_at(level, ours)
        times = [seconds_at(level, kept[code]) for code in others]
        if mine is not None or any(time is not None for time in times):
            cells = [_times(time, mine) for time in times]
            rows.append([f"{level:g}", f"{mine:.2f}" if mine else "never", *cells])
    reached = [f"{code} {kept[code][-1][1]:.1e}" for code in (OURS, *others)]
    table = markdown_table(("error of P", f"{OURS} [s]", *others), rows)
    return [*table, "", f"Smallest errors of P reached: {', '.join(reached)}."]


def _times(theirs: float | None, ours: float | None) -> str:
    if theirs is None:
        return "never"
    return f"takes {theirs / ours:.2g} times as long" if ours else f"{theirs:.1f} s"


def _table(case: Case, lines: list[Line]) -> list[str]:
    shown = case.quantities
    headings = [*_HEADINGS, *(f"error of {name}" for name in shown)]
    rows = []
    for line in lines:
        e = row(line)
        cells = [e["code"], e["series"], e["label"]]
        if line.point.failure:
            cells += [f"failed: {line.point.failure}"] + [""] * (len(headings) - 4)
        else:
            spread = f"{e['seconds min']} - {e['seconds max']}"
            cells += [e["dofs"], e["steps"], e["iterations"], e["factorisations"], e["seconds median"], spread]
            cells += [e["memory [MB]"], f"{line.point.values.quantities['P']:.8f}" if line.point.values else ""]
            cells += [f"{line.errors[name]:.1e}" if name in line.errors else "" for name in shown]
        rows.append(cells)
    return markdown_table(headings, rows)


def _notes(case: Case, lines: list[Line]) -> list[str]:
    """What the errors are against, and what CalculiX's own limit and its decks' export are."""
    out = []
    references = {
        line.point.values.kinematics: line.reference for line in lines if line.point.done and line.point.values
    }
    for kinematics, reference in references.items():
        values = ", ".join(
            (f"{name} = {reference.values[name]:.9g}" if name != "profile" else name)
            + f" (known to {reference.errors[name]:.0e})"
            for name in case.quantities
            if name in reference.errors
        )
        out.append(f"Errors of codes with `{kinematics}` kinematics are against {values}.")
    for series, limit in own_limit(lines, case.name).items():
        out.append(
            f"{CALCULIX}'s {series} extrapolates to P = {limit.value:.8f} by itself, with order {limit.order:.1f} "
            f"(moves by {limit.error:.0e} if a mesh is left out); its penalty is part of that."
        )
    exports = [line.task.export for line in lines if line.task.export]
    if exports:
        out.append(f"Meshing and writing a deck took {min(exports):.1f} to {max(exports):.1f} s more, not counted.")
    return ["", *(part for sentence in out for part in (sentence, ""))][:-1]


def _warm_table(warm: Mapping[str, Sequence[float]]) -> list[str]:
    from statistics import median

    rows = [
        (name, f"{median(seconds):.3g}", f"{min(seconds):.3g} - {max(seconds):.3g}", len(seconds))
        for name, seconds in warm.items()
    ]
    table = markdown_table(("curve", "seconds, median", "from - to", "solves"), rows)
    return ["**within one process, after a first solve**", "", *table]


def _whole(value: int | None) -> str:
    return "" if value is None else str(value)
