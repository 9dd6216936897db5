"""Soft contact: a pressure that grows exponentially as the gap closes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from archord.geometry.basis import Array
from archord.report.errors import in_sentences, require_between
from archord.solver.contact.laws.law import OPEN, SLIDE, ContactLaw, Response, State


@in_sentences
@dataclass(frozen=True)
class Exponential(ContactLaw):
    """Soft contact without friction: the exponential pressure-overclosure law of Abaqus.

    With ``h = 1 - gap/clearance`` the pressure is ``pressure h (exp(h) - 1)/(e - 1)`` where h is
    positive, and 0 elsewhere. It stands for rough surfaces, whose summits carry before the gap is
    closed.

    Parameters
    ----------
    pressure : float
        The pressure at gap 0.
    clearance : float
        The gap at which the pressure begins.

    Raises
    ------
    InputError
        For a parameter that is not positive or not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import Exponential
    >>> law = Exponential(pressure=50.0, clearance=0.01)
    >>> opening = np.array([[0.02, 0.0], [0.0, 0.0]])
    >>> answer = law.respond(opening, np.zeros((2, 2)), np.ones((2, 2)), None, 1.0)
    >>> answer.traction.round(9).tolist()
    [[0.0, 0.0], [50.0, 0.0]]
    """

    pressure: float
    clearance: float

    def __post_init__(self) -> None:
        """Check the parameters; raise `InputError`."""
        for name in ("pressure", "clearance"):
            require_between(self, name, 0, np.inf, "must be positive and finite")

    def respond(
        self, opening: Array, trial: Array, gamma: Array, state: State, dt: float
    ) -> Response:
        """The pressure of the gap alone."""
        m, d = trial.shape
        h = np.maximum(1 - opening[:, 0] / self.clearance, 0.0)
        scale = self.pressure / (np.e - 1)
        traction = np.zeros((m, d))
        traction[:, 0] = scale * h * np.expm1(h)
        by_opening = np.zeros((m, d, d))
        slope = np.expm1(h) + h * np.exp(h)
        by_opening[:, 0, 0] = -scale / self.clearance * slope
        branch = np.where(h == 0, OPEN, SLIDE)
        return Response(traction, np.zeros((m, d, d)), by_opening, branch, state)

    def stored(self, opening: Array, state: State) -> Array:
        """The work of the pressure from the gap at which it begins."""
        h = np.maximum(1 - opening[:, 0] / self.clearance, 0.0)
        scale = self.pressure / (np.e - 1)
        return self.clearance * scale * ((h - 1) * np.exp(h) + 1 - h**2 / 2)
