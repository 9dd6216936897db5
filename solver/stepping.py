"""Load stepping: output targets are hit exactly, a step that fails is rolled back with all history and halved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from archord.geometry.basis import Array
from archord.solver.equilibrium import Equilibrium, Newton

_PREDICTOR_LIMIT = 4.0  # an increment is not extrapolated to more than this many times its length


class StepFailure(RuntimeError):
    """Equilibrium was not found even with the smallest allowed step; the last accepted state stands.

    ``attempt`` is the output step that failed.
    """

    def __init__(self, message: str, attempt: Step) -> None:
        super().__init__(message)
        self.attempt = attempt


@dataclass
class Step:
    """What happened between two output targets: Newton iterations (failed attempts included), cutbacks, substeps."""

    load: float
    iterations: int = 0
    cutbacks: int = 0
    substeps: int = 0
    residuals: list[list[float]] = field(default_factory=list)


def march(
    equilibrium: Equilibrium,
    targets: Sequence[float],
    first_guess: Callable[[float], Array],
    *,
    max_cutbacks: int,
    substep_done: Callable[[float], None],
    target_done: Callable[[Step], None],
    attempted: Callable[[float, int], None] = lambda load, iterations: None,
) -> None:
    """Solve at the increasing loads ``targets`` and, where a step fails, at loads between them.

    The guess for a step extrapolates the last increment; the first step starts from ``first_guess(load)``, and from the
    elastic solution there if any point would yield. A step that fails is halved, at most ``max_cutbacks`` times below
    an output step; two accepted steps in a row double it again. ``substep_done(load)`` follows every accepted step with
    its history still to be committed, ``target_done`` every output target, ``attempted(load, iterations)`` every solve.
    Raises `StepFailure`.
    """
    load, u = 0.0, equilibrium.displacement()
    increment, length = None, 0.0
    halvings, in_a_row = 0, 0
    start = 0.0
    for target in targets:
        record = Step(target)
        output_step = target - start
        while load < target:
            step = output_step / 2**halvings
            new_load = target if load + 1.001 * step >= target else load + step
            if increment is None or (new_load - load) > _PREDICTOR_LIMIT * length:
                guess = first_guess(new_load) if increment is None else u
            else:
                guess = u + increment * ((new_load - load) / length)
            result = equilibrium.solve(new_load, guess, elastic_first=increment is None)
            record.iterations += result.iterations
            record.residuals.append(result.residuals)
            attempted(new_load, result.iterations)
            if not result.converged:
                equilibrium.restore(load, u)
                record.cutbacks += 1
                in_a_row = 0
                halvings += 1
                if halvings > max_cutbacks:
                    raise StepFailure(_why(result, new_load, halvings - 1, step), record)
                continue
            record.substeps += 1
            new = equilibrium.displacement()
            increment, length = new - u, new_load - load
            load, u = new_load, new
            substep_done(load)
            equilibrium.commit()
            in_a_row += 1
            if halvings and in_a_row >= 2:
                halvings, in_a_row = halvings - 1, 0
        target_done(record)
        start = target


def _why(result: Newton, load: float, halvings: int, step: float) -> str:
    where = "" if result.worst is None else f", the largest residual at ({result.worst[0]:.4g}, {result.worst[1]:.4g})"
    last = f"{result.residuals[-1]:.1e}" if result.residuals else "none"
    tried = f"the step was halved {halvings} times, to {step:.3g}" if halvings else "no smaller step is allowed"
    return (
        f"no equilibrium at delta = {load:.6g}: {result.reason}; after {result.iterations} iterations the residual "
        f"over reaction was {last}{where}; {tried}"
    )
