"""What a step is summed up in: force, peak pressure, contact angle, plastic strain and energies of the whole joint."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from archord.presets.arc import SYMMETRY, ArcProfile, peak_pressure, semi_angle
from archord.presets.joint import Joint
from archord.solver.stepping import Step


@dataclass(frozen=True)
class Measures:
    """One accepted output step of the whole joint (both symmetric halves), per unit thickness, in the scene's units.

    ``contact_area`` is the arc length in contact, the mean of both sides; ``peeq_max`` the largest value at a
    quadrature point, which grows without bound under mesh refinement where perfect plasticity localises. ``work`` is
    the integral of ``P`` over ``delta`` by the trapezoidal rule. ``force_balance`` is the largest difference between
    the forces at pin, contact and block, over the largest ``P`` so far, or over ``E* delta``, about what it would be in
    contact, where nothing touches: what is left there is round-off.
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

    @property
    def at(self) -> float:
        """The load that the files of fields and contact name."""
        return self.delta


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


def measure(
    joint: Joint, before: Sequence[Measures], step: Step, arcs: Collection[ArcProfile], work: float, seconds: float
) -> Measures:
    """Sum up the last accepted state of ``joint``, which follows the steps ``before``. Collective."""
    peeq, peeq_integral = joint.peeq()
    stored, dissipated = joint.energies()
    forces, delta = joint.forces(), joint.delta()
    P = forces["pin"]
    area = SYMMETRY * float(np.mean([(p.in_contact * p.width).sum() for p in arcs]))
    scale = max(
        abs(P), *(abs(m.P) for m in before), 0.0 if area else joint.scene.E_star * joint.scene.thickness * abs(delta)
    )
    eps = float(np.mean([semi_angle(p) for p in arcs]))
    return Measures(
        step=len(before) + 1,
        delta=delta,
        P=P,
        p0=peak_pressure(list(arcs), eps),
        eps=eps,
        contact_area=area,
        peeq_max=peeq,
        peeq_integral=peeq_integral,
        elastic_energy=stored,
        plastic_dissipation=dissipated,
        work=work,
        force_balance=max(abs(f - P) for f in forces.values()) / scale if scale else 0.0,
        iterations=step.iterations,
        cutbacks=step.cutbacks,
        seconds=seconds,
    )


def energy_balance(steps: Sequence[Measures], *, press_fit: bool = False) -> float | None:
    """How far work and stored and dissipated energy of the last of the ``steps`` are apart, over the largest work.

    The pin of a ``press_fit``, too large for its hole, stores energy before there is a load, by work that nobody
    counted: there both count from the first step on, and the result is None where that is the only one.
    """
    if press_fit and len(steps) == 1:
        return None
    missing = [m.work - m.elastic_energy - m.plastic_dissipation for m in (steps[0], steps[-1])]
    work = max((abs(m.work) for m in steps if m.contact_area), default=0.0)
    return abs(missing[1] - (missing[0] if press_fit else 0.0)) / work if work else 0.0
