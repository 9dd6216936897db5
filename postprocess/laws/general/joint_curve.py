"""P(delta) of one joint as a table, with its way back: what every law is reduced to before it is
used or exported.

All is dimensionless: ``x = delta/dR``, ``y = P/unit``. Between nodes curves are cubic (Hermite). Up
to the first node above zero, where the contact is Hertz's, the table may follow the logarithmic law
of line contact,

    pi x/y + ln(y/(1 + y)) = F(x),    F = a + b x + c x^2,

which has no slope at x = 0. After yielding, a joint unloads along its ``back`` curve, which is the
curve of an elastic joint of another clearance and origin: ``y = r back(h(a)/r)``, ``a = x - deepest
+ travel``, with the ``ratio`` r, a function of the deepest x, and the ``travel`` by which both
curves meet there. As what has yielded does not fit any longer, contact ends more softly: ``h`` is a
above the ``toe`` w, another such function, bends there, and is 0 at -w, where the joint opens.
``deepest`` is all that has to be remembered. Reloading goes the same way, and on along the first
loading.
"""

from __future__ import annotations

import json
import warnings
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from archord.materials.kinematics import Ints
from archord.materials.material import Array
from archord.report.by_name import ByName
from archord.report.readable import json_of

# of Newton's method for the logarithmic law: quadratic, from a guess that is good to some per cent
_ITERATIONS = 6
_INSIDE = 1 + 1e-9  # of the last node, but for round-off
_NUMBER = 1e300  # beyond it nothing is a displacement
# which files of earlier versions lack
_NEWER = ("length_unit", "force_unit", "pin_length", "radius")
_UNKNOWN = ("peak", "dpeak", "angle", "dangle", "error", "back_error")  # which nan may be
_BEND = np.sqrt(2) - 1
_BRACKETED = 60  # iterations at most of Newton's method for an inverse, which bisects where it must


class CurveState(NamedTuple):
    """What a joint's law says at displacements ``(...)``.

    Beyond the table all but the force are nan, and of nan all.
    """

    load: Array
    stiffness: Array  # dP/d(delta)
    error: Array  # of the force, expected of 9 in 10 joints
    peak_pressure: Array  # largest pressure of the contact; nan on the way back after yielding
    angle: Array  # semi-angle of the contact [rad]; nan on the way back after yielding


@dataclass(frozen=True)
class JointCurve:
    """The law of one joint: tables ``(n,)`` over nodes.

    Beyond the last node curves go on along their tangents. Expected errors are the errors that 9 in
    10 joints keep. The head of this module has the equations.

    Parameters
    ----------
    x : array
        The nodes, which begin with 0.
    y, dy : array
        Force and slope on first loading.
    back, dback : array
        Force and slope of the curve that unloading follows.
    ratio, dratio : array
        The ratio r of this curve by the deepest x, and the slope of r.
    toe : array
        The toe of this curve by the deepest x, straight between nodes.
    touch : array (3,)
        a, b, c of the logarithmic law; empty ``(0,)`` without one.
    peak, dpeak : array
        p0/sqrt(y) and its slope, nearly constant at first touch; nan if unknown.
    angle, dangle : array
        eps/sqrt(y) and its slope; nan if unknown.
    error : array
        The expected error of y on loading, over y, straight between nodes; nan if unknown.
    back_error : array
        The same on the way back, over the largest y.
    length, force, pressure : float
        The units of x (dR), y and p0, positive numbers.
    about : dict
        What it is the law of, and where it comes from.
    length_unit, force_unit : str
        Names of the units of displacement and force.
    pin_length : float
        The length of the pin that carries the force; 1 for forces per unit length.
    radius : float
        The radius of the pin, in the unit of ``length``; None if unknown.

    Examples
    --------
    >>> from archord.postprocess.laws.general.general_law import general_law
    >>> from archord.postprocess.laws.general.joint import LawJoint
    >>> joint = LawJoint(radius=10.0, clearance=0.05, E_star=115e3, plane="strain", nu=0.3)
    >>> law = general_law(joint)
    >>> law.at([0.02, 0.05]).load.round()
    array([1968., 6342.])
    >>> print(f"{law.displacement(6340.5):.4f}")
    0.0500
    >>> law.yields
    False
    """

    x: Array
    y: Array
    dy: Array
    back: Array
    dback: Array
    ratio: Array
    dratio: Array
    toe: Array
    touch: Array
    peak: Array
    dpeak: Array
    angle: Array
    dangle: Array
    error: Array
    back_error: Array
    length: float = 1.0
    force: float = 1.0
    pressure: float = 1.0
    about: ByName = field(default_factory=dict)
    length_unit: str = "unit of R"
    force_unit: str = "unit of E* times unit of R"
    pin_length: float = 1.0
    radius: float | None = None

    @cached_property
    def yields(self) -> bool:
        """Whether the way back is another than first loading, or is known less well."""
        same = np.array_equal(self.y, self.back) and np.array_equal(self.dy, self.dback)
        alike = np.array_equal(self.back_error, self.error, equal_nan=True)
        known = not self.back_error.any() or alike
        return not (same and known and (self.ratio == 1).all() and (self.dratio == 0).all())

    @property
    def limit(self) -> float:
        """Largest displacement that the table covers."""
        return self.length * self.x[-1]

    @property
    def reach(self) -> float:
        """Largest x that counts as within the table."""
        return float(_INSIDE * self.x[-1])

    @property
    def widest(self) -> float:
        """Semi-angle [rad] that cubics between nodes do not exceed: a quarter of a circle, or the
        largest node's."""
        quarter = np.pi / 2
        largest = float((self.angle * np.sqrt(self.y)).max())
        return largest if largest > _INSIDE * quarter else quarter

    def at(self, delta: npt.ArrayLike, deepest: npt.ArrayLike = 0.0) -> CurveState:
        """All quantities at ``delta`` after the joint has been as deep as ``deepest`` (both of any
        shape); 0 where the joint is open. Warns beyond the table."""
        x = np.maximum(np.asarray(delta, float) / self.length, -1.0)
        most = np.maximum(np.asarray(deepest, float) / self.length, 0.0)
        x, most = np.broadcast_arrays(x, most)
        numbers = (x <= _NUMBER) & (most <= _NUMBER)
        known = numbers & (x <= self.reach)
        if self.yields:
            known &= (x <= 0) | (most <= self.reach)
        x = np.where(numbers, x, 0.0)
        most = np.where(numbers, most, 0.0)
        is_beyond = np.maximum(x, most) > self.reach
        if is_beyond.any():
            end = f"{self.x[-1]:g} dR"
            said = f"archord: beyond {end}, where the joint's table ends, it goes on straight"
            warnings.warn(said, stacklevel=2)
        state = self._first_loading(x)
        returning = x < most
        if returning.any() and self.yields:
            state = CurveState(*map(np.asarray, state))
            first = CurveState(*(values[returning] for values in state))
            below = self._way_back(x[returning], most[returning], first)
            for values, found in zip(state, below, strict=True):
                values[returning] = found
        is_open = x <= 0
        load, *others = (np.where(is_open, 0.0, values) for values in state)
        load = np.where(numbers, load, np.nan)
        stiffness, error, peak, angle = (np.where(known, values, np.nan) for values in others)
        return CurveState(
            load * self.force,
            stiffness * self.force / self.length,
            error * self.force,
            peak * self.pressure,
            angle,
        )

    def displacement(self, load: npt.ArrayLike) -> Array:
        """The displacement of first loading at which the force is ``load`` (any shape); nan beyond
        the table's."""
        y = np.asarray(load, float) / self.force
        last = self.y[-1]
        known = y <= _INSIDE * last
        x = self._inverse(self.y, self.dy, np.where(known, np.minimum(y, last), 0.0))
        return np.where(known, x, np.nan) * self.length

    def residual(self, deepest: npt.ArrayLike) -> Array:
        """The displacement (any shape) at which the joint opens on its way back from ``deepest``;
        nan beyond the table if it yields."""
        most = np.maximum(np.asarray(deepest, float) / self.length, 0.0)
        reach = self.reach if self.yields else _NUMBER
        known = most <= reach
        most = np.where(known, most, 0.0)
        travel = self._travel(most, self._ratio(most))
        opens = np.maximum(most - travel - self._toe(most), 0.0)
        return np.where(known, opens, np.nan) * self.length

    def _first_loading(self, x: Array) -> CurveState:
        """The dimensionless state of a joint that is loaded."""
        y, dy = self._curve(self.y, self.dy, np.maximum(x, 0.0))
        root = np.sqrt(y)
        peak, _ = hermite(self.x, self.peak, self.dpeak, x)
        angle, _ = hermite(self.x, self.angle, self.dangle, x)
        error = y * np.interp(x, self.x, self.error)
        semi_angle = np.minimum(angle * root, self.widest)
        return CurveState(y, dy, error, peak * root, semi_angle)

    def _way_back(self, x: Array, most: Array, first: CurveState) -> CurveState:
        """The dimensionless state on the way back from ``most``, never above ``first`` loading."""
        ratio = self._ratio(most)
        travel = self._travel(most, ratio)
        left = x - most + travel
        a, bend = bent(left, travel, self._toe(most))
        y, dy = self._curve(self.back, self.dback, np.maximum(a / ratio, 0.0))
        y = ratio * y
        dy = np.where(a > 0, bend * dy, 0.0)
        above = y > first.load
        load = np.where(above, first.load, y)
        stiffness = np.where(above, first.stiffness, dy)
        largest, _ = self._curve(self.y, self.dy, most)
        error = largest * np.interp(most, self.x, self.back_error)
        unknown = np.full_like(y, np.nan)
        return CurveState(load, stiffness, error, unknown, unknown)

    def _ratio(self, most: Array) -> Array:
        ratio, _ = hermite(self.x, self.ratio, self.dratio, most)
        return np.maximum(ratio, 1e-3)

    def _toe(self, most: Array) -> Array:
        return np.interp(most, self.x, self.toe)

    def _travel(self, most: Array, ratio: Array) -> Array:
        """The travel of the way back from ``most``, which meets first loading there."""
        largest, _ = self._curve(self.y, self.dy, most)
        return ratio * self._inverse(self.back, self.dback, largest / ratio)

    def _curve(self, f: Array, df: Array, x: Array) -> tuple[Array, Array]:
        """``f`` and its slope at ``x >= 0``."""
        x = np.asarray(x)
        y, dy = map(np.asarray, hermite(self.x, f, df, x))
        if self.touch.size:
            early = x < self.x[1]
            y[early], dy[early] = first_touch(self.touch, np.maximum(x[early], 1e-290))
        is_open = x <= 0
        return np.where(is_open, 0.0, y), np.where(is_open, 0.0, dy)

    def _inverse(self, f: Array, df: Array, y: Array) -> Array:
        """The ``x`` at which the rising curve ``f`` is ``y``; 0 where ``y <= 0``."""
        y = np.asarray(y)
        i = interval(f, y)
        piece = Piece.of(self.x, f, df, i)
        begin = f[i]
        end = f[i + 1]
        goal = np.clip(y, begin, end)
        low = np.zeros_like(goal)
        high = np.ones_like(goal)
        rise = np.where(end > begin, end - begin, 1.0)
        t = (goal - begin) / rise
        for _ in range(_BRACKETED):
            value, slope = piece.at(t)
            miss = value - goal
            low = np.where(miss < 0, t, low)
            high = np.where(miss < 0, high, t)
            last = t
            t = last - miss / np.maximum(slope, 1e-100)
            astray = (t - low) * (high - t) < 0
            t = np.where(astray, (low + high) / 2, t)
            moved = np.abs(t - last)
            if not (moved >= 1e-12).any():
                break
        past_end = (y - f[-1]) / np.maximum(df[-1], 1e-100)
        inside = self.x[i] + piece.width * t
        x = np.where(y > f[-1], self.x[-1] + past_end, inside)
        if self.touch.size:
            early = (y > 0) & (y < f[1])
            x[early] = touch_displacement(self.touch, y[early])
        return np.where(y > 0, x, 0.0)

    def to_json(self) -> str:
        """The curve as JSON; numbers in full, null for nan."""
        data = asdict(self)
        for name, value in data.items():
            if isinstance(value, np.ndarray):
                data[name] = np.where(np.isnan(value), np.array(None), value).tolist()
        return json.dumps(data, indent=1, allow_nan=False) + "\n"

    @classmethod
    def from_json(cls, text: str) -> JointCurve:
        """The curve in ``text``. Raises ValueError if it is none."""
        given: ByName = {}
        try:
            data = json_of(text)
            for f in fields(cls):
                if f.name in data or f.name not in _NEWER:
                    value = data[f.name]
                    given[f.name] = np.array(value, float) if f.type == "Array" else value
        except (KeyError, TypeError) as error:
            raise ValueError(f"is no table of a joint's law: {error}") from None
        curve = cls(**given)
        fault = curve._fault()
        if fault:
            raise ValueError(f"is no table of a joint's law: {fault}")
        return curve

    def _fault(self) -> str:
        """What makes this no table, in words; empty if nothing does."""
        for name in ("length", "force", "pressure"):
            value = getattr(self, name)
            if not (isinstance(value, float | int) and 0 < value < np.inf):
                return f"{name} = {value!r} must be a positive number"
        if self.touch.shape not in ((0,), (3,)):
            return "touch must have three numbers, or none"
        rises = self.x.ndim == 1 and len(self.x) > 1 and self.x[0] == 0
        if not (rises and (np.diff(self.x) > 0).all()):
            return "x must rise from 0"
        for f in fields(self):
            values = getattr(self, f.name)
            if f.type != "Array" or f.name == "touch":
                continue
            if values.shape != self.x.shape:
                return f"{f.name} must have as many numbers as x"
            if f.name not in _UNKNOWN and not np.isfinite(values).all():
                return f"{f.name} must have numbers alone"
        return ""


def first_touch(touch: Array, x: Array) -> tuple[Array, Array]:
    """``y`` and ``dy/dx`` of the logarithmic law of ``touch`` ``(3,)`` at ``x > 0``."""
    a, b, c = touch
    F = a + x * (b + c * x)
    slope = b + 2 * c * x
    return line_contact(x, F, slope)


def touch_displacement(touch: Array, y: Array) -> Array:
    """The ``x`` at which the logarithmic law of ``touch`` ``(3,)`` is ``y > 0``, by Newton's
    method."""
    a, b, c = touch
    log = np.log1p(1 / y)
    x = y * (a + log) / np.pi
    for _ in range(_ITERATIONS):
        miss = np.pi * x / y - a - x * (b + c * x) - log
        slope = np.pi / y - b - 2 * c * x
        x = x - miss / slope
    return x


def line_contact(x: Array, F: Array, slope: Array) -> tuple[Array, Array]:
    """``y`` and ``dy/dx`` at ``x > 0`` where F(x) and its ``slope`` are these: ``t = 1/y`` solves
    ``pi x t - ln(1 + t) = F``, which is convex in t, by Newton's method."""
    pi_x = np.pi * x
    t = (F + np.log1p(F / pi_x)) / pi_x
    for _ in range(_ITERATIONS):
        miss = pi_x * t - np.log1p(t) - F
        t = t - miss / (pi_x - 1 / (1 + t))
    softened = pi_x * t - t / (1 + t)
    return 1 / t, (np.pi - slope / t) / softened


def line_contact_level(x: float, y: float, dy: float) -> tuple[float, float]:
    """F(x) and its slope where the logarithmic law is ``y`` with the slope ``dy``, at ``x > 0``:
    what `line_contact` undoes."""
    level = np.pi * x / y - np.log1p(1 / y)
    slope = np.pi / y + dy / y * (1 / (1 + y) - np.pi * x / y)
    return float(level), float(slope)


def bent(a: Array, travel: Array, toe: Array) -> tuple[Array, Array]:
    """``h(a)`` and its slope: ``t f(a)/f(t)``, ``f(a) = a + sqrt(a^2 + w^2) - (sqrt(2) - 1) w``, of
    ``travel`` t and ``toe`` w, which is t at t and 0 at -w, negative below."""
    cut = _BEND * toe
    root = np.maximum(np.hypot(a, toe), 1e-300)
    end = travel + np.hypot(travel, toe) - cut
    share = travel / np.maximum(end, 1e-300)
    return share * (a + root - cut), share * (1 + a / root)


class Piece(NamedTuple):
    """Cubics between two nodes each, arrays ``(...)``, over t from 0 to 1: ``f + t (first + t
    (second + t third))``."""

    width: Array
    f: Array
    first: Array
    second: Array
    third: Array

    @classmethod
    def of(cls, nodes: Array, f: Array, df: Array, i: Ints) -> Piece:
        """The pieces from the nodes ``i`` on."""
        return cls.between(nodes[i + 1] - nodes[i], f[i], f[i + 1], df[i], df[i + 1])

    @classmethod
    def between(cls, width: Array, f: Array, last: Array, df: Array, last_df: Array) -> Piece:
        """The pieces from ``f`` to ``last``, with the slopes ``df`` and ``last_df``."""
        rise = last - f
        begin = width * df
        end = width * last_df
        second = 3 * rise - 2 * begin - end
        third = begin + end - 2 * rise
        return cls(width, f, begin, second, third)

    def at(self, t: Array) -> tuple[Array, Array]:
        """Values, and slopes by t."""
        value = self.f + t * (self.first + t * (self.second + t * self.third))
        return value, self.first + t * (2 * self.second + t * 3 * self.third)


def hermite(nodes: Array, f: Array, df: Array, x: Array) -> tuple[Array, Array]:
    """The cubics through ``f`` with slopes ``df`` ``(n,)``, and their slopes, at ``x``; beyond the
    ends straight on."""
    i = interval(nodes, x)
    inside = np.clip(x, nodes[0], nodes[-1])
    piece = Piece.of(nodes, f, df, i)
    t = (inside - nodes[i]) / piece.width
    value, rise = piece.at(t)
    slope = rise / piece.width
    return value + slope * (x - inside), slope


def interval(nodes: Array, x: Array) -> Ints:
    """The last i below the last node with ``nodes[i] <= x``, or 0."""
    below = np.searchsorted(nodes, x, "right") - 1
    return np.clip(below, 0, len(nodes) - 2)
