"""The yield stress as a function of the equivalent plastic strain (PEEQ)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from archord.materials.kinematics import Ints
from archord.materials.material import Array
from archord.report.errors import InputError


class Hardening(Protocol):
    """A yield stress that does not decrease with PEEQ; arguments and results are arrays
    ``(n,)``."""

    @property
    def linear(self) -> tuple[float, float] | None:
        """Yield stress at PEEQ 0 and slope of a law that is a straight line: its return map needs
        no iteration."""
        return None

    def knots(self) -> Array:
        """PEEQ between which straight lines are the law, or are close to it up to 1: what a table
        of it needs."""
        return np.append(0.0, np.geomspace(1e-4, 1.0, 60))

    def stress(self, peeq: Array) -> Array:
        """Yield stress."""
        ...

    def slope(self, peeq: Array) -> Array | float:
        """Derivative of `stress` with respect to PEEQ."""
        ...

    def work(self, peeq: Array) -> Array:
        """Plastic work density: the integral of `stress` from 0."""
        ...

    def at(self, points: Ints) -> Hardening:
        """The law of these ``points`` of an array, where each has its own."""
        return self


@dataclass(frozen=True)
class Scaled(Hardening):
    """A ``law`` times a ``factor`` ``(n,)`` of each point."""

    law: Hardening
    factor: Array

    def stress(self, peeq: Array) -> Array:
        """Yield stress."""
        return self.factor * self.law.stress(peeq)

    def slope(self, peeq: Array) -> Array:
        """Its slope."""
        return self.factor * self.law.slope(peeq)

    def work(self, peeq: Array) -> Array:
        """Plastic work density."""
        return self.factor * self.law.work(peeq)

    def at(self, points: Ints) -> Scaled:
        """Of these points."""
        return Scaled(self.law, self.factor[points])


@dataclass(frozen=True)
class LinearHardening(Hardening):
    """A yield stress that grows linearly, ``yield_stress + modulus PEEQ``.

    Parameters
    ----------
    yield_stress : float
        The yield stress at first yield, in the unit of Young's modulus.
    modulus : float
        The slope over PEEQ. Without it plasticity is perfect.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import LinearHardening
    >>> LinearHardening(355.0, modulus=1000.0).stress(np.array([0.0, 0.1])).tolist()
    [355.0, 455.0]
    """

    yield_stress: float
    modulus: float = 0.0

    @property
    def linear(self) -> tuple[float, float]:
        """Both numbers."""
        return self.yield_stress, self.modulus

    def knots(self) -> Array:
        """The line's beginning and a point of it, if it rises."""
        return np.array([0.0, 1.0] if self.modulus else [0.0])

    def stress(self, peeq: Array) -> Array:
        """Yield stress."""
        return self.yield_stress + self.modulus * peeq

    def slope(self, peeq: Array) -> float:
        """The modulus."""
        return self.modulus

    def work(self, peeq: Array) -> Array:
        """Plastic work density."""
        return self.yield_stress * peeq + 0.5 * self.modulus * peeq**2


@dataclass(frozen=True)
class TabularHardening(Hardening):
    """A yield stress by straight lines between points, constant beyond the last one.

    A yield plateau (Lueders) is two points of equal stress.

    Parameters
    ----------
    points : tuple of (float, float)
        PEEQ and yield stress of each point, the first at PEEQ 0.

    Raises
    ------
    InputError
        If PEEQ does not begin at 0 and increase, or if stresses decrease or are not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import TabularHardening
    >>> law = TabularHardening(((0.0, 355.0), (0.02, 355.0), (0.1, 450.0)))
    >>> law.stress(np.array([0.01, 0.06, 0.5])).tolist()
    [355.0, 402.5, 450.0]
    """

    points: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        """Check the points."""
        peeq, stress = self._table
        if not (len(peeq) and peeq[0] == 0 and (np.diff(peeq) > 0).all()):
            raise InputError("PEEQ must begin at 0 and increase from point to point")
        if not (stress[0] > 0 and np.isfinite(stress).all() and (np.diff(stress) >= 0).all()):
            raise InputError("yield stresses must be positive and must not decrease with PEEQ")
        own = tuple(zip(map(float, peeq), map(float, stress), strict=True))
        object.__setattr__(self, "points", own)  # an array may be changed later

    @classmethod
    def from_engineering(cls, points: Sequence[Sequence[float]], E: float) -> TabularHardening:
        """From points (engineering strain, engineering stress) of a tension test, the first at
        first yield: true stress ``s (1 + e)``, PEEQ ``ln(1 + e) - s (1 + e) / E``, but 0 at the
        first. Raises ValueError."""
        e, s = np.array(points, dtype=float).T
        true = s * (1 + e)
        peeq = np.log1p(e) - true / E
        peeq[0] = 0.0
        return cls(tuple(zip(peeq.tolist(), true.tolist(), strict=True)))

    @property
    def _table(self) -> tuple[Array, Array]:
        peeq, stress = np.array(self.points, dtype=float).reshape(-1, 2).T
        return peeq, stress

    @property
    def linear(self) -> tuple[float, float] | None:
        """Perfect plasticity, if there is one point."""
        return (self.points[0][1], 0.0) if len(self.points) == 1 else None

    def knots(self) -> Array:
        """The points."""
        return self._table[0]

    def stress(self, peeq: Array) -> Array:
        """Yield stress."""
        return np.interp(peeq, *self._table)

    def slope(self, peeq: Array) -> Array:
        """Slope of the line that begins at a point or contains it."""
        at, stress = self._table
        slopes = np.append(np.diff(stress) / np.diff(at), 0.0)
        return slopes[np.searchsorted(at, peeq, side="right") - 1]

    def work(self, peeq: Array) -> Array:
        """Plastic work density."""
        at, stress = self._table
        pieces = np.diff(at) * (stress[1:] + stress[:-1]) / 2
        below = np.append(0.0, np.cumsum(pieces))
        line = np.searchsorted(at, peeq, side="right") - 1
        return below[line] + (peeq - at[line]) * (stress[line] + self.stress(peeq)) / 2


@dataclass(frozen=True)
class VoceHardening(Hardening):
    """A yield stress that saturates (Voce, 1948).

    It is ``saturation - (saturation - yield_stress) exp(-rate PEEQ)``.

    Parameters
    ----------
    yield_stress : float
        The yield stress at first yield, in the unit of Young's modulus.
    saturation : float
        The yield stress at large PEEQ.
    rate : float
        How fast it gets there, per PEEQ.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import VoceHardening
    >>> law = VoceHardening(yield_stress=300.0, saturation=500.0, rate=20.0)
    >>> law.stress(np.array([0.0, 0.05, 1.0])).round(1).tolist()
    [300.0, 426.4, 500.0]
    """

    yield_stress: float
    saturation: float
    rate: float

    def stress(self, peeq: Array) -> Array:
        """Yield stress."""
        return self.saturation - (self.saturation - self.yield_stress) * np.exp(-self.rate * peeq)

    def slope(self, peeq: Array) -> Array:
        """Derivative of `stress`."""
        return self.rate * (self.saturation - self.stress(peeq))

    def work(self, peeq: Array) -> Array:
        """Plastic work density."""
        rise = self.saturation - self.yield_stress
        return self.saturation * peeq + rise * np.expm1(-self.rate * peeq) / self.rate


@dataclass(frozen=True)
class SwiftHardening(Hardening):
    """A yield stress by a power of PEEQ, ``strength (offset + PEEQ)^exponent`` (Swift, 1952).

    Parameters
    ----------
    strength : float
        The factor, in the unit of Young's modulus.
    offset : float
        What is added to PEEQ, a positive number: the yield stress would begin at 0 without it.
    exponent : float
        The exponent, between 0 and 1.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import SwiftHardening
    >>> law = SwiftHardening(strength=700.0, offset=0.01, exponent=0.2)
    >>> law.stress(np.array([0.0, 0.1])).round(1).tolist()
    [278.7, 450.2]
    """

    strength: float
    offset: float
    exponent: float

    def stress(self, peeq: Array) -> Array:
        """Yield stress."""
        return self.strength * (self.offset + peeq) ** self.exponent

    def slope(self, peeq: Array) -> Array:
        """Derivative of `stress`."""
        return self.exponent * self.stress(peeq) / (self.offset + peeq)

    def work(self, peeq: Array) -> Array:
        """Plastic work density."""
        n = self.exponent + 1
        return self.strength * ((self.offset + peeq) ** n - self.offset**n) / n
