"""k and c of the plastic-Winkler law where nobody has solved the joint: fitted to archord's own simulations.

The law is that of Hu et al. with a free plateau (`archord.postprocess.chord_laws`). k and c depend on the plane, on ``s
= sigY R/(E* dR)``, Poisson's ratio, the ratio of the moduli and the body that yields; within each plane and kind of
yielding, ln k and ln c are taken as polynomials

    of x = ln(s/0.4), y = nu - 0.3 and Dundurs' constants alpha and beta (see `TERMS`).

Poisson's ratio is that of both bodies, so beta goes with alpha and nu. The polynomials were fitted to the rows of
finding.csv, one solved joint each: dR/R = 0.5 %, perfect plasticity, elements of 4 %R, 0.1 to 2 dR. ``python3 -m
archord.benchmarks.finding --csv finding.csv --json regime_law.json`` solves them again and prints the numbers anew. How
well the law with these coefficients meets the force of the simulations stands beside them (`Regime`, `RegimeFit`): in
plane strain beyond yield the pressure has no plateau, and no k and c can mend the law's shape there.
"""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from archord.postprocess import chord_laws as chord
from archord.postprocess.law import Outside
from archord.postprocess.law_joint import Array, LawJoint, LawRangeError, LawRangeWarning
from archord.solver.scene import SceneError

TABLE = Path(__file__).parent / "regime_law.json"
_PLASTIC = "1 x xx y a aa xy xa b"
# the products of x, y, alpha (a) and beta (b) by kind of yielding: what the rows can tell
TERMS = {"none": ["1", "a", "b", "aa", "ab", "bb"], "both": f"{_PLASTIC} ab".split(), "block": _PLASTIC.split()}
THIN = 0.01  # dR/R up to which the law was compared with simulations
_ROUND_OFF = 1e-9
_LAST_DIGIT = 1e-5  # of the bounds as they are stored


@dataclass(frozen=True)
class RegimeFit:
    """Coefficients of ln k and ln c for the `TERMS`, for one plane and kind of yielding ("none": elastic).

    ``s``, ``nu`` and ``alpha`` are the ranges of the ``rows`` joints fitted. ``k_error`` and ``c_error`` are the
    largest relative differences of k and c from those of the joints themselves, ``P_error`` the largest of the force
    from the simulated one over 0.5 to 2 dR, ``P_rms`` its root mean square, ``P_early`` the largest over 0.1 to 0.4 dR.
    """

    plane: str
    yielding: str
    rows: int
    ln_k: tuple[float, ...]
    ln_c: tuple[float, ...]
    s: tuple[float, float]
    nu: tuple[float, float]
    alpha: tuple[float, float]
    k_error: float
    c_error: float
    P_error: float
    P_rms: float
    P_early: float

    def coefficients(self, s: float, nu: float, alpha: float) -> tuple[float, float]:
        """k and c; c is infinite for an elastic joint."""
        terms = basis(self.plane, self.yielding, s, nu, alpha)
        k = math.exp(float(terms @ self.ln_k))
        return k, math.exp(float(terms @ self.ln_c)) if self.ln_c else math.inf

    def stray(self, s: float, nu: float, alpha: float) -> str:
        """What lies outside the range of the joints fitted, in words; empty inside."""
        ranges = (
            ("sigY R/(E* dR)", s, self.s),
            ("Poisson's ratio", nu, self.nu),
            ("Dundurs' alpha", alpha, self.alpha),
        )
        for name, value, (low, high) in ranges:
            if math.isfinite(high) and not low - _LAST_DIGIT <= value <= high + _LAST_DIGIT:
                return f"{name} = {value:.4g} is outside {low:.4g} to {high:.4g}"
        return ""


@dataclass(frozen=True)
class Regime:
    """k and c of a joint with their relative errors and those of the force (see `RegimeFit`), and ``outside``, what
    of the joint lies outside the range; empty inside."""

    k: float
    c: float
    k_error: float
    c_error: float
    P_error: float
    P_rms: float
    outside: str
    fit: RegimeFit


def basis(plane: str, yielding: str, s: float, nu: float, alpha: float) -> Array:
    """The `TERMS` of a kind of yielding at a joint ``(n,)``."""
    x = 0.0 if math.isinf(s) else math.log(s / 0.4)
    beta = alpha * ((1 - 2 * nu) / (2 * (1 - nu)) if plane == "strain" else (1 - nu) / 2)
    values = {"1": 1.0, "x": x, "y": nu - 0.3, "a": alpha, "b": beta}
    return np.array([math.prod(values[factor] for factor in term) for term in TERMS[yielding]])


@cache
def shipped_fits() -> tuple[RegimeFit, ...]:
    """The coefficients that come with archord."""
    return from_json(TABLE.read_text(encoding="utf-8"))


def to_json(fits: tuple[RegimeFit, ...]) -> str:
    """The file of the coefficients; infinite bounds are null."""
    records = [{name: _plain(value) for name, value in vars(fit).items()} for fit in fits]
    lines = [",\n".join(f"    {json.dumps(name)}: {json.dumps(value)}" for name, value in r.items()) for r in records]
    return "[\n  {\n" + "\n  },\n  {\n".join(lines) + "\n  }\n]\n"


def from_json(text: str) -> tuple[RegimeFit, ...]:
    """The coefficients in ``text``, written by `to_json`."""
    fits = []
    for record in json.loads(text):
        values: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in record.items()
        }
        values["s"] = tuple(math.inf if bound is None else bound for bound in values["s"])
        fits.append(RegimeFit(**values))
    return tuple(fits)


def _plain(value: object) -> object:
    if isinstance(value, tuple):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and math.isinf(value) else value


def regime(
    plane: str,
    nu: float,
    modulus_ratio: float = 1.0,
    s: float = math.inf,
    yielding: str = "both",
    outside: Outside = "nan",
) -> Regime:
    """k and c of the plastic-Winkler law of a joint, ``chord_laws.plastic_force`` with `LawJoint`'s k and c.

    ``plane`` is "strain" or "stress", ``nu`` Poisson's ratio of both bodies, ``modulus_ratio`` E of the pin over E of
    the block (infinite: a rigid pin), ``s = sigY R/(E* dR)`` (infinite: elastic), ``yielding`` "both" or "block".
    Outside the range of the simulations k and c are nan, with a `LawRangeWarning`; ``outside`` "raise" and
    "extrapolate" as for every `Law`. Raises `SceneError` for values that make no joint.
    """
    if not modulus_ratio > 0:
        raise SceneError(f"modulus_ratio = {modulus_ratio:g} must be a positive number.")
    if not s > 0:
        raise SceneError(f"s = {s:g} must be a positive number.")
    alpha = 1.0 if math.isinf(modulus_ratio) else (modulus_ratio - 1) / (modulus_ratio + 1)
    # any joint with this s
    joint = LawJoint(1.0, 0.005, 1.0, None if math.isinf(s) else 0.005 * s, dundurs_alpha=alpha,
                     plane=plane, nu=nu, yielding=yielding)  # fmt: skip
    found = joint_regime(joint)
    if not found.outside:
        return found
    if outside == "raise":
        raise LawRangeError(f"regime: {found.outside}.")
    warnings.warn(LawRangeWarning(f"regime: {found.outside}"), stacklevel=2)
    return found if outside == "extrapolate" else replace(found, k=math.nan, c=math.nan)


def joint_regime(joint: LawJoint) -> Regime:
    """`regime` of ``joint``, which must tell plane and nu; outside the range the formula with the reason."""
    assert joint.nu is not None
    s = math.inf
    if joint.yield_stress is not None:
        s = joint.yield_stress * joint.radius / (joint.E_star * joint.clearance)
    kind = "none" if math.isinf(s) else "block" if joint.yielding == "block" else "both"
    fit = next(f for f in shipped_fits() if (f.plane, f.yielding) == (joint.plane, kind))
    k, c = fit.coefficients(s, joint.nu, joint.dundurs_alpha)
    reason = _unfit(joint) or fit.stray(s, joint.nu, joint.dundurs_alpha)
    return Regime(k, c, fit.k_error, fit.c_error, fit.P_error, fit.P_rms, reason, fit)


def _unfit(joint: LawJoint) -> str:
    """Why no simulation was like this joint; empty if some was."""
    if joint.pin_nu is not None and not math.isclose(joint.pin_nu, joint.nu or 0.0, abs_tol=0.01):
        return f"Poisson's ratios {joint.pin_nu:g} of the pin and {joint.nu:g} of the block are not alike"
    if joint.yield_stress is not None and joint.yielding == "pin":
        return "only the pin yields"
    if joint.yield_stress is not None and joint.yielding == "unlike":
        return "the bodies have unlike yield stresses"
    ratio = joint.clearance / joint.radius
    return f"dR/R = {ratio:.3g} is more than {THIN:g}" if ratio > THIN * (1 + _ROUND_OFF) else ""


def unfit(joint: LawJoint) -> str:
    """Why the law does not hold for ``joint``; empty if it does."""
    return joint_regime(joint).outside


def _with_coefficients(joint: LawJoint) -> LawJoint:
    found = joint_regime(joint)
    return replace(joint, k=found.k, c=found.c if math.isfinite(found.c) else 1.0)


def regime_force(joint: LawJoint, delta: Array) -> Array:
    """`chord_laws.plastic_force` with the joint's k and c by `regime`."""
    return chord.plastic_force(_with_coefficients(joint), delta)


def regime_stiffness(joint: LawJoint, delta: Array) -> Array:
    """``dP/d(delta)`` of `regime_force`."""
    return chord.plastic_stiffness(_with_coefficients(joint), delta)


def regime_peak(joint: LawJoint, delta: Array) -> Array:
    """Peak pressure of `regime_force`; k and c are fitted to the force, so this is an estimate."""
    return chord.plastic_peak(_with_coefficients(joint), delta)


def range_in_words() -> str:
    """The range of the law, from the ranges of its fits."""
    parts = []
    for plane in ("strain", "stress"):
        by_kind = {f.yielding: f for f in shipped_fits() if f.plane == plane}
        said = [f"{_WORDS[kind]} {_bounds(by_kind[kind])}" for kind in _WORDS]
        parts.append(f"plane {plane}: {', '.join(said)}")
    return f"delta <= 2 dR, dR <= {THIN:g} R, one Poisson's ratio, perfect plasticity; {'; '.join(parts)}"


def quality_in_words() -> str:
    """How far the law is from the simulations."""
    parts = []
    for plane in ("strain", "stress"):
        by_kind = {f.yielding: f for f in shipped_fits() if f.plane == plane}
        said = [
            f"{_WORDS[kind]} {f.P_error:.1%} (rms {f.P_rms:.1%}; {f.P_early:.0%} from 0.1 to 0.4 dR)"
            for kind, f in ((kind, by_kind[kind]) for kind in _WORDS)
        ]
        parts.append(f"plane {plane}: {', '.join(said)}")
    return (
        "Largest difference of P from the joints it was fitted to, and some of other clearance, from 0.5 to 2 dR: "
        f"{'; '.join(parts)}. In plane strain there is no plateau beyond yield, and the law's shape is not right. "
        "p0 is an estimate: k and c are fitted to P."
    )


_WORDS = {"none": "elastic", "both": "both yield", "block": "only the block yields"}


def _bounds(fit: RegimeFit) -> str:
    s = "" if math.isinf(fit.s[1]) else f"sigY R/(E* dR) = {fit.s[0]:g} to {fit.s[1]:g}, "
    return f"({s}nu = {fit.nu[0]:g} to {fit.nu[1]:g}, alpha = {fit.alpha[0]:.2g} to {fit.alpha[1]:.2g})"
