"""The yield stress as a function of the equivalent plastic strain (PEEQ)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from archord.materials.material import Array


class Hardening(Protocol):
    """A yield stress that does not decrease with PEEQ; arguments and results are arrays ``(n,)``."""

    @property
    def linear(self) -> tuple[float, float] | None:
        """Yield stress at PEEQ 0 and slope of a law that is a straight line: its return map needs no iteration."""
        return None

    def stress(self, peeq: Array) -> Array:
        """Yield stress."""
        ...

    def slope(self, peeq: Array) -> Array | float:
        """Derivative of `stress` with respect to PEEQ."""
        ...

    def work(self, peeq: Array) -> Array:
        """Plastic work density: the integral of `stress` from 0."""
        ...


@dataclass(frozen=True)
class LinearHardening(Hardening):
    """``yield_stress + modulus PEEQ``, in units of Young's modulus; perfect plasticity without ``modulus``."""

    yield_stress: float
    modulus: float = 0.0

    @property
    def linear(self) -> tuple[float, float]:
        """Both numbers."""
        return self.yield_stress, self.modulus

    def stress(self, peeq: Array) -> Array:
        """Yield stress."""
        return self.yield_stress + self.modulus * peeq

    def slope(self, peeq: Array) -> float:
        """The modulus."""
        return self.modulus

    def work(self, peeq: Array) -> Array:
        """Plastic work density."""
        return self.yield_stress * peeq + 0.5 * self.modulus * peeq**2
