"""A joint in space, how it is pressed, and what other codes gave for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import NamedTuple

from archord.solver.path.coarse_start import coarse_start
from archord.solver.path.load_path import Position
from archord.solver.path.stepping import Step, march
from archord.solver.path.system import System
from archord.solver.problem import Problem

E = 210e3
NU = 0.3
PRESS = "press"
_COARSER = 3.0  # element size of the mesh for guesses over the size of the mesh itself
Quantity = Callable[[System], float]


def force(system: System) -> float:
    """The force of the whole joint, positive."""
    return abs(system.drive_force(PRESS))


class Reference(NamedTuple):
    """A ``quantity``, its value at a displacement of the drive by other codes, how sure it is, and
    what it is ``computed`` by."""

    quantity: str
    displacement: float
    value: float
    uncertainty: float
    computed: Quantity = force


@dataclass(frozen=True)
class Case:
    """A joint by ``problem``, of the size of elements, which is pressed in equal ``steps`` to a
    displacement of ``deepest``, and its ``references``; ``size`` is what it takes by default."""

    name: str
    problem: Callable[[float], Problem]
    references: Sequence[Reference]
    deepest: float
    steps: int
    size: float


class Compared(NamedTuple):
    """A ``reference`` and archord's ``value``."""

    reference: Reference
    value: float

    @property
    def error(self) -> float:
        """The relative difference."""
        return self.value / self.reference.value - 1


@dataclass
class Solved:
    """What a case gave on one mesh, and what it took: seconds, with the mesh, and iterations."""

    case: Case
    size: float
    compared: list[Compared] = field(default_factory=list)
    n_dofs: int = 0
    newton: int = 0
    krylov: int = 0
    cutbacks: int = 0
    seconds: float = 0.0


def solved(case: Case, size: float = 0.0) -> Solved:
    """Solve a ``case`` on elements of this ``size`` at the contact, by default its own.
    Collective."""
    begun = perf_counter()
    result = Solved(case, size or case.size)
    coarser = partial(case.problem, _COARSER * result.size)
    system = System(replace(case.problem(result.size), coarser=coarser))
    result.n_dofs = system.n_dofs
    path = system.load_path(coarse=coarse_start(system))

    def note(step: Step, position: Position) -> None:
        result.newton += step.iterations
        result.cutbacks += step.cutbacks
        result.krylov += sum(solve.krylov_iterations for solve in step.attempts)
        for reference in case.references:
            if abs(reference.displacement - step.load * case.deepest) < 1e-9:
                result.compared.append(Compared(reference, reference.computed(system)))

    march(path, [step / case.steps for step in range(1, case.steps + 1)], target_done=note)
    result.seconds = perf_counter() - begun
    return result
