"""Load stepping along a path: output targets are hit exactly, a step that fails is taken back with all history and cut.

The path is a list of loads, reached one after the other on straight lines: displacements of the pin or forces on it,
up, down and through zero. Lengths of steps are in output steps, whatever the load between two targets.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from archord.geometry.basis import Array
from archord.solver.newton import Newton, NewtonSolver
from archord.solver.scene import Stepping

_PREDICTOR_LIMIT = 4.0  # an increment is not extrapolated to more than this many times its length
_SLIVER = 1e-3  # of an output step: a step that would leave less than this goes to the target


class StepFailure(RuntimeError):
    """Equilibrium was not found even with the smallest allowed step; the last accepted state stands.

    ``attempt`` is the output step that failed.
    """

    def __init__(self, message: str, attempt: Step) -> None:
        super().__init__(message)
        self.attempt = attempt


@dataclass
class Step:
    """What happened on the way to an output target: Newton iterations (failed attempts included), cutbacks, substeps.

    ``attempts`` are the solves, the failed ones with their diagnostics.
    """

    load: float
    iterations: int = 0
    cutbacks: int = 0
    substeps: int = 0
    attempts: list[Newton] = field(default_factory=list)

    @property
    def residual(self) -> float:
        """Residual over reaction of the last solve."""
        return self.attempts[-1].residuals[-1] if self.attempts and self.attempts[-1].residuals else 0.0


class StepSize:
    """The length of the next step, in output steps, adapted to how Newton's method fares."""

    def __init__(self, rules: Stepping) -> None:
        self.rules = rules
        self.length = rules.initial
        self._just_cut = False

    def accepted(self, iterations: int) -> None:
        """Grow after a solve that was easy enough; the first one after a cut is not."""
        if iterations <= self.rules.target_iterations and not self._just_cut:
            self.length = min(self.rules.maximum, self.rules.growth * self.length)
        self._just_cut = False

    def failed(self) -> bool:
        """Cut the step; False if it is the smallest already."""
        smallest = self.length <= self.rules.minimum
        self._just_cut = True
        self.length = max(self.rules.minimum, self.rules.cutback * self.length)
        return not smallest

    def within(self, passed: float) -> float:
        """End of the next step in an output step of which the part ``passed`` is done; 1 is its target."""
        end = passed + self.length
        return 1.0 if end > 1 - _SLIVER else end


@dataclass
class Position:
    """Where a march stands between two steps: what it needs besides the state of the joint to go on as if never halted.

    ``targets_done`` output targets were reached, the last step being of length ``stride`` in the load; ``increment`` is
    what it changed in the state of the equilibrium. None before the first step.
    """

    targets_done: int = 0
    load: float = 0.0
    stride: float = 0.0
    increment: Array | None = None
    size: float | None = None


def march(
    solver: NewtonSolver,
    targets: Sequence[float],
    first_guess: Callable[[float], Array],
    *,
    rules: Stepping,
    substep_done: Callable[[float], None],
    target_done: Callable[[Step, Position], None],
    attempted: Callable[[float, int], None] = lambda load, iterations: None,
    gave_up: Callable[[float], None] = lambda load: None,
    start: Position | None = None,
    from_rest: bool = True,
) -> None:
    """Reach the loads ``targets`` in turn and, where a step fails or ``rules`` ask for it, loads between them.

    The guess for a step extrapolates the last increment; where that fails an elastic joint starts from the last state
    itself before the step is cut. Where the path starts or turns, it comes from the elastic
    solution, at the start from ``first_guess(load)``. ``substep_done(load)`` follows every accepted step with its
    history still to be committed, ``target_done(step, position)`` every output target, ``attempted(load, iterations)``
    every solve, ``gave_up(load)`` the one after which nothing smaller is allowed, before it is taken back. ``start``
    continues a march whose state the equilibrium has been given back. Without ``from_rest`` the joint is not in
    equilibrium before the first step (a pin too large for its hole), whose increment then says nothing about the next.
    Raises `StepFailure`.
    """
    equilibrium = solver.equilibrium
    at = start or Position()
    size = StepSize(rules)
    size.length = at.size or size.length
    state = equilibrium.state()
    for number in range(at.targets_done, len(targets)):
        begun, target, passed = at.load, targets[number], 0.0
        record = Step(target)
        while passed < 1:
            end = size.within(passed)
            load = target if end == 1 else begun + end * (target - begun)
            stride = load - at.load
            guess, afar = _guess(at, state, stride, load, first_guess)
            result = solver.solve(load, guess, afar=afar)
            if not result.converged and solver.elastic and not afar and guess is not state:
                # an extrapolated state has a kink where the contact ended, which fine meshes resolve
                result = solver.solve(load, state, afar=True).after(result)
            record.iterations += result.iterations
            record.attempts.append(result)
            attempted(load, result.iterations)
            if not result.converged:
                record.cutbacks += 1
                tried = size.length
                if not size.failed():
                    gave_up(load)
                    equilibrium.restore(at.load, state)
                    raise StepFailure(_why(result, equilibrium.load_name, load, at.load, tried), record)
                equilibrium.restore(at.load, state)
                continue
            record.substeps += 1
            size.accepted(result.iterations)
            new = equilibrium.state()
            if stride:
                known = from_rest or at.increment is not None
                at.increment, at.stride = (new - state if known else np.zeros_like(new)), stride
            at.load, at.size, state, passed = load, size.length, new, end
            substep_done(load)
            equilibrium.commit()
        at.targets_done = number + 1
        target_done(record, at)


def _guess(
    at: Position, state: Array, stride: float, load: float, first_guess: Callable[[float], Array]
) -> tuple[Array, bool]:
    """A guess for a step of length ``stride`` to ``load``, and whether to find the elastic solution first.

    Where the path turns, the joint first goes back the way it came, elastically.
    """
    if at.increment is None:
        return first_guess(load), True
    ratio = stride / at.stride
    guess = state if abs(ratio) > _PREDICTOR_LIMIT else state + at.increment * ratio
    return guess, ratio < 0


def _why(result: Newton, name: str, load: float, held: float, length: float) -> str:
    where = "" if result.worst is None else f", the largest residual at ({result.worst[0]:.4g}, {result.worst[1]:.4g})"
    last = f"{result.residuals[-1]:.1e}" if result.residuals and np.isfinite(result.residuals[-1]) else "none"
    tried = f"the step was cut to {length:.2g} of an output step" if length < 1 else "no smaller step is allowed"
    limit = (
        "; if the joint yields as a whole, its limit load is close" if name == "P" and result.plastic_increment else ""
    )
    return (
        f"no equilibrium at {name} = {load:.6g}: {result.reason}; after {result.iterations} iterations the residual "
        f"over reaction was {last}{where}; {tried}; the last load that held is {name} = {held:.6g}{limit}"
    )
