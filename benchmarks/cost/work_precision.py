"""Error against run time, archord's beside other codes' in one session: ``archord benchmark
work-precision``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from archord.benchmarks.cost.work_precision_codes import ANGLES, CASES, OURS, Point, points
from archord.benchmarks.timing import Said, Timing, time_all
from archord.geometry.basis import Array
from archord.report.figure import new_figure, save
from archord.report.files import replacing, write_report
from archord.report.table import Table

Pairs = list[tuple[float, float]]
LEVELS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7)
NAMES = {
    "P": "P",
    "p0": "p0",
    "eps": "contact angle",
    "profile": "pressure profile (L2)",
    "dissipation": "plastic dissipation",
}
_FLOOR = 1e-9  # an error of zero has no place on a logarithmic axis


@dataclass(frozen=True)
class Line:
    """A point, timed, and what it found, empty if it failed."""

    point: Point
    timing: Timing

    @property
    def found(self) -> dict[str, Any]:
        """The result of the last run."""
        return {} if self.timing.failure else self.timing.runs[-1].result

    @property
    def errors(self) -> dict[str, float]:
        """Relative errors by quantity against the reference of the code's kinematics."""
        case = CASES[self.point.case]
        exact = case[self.found.get("kinematics", "current")]
        errors = {
            name: abs(value / exact[name][0] - 1)
            for name, value in self.found.items()
            if name in exact
        }
        if "profile" in self.found:
            errors["profile"] = profile_error(self.found["profile"], np.array(case["profile"]))
        return errors


def run(folder: Path, only: Sequence[str], repeats: int, limit: float, said: Said) -> list[Line]:
    """Time the points that fit ``only`` below ``folder`` (see `time_all`), for ``limit`` seconds
    each at most."""
    chosen = points(only)
    timings = time_all([point.process(folder, limit) for point in chosen], repeats, said)
    return [Line(*pair) for pair in zip(chosen, timings, strict=True)]


def profile_error(pressure: Array, reference: Array) -> float:
    """Relative L2 difference over the arc, ``sqrt(int (p - p_ref)^2 / int p_ref^2)``; both
    ``(401,)`` at `ANGLES`."""
    difference = np.trapezoid((pressure - reference) ** 2, ANGLES)
    return float(np.sqrt(difference / np.trapezoid(reference**2, ANGLES)))


def series_of(lines: Sequence[Line]) -> dict[tuple[str, str], list[Line]]:
    """The lines of one case by code and series, each from coarse to fine, as given."""
    found: dict[tuple[str, str], list[Line]] = {}
    for line in lines:
        found.setdefault((line.point.code, line.point.series), []).append(line)
    return found


def envelopes(lines: Sequence[Line]) -> dict[str, Pairs]:
    """Per code the best of all its series in one case: pairs (seconds, error of P), where an error
    counts from the mesh on from which its series stays below it."""
    found: dict[str, Pairs] = {}
    for (code, _), members in series_of(lines).items():
        known = [line for line in members if "P" in line.errors]
        seconds = [line.timing.median for line in known]
        errors = lasting([line.errors["P"] for line in known])
        if known:
            found.setdefault(code, []).extend(zip(seconds, errors, strict=True))
    return {code: envelope(pairs) for code, pairs in found.items()}


def lasting(errors: Sequence[float]) -> list[float]:
    """The errors of a series, coarse to fine, each as large as any on a finer mesh: one that passes
    through zero on its mesh proves nothing of the method."""
    return [max(errors[k:]) for k in range(len(errors))]


def envelope(pairs: Iterable[tuple[float, float]]) -> Pairs:
    """Those of the pairs (seconds, error) that no other beats in both, in the order of their
    seconds."""
    ordered = sorted(pairs)
    return [
        pair for k, pair in enumerate(ordered) if all(pair[1] < error for _, error in ordered[:k])
    ]


def seconds_at(error: float, kept: Pairs) -> float | None:
    """Seconds to ``error`` along an envelope, straight in log-log; None if it does not get there.
    Errors above the cheapest point's cost what that point costs."""
    if not kept or error < kept[-1][1]:
        return None
    seconds, errors = np.log(np.maximum(kept, 1e-300)).T
    return float(np.exp(np.interp(np.log(error), errors[::-1], seconds[::-1])))


def write(lines: Sequence[Line], folder: Path) -> tuple[str, list[Path]]:
    """Write a table of points, as CSV and Markdown, and a diagram for each case; returns the tables
    and the files."""
    texts = []
    files = []
    for case, given in CASES.items():
        some = [line for line in lines if line.point.case == case]
        if not some:
            continue
        rows = [row(line) for line in some]
        codes = dict.fromkeys(f"{line.point.code} {line.point.version}".strip() for line in some)
        head = f"**{given['title']}**: {', '.join(codes)}\n"
        text = "\n".join([head, Table.of(rows).markdown(), *ratios(envelopes(some))])
        texts.append(text)
        picture = partial(draw, case, some)
        files += write_report(folder, f"work_precision_{case}", rows, text, picture)
    return "\n".join(texts), files


def row(line: Line) -> dict[str, object]:
    """The entries of a point by heading; what is not known is empty."""
    point = line.point
    found = line.found
    errors = line.errors
    entries: dict[str, object] = {
        "code": point.code,
        "series": point.series,
        "mesh": f"{point.size:g} R",
        "dofs": found.get("dofs", ""),
        "steps": point.steps,
        "iterations": found.get("iterations", ""),
        "factorisations": found.get("factorisations", ""),
    }
    entries |= dict.fromkeys(("seconds", "from - to", "MB", "P/(E* R)"), "")
    if found:
        runs = line.timing.runs
        seconds = sorted(run.seconds for run in runs)
        entries["seconds"] = f"{line.timing.median:.4g}"
        entries["from - to"] = f"{seconds[0]:.4g} - {seconds[-1]:.4g}"
        entries["MB"] = f"{max(run.memory for run in runs) / 1e6:.0f}"
    if "P" in found:
        entries["P/(E* R)"] = f"{found['P']:.8f}"
    for name in quantities(point.case):
        entries[f"error of {name}"] = f"{errors[name]:.1e}" if name in errors else ""
    return entries | {"failure": line.timing.failure}


def quantities(case: str) -> list[str]:
    """What ``case`` is judged by."""
    return [name for name in NAMES if name == "profile" or name in CASES[case]["current"]]


def ratios(kept: dict[str, Pairs]) -> list[str]:
    """Seconds at equal errors of P, of archord, and in multiples of them of the other codes."""
    others = [code for code in kept if code != OURS]
    if OURS not in kept or not others:
        return []

    table = Table("error of P", f"{OURS} [s]", *others)
    for level in LEVELS:
        ours = seconds_at(level, kept[OURS])
        times = [seconds_at(level, kept[code]) for code in others]
        if ours or any(times):
            told = [_in_words(seconds, ours) for seconds in times]
            table.add(f"{level:g}", f"{ours:.2f}" if ours else "never", *told)
    reached = ", ".join(f"{code} {kept[code][-1][1]:.1e}" for code in (OURS, *others))
    return [table.markdown(), f"Smallest errors of P reached: {reached}.\n"]


def _in_words(seconds: float | None, ours: float | None) -> str:
    """How long another code takes, as a multiple of ours where that is known."""
    if not seconds:
        return "never"
    return f"takes {seconds / ours:.2g} times as long" if ours else f"{seconds:.1f} s"


def draw(case: str, lines: Sequence[Line], file: Path) -> None:
    """Draw the errors of ``case`` over seconds (above) and dofs; grey is what the reference does
    not know."""
    names = quantities(case)
    given = CASES[case]
    codes = list(dict.fromkeys((OURS, *(line.point.code for line in lines))))
    figure = new_figure(4.1 * len(names), 9)
    panels = figure.subplots(2, len(names), sharey="col")
    for number, ((code, series), members) in enumerate(series_of(lines).items()):
        style = {
            "color": f"C{codes.index(code)}",
            "marker": "os^Dvph*"[number % 8],
            "label": f"{code}, {series}",
        }
        for k, name in enumerate(names):
            known = [line for line in members if name in line.errors]
            errors = [max(line.errors[name], _FLOOR) for line in known]
            panels[0, k].loglog([line.timing.median for line in known], errors, **style)
            panels[1, k].loglog([line.found["dofs"] for line in known], errors, **style)
    for k, name in enumerate(names):
        unknown = given["profile_error"] if name == "profile" else given["current"][name][1]
        panels[0, k].set(
            xlabel="wall time of the whole process [s]", title=f"relative error of {NAMES[name]}"
        )
        panels[1, k].set(xlabel="degrees of freedom")
        bottom = min(panels[0, k].get_ylim()[0], unknown / 2)
        for ax in panels[:, k]:
            ax.axhspan(bottom, unknown, color="0.9", zorder=0)
            ax.set_ylim(bottom=bottom)
            ax.grid(True, linewidth=0.4)
    figure.legend(
        *panels[0, 0].get_legend_handles_labels(),
        loc="outside upper center",
        ncols=4,
        title=given["title"],
    )
    with replacing(file) as new:
        save(figure, new, dots=80)
