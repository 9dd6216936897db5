"""k and c of the plastic-Winkler law where nobody has solved the joint: the calibrated model that comes with archord.

`calibrated` gives the numbers, ``LAWS["calibrated"]`` the law. The model and its errors stand in calibrated_law.json,
the cases that it was fitted to in calibrated_rows.csv; docs/calibration.md tells how to solve and fit them anew.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from archord.postprocess.laws import chord_laws as chord
from archord.postprocess.laws.calibrated_model import (
    KINDS,
    SOFT,
    SOFT_WORDS,
    Bounds,
    CalibratedModel,
    Kind,
    Points,
    equivalent,
)
from archord.postprocess.laws.law import Outside
from archord.postprocess.laws.law_joint import Array, LawJoint, LawRangeError, LawRangeWarning
from archord.scene.errors import InputError

TABLE = Path(__file__).parent / "calibrated_law.json"
ROWS = Path(__file__).parent / "calibrated_rows.csv"
_RATIO = "E'(pin)/E'(block)"
_LAST_DIGITS = 1e-3  # of the bounds as they are stored, and of moduli that a scene has rounded


@dataclass(frozen=True)
class Calibrated:
    """k and c of a joint (c infinite: elastic), ``outside``, what of the joint lies outside the range (empty: nothing),
    and the cross-validated errors of its kind: relative, rms and largest of k, c and P."""

    k: float
    c: float
    outside: str
    errors: dict[str, Any]


@cache
def shipped_model() -> CalibratedModel:
    """The model that comes with archord."""
    return CalibratedModel.from_json(TABLE.read_text(encoding="utf-8"))


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
    nan, with a `LawRangeWarning`; ``outside`` "raise" and "extrapolate" as for every `Law`. Raises `InputError` for
    values that make no joint.
    """
    if not modulus_ratio > 0:
        raise InputError(f"modulus_ratio = {modulus_ratio:g} must be a positive number.")
    if not s > 0:
        raise InputError(f"s = {s:g} must be a positive number.")
    alpha = 1.0
    if math.isfinite(modulus_ratio):
        pin = nu if pin_nu is None else pin_nu
        ratio = modulus_ratio * ((1 - nu**2) / (1 - pin**2) if plane == "strain" else 1.0)
        alpha = (ratio - 1) / (ratio + 1)
    joint = LawJoint(1.0, clearance, 1.0, None if math.isinf(s) else clearance * s, dundurs_alpha=alpha,
                     plane=plane, nu=nu, pin_nu=pin_nu, yielding=yielding)  # fmt: skip
    found = joint_calibrated(joint)
    if not found.outside:
        return found
    if outside == "raise":
        raise LawRangeError(f"calibrated: {found.outside}.")
    warnings.warn(LawRangeWarning(f"calibrated: {found.outside}"), stacklevel=2)
    return found if outside == "extrapolate" else replace(found, k=math.nan, c=math.nan)


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
    yielding = "none" if math.isinf(s) else "block" if joint.yielding == "block" else "both"
    kind = joint.plane, yielding
    pin = joint.nu if joint.pin_nu is None else joint.pin_nu
    numbers = (joint.dundurs_alpha, equivalent(pin, kind[0]), equivalent(joint.nu, kind[0]))
    ratio = joint.clearance / joint.radius
    k, c = model.coefficients(kind, Points(*(np.array([v]) for v in (*numbers, s, ratio))))
    reason = _unfit(joint) or _stray(joint, s, range_of(model, kind))
    return Calibrated(float(k[0]), float(c[0]), reason, _errors(model, kind))


def _errors(model: CalibratedModel, kind: Kind) -> dict[str, Any]:
    return model.errors.get("cross-validated", {}).get(" ".join(kind), {})


def _unfit(joint: LawJoint) -> str:
    """Why no case was like this joint; empty if some was."""
    if joint.yield_stress is not None and joint.yielding == "pin":
        return "only the pin yields"
    if joint.yield_stress is not None and joint.yielding == "unlike":
        return "the bodies have unlike yield stresses"
    return ""


def _stray(joint: LawJoint, s: float, bounds: Bounds | None) -> str:
    """What of the joint lies outside the range of the cases fitted; later yielding than theirs does not matter."""
    if bounds is None:
        return "no joint of this plane and kind of yielding was fitted"
    alpha = joint.dundurs_alpha
    checks = [("nu of the block", joint.nu, bounds.nu)]
    if alpha < 1:
        pin = joint.pin_nu if joint.pin_nu is not None else joint.nu or 0.0
        checks.append(("nu of the pin", pin, bounds.pin_nu))
        checks.append((SOFT_WORDS, (1 - alpha) / 2 * equivalent(pin, bounds.plane), (0.0, SOFT)))
    low, high = (_stiffness(value) for value in bounds.alpha)
    checks.append((_RATIO, _stiffness(alpha), (low, high)))
    checks.append(("dR/R", joint.clearance / joint.radius, bounds.clearance))
    if math.isfinite(s):
        checks.append(("sigY R/(E* dR)", s, (bounds.s[0], math.inf)))
    for name, value, (low, high) in checks:
        slack = _LAST_DIGITS * max(abs(low), abs(high) if math.isfinite(high) else 0.0)
        if value is not None and not low - slack <= value <= high + slack:
            upper = "and more" if math.isinf(high) else f"to {high:.4g}"
            return f"{name} = {value:.4g} is outside {low:.4g} {upper}"
    return ""


def range_of(model: CalibratedModel, kind: Kind) -> Bounds | None:
    """The range of a kind, None if it was not fitted.

    One design covers all kinds, so Poisson's ratios, clearance and the softest pin are from all cases together, the
    smallest s from those in the plane; the stiffest pin is the kind's own.
    """
    own = model.bounds_of(kind)
    if own is None:
        return None

    def widest(name: str, bounds: Iterable[Bounds]) -> tuple[float, float]:
        pairs = [getattr(b, name) for b in bounds]
        return min(low for low, _ in pairs), max(high for _, high in pairs)

    same = [b for b in model.bounds if b.plane == own.plane and b.yielding != "none"]
    return replace(
        own,
        **{name: widest(name, model.bounds) for name in ("nu", "pin_nu", "clearance")},
        alpha=(widest("alpha", model.bounds)[0], own.alpha[1]),
        s=widest("s", same) if same else own.s,
    )


def _stiffness(alpha: float) -> float:
    """E' of the pin over that of the block, with E' = E/(1 - nu^2) or E by plane."""
    return math.inf if alpha >= 1 else (1 + alpha) / (1 - alpha)


def unfit(joint: LawJoint) -> str:
    """Why the law does not hold for ``joint``; empty if it does."""
    return joint_calibrated(joint).outside


def _with_coefficients(joint: LawJoint) -> LawJoint:
    found = joint_calibrated(joint)
    return replace(joint, k=found.k, c=found.c if math.isfinite(found.c) else 1.0)


def calibrated_force(joint: LawJoint, delta: Array) -> Array:
    """`chord_laws.plastic_force` with the joint's k and c by `calibrated`."""
    return chord.plastic_force(_with_coefficients(joint), delta)


def calibrated_stiffness(joint: LawJoint, delta: Array) -> Array:
    """``dP/d(delta)`` of `calibrated_force`."""
    return chord.plastic_stiffness(_with_coefficients(joint), delta)


def calibrated_peak(joint: LawJoint, delta: Array) -> Array:
    """Peak pressure of `calibrated_force`; k and c are fitted to the force, so this is an estimate."""
    return chord.plastic_peak(_with_coefficients(joint), delta)


_WORDS = {"none": "elastic", "both": "both yield", "block": "only the block yields"}


def range_in_words() -> str:
    """The range of the law, from the cases that it was fitted to."""
    model = shipped_model()
    found = {kind: b for kind in (("strain", "none"), *KINDS) if (b := range_of(model, kind))}
    b = found["strain", "none"]
    stiffest = {yielding: _stiffness(b.alpha[1]) for (_, yielding), b in found.items()}
    pins = "; ".join(f"to {value:.3g}, {_WORDS[yielding]}" for yielding, value in stiffest.items() if value < math.inf)
    least = ", ".join(f"{v.s[0]:.3g} (plane {plane})" for (plane, kind), v in found.items() if kind == "both")
    return (
        f"delta <= {model.load_range[1]:g} dR, perfect plasticity, nu of either body = {b.nu[0]:.3g} to {b.nu[1]:.3g}, "
        f"{_RATIO} from {_stiffness(b.alpha[0]):.3g} to a rigid pin{f' ({pins})' if pins else ''}, dR/R = "
        f"{b.clearance[0]:.2g} to {b.clearance[1]:.2g}, sigY R/(E* dR) from {least}; {SOFT_WORDS} at most {SOFT:g}"
    )


def quality_in_words() -> str:
    """How far the law is from the simulations."""
    model, said = shipped_model(), []
    for kind in (("strain", "none"), ("stress", "none"), *KINDS):
        found = _errors(model, kind).get("P")
        if found:
            said.append(f"plane {kind[0]}, {_WORDS[kind[1]]} {found['rms']:.1%} (largest {abs(found['largest']):.0%})")
    return (
        f"Cross-validated rms of P over 0.5 to 2 dR: {'; '.join(said)}. At smaller displacements the contact is "
        "Hertz's, which the law's shape is not; nor has the pressure a plateau beyond yield in plane strain. p0 is an "
        "estimate: k and c are fitted to P. Without a yield stress, or yielding beyond 2 dR, the law is elastic."
    )
