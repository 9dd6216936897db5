"""The stability benchmark: cases solved within their budgets, side by side, and a verdict on every one."""

from __future__ import annotations

import json
import math
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

import h5py
import numpy as np
from mpi4py import MPI

from archord.benchmarks.case import Case, Expected, matches, quantities, side_by_side
from archord.benchmarks.stability.cases import FINE, cases
from archord.benchmarks.stability.fine import read_fine
from archord.output.folder import claim_folder
from archord.output.history import read_history
from archord.output.run import Outcome
from archord.output.step_file import all_arrays
from archord.presets.measures import Measures
from archord.scene.errors import InputError
from archord.scene.scene import Scene
from archord.solver.stepping import Step, StepFailure

GOOD = ("converges", "stops, as it must")
_BALANCE = 1e-8  # largest difference of forces over P, unless round-off is known to be larger
_SPREAD = 10.0  # a sum of forces may be off by so many times the norm of their residual


@dataclass
class Result:
    """How a case went. ``status`` is "done", "stopped" (exit code 3) or "failed" (an error, or out of time).

    ``quantities`` are those of the last step, or of the last force that held; ``balance_limit`` and ``energy_limit``
    are what ``balance`` and ``energy`` (errors over P and over the work) may be.
    """

    status: str = ""
    message: str = ""
    seconds: float = 0.0
    steps: int = 0
    iterations: int = 0
    cutbacks: int = 0
    dofs: int = 0
    balance: float = 0.0
    balance_limit: float = _BALANCE
    energy: float = 0.0
    energy_limit: float = 0.0
    quantities: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    not_finite: list[str] = field(default_factory=list)


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
        if self.holds and not self.expected.tolerance:
            return 0.0
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

    @property
    def worst(self) -> Comparison | None:
        """The comparison that takes the largest share of its tolerance, if there is any."""
        return max(self.comparisons, key=lambda c: c.share) if self.comparisons else None


def chosen(pattern: str | None) -> list[str]:
    """Names of the cases whose name or group `matches` the ``pattern``; all without one.

    Raises `InputError` if there is none.
    """
    table = cases()
    names = [name for name, case in table.items() if matches(pattern or "", name, case.group)]
    if not names:
        groups = ", ".join(dict.fromkeys(case.group for case in table.values()))
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
    table, order, fine = cases(), with_references(names), read_fine()

    def solved(name: str) -> Result:
        result = solve_case(table[name], folder)
        said(table[name], result)
        return result

    results = dict(zip(order, side_by_side(comm, order, solved), strict=True))
    return [judge(table[name], results, fine) for name in names]


def solve_case(case: Case, folder: Path) -> Result:
    """Solve ``case`` into its run folder below ``folder`` on this rank; errors become part of the result.

    Raises KeyboardInterrupt if a signal interrupted the run, `InputError` if the folder cannot be written.
    """
    claim_folder(case.folder(folder), force=True)
    result, begun = Result(), perf_counter()
    outcome: Outcome | None = None

    def started(joint) -> None:
        result.dofs = joint.n_dofs

    def attempted(load: float, iterations: int) -> None:
        result.iterations += iterations
        if result.iterations > case.budget:
            raise StepFailure(f"more than the {case.budget} Newton iterations allowed", Step(load))

    try:
        with _time_limit(case.seconds):
            outcome = case.attempt(folder, on_start=started, on_attempt=attempted)
        result.status, result.message = outcome.status, outcome.message
    except Exception as error:
        result.status, result.message = "failed", f"{type(error).__name__}: {error}"
        if perf_counter() - begun >= case.seconds:
            result.message = f"more than the {case.seconds:g} s allowed"
    result.seconds = perf_counter() - begun
    if outcome is not None:
        _look(result, case.scene, outcome)
    return result


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raises TimeoutError in what runs within, after so many ``seconds``."""

    def out_of_time(number, frame) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, out_of_time)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _look(result: Result, scene: Scene, outcome: Outcome) -> None:
    """Fill in what the run's files and steps tell."""
    report = json.loads((outcome.folder / "run.json").read_text(encoding="utf-8"))
    result.not_finite = not_finite(outcome.folder)
    result.warnings = report["warnings"]
    result.steps = len(outcome.steps)
    result.cutbacks = sum(m.cutbacks for m in outcome.steps) + report.get("failed_step", {}).get("cutbacks", 0)
    if outcome.steps:
        result.balance = float(report["error_estimates"]["force_balance"])
        result.balance_limit = max(_BALANCE, _SPREAD * report["error_estimates"]["newton_residual"])
        result.energy = report["error_estimates"]["energy_balance"] or 0.0
        result.energy_limit = _energy_limit(scene, outcome.steps)
        result.quantities = quantities(scene, outcome.steps[-1])
    held = re.search(r"last load that held is P = (\S+?)(;|$)", outcome.message)
    if held:
        result.quantities["P/(E* R)"] = float(held[1]) / (scene.E_star * scene.joint.radius)


def _energy_limit(scene: Scene, steps: list[Measures]) -> float:
    """How far the trapezoidal rule can be from the work, over the work, where P is monotonic between two steps: half
    the sum of |dP d delta|. That of an interference fit counts from its first step on; a single step tells nothing."""
    press_fit = scene.joint.dR < 0
    if press_fit and len(steps) == 1:
        return math.inf
    begin = [] if press_fit else [0.0]
    P, delta = np.array(begin + [m.P for m in steps]), np.array(begin + [m.delta for m in steps])
    largest = max((abs(m.work) for m in steps if m.contact_area), default=0.0)
    return float(np.abs(np.diff(P) * np.diff(delta)).sum() / 2 / largest) if largest else 0.0


def not_finite(folder: Path) -> list[str]:
    """The places in a run's files that hold a nan or an infinity."""
    found = []
    if (folder / "run.json").exists():
        constants: list[str] = []
        json.loads((folder / "run.json").read_text(encoding="utf-8"), parse_constant=constants.append)
        found += [f"run.json: {name}" for name in sorted(set(constants))]
    if (folder / "history.csv").exists():
        history = read_history(folder / "history.csv")
        found += [f"history.csv: {name}" for name, column in history.items() if not np.all(np.isfinite(column))]
    for path in (folder / "fields.h5", folder / "contact.h5"):
        if path.exists():
            with h5py.File(path) as file:
                found += [f"{path.name}: {name}" for name, values in all_arrays(file) if not np.isfinite(values).all()]
    return found


def judge(case: Case, results: dict[str, Result], fine: dict[str, dict[str, float]]) -> Line:
    """Hold the result of ``case`` against its checks, the other ``results`` and the ``fine``-mesh values."""
    result, faults, comparisons = results[case.name], [], []
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
    if result.status == ("stopped" if case.stops else "done"):
        for expected in case.expected:
            value = result.quantities.get(expected.quantity, math.nan)
            comparisons.append(Comparison(expected, value, _reference(case, expected, results, fine)))
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
