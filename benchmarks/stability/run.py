"""The stability benchmark: cases solved within their budgets, side by side, a verdict on every one,
and the table."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import h5py
import numpy as np
from mpi4py import MPI

from archord.benchmarks.case import Case, Expected, matches, side_by_side
from archord.benchmarks.stability.cases import FILE, FINE, Values, cases
from archord.benchmarks.stability.picture import draw
from archord.benchmarks.timing import Said
from archord.output.files.step_file import all_arrays
from archord.output.history import read_history
from archord.presets.views import view_of
from archord.report.by_name import Amounts, Words
from archord.report.errors import InputError
from archord.report.files import read_json, write_report
from archord.report.table import Table
from archord.scene.file import AnyScene
from archord.solver.path.stepping import Step, StepFailure

_BALANCE = 1e-8  # largest difference of forces over P, unless round-off is known to be larger
_COMPARED = ("quantity", "value", "expected", "by", "deviation")
_SPREAD = 10.0  # a sum of forces may be off by so many times the norm of their residual


@dataclass(frozen=True)
class Check:
    """An ``error`` that must not be larger than ``allowed``; ``fault`` says so where it is.

    ``entries`` tell what was compared, by the table's headings.
    """

    error: float
    allowed: float
    fault: str
    entries: Words = field(default_factory=dict)

    @property
    def share(self) -> float:
        """The error over what is allowed; infinite for a nan."""
        if self.allowed and self.error < math.inf:
            return self.error / self.allowed
        return 0.0 if self.error <= self.allowed else math.inf


@dataclass
class Result:
    """How a case went. ``status`` is "done", "stopped" (exit code 3) or "failed" (an error).

    ``quantities`` are of the last step. ``forces`` checks the balance of forces over P,
    ``energy`` the balance of energies over the work; None where nothing was solved.
    """

    status: str = ""
    message: str = ""
    seconds: float = 0.0
    steps: int = 0
    iterations: int = 0
    cutbacks: int = 0
    forces: Check | None = None
    energy: Check | None = None
    quantities: Amounts = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    not_finite: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Line:
    """A line of the table: a case, its result, the comparison that takes the largest share of its
    tolerance, if there is any, and what is wrong."""

    case: Case
    result: Result
    worst: Check | None
    faults: list[str]

    @property
    def verdict(self) -> str:
        """How it ended, or the faults."""
        return "; ".join(self.faults) or ("stops, as it must" if self.case.stops else "converges")


def chosen(pattern: str | None) -> list[str]:
    """Names of the cases whose name or group `matches` the ``pattern``; all without one.

    Raises `InputError` if there is none.
    """
    table = cases()
    names = [name for name, case in table.items() if matches(pattern or "", name, case.group)]
    if not names:
        groups = ", ".join(dict.fromkeys(case.group for case in table.values()))
        raise InputError(
            f"--only {pattern}: no case has such a name or group; groups are {groups}."
        )
    return names


def with_references(names: list[str]) -> list[str]:
    """``names`` and the cases they are compared with, in the order of the table."""
    table = cases()
    wanted = set[str]()
    more = set(names)
    while more:
        wanted |= more
        named = {str(e.value) for name in more for e in table[name].expected}
        more = (named & table.keys()) - wanted
    return [name for name in table if name in wanted]


def run(names: list[str], folder: Path, comm: MPI.Comm, said: Said) -> list[Line]:
    """Solve the cases ``names`` and those they are compared with below ``folder``, each on one
    rank; judge ``names``.

    ``said(sentence)`` follows each on the rank that solved it. The lines are the same on all ranks.
    Collective.
    """
    table = cases()
    order = with_references(names)
    fine = read_json(FILE)

    def solved(name: str) -> Result:
        r = solve_case(table[name], folder)
        cost = (
            f"{r.steps} steps, {r.iterations} iterations, {r.cutbacks} cutbacks, {r.seconds:.1f} s"
        )
        said(f"{table[name].group}: {name}: {r.status}, {cost}")
        return r

    results = dict(zip(order, side_by_side(comm, order, solved), strict=True))
    return [judge(table[name], results, fine) for name in names]


def solve_case(case: Case, folder: Path) -> Result:
    """Solve ``case`` into its run folder below ``folder`` on this rank; errors become part of the
    result.

    Raises KeyboardInterrupt if a signal interrupted the run.
    """
    result = Result()
    begun = perf_counter()
    scene = case.scene

    def attempted(load: float, iterations: int) -> None:
        result.iterations += iterations
        if result.iterations > case.budget:
            raise StepFailure(f"more than the {case.budget} Newton iterations allowed", Step(load))

    try:
        outcome = case.attempt(folder, on_attempt=attempted)
        result.status = outcome.status
        result.message = outcome.message
        report = read_json(outcome.folder / "run.json")
        result.not_finite = not_finite(outcome.folder)
        result.warnings = report["warnings"]
        result.steps = len(outcome.steps)
        result.cutbacks = report["totals"]["cutbacks"]
        result.cutbacks += report.get("failed_step", {}).get("cutbacks", 0)
        if outcome.steps:
            estimates = report["error_estimates"]
            balance = estimates["force_balance"]
            energy = estimates["energy_balance"] or 0.0
            allowed = max(_BALANCE, _SPREAD * estimates["newton_residual"])
            result.forces = Check(balance, allowed, f"forces differ by {balance:.1e} of P")
            limit = 1.001 * _energy_limit(scene, outcome.steps) + 1e-8
            result.energy = Check(energy, limit, f"energy is off by {energy:.1e} of the work")
            result.quantities = view_of(scene).quantities(outcome.steps[-1])
    except Exception as error:
        result.status = "failed"
        result.message = f"{type(error).__name__}: {error}"
    result.seconds = perf_counter() - begun
    return result


def _energy_limit(scene: AnyScene, steps: list[Any]) -> float:
    """How far the trapezoidal rule can be from the work, over the work, where loads are monotonic
    between two steps: half the sum of |dP d delta|. That of interferences counts from their first
    step on; a single step tells nothing."""
    columns = view_of(scene).work_columns
    path = np.array([[(m[force], m[moved]) for force, moved in columns] for m in steps])
    if scene.fits and len(steps) == 1:
        return math.inf
    largest = max((abs(m.work) for m in steps if m.contact_area), default=0.0)
    if not largest:
        return 0.0
    if not scene.fits:
        path = np.concatenate([np.zeros_like(path[:1]), path])
    rectangles = np.prod(np.diff(path, axis=0), axis=2)
    return float(np.abs(rectangles).sum() / 2 / largest)


def not_finite(folder: Path) -> list[str]:
    """The places in a run's files that hold a nan or an infinity."""
    constants: list[str] = []
    if (folder / "run.json").exists():
        json.loads((folder / "run.json").read_bytes(), parse_constant=constants.append)
    found = [f"run.json: {name}" for name in sorted(set(constants))]
    history = read_history(folder / "history.csv")
    found += [
        f"history.csv: {name}"
        for name, column in history.items()
        if not np.all(np.isfinite(column))
    ]
    for path in (folder / "fields.h5", folder / "contact.h5"):
        if path.exists():
            with h5py.File(path) as file:
                found += [
                    f"{path.name}: {name}"
                    for name, values in all_arrays(file)
                    if not np.isfinite(values).all()
                ]
    return found


def judge(case: Case, results: dict[str, Result], fine: Values) -> Line:
    """Hold the result of ``case`` against its checks, the other ``results`` and the ``fine``-mesh
    values."""
    result = results[case.name]
    faults = []
    ended = result.status == ("stopped" if case.stops else "done")
    if not ended:
        how = "went on" if result.status == "done" else result.status
        faults.append(f"{how}: {result.message}".rstrip(": "))
    elif case.stops not in result.message:
        faults.append(f"stopped, but said {result.message}")
    if case.warns and not any(case.warns in warning for warning in result.warnings):
        faults.append(f'does not warn "{case.warns}"')
    if result.not_finite:
        faults.append(f"not finite: {', '.join(result.not_finite)}")
    comparisons = [_compare(case, expected, results, fine) for expected in case.expected if ended]
    checks = (result.forces, result.energy, *comparisons)
    faults += [check.fault for check in checks if check and check.share > 1]
    worst = max(comparisons, key=lambda check: check.share, default=None)
    return Line(case, result, worst, faults)


def _compare(case: Case, expected: Expected, results: dict[str, Result], fine: Values) -> Check:
    """The relative error, absolute where the reference is 0."""
    value = results[case.name].quantities.get(expected.quantity, math.nan)
    reference = expected.value
    if isinstance(reference, str):
        values = fine.get(case.name, {}) if reference == FINE else results[reference].quantities
        reference = expected.factor * values.get(expected.quantity, math.nan)
    deviation = abs(value / reference - 1) if reference else abs(value)
    fault = f"{expected.quantity} is {value:.6g}, not {reference:.6g} ({expected.source})"
    numbers = f"{value:.8g}", f"{reference:.8g}", expected.source, f"{deviation:.1e}"
    entries = dict(zip(_COMPARED, (expected.quantity, *numbers), strict=True))
    return Check(deviation, expected.tolerance, fault, entries)


def row(line: Line) -> dict[str, object]:
    """The entries of a line by heading; what is not there is empty."""
    case = line.case
    result = line.result
    energy = result.energy if result.energy and result.energy.allowed < math.inf else None
    return {
        "group": case.group,
        "case": case.name,
        "status": result.status,
        "steps": result.steps,
        "iterations": result.iterations,
        "cutbacks": result.cutbacks,
        "force balance": f"{result.forces.error:.0e}" if result.forces else "",
        "energy error": f"{energy.error:.0e}" if energy else "",
        **(line.worst.entries if line.worst else dict.fromkeys(_COMPARED, "")),
        "seconds": f"{result.seconds:.1f}",
        "verdict": line.verdict,
    }


def write(lines: list[Line], folder: Path) -> tuple[str, list[Path]]:
    """Write stability.csv, stability.md and a map of the cases, stability.png, into ``folder``.

    The Markdown tells how many cases are as they should be, has the table and the sentences of the
    runs that stopped. Returns it and the files.
    """
    rows = [row(line) for line in lines]
    converged = sum(line.result.status == "done" for line in lines)
    solvable = sum(not line.case.stops for line in lines)
    faulty = sum(bool(line.faults) for line in lines)
    seconds = sum(line.result.seconds for line in lines)
    text = (
        f"{len(lines)} scenes in {seconds:.0f} s: {converged} converged of the {solvable} that "
        f"have a solution, {len(lines) - solvable} must stop with a sentence; {faulty} not as they "
        f"should be.\n\n{Table.of(rows).markdown()}"
    )
    stopped = [line for line in lines if line.result.message]
    if stopped:
        said = "".join(f"- {line.case.name}: {line.result.message}.\n" for line in stopped)
        text += f"\nWhat the runs that stopped said:\n\n{said}"
    return text, write_report(folder, "stability", rows, text, partial(draw, rows))
