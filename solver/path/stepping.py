"""Load stepping along a path: output targets are hit exactly, a step that fails is taken back with
all history and cut.

The path is a list of loads, reached on straight lines, up, down and through zero. Steps are
measured in output steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from archord.solver.path.load_path import LoadPath, Position
from archord.solver.path.newton import Newton
from archord.solver.problem import Problem

_SLIVER = 1e-3  # of an output step: a step that would leave less than this goes to the target


@dataclass(frozen=True)
class StepRules:
    """How the length of a step follows Newton's method; lengths are in output steps.

    The first step has the length ``initial``; it grows by ``growth`` after a solve in at most
    ``target_iterations``, is cut by ``cutback`` after one that failed, and stays between
    ``minimum`` and ``maximum``.
    """

    initial: float = 1.0
    minimum: float = 1e-3
    maximum: float = 1.0
    growth: float = 2.0
    cutback: float = 0.5
    target_iterations: int = 15


class StepFailure(RuntimeError):
    """No equilibrium even with the smallest step in the output step ``attempt``; the last accepted
    state remains."""

    def __init__(self, message: str, attempt: Step) -> None:
        super().__init__(message)
        self.attempt = attempt


@dataclass
class Step:
    """What happened on the way to an output target: Newton iterations (failed attempts included),
    cutbacks, substeps.

    ``attempts`` are the solves, the failed ones with their diagnostics; ``coarse_iterations`` those
    on coarser meshes.
    """

    load: float
    iterations: int = 0
    coarse_iterations: int = 0
    cutbacks: int = 0
    substeps: int = 0
    attempts: list[Newton] = field(default_factory=list)

    @property
    def residual(self) -> float:
        """Residual over reaction of the last solve."""
        residuals = self.attempts[-1].residuals if self.attempts else []
        return residuals[-1] if residuals else 0.0

    def note(self, result: Newton, coarse_iterations: int) -> None:
        """Note an attempt."""
        self.attempts.append(result)
        self.iterations += result.iterations
        self.coarse_iterations += coarse_iterations
        self.substeps += result.converged
        self.cutbacks += not result.converged


def march(
    path: LoadPath,
    targets: Sequence[float],
    *,
    rules: StepRules | None = None,
    substep_done: Callable[[float], None] = lambda load: None,
    target_done: Callable[[Step, Position], None] = lambda step, position: None,
    attempted: Callable[[float, int], None] = lambda load, iterations: None,
) -> None:
    """Follow ``path`` to the loads ``targets`` in turn and, where a step fails or ``rules`` say so,
    to loads between.

    ``substep_done(load)`` follows every accepted step, ``target_done(step, position)`` every output
    target, ``attempted(load, iterations)`` every solve. Raises `StepFailure`.
    """
    at = path.at
    rules = rules or StepRules()
    size = at.size or rules.initial
    for number in range(at.targets_done, len(targets)):
        begun = at.load
        target = targets[number]
        passed = 0.0  # part of the output step
        just_cut = False
        record = Step(target)
        nearest = begun + rules.minimum * (target - begun)
        unheld = path.unheld(nearest, tied=True)
        if unheld:
            result = Newton(False, "", 0, [], floating=unheld)
            raise StepFailure(_why(result, path.equilibrium.problem, target, begun, size), record)
        while passed < 1:
            end = passed + size if passed + size <= 1 - _SLIVER else 1.0
            load = target if end == 1 else begun + end * (target - begun)
            result = path.attempt(load)
            record.note(result, path.coarse_iterations)
            attempted(load, result.iterations)
            if not result.converged:
                path.take_back()
                nearest = at.load + rules.minimum * (target - begun)
                unheld = path.unheld(nearest)
                if size <= rules.minimum or unheld:
                    result.floating = unheld or result.floating
                    problem = path.equilibrium.problem
                    raise StepFailure(_why(result, problem, load, at.load, size), record)
                size = max(rules.minimum, rules.cutback * size)
                just_cut = True
                continue
            if result.iterations <= rules.target_iterations and not just_cut:
                size = min(rules.maximum, rules.growth * size)
            just_cut = False
            passed = end
            at.size = size
            path.accept(load)
            substep_done(load)
        at.targets_done = number + 1
        target_done(record, at)


def _why(result: Newton, problem: Problem, load: float, held: float, size: float) -> str:
    """Why the step to ``load`` failed, in one sentence."""
    name = problem.load_name
    cut = "no smaller step helps" if result.floating else "no smaller step is allowed"
    if size < 1:
        cut = f"the step was cut to {size:.2g} of an output step"
    last_held = f"{cut}; the last load that held is {name} = {held:.6g}"
    if result.floating:
        return (
            f"nothing holds what the loads move at {name} = {load:.6g}: no contact carries "
            f"{result.floating!r}; hold it by a support, or let more of the loads press it against "
            f"others; {last_held}"
        )
    last = "none"
    if result.residuals and np.isfinite(result.residuals[-1]):
        last = f"{result.residuals[-1]:.1e}"
    where = ""
    if result.worst is not None:
        place = ", ".join(f"{x:.4g}" for x in result.worst)
        where = f", the largest residual at ({place})"
    limit = ""
    if problem.by_force and result.plastic_increment:
        limit = "; if the bodies yield as a whole, the limit load is close"
    return (
        f"no equilibrium at {name} = {load:.6g}: {result.reason}; "
        f"after {result.iterations} iterations the residual over reaction was {last}{where}; "
        f"{last_held}{limit}"
    )
