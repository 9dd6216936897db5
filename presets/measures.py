"""What a step is summed up in: forces, contact, plastic strain and energies of the whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.report.doubts import Doubt
from archord.solver.path.stepping import Step

if TYPE_CHECKING:  # records are read from a run folder, too, without the solver
    from archord.solver.path.system import System
    from archord.solver.problem import Body

WORK_OFF = "the work of the loads"  # how the warning of it begins
_OFF = 0.01  # of the largest work
LARGE_STRAIN = 0.05
LARGE = 'analysis.strain = "large" is for that'
_PLASTIC = 0.5  # PEEQ over the strain from which the strain is that of yielding
_OTHER_UNIT = 3e5  # ratio of moduli: MPa for Pa is a million, steel on soft rubber 2e5
_LEFT = 1e-3  # of the largest pressure of a run, what is left of it after unloading
_NOTHING = (
    1e-4  # of the largest energy, as of a press fit, beside which loads that do less work do none
)
_FAR_TURN = 0.2  # angle at which linear rotations stretch lengths by 2 %
ENERGIES = ("elastic_energy", "plastic_dissipation", "friction_dissipation")


@dataclass(frozen=True)
class Measures:
    """One accepted output step of the whole joint (both symmetric halves), in the scene's units.

    ``contact_area`` is the arc length in contact, the mean of both sides; ``peeq_max`` the largest
    value at a quadrature point, which grows without bound under mesh refinement where perfect
    plasticity localises, as beside the held corner of the block. ``peeq`` has the largest value, x
    and y of each body that can yield, and near the "contact"; runs of version 0.1 lack it.
    ``force_balance`` is the largest difference between the forces at pin, contact and block, over
    the largest ``P`` so far, or where nothing touches over ``E* delta``, about what it would be in
    contact.
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
    """One accepted output step of a general problem, at the load factor ``at``; ``values`` by the
    names of columns."""

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


def contrast_doubts(bodies: Sequence[Body]) -> list[str]:
    """A warning where the moduli of two ``bodies`` are so far apart that they may be given in
    different units."""
    moduli = {body.name: float(body.material.elastic_tangent[2, 2]) for body in bodies}
    softest, stiffest = (choose(moduli, key=lambda name: moduli[name]) for choose in (min, max))
    ratio = moduli[stiffest] / moduli[softest]
    if ratio < _OTHER_UNIT:
        return []
    return [
        f"{stiffest!r} is {ratio:.1e} times as stiff as {softest!r}: look whether their E have the same unit"
    ]


def distortion_doubts(system: System, peeq: float, *, small: bool) -> list[str]:
    """What to warn of where cells are strained or turned far in the last accepted state, by
    ``small`` strain, or turned over, by any; ``peeq``, which has a warning of its own, is the
    largest. Collective."""
    strain, tag, angle, inside_out = system.distortion()
    said = list[str]()
    if inside_out:
        cells = "1 element is" if inside_out == 1 else f"{inside_out} elements are"
        said.append(
            Doubt(f"{cells} turned inside out: stresses and forces mean nothing", inside_out)
        )
    if not small:
        return said
    if strain > LARGE_STRAIN and peeq < _PLASTIC * strain:
        name = next(body.name for body in system.problem.bodies if system.problem.tag(body) == tag)
        off = f"which makes stresses and forces wrong by about {100 * strain:.2g} %"
        text = f"the strain reaches {strain:.2g} in {name!r}, too much for small-strain theory, {off}; {LARGE}"
        said.append(Doubt(text, strain))
    if angle > _FAR_TURN:
        text = f"elements turn by {angle:.2g} rad, which small-strain theory takes for a strain of {angle**2 / 2:.2g}"
        said.append(Doubt(f"{text}; {LARGE}", angle))
    return said


@dataclass
class Work:
    """``total`` work of the loads: the trapezoidal rule over every accepted step, the last of them
    at the displacement ``delta`` under ``force``, a number or one for every load."""

    delta: Any = 0.0
    force: Any = 0.0
    total: float = 0.0

    def add(self, delta: Any, force: Any) -> None:
        """Add the step from the last ``delta`` to this one, where the load is ``force``."""
        self.total += float(
            np.sum(0.5 * np.add(force, self.force) * np.subtract(delta, self.delta))
        )
        self.delta, self.force = (np.asarray(value).tolist() for value in (delta, force))


def costs(
    before: Sequence[Any], step: Step, system: System, work: float, seconds: float
) -> dict[str, Any]:
    """What both kinds of records tell of a ``step`` that follows the steps ``before``.
    Collective."""
    energy = dict(zip(("elastic_energy", "plastic_dissipation"), system.energies(), strict=True))
    energy |= {"friction_dissipation": system.friction_dissipation(), "work": work}
    cost = {"iterations": step.iterations, "cutbacks": step.cutbacks, "seconds": seconds}
    return {"step": len(before) + 1} | energy | cost


def dissipated(m: Measures | Record) -> float:
    """Energy dissipated by yielding and by friction."""
    return m.plastic_dissipation + m.friction_dissipation


def told_of_facets(pressure: float, before: Sequence[float]) -> bool:
    """Whether a warning of few facets in contact is worth a word under this largest ``pressure``,
    after those ``before``: what unloading leaves of a contact decides on nothing."""
    return pressure > _LEFT * max(before, default=0.0)


def headed(name: str, unit: str) -> str:
    """The heading of a column, with its unit if it has one."""
    return f"{name} [{unit}]" if unit else name


def energy_balance(
    steps: Sequence[Measures | Record], fit: int = 0, *, contact: bool = True
) -> float | None:
    """How far work and stored and dissipated energy of the last of the ``steps`` are apart, over
    the largest work; 0 where there can be ``contact`` and nothing ever touched, when all of it is
    round-off, as is work beside a far larger energy.

    Bodies that are pressed into each other in the first ``fit`` steps store energy by work that
    nobody counted: there all count from the last of these steps on, and the result is None where
    there is no other.
    """
    found = _imbalances(steps, fit, contact=contact)
    return found[-1] if found else None


def _imbalances(steps: Sequence[Measures | Record], fit: int, *, contact: bool) -> list[float]:
    """The `energy_balance` of every step from the last one of the ``fit`` on."""
    missing = [m.work - m.elastic_energy - dissipated(m) for m in steps]
    if contact and not any(m.contact_area for m in steps):
        return [0.0] * len(missing[fit:])
    work = max((abs(m.work) for m in steps), default=0.0)
    stored = max((m.elastic_energy + dissipated(m) for m in steps), default=0.0)
    scale = max(work, _NOTHING * stored)
    before = missing[fit - 1] if 0 < fit <= len(steps) else 0.0
    return [abs(lost - before) / scale if work else 0.0 for lost in missing[fit:]]


def work_doubts(
    steps: Sequence[Measures | Record],
    fit: int = 0,
    *,
    contact: bool = True,
    round_off: float = 0.0,
) -> list[str]:
    """A warning where the work of a step differs from what is stored and dissipated by a hundredth
    of the largest, and by more than the energy that is ``round_off``."""
    largest = max((abs(m.work) for m in steps), default=0.0)
    if largest <= round_off:
        return []
    off = max(_imbalances(steps, fit, contact=contact), default=0.0)
    if off <= _OFF:
        return []
    sums = "a sum of trapezoids over accepted steps, and the energies stored and dissipated differ"
    return [
        f"{WORK_OFF}, {sums} by {100 * off:.2g} % of the largest work: more steps bring them together"
    ]
