"""P(delta) of one joint as a table, with its way back: what every law is reduced to before it is
used or exported.

All is dimensionless: ``x = delta/dR``, ``y = P/unit``. Between nodes curves are cubic (Hermite). Up
to the first node above zero, where the contact is Hertz's, the table may follow the logarithmic law
of line contact,

    pi x/y + ln(y/(1 + y)) = F(x),    F = a + b x + c x^2,

which has no slope at x = 0. After yielding, a joint comes back along its ``back`` curve, that of an
elastic joint of another clearance and origin: ``y = r back(h(a)/r)``, ``a = x - deepest + travel``,
with the ``ratio`` r, a function of the deepest x, and the ``travel`` by which both curves meet
there. As what has yielded does not fit any longer, contact ends more softly: ``h`` is a above the
``toe`` w, another such function, bends there, and is 0 at -w, where the joint opens. ``deepest`` is
all that has to be remembered. Reloading goes the same way, and on along the first loading.
"""

from __future__ import annotations

import json
import warnings
from dataclasses import asdict, dataclass, field, fields
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from archord.postprocess.laws.general.joint import Array
from archord.report.readable import json_of

# of Newton's method for the logarithmic law: quadratic, from a guess that is good to some per cent
_ITERATIONS = 6
_INSIDE = 1 + 1e-9  # of the last node, but for round-off
_NUMBER = 1e300  # beyond it nothing is a displacement
_NEWER = ("length_unit", "force_unit", "pin_length")  # which files of earlier versions lack
_BEND = np.sqrt(2) - 1
_BRACKETED = 60  # iterations at most of Newton's method for an inverse, which bisects where it must


class CurveState(NamedTuple):
    """What a joint's law says at displacements ``(...)``: force, dP/d(delta), and the error of the
    force expected of 9 in 10 joints; largest pressure and semi-angle [rad] of the contact, nan on
    the way back after yielding. Beyond the table all but the force are nan, and of nan all."""

    load: Array
    stiffness: Array
    error: Array
    peak_pressure: Array
    angle: Array


@dataclass(frozen=True)
class JointCurve:
    """The law of one joint, or of several: tables ``(..., n)`` over the nodes ``x`` ``(n,)``, which
    begin with 0.

    ``length`` (dR), ``force`` and ``pressure`` are the units of x, y and p0, positive numbers or
    ``(..., 1)``. ``y`` and ``dy`` are force and slope on first loading, ``back`` and ``dback``
    those of the curve that unloading follows, ``ratio`` and ``dratio`` its r by the deepest x,
    ``toe``, straight between nodes, its toe. ``touch`` ``(..., 3)`` has a, b, c of the logarithmic
    law; empty ``(0,)`` without one. ``peak``, ``dpeak`` are of p0/sqrt(y), ``angle``, ``dangle`` of
    eps/sqrt(y): nearly constant at first touch; nan where unknown. Beyond the last node curves go
    on along their tangents. Expected errors are of 9 in 10 joints, straight between nodes:
    ``error`` that of y on loading, over y, ``back_error`` on the way back, over the largest y.
    ``about`` says what it is the law of and where it comes from, ``length_unit`` and ``force_unit``
    name the units of displacement and force, and ``pin_length`` is the length of the pin that
    carries the force: 1 where forces are per unit length.
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
    length: Any = 1.0
    force: Any = 1.0
    pressure: Any = 1.0
    about: dict[str, Any] = field(default_factory=dict)
    length_unit: str = "unit of R"
    force_unit: str = "unit of E* times unit of R"
    pin_length: float = 1.0

    @property
    def yields(self) -> bool:
        """Whether the way back is another than first loading."""
        same = np.array_equal(self.y, self.back) and np.array_equal(self.dy, self.dback)
        return not (same and (self.ratio == 1).all() and (self.dratio == 0).all())

    @property
    def limit(self) -> Any:
        """Largest displacement that the table covers."""
        return self.length * self.x[-1]

    @property
    def reach(self) -> float:
        """Largest x that counts as within the table."""
        return float(_INSIDE * self.x[-1])

    @property
    def widest(self) -> Any:
        """Semi-angle [rad] that cubics between nodes do not exceed: a quarter of a circle, or the
        largest node's."""
        largest = (self.angle * np.sqrt(self.y)).max(axis=-1, keepdims=self.y.ndim > 1)
        return np.where(largest > _INSIDE * np.pi / 2, largest, np.pi / 2)

    def at(self, delta: npt.ArrayLike, deepest: npt.ArrayLike = 0.0) -> CurveState:
        """All quantities at ``delta`` after the joint has been as deep as ``deepest`` (both ``(...,
        k)``); 0 where the joint is open. Warns beyond the table."""
        x = np.asarray(delta, float) / self.length
        most = np.maximum(np.asarray(deepest, float) / self.length, 0.0)
        x, most = np.broadcast_arrays(np.maximum(x, -1.0), most)
        numbers = (x <= _NUMBER) & (most <= _NUMBER)
        known = numbers & (x <= self.reach)
        if self.yields:
            known &= (x <= 0) | (most <= self.reach)
        x, most = (np.where(numbers, values, 0.0) for values in (x, most))
        if (np.maximum(x, most) > self.reach).any():
            warnings.warn(
                f"archord: beyond {self.x[-1]:g} dR, where the joint's table ends, it goes on straight",
                stacklevel=2,
            )
        y, dy = self._loading(np.maximum(x, 0.0))
        root = np.sqrt(y)
        peak, angle = (
            hermite(self.x, f, df, x)[0] * root
            for f, df in ((self.peak, self.dpeak), (self.angle, self.dangle))
        )
        angle = np.minimum(angle, self.widest)
        error = y * linear(self.x, self.error, x)
        returning = x < most
        if returning.any() and self.yields:
            ymost, ratio, travel, toe = self._way(most)
            a, da = bent(x - most + travel, travel, toe)
            yb, dyb = self._curve(self.back, self.dback, np.maximum(a / ratio, 0.0))
            yb, dyb = ratio * yb, np.where(a > 0, da * dyb, 0.0)
            above = yb > y
            yb, dyb = np.where(above, y, yb), np.where(above, dy, dyb)
            y, dy = np.where(returning, yb, y), np.where(returning, dyb, dy)
            error = np.where(returning, ymost * linear(self.x, self.back_error, most), error)
            peak, angle = (np.where(returning, np.nan, values) for values in (peak, angle))
        y, dy, error, peak, angle = (
            np.where(x <= 0, 0.0, values) for values in (y, dy, error, peak, angle)
        )
        y = np.where(numbers, y, np.nan)
        dy, error, peak, angle = (
            np.where(known, values, np.nan) for values in (dy, error, peak, angle)
        )
        return CurveState(
            y * self.force,
            dy * self.force / self.length,
            error * self.force,
            peak * self.pressure,
            angle,
        )

    def displacement(self, load: npt.ArrayLike) -> Array:
        """The displacement of first loading at which the force is ``load`` ``(..., k)``; nan beyond
        the table's."""
        y = np.asarray(load, float) / self.force
        known = y <= self.y[..., -1:]
        return (
            np.where(known, self._inverse(self.y, self.dy, np.where(known, y, 0.0)), np.nan)
            * self.length
        )

    def residual(self, deepest: npt.ArrayLike) -> Array:
        """The displacement ``(..., k)`` at which the joint opens on its way back from ``deepest``;
        nan beyond the table if it yields."""
        most = np.maximum(np.asarray(deepest, float) / self.length, 0.0)
        known = most <= (self.reach if self.yields else _NUMBER)
        most = np.where(known, most, 0.0)
        _, _, travel, toe = self._way(most)
        return np.where(known, np.maximum(most - travel - toe, 0.0), np.nan) * self.length

    def _way(self, most: Array) -> tuple[Array, Array, Array, Array]:
        """Of the way back from ``most`` its y there, ratio, travel and toe."""
        y = self._loading(most)[0]
        ratio = np.maximum(hermite(self.x, self.ratio, self.dratio, most)[0], 1e-3)
        return y, ratio, ratio * self._back_displacement(y / ratio), linear(self.x, self.toe, most)

    def _loading(self, x: Array) -> tuple[Array, Array]:
        return self._curve(self.y, self.dy, x)

    def _back_displacement(self, y: Array) -> Array:
        return self._inverse(self.back, self.dback, y)

    def _curve(self, f: Array, df: Array, x: Array) -> tuple[Array, Array]:
        """``f`` and its slope at ``x >= 0``."""
        y, dy = hermite(self.x, f, df, x)
        if self.touch.size:
            ty, tdy = first_touch(self.touch, np.clip(x, 1e-290, self.x[1]))
            y, dy = np.where(x < self.x[1], ty, y), np.where(x < self.x[1], tdy, dy)
        return np.where(x <= 0, 0.0, y), np.where(x <= 0, 0.0, dy)

    def _inverse(self, f: Array, df: Array, y: Array) -> Array:
        """The ``x`` at which the rising curve ``f`` is ``y``; 0 where ``y <= 0``."""
        f, df, y = np.broadcast_arrays(f[..., None, :], df[..., None, :], y[..., None])
        f, df, y = f.reshape(-1, len(self.x)), df.reshape(-1, len(self.x)), y[..., 0]
        shape, rows = y.shape, np.arange(f.shape[0])
        values: Array = y.ravel()
        i = np.clip((f <= values[:, None]).sum(-1) - 1, 0, len(self.x) - 2)
        x0, h = self.x[i], self.x[i + 1] - self.x[i]
        f0, f1, d0, d1 = f[rows, i], f[rows, i + 1], h * df[rows, i], h * df[rows, i + 1]
        rise = np.where(f1 > f0, f1 - f0, 1.0)
        goal = np.clip(values, f0, f1)
        low, high, t = np.zeros_like(goal), np.ones_like(goal), (goal - f0) / rise
        for _ in range(_BRACKETED):
            miss, slope, last = _cubic(t, f0, f1, d0, d1) - goal, _cubic_slope(t, f0, f1, d0, d1), t
            low, high = np.where(miss < 0, t, low), np.where(miss < 0, high, t)
            t = t - miss / np.maximum(slope, 1e-100)
            t = np.where((t - low) * (high - t) < 0, (low + high) / 2, t)
            if not (np.abs(t - last) >= 1e-12).any():
                break
        end = self.x[-1] + (values - f[:, -1]) / np.maximum(df[:, -1], 1e-100)
        x = np.where(values > f[:, -1], end, x0 + h * t).reshape(shape)
        if self.touch.size:
            a, b, c = _each(self.touch)
            early = (y > 0) & (y < f[rows, 1].reshape(shape))
            v = np.where(early, y, 1.0)
            log = np.log1p(1 / v)
            u = v * (a + log) / np.pi
            for _ in range(_ITERATIONS):
                u = u - (np.pi * u / v - a - u * (b + c * u) - log) / (np.pi / v - b - 2 * c * u)
            x = np.where(early, u, x)
        return np.where(y > 0, x, 0.0)

    def to_json(self) -> str:
        """The curve as JSON; numbers in full, null for nan."""
        data = {
            name: np.where(np.isnan(value), np.array(None), value).tolist()
            if isinstance(value, np.ndarray)
            else value
            for name, value in asdict(self).items()
        }
        return json.dumps(data, indent=1, allow_nan=False) + "\n"

    @classmethod
    def from_json(cls, text: str) -> JointCurve:
        """The curve in ``text``. Raises ValueError if it is none."""
        try:
            data = json_of(text)
            given: dict[str, Any] = {
                f.name: np.array(data[f.name], float) if f.type == "Array" else data[f.name]
                for f in fields(cls)
                if f.name in data or f.name not in _NEWER
            }
        except (KeyError, TypeError) as error:
            raise ValueError(f"is no table of a joint's law: {error}") from None
        return cls(**given)


def first_touch(touch: Array, x: Array) -> tuple[Array, Array]:
    """``y`` and ``dy/dx`` of the logarithmic law of ``touch`` ``(..., 3)`` at ``x > 0`` ``(...,
    k)``."""
    a, b, c = _each(touch)
    return line_contact(x, a + x * (b + c * x), b + 2 * c * x)


def _each(touch: Array) -> Array:
    """a, b, c of `first_touch` ``(3, ..., 1)``, of one joint ``(3,)``."""
    return touch if touch.ndim == 1 else np.moveaxis(touch, -1, 0)[..., None]


def line_contact(x: Array, F: Array, slope: Array) -> tuple[Array, Array]:
    """``y`` and ``dy/dx`` at ``x > 0`` where F(x) and its ``slope`` are these: ``t = 1/y`` solves
    ``pi x t - ln(1 + t) = F``, which is convex in t, by Newton's method."""
    t = (F + np.log1p(F / (np.pi * x))) / (np.pi * x)
    for _ in range(_ITERATIONS):
        t = t - (np.pi * x * t - np.log1p(t) - F) / (np.pi * x - 1 / (1 + t))
    return 1 / t, (np.pi - slope / t) / (np.pi * x * t - t / (1 + t))


def bent(a: Array, travel: Array, toe: Array) -> tuple[Array, Array]:
    """``h(a)`` and its slope: ``t f(a)/f(t)``, ``f(a) = a + sqrt(a^2 + w^2) - (sqrt(2) - 1) w``, of
    ``travel`` t and ``toe`` w, which is t at t and 0 at -w, negative below."""
    root = np.maximum(np.hypot(a, toe), 1e-300)
    share = travel / np.maximum(travel + np.hypot(travel, toe) - _BEND * toe, 1e-300)
    return share * (a + root - _BEND * toe), share * (1 + a / root)


def hermite(nodes: Array, f: Array, df: Array, x: Array) -> tuple[Array, Array]:
    """The cubics through ``f`` with slopes ``df`` ``(..., n)``, and their slopes, at ``x`` ``(...,
    k)``; beyond the ends straight on."""
    i = np.clip(np.searchsorted(nodes, x, "right") - 1, 0, len(nodes) - 2)
    inside = np.clip(x, nodes[0], nodes[-1])
    h = nodes[i + 1] - nodes[i]
    f0, f1, d0, d1 = _at(f, i), _at(f, i + 1), h * _at(df, i), h * _at(df, i + 1)
    t = (inside - nodes[i]) / h
    slope = _cubic_slope(t, f0, f1, d0, d1) / h
    return _cubic(t, f0, f1, d0, d1) + slope * (x - inside), slope


def linear(nodes: Array, f: Array, x: Array) -> Array:
    """``f`` ``(..., n)`` at ``x`` ``(..., k)``, straight between nodes; beyond the ends as
    there."""
    i = np.clip(np.searchsorted(nodes, x, "right") - 1, 0, len(nodes) - 2)
    t = np.clip((x - nodes[i]) / (nodes[i + 1] - nodes[i]), 0.0, 1.0)
    return _at(f, i) * (1 - t) + _at(f, i + 1) * t


def _at(f: Array, i: npt.NDArray[np.intp]) -> Array:
    """Entries ``i`` ``(..., k)`` of the last axis of ``f`` ``(..., n)``."""
    return (
        f[i]
        if f.ndim == 1
        else np.take_along_axis(f, np.broadcast_to(i, (*f.shape[:-1], i.shape[-1])), -1)
    )


def _cubic(t: Array, f0: Array, f1: Array, d0: Array, d1: Array) -> Array:
    return f0 + t * (d0 + t * (3 * (f1 - f0) - 2 * d0 - d1 + t * (2 * (f0 - f1) + d0 + d1)))


def _cubic_slope(t: Array, f0: Array, f1: Array, d0: Array, d1: Array) -> Array:
    return d0 + t * (2 * (3 * (f1 - f0) - 2 * d0 - d1) + t * 3 * (2 * (f0 - f1) + d0 + d1))
