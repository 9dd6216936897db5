"""Contact laws: the traction at points of a surface, from how they lie to their partners.

All are arrays of ``m`` points in the frame of the opposite surface: its outward normal ``n`` and, turned from it by a
quarter anticlockwise, its tangent. A traction ``(m, 2)`` is a pressure, positive in compression, and a shear.

Closest points leave a law of sliding points no slip: friction has to accumulate it in its state, and add its derivative
where the normal turns to contact_tangent.c.
"""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

import numpy as np

from archord.geometry.basis import Array

State = Any


class ContactLaw(Protocol):
    """A law by its `update`, a pure function; without a history and without friction as it stands.

    Points of a law that ``slides`` move along the opposite surface; others keep partners, and undeformed gaps as zero.
    """

    slides: ClassVar[bool] = True

    def state(self, n: int) -> State:
        """History of ``n`` points at the beginning: None, or a dataclass of arrays, as that of a material."""
        return None

    def update(self, gap: Array, slip: Array, trial: Array, gamma: Array, state: State) -> tuple[Array, Array, State]:
        """Traction ``(m, 2)``, its derivative ``(m, 2, 2)`` with respect to ``trial``, and the new state.

        ``trial`` ``(m, 2)`` is Nitsche's traction of points that touch and stick: that of the own body's stress minus
        ``gamma`` times ``gap`` and ``slip``, ``(m,)`` each. Traction and derivative are zero at points that do not
        touch; where they touch, the pressure follows its trial value. What is not a number stays that.
        """
        ...


class Frictionless(ContactLaw):
    """``p = [trial]_+`` and no shear."""

    def update(self, gap: Array, slip: Array, trial: Array, gamma: Array, state: State) -> tuple[Array, Array, State]:
        """Pressure where the trial pressure is positive."""
        touches, derivative = ~(trial[:, 0] <= 0), np.zeros((len(trial), 2, 2))
        derivative[:, 0, 0] = touches
        return np.where(touches[:, None], trial * [1.0, 0.0], 0.0), derivative, state


class Tied(ContactLaw):
    """The whole trial traction, whatever its sign: the surfaces stay as they are to each other."""

    slides = False

    def update(self, gap: Array, slip: Array, trial: Array, gamma: Array, state: State) -> tuple[Array, Array, State]:
        """The trial traction."""
        return trial, np.tile(np.eye(2), (len(trial), 1, 1)), state


LAWS: dict[str, ContactLaw] = {"frictionless": Frictionless(), "tied": Tied()}
