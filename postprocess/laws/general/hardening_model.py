"""Hardening by a representative strain (Tabor 1951): a body that hardens acts on the joint as a
perfectly plastic one does whose yield stress is the flow stress at a strain ``eps_rep``.

    P(x) = P_pp(x; s_eff),   s_eff = s(eps_rep(x, s_eff)),   s = sigY R/(E* dR)

P_pp is the law of yield_model.py. ``ln(eps_rep R/dR)`` is a polynomial of ln x and ln s_eff, and of
what the two bodies are; it hardly depends on the curve s(PEEQ). hardening_model.json has its
coefficients by plane and body, and factors of the expected error: hardening_fit.py makes it. p0,
eps and the way back follow the same s_eff.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from archord.postprocess.laws.general.joint import Array, LawJoint
from archord.postprocess.laws.general.yield_model import Loss, Yielding, loss

TABLE = Path(__file__).parent / "hardening_model.json"
BODIES = ("pin", "block")
# of ln(eps_rep R/dR), with s of the body itself
TERMS = (
    *("1", "ln x", "ln s", "ln x^2", "ln x ln s", "ln s^2"),
    *("share", "soft", "weaker", "|weaker|", "ln dR/R"),
)
_ITERATIONS = 60  # at most, of the fixed point
_CLOSE = 1e-13
_NEAREST = 0.05  # x below which eps_rep is no more asked for
_ALIKE = 0.5  # |ln| of the bodies' s, beyond which it does not matter which is weaker
_YIELDED = 0.02
_LEAST = 0.5  # ln of the rise that counts where a curve is flat
WIDE = 3.0  # factor on eps_rep, up and down, between which the curve tells the error

Flow = Callable[[Array], Array]  # s of a body by PEEQ
Flows = tuple[Flow | None, Flow | None]  # of pin and block; None: does not harden


class Strains(NamedTuple):
    """What a joint that hardens is at ``x`` ``(k,)``: s_eff and eps_rep of pin and block, each
    ``(2, k)``; of a body that is elastic infinite and 0."""

    s: Array
    strain: Array


def flows(joint: LawJoint) -> Flows:
    """s by PEEQ of pin and block."""
    unit = joint.unit / joint.radius

    def flow(law: Any) -> Flow | None:
        return None if law is None else lambda strain: law.stress(strain) / unit

    return flow(joint.pin_hardening), flow(joint.block_hardening)


def ln_strain(
    of: Array, numbers: Sequence[float], body: str, x: Array, own: Array, other: Array
) -> Array:
    """``ln(eps_rep R/dR)`` ``(k,)`` of a ``body`` of the joint with these ``numbers`` (see
    `joint_numbers`) with the coefficients ``of`` all `TERMS`, at ``x`` ``(k,)`` with these s of its
    ``own`` and of the ``other`` body."""
    _, p, m, n, clearance, *_ = numbers
    share, soft = (p, p * m) if body == "pin" else (1 - p, (1 - p) * n)
    lx = np.log(np.maximum(x, _NEAREST))
    ls = np.log(own)
    weaker = np.clip(np.log(other) - ls, -_ALIKE, _ALIKE)
    first, of_x, of_s, xx, xs, ss, of_share, of_soft, of_weaker, apart, of_clearance = of
    bodies = of_share * (share - 0.5) + of_soft * soft + of_clearance * np.log(clearance / 0.005)
    curve = of_x * lx + of_s * ls + xx * lx**2 + xs * lx * ls + ss * ls**2
    return first + bodies + curve + of_weaker * weaker + apart * np.abs(weaker)


def representative(
    model: Mapping[str, Array], numbers: Sequence[float], given: Flows, x: Array
) -> Strains:
    """The fixed point of s_eff and eps_rep at ``x`` ``(k,)`` of the joint with these ``numbers``,
    whose bodies harden as ``given``; ``model`` has the coefficients by plane and body."""
    plane = "strain" if numbers[0] else "stress"
    s = np.repeat(np.array(numbers[5:])[:, None], len(x), axis=1)
    strain = np.zeros_like(s)
    for _ in range(_ITERATIONS):
        before = s.copy()
        moved = 0.0
        for i, (body, flow) in enumerate(zip(BODIES, given, strict=True)):
            if flow is not None and np.isfinite(s[i]).all():
                of = model[f"{plane} {body}"]
                ln = ln_strain(of, numbers, body, x, before[i], before[1 - i])
                strain[i] = numbers[4] * np.exp(ln)
                s[i] = np.sqrt(before[i] * flow(strain[i]))
                moved = max(moved, float(np.abs(s[i] / before[i] - 1).max()))
        if moved <= _CLOSE:
            break
    return Strains(s, strain)


def gains(numbers: Sequence[float], given: Flows, x: float) -> Array:
    """``s_eff/s`` of the bodies that harden at ``x``; one of none."""
    found = representative(hardening_model()["strain"], numbers, given, np.array([x]))
    hardens = [i for i, flow in enumerate(given) if flow is not None]
    return np.append(1.0, found.s[hardens, 0] / np.array(numbers[5:])[hardens])


def hardened_loss(numbers: Sequence[float], given: Flows, x: Array) -> Loss:
    """What yielding does at ``x`` ``(k,)`` to the joint with these ``numbers``, whose bodies harden
    as ``given``."""
    table = hardening_model()
    found = representative(table["strain"], numbers, given, x)
    lost = loss(numbers, Yielding(*found.s), x)
    slope: Array = CubicSpline(np.log(x), lost.force)(np.log(x), 1) / x
    wrong = table["error"][kind(numbers)] * unsure(given, found, lost)
    error: Array = np.sqrt(lost.deviation**2 + wrong**2)
    return lost._replace(slope=slope, deviation=error)


def kind(numbers: Sequence[float]) -> str:
    """Plane, and which body yields, "pin", "block" or "both"."""
    strain, *_, pin, block = numbers
    body = "both"
    if np.isinf(pin) or np.isinf(block):
        body = "pin" if np.isinf(block) else "block"
    return f"{'strain' if strain else 'stress'} {body}"


def unsure(given: Flows, found: Strains, lost: Loss) -> Array:
    """By how much P ``(k,)`` would change, roughly and relatively, if eps_rep were `WIDE` times as
    large: ln of the rise of the curves, at least `_LEAST`, where `_YIELDED` of P and more is
    ``lost`` to yielding, and less before."""
    squares: Array = np.full(len(lost.force), _LEAST**2)
    for i, flow in enumerate(given):
        if flow is not None:
            strain = found.strain[i]
            rise = np.log(flow(WIDE * strain) / flow(strain / WIDE))
            squares += rise**2
    return np.sqrt(squares) * np.clip((1 - np.exp(lost.force)) / _YIELDED, 0.0, 1.0)


@cache
def hardening_model() -> dict[str, dict[str, Any]]:
    """The model that comes with archord: ``strain``, the coefficients of `ln_strain` by plane and
    body, and ``error``, the factor on `unsure` that 9 in 10 errors keep, by `kind`."""
    table = json.loads(TABLE.read_text(encoding="utf-8"))
    strain = {name: np.array(values) for name, values in table["strain"].items()}
    return {"strain": strain, "error": table["error"]}
