"""k and c of the plastic-Winkler law where nobody has solved the joint: a compact model over what decides a joint.

`calibrated` gives the numbers of the model that comes with archord, ``LAWS["calibrated"]`` the law. The model with its
ranges and errors is data, calibrated_law.json, the cases that it was fitted to are calibrated_rows.csv;
docs/calibration.md says how to solve and fit them again, study.py fits.

Elastic: 1/k is the sum of what pin and block yield, each in its share of the compliance 1/E*. A joint in plane stress
is one in plane strain with other constants, so ``n = nu/(1 - nu)`` (plane strain) or ``n = nu`` (plane stress) and
Dundurs' alpha stand for the materials in either plane:

    1/k_e = polynomial of p = (1 - alpha)/2, q = (1 + alpha)/2, m = n of the pin, n = n of the block

Plastic: k tends to the elastic one as the joint yields later and later: ``s/k_e``, ``s = sigY R/(E* dR)``, is the
displacement, in clearances, at which the elastic law's peak pressure reaches sigY. c is a power of s with an exponent
and a factor that depend on the materials. For each plane and kind of yielding

    ln(k/k_e) = A exp(-b s/k_e),    ln c = C,    A and C polynomials of x = ln(s/0.4), p, q, m, n and d = 100 dR/R
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from archord.postprocess.laws.joint import Array, LawJoint
from archord.postprocess.laws.law import Outside, warn

Kind = tuple[str, str]  # plane; which bodies yield, "none", "both" or "block"
TABLE = Path(__file__).parent / "calibrated_law.json"
ROWS = Path(__file__).parent / "calibrated_rows.csv"
JSON_BEGINS = '{\n "form": {\n  "name": '  # by which a file of `CalibratedModel.to_json` is known
MIDDLE = 0.4  # of s: where x = 0
SOFT = 0.5  # largest p m: beyond, the pin is soft and hardly compressible, and the pressure no parabola over the chord
SOFT_WORDS = "(1 - alpha)/2 times the pin's equivalent Poisson's ratio"
UNFIT = {"pin": "only the pin yields", "unlike": "the bodies have unlike yield stresses"}
_RATIO = "E'(pin)/E'(block)"
_LAST_DIGITS = 1e-3  # of the bounds as they are stored, and of moduli that a scene has rounded


@dataclass(frozen=True)
class Points:
    """The numbers that decide joints, arrays ``(n,)``: Dundurs' ``alpha``, ``m`` and ``n`` of pin and block, ``s`` and
    ``clearance`` dR/R. ``m`` of a rigid pin has no influence."""

    alpha: Array
    m: Array
    n: Array
    s: Array
    clearance: Array

    @classmethod
    def of(cls, joints: Mapping[str, Any]) -> Points:
        """From plane, alpha, pin_nu (nan: the block's), nu, s and clearance of ``joints``, numbers or arrays."""
        names = ("plane", "alpha", "pin_nu", "nu", "s", "clearance")
        plane, alpha, pin, nu, s, clearance = np.broadcast_arrays(*(np.atleast_1d(joints[name]) for name in names))
        ratios = np.stack([np.where(np.isnan(pin), nu, pin), nu])
        # Poisson's ratios that bodies in plane stress would need to deform like these in their plane
        m, n = np.where(plane == "strain", ratios / (1 - ratios), ratios)
        return cls(alpha, m, n, s, clearance)

    def terms(self, names: list[str]) -> Array:
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
        return np.stack([np.prod([factors[letter] for letter in name], axis=0) for name in names], axis=-1)


@dataclass(frozen=True)
class CalibratedModel:
    """The model as the ``data`` of its JSON file.

    ``form`` has the terms of 1/k_e ("elastic"), of A ("late"), and of C in plane "strain" and "stress"; ``elastic`` the
    coefficients of 1/k_e; ``plastic``, by plane and yielding, ``rate`` b, those of A ("late") and C ("threshold"), and
    from how many cases they are; ``bounds``, likewise, the smallest and largest of what was fitted (None: infinite);
    ``load_range`` is delta/dR of the steps fitted; ``errors`` say how good the model is, ``provenance`` where it is
    from.
    """

    data: dict[str, Any]

    def elastic_k(self, points: Points) -> Array:
        """k without yielding ``(n,)``."""
        return 1 / (points.terms(self.data["form"]["elastic"]) @ np.array(self.data["elastic"]))

    def coefficients(self, kind: Kind, points: Points) -> tuple[Array, Array]:
        """k and c ``(n,)``; c is infinite where s is. Raises ValueError for a kind that was not fitted."""
        k = self.elastic_k(points)
        if kind[1] == "none":
            return k, np.full(k.shape, np.inf)
        found, form = self.plastic(kind), self.data["form"]
        late = np.exp(-found["rate"] * points.s / k)
        k = k * np.exp(late * (points.terms(form["late"]) @ np.array(found["late"])))
        c = np.exp(points.terms(form[kind[0]]) @ np.array(found["threshold"]))
        return k, np.where(np.isfinite(points.s), c, np.inf)

    def plastic(self, kind: Kind) -> dict[str, Any]:
        """The coefficients of a kind. Raises ValueError if no such joints were fitted."""
        for part in self.data["plastic"]:
            if (part["plane"], part["yielding"]) == kind:
                return part
        raise ValueError(f"calibrated: no joint in plane {kind[0]} of which {kind[1]} yields was fitted.")

    def bounds(self, kind: Kind) -> dict[str, tuple[float, float]]:
        """The range of a kind, empty if it was not fitted.

        One design covers all kinds, so Poisson's ratios, clearance and the softest pin are from all cases together, the
        smallest s from those in the plane; the stiffest pin is the kind's own.
        """
        every = self.data["bounds"]
        own = next((b for b in every if (b["plane"], b["yielding"]) == kind), None)
        if own is None:
            return {}
        same = [b for b in every if b["plane"] == kind[0] and b["yielding"] != "none"] or [own]
        found = {name: _widest(name, every) for name in ("nu", "pin_nu", "clearance", "alpha")}
        return found | {"s": _widest("s", same), "alpha": (found["alpha"][0], own["alpha"][1])}

    def to_json(self) -> str:
        """The model as JSON."""
        text = json.dumps(self.data, indent=1, ensure_ascii=False, allow_nan=False)
        return re.sub(r"\[\s+([^][{}]*?)\s+\]", lambda found: f"[{' '.join(found[1].split())}]", text) + "\n"

    @classmethod
    def from_json(cls, text: str) -> CalibratedModel:
        """The model in ``text``, written by `to_json`. Raises ValueError."""
        try:
            model = cls(json.loads(text))
            for kind in [("strain", "none"), *((part["plane"], part["yielding"]) for part in model.data["plastic"])]:
                model.coefficients(kind, Points(*np.full((5, 1), 0.3)))
                model.bounds(kind)
            if not {"load_range", "errors", "provenance"} <= model.data.keys():
                raise KeyError
        except (ValueError, KeyError, TypeError, AttributeError):
            raise ValueError("law: is not a calibrated law, as archord fit SWEEP --law writes it.") from None
        return model


def _widest(name: str, bounds: list[dict[str, Any]]) -> tuple[float, float]:
    pairs = [[math.inf if value is None else value for value in b[name]] for b in bounds]
    return min(low for low, _ in pairs), max(high for _, high in pairs)


@cache
def shipped_model() -> CalibratedModel:
    """The model that comes with archord."""
    return CalibratedModel.from_json(TABLE.read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Calibrated:
    """k and c of a joint (c infinite: elastic), ``outside``, what of the joint lies outside the range (empty: nothing),
    and the cross-validated errors of its kind: relative, rms and largest of k, c and P."""

    k: float
    c: float
    outside: str
    errors: dict[str, Any]


def calibrated(
    plane: str,
    nu: float,
    modulus_ratio: float = 1.0,
    s: float = math.inf,
    yielding: str = "both",
    pin_nu: float | None = None,
    clearance: float = 0.005,
    outside: Outside = "nan",
) -> Calibrated:
    """k and c of a joint for ``chord_laws.plastic_force``.

    ``plane`` is "strain" or "stress", ``nu`` Poisson's ratio of the block and ``pin_nu`` of the pin (None: the same),
    ``modulus_ratio`` E of the pin over E of the block (infinite: a rigid pin), ``s = sigY R/(E* dR)`` (infinite:
    elastic), ``yielding`` "both" or "block", ``clearance`` dR/R. Outside the range of the cases fitted k and c are
    nan, with a `LawRangeWarning`; ``outside`` "raise" and "extrapolate" as for every `Law`. Raises ValueError for
    values that make no joint.
    """
    for name, value in (("modulus_ratio", modulus_ratio), ("s", s)):
        if not value > 0:
            raise ValueError(f"{name} = {value:g} must be a positive number.")
    alpha = dundurs_alpha(plane, modulus_ratio, nu if pin_nu is None else pin_nu, nu)
    joint = LawJoint(1.0, clearance, 1.0, None if math.isinf(s) else clearance * s, dundurs_alpha=alpha,
                     plane=plane, nu=nu, pin_nu=pin_nu, yielding=yielding)  # fmt: skip
    found = joint_calibrated(joint)
    if not found.outside:
        return found
    warn(f"calibrated: {found.outside}", outside)
    return found if outside == "extrapolate" else replace(found, k=math.nan, c=math.nan)


def dundurs_alpha(plane: str, ratio: float, pin_nu: float, nu: float) -> float:
    """Dundurs' alpha, positive for the stiffer pin, where E of the pin is ``ratio`` times E of the block; 1: rigid."""
    if math.isinf(ratio):
        return 1.0
    moduli = ratio * ((1 - nu**2) / (1 - pin_nu**2) if plane == "strain" else 1.0)
    return (moduli - 1) / (moduli + 1)


def joint_calibrated(joint: LawJoint, model: CalibratedModel | None = None) -> Calibrated:
    """k and c of ``joint``, which must tell plane and nu, by ``model`` [that of archord]; outside the range those of
    the formulas, with the reason.

    Of a joint that no formula is for, "both" stands for bodies with unlike yield stresses, and for the pin alone.
    """
    model = model or shipped_model()
    assert joint.plane is not None
    assert joint.nu is not None
    s = math.inf
    if joint.yield_stress is not None:
        s = joint.yield_stress * joint.radius / (joint.E_star * joint.clearance)
    kind = joint.plane, "none" if math.isinf(s) else "block" if joint.yielding == "block" else "both"
    pin_nu = joint.nu if joint.pin_nu is None else joint.pin_nu
    points = Points.of({"plane": joint.plane, "alpha": joint.dundurs_alpha, "pin_nu": pin_nu, "nu": joint.nu, "s": s,
                        "clearance": joint.clearance / joint.radius})  # fmt: skip
    k, c = model.coefficients(kind, points)
    reason = UNFIT.get(joint.yielding, "") if joint.yield_stress is not None else ""
    errors = model.data["errors"].get("cross-validated", {}).get(" ".join(kind), {})
    return Calibrated(float(k[0]), float(c[0]), reason or _stray(points, pin_nu, joint.nu, model.bounds(kind)), errors)


def _stray(points: Points, pin_nu: float, nu: float, bounds: dict[str, tuple[float, float]]) -> str:
    """What of a joint lies outside the range of the cases fitted; later yielding than theirs does not matter."""
    if not bounds:
        return "no joint of this plane and kind of yielding was fitted"
    alpha, m, _, s, clearance = (float(value[0]) for value in vars(points).values())
    checks = [("nu of the block", nu, bounds["nu"])]
    if alpha < 1:
        checks += [("nu of the pin", pin_nu, bounds["pin_nu"]), (SOFT_WORDS, (1 - alpha) / 2 * m, (0.0, SOFT))]
    softest, stiffest = (stiffness_ratio(value) for value in bounds["alpha"])
    checks += [(_RATIO, stiffness_ratio(alpha), (softest, stiffest)), ("dR/R", clearance, bounds["clearance"])]
    if math.isfinite(s):
        checks.append(("sigY R/(E* dR)", s, (bounds["s"][0], math.inf)))
    for name, value, (low, high) in checks:
        slack = _LAST_DIGITS * max(abs(low), abs(high) if math.isfinite(high) else 0.0)
        if not low - slack <= value <= high + slack:
            upper = "and more" if math.isinf(high) else f"to {high:.4g}"
            return f"{name} = {value:.4g} is outside {low:.4g} {upper}"
    return ""


def stiffness_ratio(alpha: float) -> float:
    """E' of the pin over that of the block, with E' = E/(1 - nu^2) or E by plane."""
    return math.inf if alpha >= 1 else (1 + alpha) / (1 - alpha)


def with_coefficients(joint: LawJoint) -> LawJoint:
    """``joint`` with its k and c by the model of archord."""
    found = joint_calibrated(joint)
    return replace(joint, k=found.k, c=found.c if math.isfinite(found.c) else 1.0)
