"""One case of the stability benchmark, solved within its budget, and what came of it."""

from __future__ import annotations

import json
import math
import re
import signal
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

import h5py
import numpy as np
from mpi4py import MPI

from archord.benchmarks.stability.cases import Case
from archord.output.folder import claim_folder
from archord.output.history import read_history
from archord.output.measures import Measures
from archord.output.run import Outcome, solve_scene
from archord.output.step_file import all_arrays
from archord.scene.scene import Scene
from archord.solver.stepping import Step, StepFailure

_BALANCE = 1e-8  # largest difference of forces over P, unless round-off is known to be larger
_SPREAD = 10.0  # a sum of forces may be off by so many times the norm of their residual


@dataclass
class Result:
    """How a case went. ``status`` is "done", "stopped" (exit code 3) or "failed" (an error, or out of time).

    ``quantities`` are those of the last step, or of the last force that held; ``balance_limit`` and ``energy_limit``
    are what ``balance`` and ``energy`` (errors over P and over the work) may be.
    """

    name: str
    status: str
    message: str
    seconds: float
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


def solve_case(case: Case, folder: Path) -> Result:
    """Solve ``case`` into its run folder below ``folder`` on this rank; errors become part of the result.

    Raises KeyboardInterrupt if a signal interrupted the run.
    """
    run, begun, spent, dofs = folder / slug(case.name), perf_counter(), 0, 0
    claim_folder(run, force=True)

    def started(joint) -> None:
        nonlocal dofs
        dofs = joint.n_dofs

    def attempted(load: float, iterations: int) -> None:
        nonlocal spent
        spent += iterations
        if spent > case.budget:
            raise StepFailure(f"more than the {case.budget} Newton iterations allowed", Step(load))

    def out_of_time(number, frame) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, out_of_time)
    signal.setitimer(signal.ITIMER_REAL, case.seconds)
    outcome: Outcome | None = None
    try:
        outcome = solve_scene(case.scene, run, MPI.COMM_SELF, on_start=started, on_attempt=attempted)
        status, message = outcome.status, outcome.message
    except Exception as error:
        status, message = "failed", f"{type(error).__name__}: {error}"
        if perf_counter() - begun >= case.seconds:
            message = f"more than the {case.seconds:g} s allowed"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    if status == "interrupted":
        raise KeyboardInterrupt
    result = Result(case.name, status, message, perf_counter() - begun, iterations=spent, dofs=dofs)
    if outcome is not None:
        _look(result, case.scene, outcome)
    return result


def slug(name: str) -> str:
    """A folder's name for a case."""
    return re.sub(r"[^\w.+-]+", "_", name.replace("<", "below").replace("%", "pc")).strip("_")


def quantities(scene: Scene, m: Measures) -> dict[str, float]:
    """What cases are compared by, without units."""
    E, R = scene.E_star, scene.joint.radius
    return {
        "P/(E* R)": m.P / (E * R),
        "p0/E*": m.p0 / E,
        "eps": m.eps,
        "delta/dR": m.delta / scene.joint.dR,
        "p0/P": m.p0 * R / m.P if m.P else 0.0,
    }


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
    the sum of |dP d delta|. That of an interference fit counts from its first step on, alone it knows none."""
    press_fit = scene.joint.dR < 0
    if press_fit and len(steps) == 1:
        return math.inf
    begin = [] if press_fit else [0.0]
    P, delta = np.array(begin + [m.P for m in steps]), np.array(begin + [m.delta for m in steps])
    largest = max((abs(m.work) for m in steps if m.contact_area), default=0.0)
    return float(np.abs(np.diff(P) * np.diff(delta)).sum() / 2 / largest) if largest else 0.0


def not_finite(folder: Path) -> list[str]:
    """The files of a run that hold a nan or an infinity, with the place."""
    found = []

    def constant(name: str) -> float:
        raise ValueError(name)

    try:
        json.loads((folder / "run.json").read_text(encoding="utf-8"), parse_constant=constant)
    except ValueError as error:
        found.append(f"run.json: {error}")
    history = read_history(folder / "history.csv")
    found += [f"history.csv: {name}" for name, column in history.items() if not np.all(np.isfinite(column))]

    for path in (folder / "fields.h5", folder / "contact.h5"):
        if path.exists():
            with h5py.File(path) as file:
                found += [f"{path.name}: {name}" for name, values in all_arrays(file) if not np.isfinite(values).all()]
    return found
