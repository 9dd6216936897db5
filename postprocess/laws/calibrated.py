"""k and c of the plastic-Winkler law where nobody has solved the joint: a compact model over what decides a joint.

The model that comes with archord is data with its ranges and errors, calibrated_law.json; the cases that it was fitted
to are calibrated_rows.csv. docs/calibration.md says how to solve and fit them again, study.py fits. A joint in plane
stress is one in plane strain with other constants: ``n = nu/(1 - nu)`` (plane strain) or ``n = nu`` (plane stress)

    1/k_e = polynomial of p = (1 - alpha)/2, q = (1 + alpha)/2, m = n of the pin, n = n of the block
    ln(k/k_e) = A exp(-b s/k_e),    ln c = C,    A and C polynomials of x = ln(s/0.4), p, q, m, n and d = 100 dR/R

with Dundurs' alpha and ``s = sigY R/(E* dR)``; A, b and C for each plane and kind of yielding. ``s/k_e`` is the
displacement, in clearances, at which the elastic law's peak pressure reaches sigY.
"""

from __future__ import annotations

import json
import math
import re
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from archord.postprocess.laws.joint import Array, LawJoint

TABLE = Path(__file__).parent / "calibrated_law.json"
_MIDDLE = 0.4  # of s: where x = 0
SOFT = 0.5  # largest p m: beyond, the pin is soft and hardly compressible, and the pressure no parabola over the chord
SOFT_WORDS = "(1 - alpha)/2 times the pin's equivalent Poisson's ratio"
UNFIT = {"pin": "only the pin yields", "unlike": "the bodies have unlike yield stresses"}
_LAST_DIGITS = 1e-3  # of the bounds as they are stored, and of moduli that a scene has rounded


def equivalent_nu(strain: Any, nu: Any) -> Any:
    """Poisson's ratio that a body in plane stress would need to deform like this one, in plane ``strain`` or not."""
    return np.where(strain, nu / (1 - nu), nu)


class Points(NamedTuple):
    """The numbers that decide joints, ``(n,)`` or of one joint: Dundurs' ``alpha``, ``m`` and ``n`` of pin and block,
    ``s`` and ``clearance`` dR/R; a table of cases has them, too. ``m`` of a rigid pin has no influence."""

    alpha: Array
    m: Array
    n: Array
    s: Array
    clearance: Array


def terms(points: Any, names: list[str]) -> Array:
    """The products called ``names`` ``(n, terms)`` of the numbers of `Points`."""
    alpha, m, n, s, clearance = (np.asarray(getattr(points, name)) for name in Points._fields)
    x = np.log(np.where(np.isfinite(s), s, _MIDDLE) / _MIDDLE)
    factors = {"1": np.ones_like(alpha), "p": (1 - alpha) / 2, "q": (1 + alpha) / 2, "m": m, "n": n, "x": x,
               "d": 100 * clearance}  # fmt: skip
    return np.stack([np.prod([factors[letter] for letter in name], axis=0) for name in names], axis=-1)


@dataclass(frozen=True)
class CalibratedModel:
    """The model as the ``data`` of its JSON file; a kind of joint is its plane and which bodies yield, "strain none",
    "stress both" or "strain block".

    ``form`` has the terms of 1/k_e ("elastic"), of A ("late"), and of C in plane "strain" and "stress"; ``elastic`` the
    coefficients of 1/k_e; ``plastic``, by kind, ``rate`` b, those of A ("late") and C ("threshold"), and their numbers
    of cases; ``bounds``, by kind, the range of the joints (None: infinite); ``load_range`` is delta/dR of the steps.
    """

    data: dict[str, Any]

    def elastic_k(self, points: Any) -> Array:
        """k without yielding ``(n,)`` of `Points`, or of a table of cases."""
        return 1 / (terms(points, self.data["form"]["elastic"]) @ np.array(self.data["elastic"]))

    def coefficients(self, kind: str, points: Any) -> tuple[Array, Array]:
        """k and c ``(n,)``; c is infinite where s is. Raises ValueError for a kind that was not fitted."""
        k, (plane, yielding) = self.elastic_k(points), kind.split()
        if yielding == "none":
            return k, np.full(k.shape, np.inf)
        if kind not in self.data["plastic"]:
            raise ValueError(f"calibrated: no joint in plane {plane} of which {yielding} yields was fitted.")
        found, form, s = self.data["plastic"][kind], self.data["form"], np.asarray(points.s)
        late = np.exp(-found["rate"] * s / k)
        k = k * np.exp(late * (terms(points, form["late"]) @ np.array(found["late"])))
        c = np.exp(terms(points, form[plane]) @ np.array(found["threshold"]))
        return k, np.where(np.isfinite(s), c, np.inf)

    def to_json(self) -> str:
        """The model as JSON."""
        text = json.dumps(self.data, indent=1, ensure_ascii=False, allow_nan=False)
        return re.sub(r"\[\s+([^][{}]*?)\s+\]", lambda found: f"[{' '.join(found[1].split())}]", text) + "\n"

    @classmethod
    def from_json(cls, text: str) -> CalibratedModel:
        """The model in ``text``, written by `to_json`. Raises ValueError."""
        with suppress(ValueError, KeyError, TypeError, AttributeError):
            model = cls(json.loads(text))
            for kind in model.data["bounds"]:
                model.coefficients(kind, Points(*np.full((5, 1), 0.3)))
            if {"load_range", "errors", "provenance"} <= model.data.keys():
                return model
        raise ValueError("law: is not a calibrated law, as archord fit SWEEP --law writes it.")


@cache
def shipped_model() -> CalibratedModel:
    """The model that comes with archord."""
    return CalibratedModel.from_json(TABLE.read_text(encoding="utf-8"))


class Calibrated(NamedTuple):
    """k and c of a joint (c infinite: elastic), ``outside``, what of the joint lies outside the range (empty: nothing),
    and the cross-validated errors of its kind: relative, rms and largest of k, c and P."""

    k: float
    c: float
    outside: str
    errors: dict[str, Any]


def calibrated(joint: LawJoint, model: CalibratedModel | None = None) -> Calibrated:
    """k and c of ``joint``, which must tell plane and nu, by ``model`` [that of archord]; outside the range those of
    the formulas ("both" for bodies with unlike yield stresses, and for the pin alone), with the reason."""
    model = model or shipped_model()
    assert joint.nu is not None
    elastic = joint.yield_stress is None
    kind = f"{joint.plane} {'none' if elastic else 'block' if joint.yielding == 'block' else 'both'}"
    pin_nu = joint.nu if joint.pin_nu is None else joint.pin_nu
    m, n = equivalent_nu(joint.plane == "strain", np.array([pin_nu, joint.nu]))
    points = joint.dundurs_alpha, m, n, joint.onset, joint.clearance / joint.radius
    k, c = model.coefficients(kind, Points(*map(np.asarray, points)))
    unfit, bounds = "" if elastic else UNFIT.get(joint.yielding, ""), model.data["bounds"].get(kind)
    errors = model.data["errors"].get("cross-validated", {}).get(kind, {})
    return Calibrated(float(k), float(c), unfit or _stray(joint, pin_nu, float(m), bounds), errors)


def _stray(joint: LawJoint, pin_nu: float, m: float, bounds: dict[str, Any] | None) -> str:
    """What of a joint lies outside the range of the cases fitted; later yielding than theirs does not matter."""
    if not bounds:
        return "no joint of this plane and kind of yielding was fitted"
    alpha = joint.dundurs_alpha
    stiffness, *ends = ((1 + a) / (1 - a) if a < 1 else math.inf for a in (alpha, *bounds["alpha"]))
    checks = [("nu of the block", joint.nu, bounds["nu"])]
    if alpha < 1:
        checks += [("nu of the pin", pin_nu, bounds["pin_nu"]), (SOFT_WORDS, (1 - alpha) / 2 * m, (0.0, SOFT))]
    checks += [("E'(pin)/E'(block)", stiffness, ends), ("dR/R", joint.clearance / joint.radius, bounds["clearance"])]
    if joint.yield_stress is not None:
        checks.append(("sigY R/(E* dR)", joint.onset, (bounds["s"][0], math.inf)))
    for name, value, (low, high) in checks:
        slack = _LAST_DIGITS * max(abs(low), abs(high) if math.isfinite(high) else 0.0)
        if not low - slack <= value <= high + slack:
            upper = "and more" if math.isinf(high) else f"to {high:.4g}"
            return f"{name} = {value:.4g} is outside {low:.4g} {upper}"
    return ""
