"""The stability benchmark: many scenes, one line each, and a verdict on every line."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

from mpi4py import MPI

from archord.benchmarks.stability.cases import FINE, Case, Expected, cases
from archord.benchmarks.stability.fine import read_fine
from archord.benchmarks.stability.run import Result, solve_case
from archord.scene.errors import InputError

GOOD = ("converges", "stops, as it must")


@dataclass(frozen=True)
class Comparison:
    """A quantity of a result beside what was expected; ``deviation`` is relative, absolute where zero is expected."""

    expected: Expected
    value: float
    reference: float

    @property
    def deviation(self) -> float:
        """How far off the value is."""
        return abs(self.value / self.reference - 1) if self.reference else abs(self.value)

    @property
    def holds(self) -> bool:
        """Whether that is within the tolerance; a nan is not."""
        return self.deviation <= self.expected.tolerance

    @property
    def share(self) -> float:
        """The deviation over the tolerance; infinite for a nan."""
        if self.holds:
            return self.deviation / self.expected.tolerance if self.expected.tolerance else 0.0
        share = self.deviation / (self.expected.tolerance or math.nan)
        return math.inf if math.isnan(share) else share


@dataclass(frozen=True)
class Line:
    """A line of the table: a case, its result, what it was compared with, and what is wrong with it, if anything."""

    case: Case
    result: Result
    comparisons: list[Comparison]
    faults: list[str]

    @property
    def verdict(self) -> str:
        """How it ended, or the faults."""
        return "; ".join(self.faults) or GOOD[bool(self.case.stops)]

    @property
    def iterations_per_step(self) -> float:
        """Newton iterations, failed attempts included, over accepted output steps."""
        return self.result.iterations / max(1, self.result.steps)


def chosen(pattern: str | None) -> list[str]:
    """Names of the cases whose name or group is ``pattern`` (with * and ?), or contains it; all without one.

    Raises `InputError` if there is none.
    """
    table = cases()
    names = [
        c.name
        for c in table.values()
        if pattern is None
        or any(pattern.lower() in text.lower() or fnmatch(text.lower(), pattern.lower()) for text in (c.name, c.group))
    ]
    if not names:
        groups = ", ".join(dict.fromkeys(c.group for c in table.values()))
        raise InputError(f"--only {pattern}: no case has such a name or group; groups are {groups}.")
    return names


def with_references(names: list[str]) -> list[str]:
    """``names`` and the cases they are compared with, in the order of the table."""
    table, wanted = cases(), set(names)
    while more := {str(e.value) for n in wanted for e in table[n].expected if e.value in table} - wanted:
        wanted |= more
    return [name for name in table if name in wanted]


def run(
    names: list[str], folder: Path, comm: MPI.Comm, said: Callable[[Case, Result], None] = lambda case, result: None
) -> list[Line]:
    """Solve the cases ``names`` and those they are compared with below ``folder``, each on one rank; judge ``names``.

    ``said(case, result)`` follows each on the rank that solved it. The lines are the same on all ranks. Collective.
    """
    table, order = cases(), with_references(names)
    mine = {}
    for name in order[comm.rank :: comm.size]:
        mine[name] = solve_case(table[name], folder)
        said(table[name], mine[name])
    results = {name: result for part in comm.allgather(mine) for name, result in part.items()}
    return [judge(table[name], results, read_fine()) for name in names]


def judge(case: Case, results: dict[str, Result], fine: dict[str, dict[str, float]]) -> Line:
    """Hold the result of ``case`` against its checks, the other ``results`` and the ``fine``-mesh values."""
    result, faults = results[case.name], []
    if result.status != ("stopped" if case.stops else "done"):
        faults.append(f"{'went on' if result.status == 'done' else result.status}: {result.message}".rstrip(": "))
    elif case.stops not in result.message:
        faults.append(f"stopped, but said {result.message}")
    if case.warns and not any(case.warns in warning for warning in result.warnings):
        faults.append(f'does not warn "{case.warns}"')
    if result.not_finite:
        faults.append(f"not finite: {', '.join(result.not_finite)}")
    if not result.balance <= result.balance_limit:
        faults.append(f"forces differ by {result.balance:.1e} of P")
    if not result.energy <= 1.001 * result.energy_limit + 1e-8:
        faults.append(f"energy is off by {result.energy:.1e} of the work")
    comparisons = []
    if result.status != "failed" and (result.status == "stopped") == bool(case.stops):
        for expected in case.expected:
            reference = _reference(case, expected, results, fine)
            value = result.quantities.get(expected.quantity, math.nan)
            comparisons.append(Comparison(expected, value, reference))
        faults += [
            f"{c.expected.quantity} is {c.value:.6g}, not {c.reference:.6g} ({c.expected.source})"
            for c in comparisons
            if not c.holds
        ]
    return Line(case, result, comparisons, faults)


def _reference(case: Case, expected: Expected, results: dict[str, Result], fine: dict[str, dict[str, float]]) -> float:
    if isinstance(expected.value, float):
        return expected.value
    values = fine.get(case.name, {}) if expected.value == FINE else results[expected.value].quantities
    return expected.factor * values.get(expected.quantity, math.nan)
