"""A closed-form law with its range: never a silent number outside it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from archord.materials.material import Array
from archord.postprocess.laws.general.joint import ROUGH_PRESSURE, LawJoint, LawRangeWarning
from archord.report.by_name import Names

ROUND_OFF = 1e-9  # a grid up to the limit may overshoot it
_FAR = 1e150  # no displacement, and its square is still a number


NOTHING: Array = np.array(np.nan)  # a quantity that a law does not give


class LawState(NamedTuple):
    """What a law says at several points, arrays of one shape; nan outside the range, and `NOTHING`
    for a quantity that the law does not give.

    - ``delta``: displacement
    - ``load``: force per unit length
    - ``stiffness``: ``dP/d(delta)``
    - ``peak_pressure``: largest contact pressure
    - ``angle``: semi-angle of the contact
    - ``error``: error of the load that 9 in 10 joints keep
    """

    delta: Array
    load: Array
    stiffness: Array
    peak_pressure: Array = NOTHING
    angle: Array = NOTHING
    error: Array = NOTHING


@dataclass(frozen=True)
class Law:
    """A law ``P(delta)`` of a pin joint, or one that gives only pressure and angle of a load.

    Displacements are positive in compression and measured from first touch. Forces are per unit
    length of the joint. Angles are semi-angles in radians. Methods take arrays of any shape and
    return arrays of the same shape. Points outside the range give a `LawRangeWarning`, and nan.
    With ``extrapolate`` they give the formula instead of nan, as far as the formula reaches. For a
    small block or a whole pin laws with displacements warn. All methods raise ValueError if the law
    needs a parameter that the joint lacks, or if it gives displacements and the joint is a ring.

    `archord.postprocess.laws.laws.find_law` gives a law by its name.

    Parameters
    ----------
    name, title, formula, range, source, remarks : str
        The law in words.
    state : callable
        The `LawState` of a joint at displacements, or at loads of a law without displacements.
    limit : callable
        The largest displacement of the range for a joint, or the largest load.
    unfit : callable
        Why the law does not hold for a joint at all; empty if it does.
    needs : tuple of str
        Parameters of the joint that the law needs.
    gives : tuple of str
        The quantities that it gives.
    coefficients : tuple of str
        The fitted ones among k and c.
    plastic : bool
        Whether it knows yielding, without hardening.
    solved : bool
        Whether it is made from joints that archord has solved.

    Examples
    --------
    >>> from archord.postprocess.laws.general.joint import LawJoint
    >>> from archord.postprocess.laws.laws import find_law
    >>> joint = LawJoint(radius=10.0, clearance=0.05, E_star=115e3)
    >>> law = find_law("paper")
    >>> law.force(joint, [0.025, 0.05]).round(1)
    array([2660.4, 6516.7])
    >>> print(f"{law.displacement(joint, 6516.7):.4f}")
    0.0500
    """

    name: str
    title: str
    formula: str
    range: str
    source: str
    remarks: str
    state: Callable[
        [LawJoint, Array], LawState
    ]  # of displacements; of loads where it gives no displacement
    limit: Callable[
        [LawJoint], float
    ]  # largest displacement of the range; largest load of a law without displacements
    unfit: Callable[[LawJoint], str] = (
        lambda joint: ""
    )  # why the law does not hold for the whole joint
    needs: Names = ()
    gives: Names = ("displacement", "pressure", "contact angle")
    coefficients: Names = ()  # fitted ones among k and c
    plastic: bool = False  # whether it knows yielding, without hardening
    solved: bool = False  # whether it is of joints that archord has solved

    @property
    def gives_displacement(self) -> bool:
        """Whether the law relates force and displacement."""
        return "displacement" in self.gives

    def force(self, joint: LawJoint, delta: npt.ArrayLike, extrapolate: bool = False) -> Array:
        """``P(delta)``."""
        return self.at_displacement(joint, delta, extrapolate).load

    def stiffness(self, joint: LawJoint, delta: npt.ArrayLike, extrapolate: bool = False) -> Array:
        """``dP/d(delta)``; infinite at a load limit."""
        return self.at_displacement(joint, delta, extrapolate).stiffness

    def displacement(
        self, joint: LawJoint, load: npt.ArrayLike, extrapolate: bool = False
    ) -> Array:
        """``delta(P)``, the inverse of `force`; nan for a law without displacements."""
        return self.at_load(joint, load, extrapolate).delta

    def at_displacement(
        self, joint: LawJoint, delta: npt.ArrayLike, extrapolate: bool = False
    ) -> LawState:
        """All quantities at displacements ``delta``."""
        self.check(joint)
        if not self.gives_displacement:
            raise ValueError(
                f"{self.name}: this law gives no displacement, only pressure and angle of a load."
            )
        inside = self._inside(joint, delta, self.limit(joint), "delta", extrapolate)
        return self._judged(joint, self._known(joint, inside))

    def at_load(self, joint: LawJoint, load: npt.ArrayLike, extrapolate: bool = False) -> LawState:
        """All quantities at loads ``load``; displacement and stiffness are nan where the law gives
        none."""
        self.check(joint)
        limit = self.limit(joint)
        if not self.gives_displacement:
            return self._known(joint, self._inside(joint, load, limit, "P", extrapolate))
        largest = float(self.state(joint, np.array(limit)).load)
        P = self._inside(joint, load, largest, "P", extrapolate)
        delta = rising_root(lambda x: self.state(joint, x).load, P, limit)
        return self._judged(joint, self._known(joint, delta))._replace(load=P)

    def _judged(self, joint: LawJoint, state: LawState) -> LawState:
        """The ``state``, whose error nobody knows of a joint that is not in the range."""
        return state._replace(error=NOTHING) if self.unfit(joint) else state

    def _known(self, joint: LawJoint, x: Array) -> LawState:
        """The state at checked points ``x``: nan in, nan out."""
        state = self.state(joint, np.where(x >= 0, x, 0.0))
        return LawState(*(np.where(x >= 0, values, np.nan) for values in state))

    def _inside(
        self, joint: LawJoint, x: npt.ArrayLike, limit: float, what: str, extrapolate: bool
    ) -> Array:
        """``x`` with nan where the law has nothing to say; warns about points outside the range."""
        named, unit = ("dR", joint.clearance) if what == "delta" else ("E* dR", joint.unit)
        x = np.array(x, dtype=float)
        beyond = (x < 0) | (x > limit * (1 + ROUND_OFF))
        reason = self.unfit(joint)
        if not (beyond.any() or reason):
            return x
        valid = x >= 0 if extrapolate else ~beyond & (not reason)
        if not reason:
            extremes = (x[beyond].min(), x[beyond].max())
            ends = dict.fromkeys(f"{end / unit:.4g}" for end in extremes)
            given = " to ".join(ends)
            reason = f"{what} = {given} {named} is outside 0 to {limit / unit:.4g} {named}"
        warnings.warn(LawRangeWarning(f"{self.name}: {reason} (range: {self.range})"), stacklevel=4)
        return np.where(valid, x, np.nan)

    def check(self, joint: LawJoint) -> None:
        """Warn of the `doubts` of a joint."""
        for said in self.doubts(joint):
            warnings.warn(LawRangeWarning(said), stacklevel=4)

    def doubts(self, joint: LawJoint) -> list[str]:
        """By what a joint is softer or stiffer than the law's. Raises ValueError for one that lacks
        what the law needs, or whose P(delta) is another one."""
        for name in self.needs:
            if getattr(joint, name) is None:
                raise ValueError(f"{self.name}: this law needs {name}.")
        if joint.ring and self.gives_displacement:
            raise ValueError(
                f'{self.name}: is a law for a pin in a block; of joint.model = "ring" its P would '
                "be about twice too "
                "high. Of a ring only hertz and persson hold, which give no displacement."
            )
        said = joint.unlike_solved
        if not self.solved:
            said = joint.other_shapes if self.gives_displacement else []
            if joint.hardens and self.plastic:
                said.append(
                    "of perfect plasticity; of bodies that harden its P is too low beyond yield"
                )
            if joint.friction:
                said.append(
                    f"without friction; with the coefficient {joint.friction:g} P is higher: in "
                    "the paper's elastic joint at 2 dR by 3.5 % with 0.1, by 10.5 % with 0.3"
                )
            if joint.large_strain:
                said.append(
                    "of small strain; at large strain P is higher: 0.2 to 0.4 % at dR/R = 0.5 %, "
                    "1.6 % at 2 %"
                )
        told = [f"{self.name}: is a law {kind}" for kind in said]
        if self.solved and joint.friction:
            told.append(f"{self.name}: {ROUGH_PRESSURE}")
        return told


def rising_root(f: Callable[[Array], Array], target: Array, start: float) -> Array:
    """Solve ``f(x) = target`` ``(...)`` for ``x >= 0`` with ``f`` rising, until no number is left
    between the ends of brackets; nan where f stays below it. ``start`` is a first guess of the size
    of x; f may be nan above some x. Targets that are not positive or nan give 0 and nan."""
    target = np.asarray(target, dtype=float)
    low = np.zeros_like(target)
    high = np.full_like(target, start)
    while (short := (f(high) < target) & (high < _FAR)).any():
        low = np.where(short, high, low)
        high = np.where(short, 2 * high, high)
    middle = (low + high) / 2
    while ((low < middle) & (middle < high)).any():
        short = f(middle) < target
        low = np.where(short, middle, low)
        high = np.where(short, high, middle)
        middle = (low + high) / 2
    return np.where(target <= 0, 0.0, np.where(f(high) >= target, high, np.nan))
