"""The elastic joint: P(delta), p0 and eps as polynomials of what decides it, the same in plane
strain and stress.

With the pin's share ``p`` of the compliance 1/E*, ``q = 1 - p``, and ``m``, ``n`` of pin and block,
``nu/(1 - nu)`` in plane strain and ``nu`` in plane stress, three functions of ``x = delta/dR`` say
all of ``y = P/(E* dR)``:

    F = pi x/y + ln(y/(1 + y)),    p0 R/(E* dR sqrt(y)),    eps/sqrt(y)

F is constant at first touch, where the contact is a line contact's (Johnson 1985, eq. 5.57), and a
compliance at depth. Each is a sum of Chebyshev polynomials of x/(1 + x) times products of p, p m, q
n and dR/R. elastic_model.json has those that tell most, which law_fit.py chooses and fits.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from archord.materials.material import Array
from archord.postprocess.laws.general.joint_curve import line_contact
from archord.report.table import in_digits

TABLE = Path(__file__).parent / "elastic_model.json"
FARTHEST = 3.8  # delta/dR at the end of the polynomials; what is fitted ends at 3
_CLEARANCE = 0.02  # the dR/R in which dR/R is counted


class Elastic(NamedTuple):
    """What decides an elastic joint, or ``(m,)`` joints: share of the pin p, ``m`` and ``n`` of pin
    and block, ``clearance`` dR/R."""

    p: Any
    m: Any
    n: Any
    clearance: Any


class ElasticState(NamedTuple):
    """Of a joint at ``x`` ``(k,)``, or of joints ``(m, k)``: y and dy/dx, p0 R/(E* dR) and eps
    [rad]."""

    y: Array
    slope: Array
    peak: Array
    angle: Array


def products(joints: Elastic, exponents: Array) -> Array:
    """``p^a (p m)^b (q n)^c d^e`` ``(..., terms)`` for the rows a, b, c, e of ``exponents``."""
    p, m, n, clearance = joints
    factors = np.stack([p, p * m, (1 - p) * n, clearance / _CLEARANCE], axis=-1)
    return np.prod(factors[..., None, :] ** exponents, axis=-1)


@cache
def _derivative(length: int) -> Array:
    """The matrix ``(length - 1, length)`` from a series to the series of its derivative."""
    return chebyshev.chebder(np.eye(length))


def depth(x: Array) -> Array:
    """x on Chebyshev's interval from -1, first touch, to 1."""
    return 2 * (x / (1 + x)) * (1 + FARTHEST) / FARTHEST - 1


@dataclass(frozen=True)
class Polynomials:
    """One of the three functions: ``coefficients`` ``(terms, degree + 1)`` of the products with
    ``exponents``."""

    exponents: Array
    coefficients: Array

    def series(self, joints: Elastic) -> Array:
        """Coefficients ``(degree + 1, ..., 1)`` of Chebyshev's polynomials of `depth`."""
        return (products(joints, self.exponents) @ self.coefficients).T[..., None]

    def value(self, joints: Elastic, t: Array) -> Array:
        """The function ``(..., k)`` at the `depth` ``t`` ``(k,)``."""
        return chebyshev.chebval(t, self.series(joints), tensor=False)

    def at(self, joints: Elastic, x: Array) -> tuple[Array, Array]:
        """The function and its derivative by x ``(..., k)``, at ``x`` ``(k,)``."""
        t = depth(x)
        series = self.series(joints)
        value = chebyshev.chebval(t, series, tensor=False)
        slopes = np.tensordot(_derivative(len(series)), series, 1)
        rise = chebyshev.chebval(t, slopes, tensor=False)
        return value, rise * (2 * (1 + FARTHEST) / FARTHEST / (1 + x) ** 2)


@dataclass(frozen=True, eq=False)
class ElasticModel:
    """The three functions."""

    F: Polynomials
    peak: Polynomials
    angle: Polynomials

    def at(self, joints: Elastic, x: Array) -> ElasticState:
        """All quantities of ``joints`` at ``x > 0`` ``(k,)``."""
        t = depth(x)
        F, F_slope = self.F.at(joints, x)
        y, slope = line_contact(x, F, F_slope)
        root = np.sqrt(y)
        peak = self.peak.value(joints, t) * root
        angle = self.angle.value(joints, t) * root
        return ElasticState(y, slope, peak, angle)

    def pressure(self, joints: Elastic, x: Array) -> Array:
        """p0 R/(E* dR) alone, of ``joints`` at ``x > 0`` ``(k,)``."""
        t = depth(x)
        F = self.F.value(joints, t)
        y, _ = line_contact(x, F, np.zeros_like(F))
        return self.peak.value(joints, t) * np.sqrt(y)

    def to_json(self) -> str:
        """The model as a table: a row for each product, its exponents and coefficients in six
        digits."""
        tables = []
        for name, of in vars(self).items():
            rows = []
            for exponents, coefficients in zip(of.exponents, of.coefficients, strict=True):
                digits = [in_digits(c, 6) for c in coefficients]
                rows.append(json.dumps([*map(int, exponents), *digits]))
            tables.append(f' "{name}": [\n  ' + ",\n  ".join(rows) + "\n ]")
        return "{\n" + ",\n".join(tables) + "\n}\n"

    @classmethod
    def from_json(cls, text: str) -> ElasticModel:
        """The model in ``text``, as `to_json` writes it."""
        tables = {name: np.array(rows) for name, rows in json.loads(text).items()}
        return cls(**{name: Polynomials(rows[:, :4], rows[:, 4:]) for name, rows in tables.items()})


@cache
def elastic_model() -> ElasticModel:
    """The model that comes with archord."""
    return ElasticModel.from_json(TABLE.read_text(encoding="utf-8"))
