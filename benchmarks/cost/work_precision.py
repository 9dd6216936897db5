"""The work-precision benchmark: error against wall time and dofs, archord's beside other codes' in one session."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from archord.benchmarks.cost.envelope import Pairs, envelope, lasting
from archord.benchmarks.cost.pressure_profile import profile_error
from archord.benchmarks.cost.work_precision_cases import Case, matches
from archord.benchmarks.cost.work_precision_codes import CALCULIX, archord_tasks, calculix_tasks, peer_tasks
from archord.benchmarks.cost.work_precision_reference import Reference, read_reference
from archord.benchmarks.cost.work_precision_run import LIMIT, Point, Task, run_all
from archord.postprocess.convergence import Limit, extrapolated
from archord.scene.errors import InputError

OWN_LIMIT = "own limit"
_SCATTER = 1e-4


@dataclass(frozen=True)
class Line:
    """A point and its relative errors by quantity, against the reference of its kinematics."""

    point: Point
    errors: dict[str, float]
    reference: Reference

    @property
    def task(self) -> Task:
        """What was run."""
        return self.point.task


def tasks(case: Case, folder: Path, *, quick: bool = False, peers: bool = True, limit: float = LIMIT) -> list[Task]:
    """All points of ``case``; what they need is written below ``folder``."""
    found = list(archord_tasks(case, folder, limit, quick))
    if peers:
        found += [*calculix_tasks(case, folder, limit, quick), *peer_tasks(case, folder, limit, quick)]
    return found


def chosen(found: list[Task], patterns: Sequence[str]) -> list[Task]:
    """Those whose code, series or "code, series, mesh" is one of ``patterns`` (with * and ?), or contains it; all
    without any.

    Raises `InputError` for a pattern that fits none.
    """
    names = {t.folder: (t.code, t.series, f"{t.code}, {t.series}, {t.label}") for t in found}
    for pattern in patterns:
        if not any(matches(pattern, *names[t.folder]) for t in found):
            known = ", ".join(dict.fromkeys(name for t in found for name in (t.code, t.series)))
            raise InputError(f"--only {pattern}: no code or series has such a name; there are {known}.")
    return [t for t in found if not patterns or any(matches(p, *names[t.folder]) for p in patterns)]


def run(
    found: list[Task], repeats: int, said: Callable[[Task, int, str], None] = lambda task, repeat, sentence: None
) -> list[Line]:
    """Time the tasks and judge what they found."""
    return [judge(point) for point in run_all(found, repeats, said)]


def judge(point: Point) -> Line:
    """The errors of a point; none if it failed."""
    values = point.values
    reference = read_reference(point.task.case, values.kinematics if values else "current")
    errors: dict[str, float] = {}
    if point.done and values is not None:
        for name, value in values.quantities.items():
            error = reference.error(name, value)
            if error is not None:
                errors[name] = error
        if values.profile is not None and values.side in reference.profile:
            errors["profile"] = profile_error(values.profile, reference.profile[values.side])
    return Line(point, errors, reference)


def series_of(lines: list[Line], case: str) -> dict[tuple[str, str], list[Line]]:
    """The lines of ``case`` by code and series, each from coarse to fine, as given."""
    found: dict[tuple[str, str], list[Line]] = {}
    for line in lines:
        if line.task.case == case:
            found.setdefault((line.task.code, line.task.series), []).append(line)
    return found


def own_limit(lines: list[Line], case: str, code: str = CALCULIX) -> dict[str, Limit]:
    """Per series of ``code``, its P extrapolated from the four finest meshes, or from three if no more were solved;
    absent where one of them moves it by more than 1e-4.

    CalculiX's contact is a penalty: its P converges to a value that is a little smaller than that of exact contact.
    """
    found = {}
    for (name, series), members in series_of(lines, case).items():
        pairs = [(line.task.size, line.point.values.quantities["P"]) for line in members if _has_force(line)]
        if name == code and len({size for size, _ in pairs}) >= 3:
            sizes, values = zip(*sorted(pairs)[:4], strict=True)
            limit = extrapolated(sizes, values)
            if limit.error < _SCATTER * abs(limit.value):
                found[series] = limit
    return found


def envelopes(lines: list[Line], case: str, quantity: str = "P") -> dict[str, Pairs]:
    """Per code the best of all its series: pairs (seconds, error), where an error counts from the mesh on from which
    its series stays below it. "CalculiX, own limit" is CalculiX against its own extrapolated P."""
    found: dict[str, Pairs] = {}
    limits = own_limit(lines, case) if quantity == "P" else {}
    for (code, series), members in series_of(lines, case).items():
        found[code] = found.get(code, []) + _pairs(members, [line.errors.get(quantity) for line in members])
        if code == CALCULIX and series in limits:
            name, value = f"{CALCULIX}, {OWN_LIMIT}", limits[series].value
            forces = [line.point.values.quantities["P"] if _has_force(line) else None for line in members]
            errors = [None if force is None else abs(force / value - 1) for force in forces]
            found[name] = found.get(name, []) + _pairs(members, errors)
    return {code: envelope(pairs) for code, pairs in found.items() if pairs}


def _pairs(members: list[Line], errors: list[float | None]) -> Pairs:
    lasted = lasting(errors)
    return [(line.point.median, e) for line, e in zip(members, lasted, strict=True) if e is not None]


def _has_force(line: Line) -> bool:
    return line.point.done and line.point.values is not None and "P" in line.point.values.quantities
