"""The work of the loads, and how it compares with the energies stored and dissipated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from archord.measures.record import Record

ENERGIES = ("elastic_energy", "plastic_dissipation", "friction_dissipation")
WORK_OFF = "the work of the loads"  # how the warning of it begins
_OFF = 0.01  # of the largest work
# of the largest energy, as of a press fit, beside which loads that do less work do none
_NOTHING = 1e-4


@dataclass
class Work:
    """``total`` work of the loads: the trapezoidal rule over every accepted step, the last of them
    at the displacement ``delta`` under ``force``, a number or one for every load."""

    delta: Any = 0.0
    force: Any = 0.0
    total: float = 0.0

    def add(self, delta: Any, force: Any) -> None:
        """Add the step from the last ``delta`` to this one, where the load is ``force``."""
        mean = 0.5 * np.add(force, self.force)
        self.total += float(np.sum(mean * np.subtract(delta, self.delta)))
        self.delta = np.asarray(delta).tolist()
        self.force = np.asarray(force).tolist()


def largest_energies(steps: Sequence[Record]) -> tuple[float, float]:
    """The largest energy stored and dissipated in one of the ``steps``, and the largest of it and
    the work."""
    stored = max((m.elastic_energy + m.dissipated for m in steps), default=0.0)
    return stored, max(stored, _largest_work(steps))


def _largest_work(steps: Sequence[Record]) -> float:
    return max((abs(m.work) for m in steps), default=0.0)


def energy_balance(steps: Sequence[Record], fit: int = 0, *, contact: bool = True) -> float | None:
    """How far work and stored and dissipated energy of the last of the ``steps`` are apart, over
    the largest work; 0 where there can be ``contact`` and nothing ever touched, when all of it is
    round-off, as is work beside a far larger energy.

    Bodies that are pressed into each other in the first ``fit`` steps store energy by work that
    nobody counted: there all count from the last of these steps on, and the result is None where
    there is no other.
    """
    found = _imbalances(steps, fit, contact=contact)
    return found[-1] if found else None


def _imbalances(steps: Sequence[Record], fit: int, *, contact: bool) -> list[float]:
    """The `energy_balance` of every step from the last one of the ``fit`` on."""
    missing = [m.missing for m in steps]
    touched = any(m.contact_area for m in steps)
    work = _largest_work(steps)
    if not work or (contact and not touched):
        return [0.0] * len(missing[fit:])
    scale = max(work, _NOTHING * largest_energies(steps)[0])
    before = missing[fit - 1] if 0 < fit <= len(steps) else 0.0
    return [abs(lost - before) / scale for lost in missing[fit:]]


def work_doubts(
    steps: Sequence[Record], fit: int = 0, *, contact: bool = True, round_off: float = 0.0
) -> list[str]:
    """A warning where the work of a step differs from what is stored and dissipated by a hundredth
    of the largest, and by more than the energy that is ``round_off``."""
    if _largest_work(steps) <= round_off:
        return []
    off = max(_imbalances(steps, fit, contact=contact), default=0.0)
    if off <= _OFF:
        return []
    sums = "a sum of trapezoids over accepted steps, and the energies stored and dissipated differ"
    by = f"by {100 * off:.2g} % of the largest work: more steps bring them together"
    return [f"{WORK_OFF}, {sums} {by}"]
