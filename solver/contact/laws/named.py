"""Contact laws by name, and the laws without friction."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.solver.contact.laws.coulomb import Coulomb
from archord.solver.contact.laws.exponential import Exponential
from archord.solver.contact.laws.law import OPEN, SLIDE, STICK, ContactLaw, Response, State


class Frictionless(ContactLaw):
    """``p = [trial]_+`` and no shear."""

    unilateral = True

    def respond(
        self, opening: Array, trial: Array, gamma: Array, state: State, dt: float
    ) -> Response:
        """Pressure where the trial pressure is positive."""
        touches = ~(trial[:, 0] <= 0)
        traction = np.zeros_like(trial)
        traction[:, 0] = np.where(touches, trial[:, 0], 0.0)
        by_trial = np.zeros((*trial.shape, trial.shape[1]))
        by_trial[:, 0, 0] = touches
        return Response(traction, by_trial, None, np.where(touches, SLIDE, OPEN), state)


class Tied(ContactLaw):
    """The whole trial traction, whatever its sign: the surfaces stay as they are to each other."""

    slides = False

    def respond(
        self, opening: Array, trial: Array, gamma: Array, state: State, dt: float
    ) -> Response:
        """The trial traction."""
        m, d = trial.shape
        by_trial = np.tile(np.eye(d), (m, 1, 1))
        return Response(trial, by_trial, None, np.full(m, STICK), state)


# A new law is a class, a row here, and a row of CONTACT_LAWS in scene/sections/contact.py.
LAWS: dict[str, type[ContactLaw]] = {
    "frictionless": Frictionless,
    "coulomb": Coulomb,
    "tied": Tied,
    "exponential": Exponential,
}
WITHOUT_PARAMETERS = ("frictionless", "tied")
NAMES = (*WITHOUT_PARAMETERS, "coulomb")  # what a `Problem` may say, with a coefficient of friction


def contact_law(law: str | ContactLaw, friction: float) -> ContactLaw:
    """The law of a name, or the ``law`` itself if it is one already.

    "frictionless" with a coefficient of ``friction`` is "coulomb". Raises ValueError for an unknown
    name, and for friction that is not positive, or of another law.
    """
    if law == "coulomb" and not friction > 0:
        raise ValueError(
            f"the law 'coulomb' needs a positive coefficient of friction, not {friction:g}"
        )
    if friction and (law not in ("coulomb", "frictionless") or not friction > 0):
        raise ValueError(
            "friction must be positive, of a law that is frictionless without it: "
            f"{friction:g} of {law!r}"
        )
    if friction:
        return Coulomb(friction)
    if not isinstance(law, str):
        return law
    if law not in WITHOUT_PARAMETERS:
        raise ValueError(f"there is no contact law {law!r}; there are {', '.join(NAMES)}")
    return LAWS[law]()
