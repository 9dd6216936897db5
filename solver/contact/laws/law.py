"""The protocol of contact laws: the contact traction at points of a surface, from how they lie to
their partners.

All are arrays of ``m`` points in the frame of the opposite surface: its outward normal ``n`` first,
then its tangent, which in a plane is ``n`` turned by a quarter anticlockwise, or its two tangents
in space. There are as many components ``d`` as displacements have. A traction ``(m, d)`` is a
pressure, positive in compression, and a shear. An opening ``(m, d)`` is a gap, positive when open,
and a slip.
"""

from __future__ import annotations

from copy import deepcopy
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from archord.geometry.basis import Array
from archord.materials.faults import overwrites

State = Any
Branches = npt.NDArray[np.integer]

OPEN = 0  # the point carries nothing: its traction and all derivatives are zero
STICK = 1
SLIDE = 2
SLIDE_BACK = 3  # against the tangent of the frame


class Response(NamedTuple):
    """What a contact law answers at ``m`` points.

    Parameters
    ----------
    traction : array (m, d)
        Pressure, positive in compression, and shear.
    by_trial : array (m, d, d)
        Derivative of the traction by the trial traction.
    by_opening : array (m, d, d) or None
        Derivative of the traction by the opening, None if it has none.
    branch : array of int (m,)
        0 (open), 1 (sticks), 2 or 3 (slides along or against the tangent), or a number of the law's
        own.
    state : dataclass or None
        The new history.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import Coulomb
    >>> law = Coulomb(friction=0.1)
    >>> trial = np.array([[100.0, 5.0], [100.0, -25.0], [-1.0, 0.0]])
    >>> answer = law.respond(np.zeros((3, 2)), trial, np.full((3, 2), 1e5), law.state(3), 1.0)
    >>> answer.branch.tolist()
    [1, 3, 0]
    >>> answer.by_trial.shape
    (3, 2, 2)
    """

    traction: Array  # (m, d)
    by_trial: Array  # (m, d, d) derivative of the traction by the trial traction
    by_opening: Array | None  # (m, d, d) its derivative by the opening; None if it has none
    branch: Branches  # (m,) OPEN, STICK, SLIDE or another number of the law's own
    state: State  # the new history


class Quantity(NamedTuple):
    """What a contact law tells of its points besides the traction.

    Parameters
    ----------
    density : array (m,)
        The quantity per area of the surface.
    unit : str
        The unit of its integral over the surface.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import Quantity
    >>> worn = Quantity(np.array([0.0, 1e-3]), unit="mm2")
    >>> worn.unit
    'mm2'
    """

    density: Array  # (m,) per area of the surface
    unit: str = ""  # unit of the integral over the surface


class ContactLaw(Protocol):
    """What a contact law of your own is made from: a law by its `respond`, a pure function.

    A law inherits what it does not define, which fits a law without history and without friction.

    Attributes
    ----------
    slides : bool
        Whether points move along the opposite surface. Otherwise they keep the partners of the
        undeformed surfaces, and their undeformed gaps count as zero.
    counts_slip : bool
        Whether the law gets the slip since the last accepted state, of the points that are partners
        now. In contact both sides agree on this slip, whatever the angle at which they met.
    has_friction : bool
        Whether the law carries shear: it counts slip, and the shear is reported. The slip and the
        trial shear of other laws that slide mean nothing.
    unilateral : bool
        Whether points can be open. Strategies that look ahead at which points close are for such
        laws alone.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import ContactLaw, Response
    >>> class Frictionless(ContactLaw):
    ...     unilateral = True
    ...
    ...     def respond(self, opening, trial, gamma, state, dt):
    ...         touches = (trial[:, 0] > 0).astype(int)
    ...         by_trial = touches[:, None, None] * np.diag([1.0, 0.0])
    ...         traction = np.maximum(trial[:, :1], 0.0) * [1.0, 0.0]
    ...         return Response(traction, by_trial, None, touches, state)
    >>> trial = np.array([[100.0, 5.0], [-1.0, 0.0]])
    >>> Frictionless().respond(np.zeros((2, 2)), trial, np.ones((2, 2)), None, 1.0).branch.tolist()
    [1, 0]
    """

    slides: ClassVar[bool] = True
    counts_slip: ClassVar[bool] = False
    has_friction: ClassVar[bool] = False
    unilateral: ClassVar[bool] = False

    def respond(
        self, opening: Array, trial: Array, gamma: Array, state: State, dt: float
    ) -> Response:
        """The traction of points from their ``state`` at the beginning of the step.

        Parameters
        ----------
        opening : (m, d) array
            Gap and slip.
        trial : (m, d) array
            Nitsche's traction of points that touch and stick: the traction of the own body's
            stress, less ``gamma`` times the opening.
        gamma : (m, d) array
            Nitsche's stiffness of the gap and of the slip, in stress per length.
        state
            What `state` or an accepted answer returned.
        dt : float
            The length of the step in the load factor, the time of the path. It is 0 where an
            accepted state is evaluated once more, and where loose bodies come to rest first.

        Returns
        -------
        Response
            Derivatives are partial: by the trial traction at a fixed opening, and by the opening
            at a fixed trial traction. Equal numbers of ``branch`` mean the same smooth piece of
            the law; the solver counts the points that change their branch. What is not a number
            stays that.
        """
        ...

    def state(self, n: int) -> State:
        """History of ``n`` points at the beginning: None, or a dataclass of arrays whose first
        axis are the points, as of a material."""
        return None

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

    def in_space(self) -> ContactLaw | None:
        """The law with two components of slip and shear; None if a law of slip has none."""
        return None if self.has_friction or self.counts_slip else self

    def stored(self, opening: Array, state: State) -> Array | float:
        """Energy that is stored in the contact per area ``(m,)``, as a soft layer does."""
        return 0.0

    def dissipation(self, state: State) -> Array | float:
        """Energy dissipated so far per area ``(m,)``."""
        return 0.0

    def quantities(self, state: State) -> dict[str, Quantity]:
        """Quantities per area by name, such as a depth of wear: their integrals over the surface
        are reported for each step."""
        return {}


def fault_of(law: ContactLaw, d: int) -> str:
    """What is wrong with the arrays of a ``law``'s answers at points with ``d`` components; empty
    if nothing is. Arrays of other shapes could be spread over the points without a word."""
    trial = np.zeros((2, d))
    trial[:, 0] = [1.0, -1.0]
    gamma = np.ones((2, d))
    closed = np.zeros((2, d))
    state = law.state(2)

    def answer_at(opening: Array, trial: Array) -> Response:
        return law.respond(opening, trial, gamma.copy(), deepcopy(state), 1.0)

    answer = answer_at(closed.copy(), trial.copy())
    if not isinstance(answer, Response):
        return f"must answer a Response, not {type(answer).__name__}"
    shapes = {"traction": (2, d), "by_trial": (2, d, d), "by_opening": (2, d, d), "branch": (2,)}
    for name, shape in shapes.items():
        found = getattr(answer, name)
        if found is not None and np.shape(found) != shape:
            return f"must answer a {name} of the shape {shape} at 2 points, not {np.shape(found)}"
    if np.asarray(answer.traction).dtype != float:
        return f"must answer a traction of float64, not {np.asarray(answer.traction).dtype}"
    densities = {
        "stored energy": law.stored(closed, answer.state),
        "dissipation": law.dissipation(answer.state),
    }
    densities |= {name: told.density for name, told in law.quantities(answer.state).items()}
    for name, density in densities.items():
        if np.shape(density) not in ((), (2,)):
            shape = np.shape(density)
            return f"must have a density of {name!r} of the shape (2,) at 2 points, not {shape}"
    if overwrites(answer_at, (closed.copy(), trial.copy()), (closed + 1, trial + 1)):
        return "must answer new arrays, and not write into arrays that it gave before"
    return ""
