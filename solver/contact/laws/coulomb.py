"""Coulomb's friction: a return map of the shear to the cone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from archord.geometry.basis import Array
from archord.report.errors import in_sentences, require_between
from archord.solver.contact.laws.law import OPEN, SLIDE, SLIDE_BACK, STICK, ContactLaw, Response


@dataclass(frozen=True)
class FrictionState:
    """History of ``m`` points."""

    elastic_slip: (
        Array  # (m,), in space (m, 2): gamma times it is what the shear is below the own stress's
    )
    pressure: Array  # (m,)
    dissipated: Array  # (m,) energy per area


@in_sentences
@dataclass(frozen=True)
class Coulomb(ContactLaw):
    """Coulomb's friction: shear within the cone ``|q| <= friction p``.

    The law is by Chouly, Mlika and Renard (2018), in time by backward Euler. A point that sticks
    has its trial shear, and the slip of the step is added to its elastic slip: what sticks for many
    steps does not creep. Where that leaves the cone the shear comes back to it at the same
    pressure, and the elastic slip becomes what gives this shear: a return map with gamma for its
    stiffness. The elastic slip is zero at points that do not touch.

    Parameters
    ----------
    friction : float
        The coefficient of friction.
    held : bool
        Points that touched stick, whatever their shear, and others slide without friction: an
        elastic predictor.
    secant : bool
        At points that slide, the derivative by the trial shear is shear over trial shear, and the
        shear does not follow the pressure. Newton's method then is the fixed-point iteration of
        Kacanov (1959). It is slower, but bodies that only friction keeps from turning keep a
        stiffness.

    Raises
    ------
    InputError
        For a coefficient that is negative or not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import Coulomb
    >>> law = Coulomb(friction=0.1)
    >>> trial = np.array([[100.0, 5.0], [100.0, -25.0], [-1.0, 0.0]])
    >>> answer = law.respond(np.zeros((3, 2)), trial, np.full((3, 2), 1e5), law.state(3), 1.0)
    >>> answer.traction.tolist()
    [[100.0, 5.0], [100.0, -10.0], [0.0, 0.0]]
    """

    friction: float
    held: bool = False
    secant: bool = False
    has_friction = True
    unilateral = True

    def __post_init__(self) -> None:
        """Check the coefficient; raise `InputError`."""
        said = "must not be negative, and be finite"
        require_between(self, "friction", 0, np.inf, said, least=True)

    def state(self, n: int) -> FrictionState:
        """Points at rest."""
        return FrictionState(*np.zeros((3, n)))

    def respond(
        self, opening: Array, trial: Array, gamma: Array, state: FrictionState, dt: float
    ) -> Response:
        """Pressure as without friction, and the shear returned to the cone along itself."""
        m, d = trial.shape
        stiffness = gamma[:, 1:]
        before = state.elastic_slip.reshape(m, d - 1)
        touches = ~(trial[:, 0] <= 0)
        touched = state.pressure > 0
        friction = np.full(m, self.friction)
        if self.held:
            friction[~touched] = 0.0

        pressure = np.where(touches, trial[:, 0], 0.0)
        limit = friction * pressure
        sticking = np.where(touches[:, None], trial[:, 1:] - stiffness * before, 0.0)
        size = np.linalg.norm(sticking, axis=1)
        direction = sticking / np.where(size > 0, size, 1.0)[:, None]
        slides = size > limit
        if self.held:
            slides &= ~touched
        sticks = touches & ~slides
        over = np.where(slides, size - limit, 0.0)
        shear = np.where(slides[:, None], limit[:, None] * direction, sticking)
        slid = over[:, None] * direction / stiffness

        by_trial = np.zeros((m, d, d))
        by_trial[:, 0, 0] = touches
        across = np.where(slides, limit / np.where(slides, size, 1.0), sticks)
        by_trial[:, 1:, 1:] = across[:, None, None] * np.eye(d - 1)
        if not self.secant:
            along = np.where(slides, across, 0.0)[:, None, None]
            by_trial[:, 1:, 1:] -= along * direction[:, :, None] * direction[:, None]
            by_trial[:, 1:, 0] = np.where(slides, friction, 0.0)[:, None] * direction

        backwards = (direction[:, 0] < 0) & (friction > 0) & (d == 2)
        sliding = np.where(backwards, SLIDE_BACK, SLIDE)
        branch = np.where(touches, np.where(sticks, STICK, sliding), OPEN)

        way = np.linalg.norm(slid, axis=1)
        lost = 0.5 * friction * (state.pressure + pressure) * way
        moved = np.where(touches[:, None], before + opening[:, 1:] + slid, 0.0)
        elastic_slip = moved.reshape(state.elastic_slip.shape)
        new = FrictionState(elastic_slip, pressure, state.dissipated + lost)
        return Response(np.column_stack([pressure, shear]), by_trial, None, branch, new)

    def elastic(self) -> Coulomb:
        """The law in which points that touched are ``held``."""
        return replace(self, held=True)

    def frictionless(self) -> Coulomb:
        """The law without friction."""
        return replace(self, friction=0.0)

    def by_secants(self) -> Coulomb:
        """The law with ``secant`` derivatives."""
        return replace(self, secant=True)

    def dissipation(self, state: FrictionState) -> Array:
        """Work done against friction so far per area ``(m,)``."""
        return state.dissipated

    def in_space(self) -> CoulombInSpace:
        """The law with two components of slip and shear."""
        return CoulombInSpace(**vars(self))


@dataclass(frozen=True)
class CoulombInSpace(Coulomb):
    """Coulomb's friction with two components of slip and shear.

    The elastic slip ``(m, 2)`` is kept along the tangents of the frame, which follow the normal.
    """

    def state(self, n: int) -> FrictionState:
        """Points at rest."""
        return FrictionState(np.zeros((n, 2)), np.zeros(n), np.zeros(n))

    def in_space(self) -> CoulombInSpace:
        """The law itself."""
        return self
