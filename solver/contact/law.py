"""Contact laws: the traction at points of a surface, from how they lie to their partners.

All are arrays of ``m`` points in the frame of the opposite surface: its outward normal ``n`` and,
turned from it by a quarter anticlockwise, its tangent. A traction ``(m, 2)`` is a pressure,
positive in compression, and a shear.

The slip is that since the last accepted state, along the tangent, of the points that are partners
now: in contact both sides agree on it, whatever the angle at which they met, and what turns with
the surfaces slips by nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol

import numpy as np

from archord.geometry.basis import Array

State = Any


class ContactLaw(Protocol):
    """A law by its `update`, a pure function; without a history and without friction as it stands.

    Points of a law that ``slides`` move along the opposite surface; others keep partners, and
    undeformed gaps as zero. One that ``has_friction`` has shear; of one that is ``unilateral``
    points which do not touch carry nothing.
    """

    slides: ClassVar[bool] = True
    has_friction: ClassVar[bool] = False
    unilateral: ClassVar[bool] = False

    def state(self, n: int) -> State:
        """History of ``n`` points at the beginning: None, or a dataclass of arrays, as that of a
        material."""
        return None

    def update(
        self, gap: Array, slip: Array, trial: Array, gamma: Array, state: State
    ) -> tuple[Array, Array, State]:
        """Traction ``(m, 2)``, its derivative ``(m, 2, 2)`` with respect to ``trial``, and the new
        state.

        ``trial`` ``(m, 2)`` is Nitsche's traction of points that touch and stick: that of the own
        body's stress minus ``gamma`` ``(m, 2)`` times ``gap`` and ``slip``, ``(m,)`` each. Traction
        and derivative are zero at points that do not touch; where they touch, the pressure follows
        its trial value. What is not a number stays that.
        """
        ...

    def elastic(self) -> ContactLaw:
        """A law with the same states that answers from each as if points could not slide (any
        further)."""
        return self

    def frictionless(self) -> ContactLaw:
        """A law with the same states that answers without shear."""
        return self

    def by_secants(self) -> ContactLaw:
        """The law itself, with a derivative that leaves no point without stiffness along the
        surface."""
        return self

    def dissipation(self, state: State) -> Array | float:
        """Energy dissipated so far per area ``(m,)``."""
        return 0.0


class Frictionless(ContactLaw):
    """``p = [trial]_+`` and no shear."""

    unilateral = True

    def update(
        self, gap: Array, slip: Array, trial: Array, gamma: Array, state: State
    ) -> tuple[Array, Array, State]:
        """Pressure where the trial pressure is positive."""
        touches, derivative = ~(trial[:, 0] <= 0), np.zeros((len(trial), 2, 2))
        derivative[:, 0, 0] = touches
        return np.where(touches[:, None], trial * [1.0, 0.0], 0.0), derivative, state


@dataclass(frozen=True)
class FrictionState:
    """History of ``m`` points: ``elastic_slip``, gamma times which is what the shear is below that
    of the own body's stress, ``pressure``, and the energy ``dissipated`` per area."""

    elastic_slip: Array
    pressure: Array
    dissipated: Array


@dataclass(frozen=True)
class Coulomb(ContactLaw):
    """Shear within the cone ``|q| <= friction p`` (Chouly, Mlika and Renard 2018; in time backward
    Euler).

    A point that sticks has its trial shear, and the slip of the step is added to its elastic slip:
    what sticks for many steps does not creep. Where that leaves the cone the shear comes back to it
    at the same pressure, and the elastic slip becomes what gives this shear: a return map with
    gamma for its stiffness. It is zero at points that do not touch.

    If ``held``, points that touched stick, whatever their shear, and others slide without friction:
    an elastic predictor. With ``secant`` the derivative by the trial shear is shear over trial
    shear at points that slide, and the shear does not follow the pressure there. Newton's method
    then is the fixed-point iteration of Kacanov (1959): slower, but bodies that only friction keeps
    from turning keep a stiffness.
    """

    friction: float
    held: bool = False
    secant: bool = False
    has_friction = True
    unilateral = True

    def state(self, n: int) -> FrictionState:
        """Points at rest."""
        return FrictionState(*np.zeros((3, n)))

    def update(
        self, gap: Array, slip: Array, trial: Array, gamma: Array, state: State
    ) -> tuple[Array, Array, State]:
        """Pressure as without friction, and the shear returned to the cone."""
        touches = ~(trial[:, 0] <= 0)
        pressure = np.where(touches, trial[:, 0], 0.0)
        sticking = np.where(touches, trial[:, 1] - gamma[:, 1] * state.elastic_slip, 0.0)
        touched = state.pressure > 0
        friction = np.where(touched, self.friction, 0.0) if self.held else self.friction
        most = friction * pressure
        sign, size = np.sign(sticking), np.abs(sticking)
        slides = size > most
        if self.held:
            slides &= ~touched
        shear = np.where(slides, sign * most, sticking)
        moved = np.where(slides, sign * (size - most) / gamma[:, 1], 0.0)
        derivative = np.zeros((len(trial), 2, 2))
        derivative[:, 0, 0], derivative[:, 1, 1] = touches, touches & ~slides
        if self.secant:
            derivative[slides, 1, 1] = most[slides] / size[slides]
        else:
            derivative[:, 1, 0] = np.where(slides, sign * friction, 0.0)
        lost = 0.5 * friction * (state.pressure + pressure) * np.abs(moved)
        new = FrictionState(
            np.where(touches, state.elastic_slip + slip + moved, 0.0),
            pressure,
            state.dissipated + lost,
        )
        return np.stack([pressure, shear], axis=1), derivative, new

    def elastic(self) -> Coulomb:
        """The law in which points that touched are ``held``."""
        return replace(self, held=True)

    def frictionless(self) -> Coulomb:
        """The law without friction."""
        return replace(self, friction=0.0)

    def by_secants(self) -> Coulomb:
        """The law with ``secant`` derivatives."""
        return replace(self, secant=True)

    def dissipation(self, state: State) -> Array:
        """Work done against friction so far per area ``(m,)``."""
        return state.dissipated


class Tied(ContactLaw):
    """The whole trial traction, whatever its sign: the surfaces stay as they are to each other."""

    slides = False

    def update(
        self, gap: Array, slip: Array, trial: Array, gamma: Array, state: State
    ) -> tuple[Array, Array, State]:
        """The trial traction."""
        return trial, np.tile(np.eye(2), (len(trial), 1, 1)), state


def contact_law(law: str | ContactLaw, friction: float = 0.0) -> ContactLaw:
    """The law of a name, with Coulomb's ``friction`` if there is any. Raises ValueError for
    friction that is negative, or of another law than that without friction."""
    if friction and (law != "frictionless" or not friction > 0):
        raise ValueError(
            f"friction must be positive, of a law that is frictionless without it: {friction:g} of {law!r}"
        )
    return Coulomb(friction) if friction else LAWS[law] if isinstance(law, str) else law


LAWS: dict[str, ContactLaw] = {"frictionless": Frictionless(), "tied": Tied()}
