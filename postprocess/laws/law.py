"""A closed-form law with its range: never a silent number outside it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from archord.postprocess.laws.law_joint import LARGE, Array, LawJoint, LawRangeError, LawRangeWarning
from archord.postprocess.laws.monotone_root import monotone_root
from archord.scene.errors import InputError

Outside = Literal["nan", "raise", "extrapolate"]
_Function = Callable[[LawJoint, Array], Array]
_Load = Callable[[LawJoint], float]
_FELT = 1e-3  # share of P by which a small block must change it to be worth a word
_ROUND_OFF = 1e-9  # a grid up to the limit may overshoot it


@dataclass(frozen=True)
class LawState:
    """What a law says at several points; nan where it is outside its range, or says nothing of that quantity."""

    delta: Array
    load: Array
    stiffness: Array
    peak_pressure: Array
    angle: Array


@dataclass(frozen=True)
class Law:
    """A law ``P(delta)`` of a pin joint, or one that gives pressure and angle of a load only.

    Displacements are positive in compression and measured from first touch, forces are per unit length of the joint,
    angles are semi-angles in radians. Methods take arrays of any shape and return arrays of that shape. ``outside``
    says what happens to points outside the range: ``"nan"`` and a `LawRangeWarning`, ``"raise"`` a `LawRangeError`,
    ``"extrapolate"`` the formula with a `LawRangeWarning`, nan where the formula itself has ended. Of a joint in a
    small block laws with displacements warn (``"raise"``: a `LawRangeError`). All raise `InputError` if the law needs a
    parameter that the joint lacks, does not give the quantity, or gives displacements and the joint is a ring.
    """

    name: str
    title: str
    formula: str
    range: str
    source: str
    remarks: str
    limit: _Load  # largest displacement of the range; largest load of a law without displacements
    end: _Load = lambda joint: math.inf  # likewise, where the formula ends
    unfit: Callable[[LawJoint], str] = lambda joint: ""  # why the law does not hold for the whole joint
    pressure_limit: _Load | None = None  # largest load for which pressure and angle hold, if smaller than the range's
    needs: tuple[str, ...] = ()
    force_at: _Function | None = None
    stiffness_at: _Function | None = None
    displacement_of: _Function | None = None  # by root finding if absent
    peak_at: _Function | None = None  # of the displacement
    peak_of: _Function | None = None  # of the load
    angle_at: _Function | None = None
    angle_of: _Function | None = None

    @property
    def gives_displacement(self) -> bool:
        """Whether the law relates force and displacement."""
        return self.force_at is not None

    def force(self, joint: LawJoint, delta: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """``P(delta)``."""
        return self._at_displacement(joint, delta, outside).load

    def displacement(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """``delta(P)``, the inverse of `force`."""
        self._require_displacement()
        return self._at_load(joint, load, outside).delta

    def stiffness(self, joint: LawJoint, delta: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """``dP/d(delta)``; infinite at a load limit."""
        return self._at_displacement(joint, delta, outside).stiffness

    def peak_pressure(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """``p0(P)``."""
        if self.peak_at is None and self.peak_of is None:
            raise InputError(f"{self.name}: this law gives no pressure.")
        return self.at_load(joint, load, outside).peak_pressure

    def angle(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside = "nan") -> Array:
        """Contact semi-angle ``eps(P)``."""
        if self.angle_at is None and self.angle_of is None:
            raise InputError(f"{self.name}: this law gives no contact angle.")
        return self.at_load(joint, load, outside).angle

    def at_displacement(self, joint: LawJoint, delta: npt.ArrayLike, outside: Outside = "nan") -> LawState:
        """All quantities at displacements ``delta``."""
        return self._with_pressure(joint, self._at_displacement(joint, delta, outside), outside)

    def at_load(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside = "nan") -> LawState:
        """All quantities at loads ``load``; displacement and stiffness are nan for a law without."""
        return self._with_pressure(joint, self._at_load(joint, load, outside), outside)

    def _with_pressure(self, joint: LawJoint, state: LawState, outside: Outside) -> LawState:
        """``state``, with pressure and angle taken out beyond their own range."""
        limit = math.inf if self.pressure_limit is None else self.pressure_limit(joint)
        beyond = state.load > limit * (1 + _ROUND_OFF)
        if not beyond.any():
            return state
        unit = joint.E_star * joint.clearance
        said = (
            f"{self.name}: p0 and eps are Hertz's, for P up to {limit / unit:.4g} E* dR, where the half-width of the "
            f"contact is R/2; asked for {_span(state.load[beyond] / unit)} E* dR"
        )
        _tell(said, outside)
        if outside == "extrapolate":
            return state
        p0, eps = (np.where(beyond, np.nan, x) for x in (state.peak_pressure, state.angle))
        return replace(state, peak_pressure=p0, angle=eps)

    def _at_displacement(self, joint: LawJoint, delta: npt.ArrayLike, outside: Outside) -> LawState:
        self._require_displacement()
        self._require(joint)
        self._heed_block(joint, outside)
        given = np.asarray(delta, dtype=float)
        return self._state(joint, self._inside(joint, given, self.limit(joint), self.end(joint), "delta", outside))

    def _at_load(self, joint: LawJoint, load: npt.ArrayLike, outside: Outside) -> LawState:
        self._require(joint)
        P = np.asarray(load, dtype=float)
        limit, end = self.limit(joint), self.end(joint)
        if self.force_at is None:
            return self._state(joint, None, self._inside(joint, P, limit, end, "P", outside))
        self._heed_block(joint, outside)
        P = self._inside(joint, P, self._force(joint, limit), self._force(joint, end), "P", outside)
        if self.displacement_of is not None:
            delta = self.displacement_of(joint, np.where(P >= 0, P, 0.0))
        else:
            force, slope = self.force_at, self.stiffness_at
            assert slope is not None
            delta = monotone_root(lambda x: force(joint, x), lambda x: slope(joint, x), P, joint.clearance)
        return self._state(joint, np.where(P >= 0, delta, np.nan), P)

    def _force(self, joint: LawJoint, delta: float) -> float:
        assert self.force_at is not None
        return math.inf if math.isinf(delta) else float(self.force_at(joint, np.array(delta)))

    def _state(self, joint: LawJoint, delta: Array | None, load: Array | None = None) -> LawState:
        """Evaluate at checked points: nan in, nan out."""
        reference = load if delta is None else delta
        assert reference is not None
        nothing = np.full(np.shape(reference), np.nan)

        def known(function: _Function | None, x: Array | None) -> Array | None:
            if function is None or x is None:
                return None
            valid = x >= 0
            return np.where(valid, function(joint, np.where(valid, x, 0.0)), np.nan)

        def first(*found: Array | None) -> Array:
            return next((value for value in found if value is not None), nothing)

        load = first(load, known(self.force_at, delta))
        return LawState(
            delta=first(delta),
            load=load,
            stiffness=first(known(self.stiffness_at, delta)),
            peak_pressure=first(known(self.peak_at, delta), known(self.peak_of, load)),
            angle=first(known(self.angle_at, delta), known(self.angle_of, load)),
        )

    def _inside(self, joint: LawJoint, x: Array, limit: float, end: float, what: str, outside: Outside) -> Array:
        """``x`` with nan where the law has nothing to say; warns, or raises, about points outside the range."""
        unit = joint.clearance if what == "delta" else joint.E_star * joint.clearance
        named = "dR" if what == "delta" else "E* dR"
        shift = 1 + _ROUND_OFF
        beyond = (x < 0) | (x > limit * shift)
        reason = self.unfit(joint)
        if not (beyond.any() or reason):
            return x
        stray = reason or f"{what} = {_span(x[beyond] / unit)} {named} is outside 0 to {limit / unit:.4g} {named}"
        said = f"{self.name}: {stray} (range: {self.range})"
        _tell(said, outside)
        keep = (x >= 0) & (x <= end * shift) if outside == "extrapolate" else ~beyond & (not reason)
        return np.where(keep, x, np.nan)

    def _heed_block(self, joint: LawJoint, outside: Outside) -> None:
        """Refuse a ring, whose P(delta) is another one; warn of a small block, which is softer than the law's."""
        if joint.model == "ring":
            raise InputError(
                f'{self.name}: is a law for a pin in a block; of joint.model = "ring" its P would be about twice too '
                "high. Of a ring only hertz and persson hold, which give no displacement."
            )
        about, most = joint.softer
        if about > _FELT:
            assert joint.block_size is not None
            width = joint.block_size / joint.radius
            _tell(
                f"{self.name}: is a law for a block of {LARGE:g} R; in this one of {width:.4g} R the joint is softer, "
                f"and its P about {about:.1%} smaller than the law's (up to {most:.1%} with a rigid pin, or beyond "
                "yield)",
                outside,
            )

    def _require(self, joint: LawJoint) -> None:
        for name in self.needs:
            if getattr(joint, name) is None:
                raise InputError(f"{self.name}: this law needs {name}.")

    def _require_displacement(self) -> None:
        if self.force_at is None:
            raise InputError(f"{self.name}: this law gives no displacement, only pressure and angle of a load.")


def _tell(said: str, outside: Outside) -> None:
    if outside == "raise":
        raise LawRangeError(f"{said}.")
    warnings.warn(LawRangeWarning(said), stacklevel=5)


def _span(x: Array) -> str:
    low, high = x.min(), x.max()
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
