"""The work-precision benchmark: error against wall time and dofs, archord's beside other codes' in one session."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import cast

import numpy as np

from archord.benchmarks.case import Case
from archord.benchmarks.cost.work_precision_cases import CASES, meshes
from archord.benchmarks.cost.work_precision_codes import CALCULIX, Task, Values
from archord.benchmarks.cost.work_precision_reference import Reference, profile_error, read_reference
from archord.benchmarks.timing import Timing
from archord.postprocess.convergence import Limit, extrapolated

Pairs = list[tuple[float, float]]
_SCATTER = 1e-4


@dataclass(frozen=True)
class Line:
    """A task, timed, what it found (None if it failed), and its relative errors by quantity, against the reference of
    its kinematics."""

    task: Task
    timing: Timing
    values: Values | None
    errors: dict[str, float]
    reference: Reference

    @property
    def force(self) -> float | None:
        """P/(E* R); None if it failed."""
        return self.values.quantities.get("P") if self.values else None


def judge(timing: Timing) -> Line:
    """The errors of what a task found; none if it failed."""
    task, errors = cast(Task, timing.process), {}
    values: Values | None = timing.runs[-1].result if timing.done else None
    reference = read_reference(task.case, values.kinematics if values else "current")
    if values:
        exact = reference.values
        errors = {name: abs(value / exact[name] - 1) for name, value in values.quantities.items() if exact.get(name)}
        if values.profile is not None and values.side in reference.profile:
            errors["profile"] = profile_error(values.profile, reference.profile[values.side])
    return Line(task, timing, values, errors, reference)


def series_of(lines: Sequence[Line]) -> dict[tuple[str, str], list[Line]]:
    """The lines of one case by code and series, each from coarse to fine, as given."""
    found: dict[tuple[str, str], list[Line]] = {}
    for line in lines:
        found.setdefault((line.task.code, line.task.series), []).append(line)
    return found


def own_limit(code: str, members: Sequence[Line]) -> Limit | None:
    """For a series of CalculiX, its P extrapolated from the four finest meshes, or from three if no more were solved;
    None for others, and where one of the meshes moves it by more than 1e-4.

    CalculiX's contact is a penalty: its P converges to a value that is a little smaller than that of exact contact.
    """
    pairs = [(line.task.size, line.force) for line in members if line.force is not None]
    if code != CALCULIX or len({size for size, _ in pairs}) < 3:
        return None
    limit = extrapolated(*zip(*sorted(pairs)[:4], strict=True))
    return limit if limit.error < _SCATTER * abs(limit.value) else None


def envelopes(lines: Sequence[Line]) -> dict[str, Pairs]:
    """Per code the best of all its series in one case: pairs (seconds, error of P), where an error counts from the mesh
    on from which its series stays below it. "CalculiX, own limit" is CalculiX against its own extrapolated P."""
    found: dict[str, Pairs] = {}
    for (code, _), members in series_of(lines).items():
        judged = {code: [line.errors.get("P") for line in members]}
        if limit := own_limit(code, members):
            judged[f"{code}, own limit"] = [m.force and abs(m.force / limit.value - 1) for m in members]
        for name, errors in judged.items():
            lasted = zip(members, lasting(errors), strict=True)
            found.setdefault(name, []).extend((line.timing.median, e) for line, e in lasted if e is not None)
    return {code: envelope(pairs) for code, pairs in found.items() if pairs}


def lasting(errors: Sequence[float | None]) -> list[float | None]:
    """The errors of a series, coarse to fine, with each as large as any that follows on a finer mesh.

    An error that happens to pass through zero on one mesh proves nothing of the method. Unknown errors stay None.
    """
    return [None if error is None else max(e for e in errors[k:] if e is not None) for k, error in enumerate(errors)]


def envelope(pairs: Iterable[tuple[float, float]]) -> Pairs:
    """Those of the pairs (seconds, error) that no other beats in both, in the order of their seconds."""
    kept: Pairs = []
    for seconds, error in sorted(pairs):
        if not kept or error < kept[-1][1]:
            kept.append((seconds, error))
    return kept


def seconds_at(error: float, kept: Pairs) -> float | None:
    """Seconds to ``error`` along an envelope, straight in log-log; None if it does not get there.

    Nothing is extrapolated: errors above that of the cheapest point cost what it costs.
    """
    if not kept or error < kept[-1][1]:
        return None
    seconds, errors = np.log([max(s, 1e-300) for s, _ in kept]), np.log([max(e, 1e-300) for _, e in kept])
    return float(np.exp(np.interp(np.log(error), errors[::-1], seconds[::-1])))


def warm_curves() -> list[Case]:
    """Curves up to 2 dR, on the meshes that are good for 1e-4 (elastic) and 3e-4 (plastic) in P."""
    elastic, plastic = (
        meshes(0.16, growth=0.5, edge="elastic", degree=3)[0],
        meshes(0.1, growth=0.3, edge="plastic")[0],
    )
    return [
        Case("elastic, 8 steps", replace(CASES["elastic"], steps=8).scene(elastic)),
        Case("elasto-plastic, sigY/E* = 0.2 %, 20 steps", CASES["plastic"].scene(plastic)),
    ]


def warm_seconds(repeats: int, curves: Sequence[Case] = ()) -> dict[str, list[float]]:
    """Seconds of each of the ``curves``, or of `warm_curves`, within this process, ``repeats`` times in turn, after one
    solve of each that is not counted: what calibrations and parameter studies pay.

    Raises RuntimeError if one does not get to its end.
    """
    curves = curves or warm_curves()
    found: dict[str, list[float]] = {case.name: [] for case in curves}
    for repeat in range(repeats + 1):
        for case in curves:
            with tempfile.TemporaryDirectory() as folder:
                start = perf_counter()
                case.solve(Path(folder))
                seconds = perf_counter() - start
            if repeat:
                found[case.name].append(seconds)
    return found
