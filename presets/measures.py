"""What a step is summed up in: forces, contact, plastic strain and energies of the whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.solver.stepping import Step

if TYPE_CHECKING:  # records are read from a run folder, too, without the solver
    from archord.solver.system import System

ENERGIES = ("elastic_energy", "plastic_dissipation", "friction_dissipation")


@dataclass(frozen=True)
class Measures:
    """One accepted output step of the whole joint (both symmetric halves), in the scene's units.

    ``contact_area`` is the arc length in contact, the mean of both sides; ``peeq_max`` the largest value at a
    quadrature point, which grows without bound under mesh refinement where perfect plasticity localises, as beside the
    held corner of the block. ``peeq`` has the largest value, x and y of each body that can yield, and near the
    "contact"; runs of version 0.1 lack it.
    ``force_balance`` is the largest difference between the forces at pin, contact and block, over the largest ``P`` so
    far, or where nothing touches over ``E* delta``, about what it would be in contact.
    """

    step: int
    delta: float
    P: float
    p0: float
    eps: float
    contact_area: float
    peeq_max: float
    peeq_integral: float
    elastic_energy: float
    plastic_dissipation: float
    work: float
    force_balance: float
    iterations: int
    cutbacks: int
    seconds: float
    friction_dissipation: float = 0.0
    peeq: dict[str, Sequence[float]] = field(default_factory=dict)

    @property
    def at(self) -> float:
        """The load that the files of fields and contact name."""
        return self.delta


@dataclass(frozen=True)
class Record:
    """One accepted output step of a general problem, at the load factor ``at``; ``values`` by the names of columns."""

    step: int
    at: float
    values: dict[str, float]
    contact_area: float
    elastic_energy: float
    plastic_dissipation: float
    work: float
    force_balance: float
    iterations: int
    cutbacks: int
    seconds: float
    friction_dissipation: float = 0.0

    def __getitem__(self, name: str) -> float:
        """The value of a column."""
        return self.values[name]


@dataclass
class Work:
    """``total`` work of the loads: the trapezoidal rule over every accepted step, the last of them at the displacement
    ``delta`` under ``force``, a number or one for every load."""

    delta: Any = 0.0
    force: Any = 0.0
    total: float = 0.0

    def add(self, delta: Any, force: Any) -> None:
        """Add the step from the last ``delta`` to this one, where the load is ``force``."""
        self.total += float(np.sum(0.5 * np.add(force, self.force) * np.subtract(delta, self.delta)))
        self.delta, self.force = (np.asarray(value).tolist() for value in (delta, force))


def costs(before: Sequence[Any], step: Step, system: System, work: float, seconds: float) -> dict[str, Any]:
    """What both kinds of records tell of a ``step`` that follows the steps ``before``. Collective."""
    energy = dict(zip(("elastic_energy", "plastic_dissipation"), system.energies(), strict=True))
    energy |= {"friction_dissipation": system.friction_dissipation(), "work": work}
    cost = {"iterations": step.iterations, "cutbacks": step.cutbacks, "seconds": seconds}
    return {"step": len(before) + 1} | energy | cost


def dissipated(m: Measures | Record) -> float:
    """Energy dissipated by yielding and by friction."""
    return m.plastic_dissipation + m.friction_dissipation


def headed(name: str, unit: str) -> str:
    """The heading of a column, with its unit if it has one."""
    return f"{name} [{unit}]" if unit else name


def energy_balance(steps: Sequence[Measures | Record], fit: int = 0, *, contact: bool = True) -> float | None:
    """How far work and stored and dissipated energy of the last of the ``steps`` are apart, over the largest work, of a
    step in ``contact`` if that can be: without one it is round-off.

    Bodies that are pressed into each other in the first ``fit`` steps store energy by work that nobody counted: there
    all count from the last of these steps on, and the result is None where there is no other.
    """
    if len(steps) <= fit:
        return None
    missing = [m.work - m.elastic_energy - dissipated(m) for m in (steps[fit - 1], steps[-1])]
    work = max((abs(m.work) for m in steps if m.contact_area or not contact), default=0.0)
    return abs(missing[1] - (missing[0] if fit else 0.0)) / work if work else 0.0
