"""A closed-form law with its range: never a silent number outside it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Literal

import numpy as np
import numpy.typing as npt

from archord.postprocess.laws.joint import LARGE, Array, LawJoint, LawRangeError, LawRangeWarning

Outside = Literal["nan", "raise", "extrapolate"]
_OfJoint = Callable[[LawJoint], float]
_FELT = 1e-3  # share of P by which a small block must change it to be worth a word
_ROUND_OFF = 1e-9  # a grid up to the limit may overshoot it
_FAR = 1e150  # no displacement, and its square is still a number
_ENOUGH = 1000  # halvings leave no digit of any bracket after 64; the rest is for doubling and halving to tiny roots


def _nothing() -> Array:
    return np.array(np.nan)


@dataclass(frozen=True)
class LawState:
    """What a law says at several points; nan where it is outside its range, or says nothing of that quantity."""

    delta: Array
    load: Array
    stiffness: Array = field(default_factory=_nothing)
    peak_pressure: Array = field(default_factory=_nothing)
    angle: Array = field(default_factory=_nothing)


@dataclass(frozen=True)
class Law:
    """A law ``P(delta)`` of a pin joint, or one that gives pressure and angle of a load only.

    Displacements are positive in compression and measured from first touch, forces are per unit length of the joint,
    angles are semi-angles in radians. Methods take arrays of any shape and return arrays of that shape. ``outside``
    says what happens to points outside the range: ``"nan"`` and a `LawRangeWarning`, ``"raise"`` a `LawRangeError`,
    ``"extrapolate"`` the formula with a `LawRangeWarning`, nan where the formula itself has ended. Of a joint in a
    small block laws with displacements warn (``"raise"``: a `LawRangeError`). All raise ValueError if the law needs a
    parameter that the joint lacks, does not give the quantity, or gives displacements and the joint is a ring.
    """

    name: str
    title: str
    formula: str
    range: str
    source: str
    remarks: str
    state: Callable[[LawJoint, Array], LawState]  # of displacements; of loads where it gives no displacement
    limit: _OfJoint  # largest displacement of the range; largest load of a law without displacements
    end: _OfJoint = lambda joint: math.inf  # likewise, where the formula ends
    unfit: Callable[[LawJoint], str] = lambda joint: ""  # why the law does not hold for the whole joint
    pressure_limit: _OfJoint = lambda joint: math.inf  # largest load for which pressure and angle hold
    needs: tuple[str, ...] = ()
    inverse: Callable[[LawJoint, Array], Array] | None = None  # displacement of a load; by root finding if absent
    gives: tuple[str, ...] = ("displacement", "pressure", "contact angle")

    @property
    def gives_displacement(self) -> bool:
        """Whether the law relates force and displacement."""
        return "displacement" in self.gives

    def force(self, joint: LawJoint, delta: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """``P(delta)``."""
        return self._at_displacement(joint, delta, outside).load

    def displacement(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """``delta(P)``, the inverse of `force`."""
        self._require("displacement")
        return self._at_load(joint, load, outside).delta

    def stiffness(self, joint: LawJoint, delta: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """``dP/d(delta)``; infinite at a load limit."""
        return self._at_displacement(joint, delta, outside).stiffness

    def peak_pressure(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """``p0(P)``."""
        self._require("pressure")
        return self.at_load(joint, load, outside).peak_pressure

    def angle(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """Contact semi-angle ``eps(P)``."""
        self._require("contact angle")
        return self.at_load(joint, load, outside).angle

    def at_displacement(self, joint: LawJoint, delta: npt.ArrayLike, outside: Outside = "nan") -> LawState:
        """All quantities at displacements ``delta``."""
        return self._with_pressure(joint, self._at_displacement(joint, delta, outside), outside)

    def at_load(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside = "nan") -> LawState:
        """All quantities at loads ``load``; displacement and stiffness are nan for a law without."""
        return self._with_pressure(joint, self._at_load(joint, load, outside), outside)

    def _require(self, quantity: str) -> None:
        if quantity not in self.gives:
            but = ", only pressure and angle of a load" if quantity == "displacement" else ""
            raise ValueError(f"{self.name}: this law gives no {quantity}{but}.")

    def _at_displacement(self, joint: LawJoint, delta: npt.ArrayLike, outside: Outside) -> LawState:
        self._require("displacement")
        self._check(joint, outside)
        given = np.asarray(delta, dtype=float)
        return self._known(joint, self._inside(joint, given, self.limit(joint), self.end(joint), "delta", outside))

    def _at_load(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside) -> LawState:
        self._check(joint, outside)
        P, limit, end = np.asarray(load, dtype=float), self.limit(joint), self.end(joint)
        if not self.gives_displacement:
            return self._known(joint, self._inside(joint, P, limit, end, "P", outside))
        state = partial(self.state, joint)
        limit, end = (x if math.isinf(x) else float(state(np.array(x)).load) for x in (limit, end))
        P = self._inside(joint, P, limit, end, "P", outside)
        if self.inverse is not None:
            delta = self.inverse(joint, np.where(P >= 0, P, 0.0))
        else:
            delta = monotone_root(lambda x: state(x).load, lambda x: state(x).stiffness, P, joint.clearance)
        return replace(self._known(joint, np.where(P >= 0, delta, np.nan)), load=P)

    def _known(self, joint: LawJoint, x: Array) -> LawState:
        """The state at checked points ``x``: nan in, nan out."""
        valid = x >= 0
        state = self.state(joint, np.where(valid, x, 0.0))
        return LawState(*(np.where(valid, getattr(state, each.name), np.nan) for each in fields(LawState)))

    def _with_pressure(self, joint: LawJoint, state: LawState, outside: Outside) -> LawState:
        """``state``, with pressure and angle taken out beyond their own range."""
        limit, unit = self.pressure_limit(joint), joint.E_star * joint.clearance
        beyond = state.load > limit * (1 + _ROUND_OFF)
        if not beyond.any():
            return state
        said = (
            f"{self.name}: p0 and eps are Hertz's, for P up to {limit / unit:.4g} E* dR, where the half-width of the "
            f"contact is R/2; asked for {_span(state.load[beyond] / unit)} E* dR"
        )
        warn(said, outside)
        if outside == "extrapolate":
            return state
        p0, eps = (np.where(beyond, np.nan, x) for x in (state.peak_pressure, state.angle))
        return replace(state, peak_pressure=p0, angle=eps)

    def _inside(self, joint: LawJoint, x: Array, limit: float, end: float, what: str, outside: Outside) -> Array:
        """``x`` with nan where the law has nothing to say; warns, or raises, about points outside the range."""
        named, unit = ("dR", joint.clearance) if what == "delta" else ("E* dR", joint.E_star * joint.clearance)
        beyond = (x < 0) | (x > limit * (1 + _ROUND_OFF))
        reason = self.unfit(joint)
        if not (beyond.any() or reason):
            return x
        stray = reason or f"{what} = {_span(x[beyond] / unit)} {named} is outside 0 to {limit / unit:.4g} {named}"
        warn(f"{self.name}: {stray} (range: {self.range})", outside)
        within_formula = (x >= 0) & (x <= end * (1 + _ROUND_OFF))
        return np.where(within_formula if outside == "extrapolate" else ~beyond & (not reason), x, np.nan)

    def _check(self, joint: LawJoint, outside: Outside) -> None:
        """Refuse a joint that lacks what the law needs; of laws with displacements also a ring, whose P(delta) is
        another one, and warn of a small block, which is softer than the law's."""
        for name in self.needs:
            if getattr(joint, name) is None:
                raise ValueError(f"{self.name}: this law needs {name}.")
        if not self.gives_displacement:
            return
        if joint.model == "ring":
            raise ValueError(
                f'{self.name}: is a law for a pin in a block; of joint.model = "ring" its P would be about twice too '
                "high. Of a ring only hertz and persson hold, which give no displacement."
            )
        about, most = joint.softer
        if joint.block_size is not None and about > _FELT:
            width = joint.block_size / joint.radius
            said = (
                f"{self.name}: is a law for a block of {LARGE:g} R; in this one of {width:.4g} R the joint is softer, "
                f"and its P about {about:.1%} smaller than the law's (up to {most:.1%} with a rigid pin, or beyond "
                "yield)"
            )
            warn(said, outside)


def warn(said: str, outside: Outside) -> None:
    """Warn with `LawRangeWarning`, or raise `LawRangeError` where ``outside`` is "raise"."""
    if outside == "raise":
        raise LawRangeError(f"{said}.")
    warnings.warn(LawRangeWarning(said), stacklevel=5)


def _span(x: Array) -> str:
    low, high = x.min(), x.max()
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def monotone_root(f: Callable[[Array], Array], slope: Callable[[Array], Array], target: Array, start: float) -> Array:
    """Solve ``f(x) = target`` for ``x >= 0`` with ``f`` rising from ``f(0) <= target``; nan where f stays below it.

    Newton's method in a bracket, with the middle of the bracket where a step would leave it. ``start`` is a first guess
    of the size of x. Targets that are not positive or not finite give 0 and nan. Shapes ``(...)`` in and out.
    """
    target = np.asarray(target, dtype=float)
    wanted = np.isfinite(target) & (target > 0)
    goal = np.where(wanted, target, 1.0)
    low, high = np.zeros_like(goal), np.full_like(goal, start)
    for _ in range(_ENOUGH):
        short = (f(high) < goal) & (high < _FAR)
        if not short.any():
            break
        low, high = np.where(short, high, low), np.where(short, 2 * high, high)
    reached = f(high) >= goal
    goal = np.where(reached, goal, f(high))
    x = high
    for _ in range(_ENOUGH):
        excess = f(x) - goal
        low, high = np.where(excess <= 0, x, low), np.where(excess >= 0, x, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = x - excess / slope(x)
        # NaN compares false, so a vanishing slope falls to the middle as well
        step = np.where((step > low) & (step < high), step, 0.5 * (low + high))
        done = (np.abs(step - x) <= 4e-16 * np.abs(step)) | (excess == 0)
        x = np.where(excess == 0, x, step)
        if done.all():
            break
    return np.where(wanted & reached, x, np.where(target <= 0, 0.0, np.nan))
