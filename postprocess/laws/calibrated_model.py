"""A compact model of k and c of the plastic-Winkler law over the numbers that decide a joint.

Elastic: 1/k is the sum of what pin and block yield, each in its share of the compliance 1/E*. A joint in plane stress
is one in plane strain with other constants, so ``n = nu/(1 - nu)`` (plane strain) or ``n = nu`` (plane stress) and
Dundurs' alpha stand for the materials in either plane:

    1/k_e = polynomial of p = (1 - alpha)/2, q = (1 + alpha)/2, m = n of the pin, n = n of the block

Plastic: k tends to the elastic one as the joint yields later and later: ``s/k_e``, ``s = sigY R/(E* dR)``, is the
displacement, in clearances, at which the elastic law's peak pressure reaches sigY. c is a power of s with an exponent
and a factor that depend on the materials. For each plane and kind of yielding

    ln(k/k_e) = A exp(-b s/k_e),    ln c = C,    A and C polynomials of x = ln(s/0.4), p, q, m, n and d = 100 dR/R

`Form` says which terms the polynomials have.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from archord.geometry.basis import Array
from archord.scene.errors import InputError

Kind = tuple[str, str]  # plane; "both" or "block" yield
KINDS: tuple[Kind, ...] = (("strain", "both"), ("strain", "block"), ("stress", "both"), ("stress", "block"))
MIDDLE = 0.4  # of s: where x = 0
SOFT = 0.5  # largest p m: beyond, the pin is soft and hardly compressible, and the pressure no parabola over the chord
JSON_BEGINS = '{\n "form": {\n  "name": '  # by which a file of `CalibratedModel.to_json` is known


@dataclass(frozen=True)
class Points:
    """The numbers that decide joints, arrays of one shape: Dundurs' ``alpha``, ``m`` and ``n`` of pin and block, ``s``
    and ``clearance`` dR/R. ``m`` of a rigid pin has no influence."""

    alpha: Array
    m: Array
    n: Array
    s: Array
    clearance: Array

    @classmethod
    def of(cls, joints: list[Any]) -> Points:
        """From joints that tell plane, alpha, pin_nu (nan or None: the block's), nu, s and clearance."""
        pins = [j.nu if j.pin_nu is None or math.isnan(j.pin_nu) else j.pin_nu for j in joints]
        return cls(
            np.array([j.alpha for j in joints]),
            np.array([equivalent(nu, j.plane) for nu, j in zip(pins, joints, strict=True)]),
            np.array([equivalent(j.nu, j.plane) for j in joints]),
            np.array([j.s for j in joints]),
            np.array([j.clearance for j in joints]),
        )

    def terms(self, names: tuple[str, ...]) -> Array:
        """The products called ``names`` ``(n, terms)``."""
        factors = {
            "1": np.ones_like(self.alpha),
            "p": (1 - self.alpha) / 2,
            "q": (1 + self.alpha) / 2,
            "m": self.m,
            "n": self.n,
            "x": np.log(np.where(np.isfinite(self.s), self.s, MIDDLE) / MIDDLE),
            "d": 100 * self.clearance,
        }
        columns = [np.prod([factors[letter] for letter in name], axis=0) for name in names]
        return np.stack(columns, axis=-1) if columns else np.zeros((*self.alpha.shape, 0))


def equivalent(nu: float, plane: str) -> float:
    """Poisson's ratio that a body in plane stress would need to deform like this one in its plane."""
    return nu / (1 - nu) if plane == "strain" else nu


SOFT_WORDS = "(1 - alpha)/2 times the pin's equivalent Poisson's ratio"


def pin_softness(joint: Any) -> float:
    """p m of a joint that tells plane, alpha and pin_nu; 0 for a rigid pin."""
    if joint.alpha == 1 or joint.pin_nu is None or math.isnan(joint.pin_nu):
        return 0.0
    return (1 - joint.alpha) / 2 * equivalent(joint.pin_nu, joint.plane)


@dataclass(frozen=True)
class Form:
    """Terms of 1/k_e, of A for late yielding, and of ln c in plane ``strain`` and plane ``stress``; without ``late``
    terms k is the elastic one throughout."""

    name: str
    elastic: tuple[str, ...]
    late: tuple[str, ...]
    strain: tuple[str, ...]
    stress: tuple[str, ...]

    def threshold(self, plane: str) -> tuple[str, ...]:
        """Terms of ln c in a plane."""
        return self.strain if plane == "strain" else self.stress


@dataclass(frozen=True)
class Plastic:
    """Coefficients of one plane and kind of yielding: ``rate`` b, of A, and of ln c; how many cases they are from."""

    plane: str
    yielding: str
    rate: float
    late: tuple[float, ...]
    threshold: tuple[float, ...]
    cases: int
    cases_of_c: int


@dataclass(frozen=True)
class Bounds:
    """Smallest and largest of the cases fitted, of one plane and kind of yielding ("none": elastic)."""

    plane: str
    yielding: str
    nu: tuple[float, float]
    pin_nu: tuple[float, float]
    modulus_ratio: tuple[float, float]
    alpha: tuple[float, float]
    clearance: tuple[float, float]
    strength: tuple[float, float]
    s: tuple[float, float]


@dataclass(frozen=True)
class CalibratedModel:
    """The model with its coefficients: ``elastic`` of 1/k_e, ``plastic`` by kind, ``bounds`` of what was fitted.

    ``load_range`` is delta/dR of the steps fitted, ``errors`` say how good it is (`cross_validation`), ``provenance``
    where it is from.
    """

    form: Form
    elastic: tuple[float, ...]
    plastic: tuple[Plastic, ...]
    bounds: tuple[Bounds, ...]
    load_range: tuple[float, float]
    errors: dict[str, Any] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)

    def elastic_k(self, points: Points) -> Array:
        """k without yielding ``(n,)``."""
        return 1 / (points.terms(self.form.elastic) @ np.array(self.elastic))

    def coefficients(self, kind: Kind, points: Points) -> tuple[Array, Array]:
        """k and c ``(n,)``; c is infinite where s is. Raises `InputError` for a kind that was not fitted."""
        k = self.elastic_k(points)
        if kind[1] == "none":
            return k, np.full(k.shape, np.inf)
        found = self.of(kind)
        late = np.exp(-found.rate * points.s / k)
        k = k * np.exp(late * (points.terms(self.form.late) @ np.array(found.late)))
        c = np.exp(points.terms(self.form.threshold(kind[0])) @ np.array(found.threshold))
        return k, np.where(np.isfinite(points.s), c, np.inf)

    def of(self, kind: Kind) -> Plastic:
        """The coefficients of a kind. Raises `InputError` if no such joints were fitted."""
        for part in self.plastic:
            if (part.plane, part.yielding) == kind:
                return part
        raise InputError(f"calibrated: no joint in plane {kind[0]} of which {kind[1]} yields was fitted.")

    def bounds_of(self, kind: Kind) -> Bounds | None:
        """The range of a kind; None if it was not fitted."""
        return next((b for b in self.bounds if (b.plane, b.yielding) == kind), None)

    @property
    def numbers(self) -> int:
        """How many coefficients there are."""
        return len(self.elastic) + sum(len(p.late) + bool(p.late) + len(p.threshold) for p in self.plastic)

    def to_json(self) -> str:
        """The model as JSON; infinite bounds are null."""
        text = json.dumps(_plain(asdict(self)), indent=1, ensure_ascii=False, allow_nan=False)
        return re.sub(r"\[\s+([^][{}]*?)\s+\]", lambda found: f"[{' '.join(found[1].split())}]", text) + "\n"

    @classmethod
    def from_json(cls, text: str) -> CalibratedModel:
        """The model in ``text``, written by `to_json`. Raises `InputError`."""
        try:
            data = json.loads(text)
            form = Form(**_tuples(data["form"]))
            plastic = tuple(Plastic(**_tuples(part)) for part in data["plastic"])
            bounds = tuple(Bounds(**_tuples(part)) for part in data["bounds"])
            low, high = data["load_range"]
            return cls(form, tuple(data["elastic"]), plastic, bounds, (low, high), data["errors"], data["provenance"])
        except (ValueError, KeyError, TypeError, AttributeError):
            raise InputError("law: is not a calibrated law, as archord fit SWEEP --law writes it.") from None


def _tuples(record: dict[str, Any]) -> dict[str, Any]:
    return {
        name: tuple(math.inf if entry is None else entry for entry in value) if isinstance(value, list) else value
        for name, value in record.items()
    }


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
