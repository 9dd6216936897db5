"""Hardening by a representative strain (Tabor 1951): a body that hardens acts on the joint as a
perfectly plastic one does whose yield stress is the mean flow stress of strains about ``eps_rep``,
whose logarithms are distributed normally.

    P(x) = P_pp(x; s_eff),   s_eff = s at eps_rep(x, s_eff),   s = sigY R/(E* dR)

P_pp is the law of yield_model.py. ``ln(eps_rep R/dR)`` is a polynomial of ln x and ln s_eff, of
what the two bodies are, of how the curve s(PEEQ) rises and bends, and of how near first yield by
s_eff is: the first points that yield strain less than those later. hardening_model.json has its
coefficients by plane and body, and factors of the expected error: hardening_fit.py makes it. p0,
eps and the way back follow the same s_eff, and p0 the rise of the curve, too. In plane strain a
stronger block yields earlier, by the rise of the pin's curve (`felt`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.elastic_model import elastic_model
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.spline import smooth_step, spline_slopes
from archord.postprocess.laws.general.yield_model import (
    Loss,
    Numbers,
    Yielding,
    loss,
    share_of_pin,
    yield_places,
)
from archord.report.by_name import ByName
from archord.report.files import read_json

TABLE = Path(__file__).parent / "hardening_model.json"
BODIES = ("pin", "block")
# Products of inputs (see `terms`), of which ln(eps_rep R/dR) is a sum.
TERMS = (
    *("1", "x", "s", "x x", "x s", "s s"),
    *("share", "soft", "weaker", "apart", "clearance", "rise", "gain", "onset", "onset onset"),
    *("s onset", "gain onset", "share onset", "x share", "s share", "x soft", "x weaker"),
    *("weaker weaker", "rise rise", "gain gain", "x bend", "apart bend"),
    *("x x x", "onset onset onset", "sharp", "x sharp"),
    *("x onset", "x x onset", "sharp onset", "soft apart sharp", "sharp sharp sharp"),
    *("x x sharp", "s sharp rise", "x bend bend", "share share clearance"),
    *("weaker gain", "share gain", "apart rise"),
)
INPUTS = (
    *("1", "x", "s", "share", "soft", "weaker", "apart", "sharp", "clearance"),
    *("rise", "bend", "gain", "onset"),
)
_NAMES = [(*term.split(), "1", "1")[:3] for term in TERMS]  # the inputs that make each of `TERMS`
# (terms, 3) their places
_FACTORS = np.array([[INPUTS.index(name) for name in names] for names in _NAMES])
_WIDTH = 0.7  # standard deviation of ln(strain)
_PLACES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(5)
STRAINS = np.exp(_WIDTH * _PLACES)  # over eps_rep
SHARES = _WEIGHTS / _WEIGHTS.sum()  # of the flow stress at each, in the mean
_ITERATIONS = 40  # at most, of Newton's method
_CLOSE = 1e-10  # step in ln(eps_rep) after which it is known to round-off
_FOUND = 1e-4  # the same, of which P hardly knows
_FARTHEST = 1.0  # of an iteration, in ln(eps_rep)
_FLATTEST = 0.3  # slope of what is missed by ln(eps_rep)
_SMALL = 1e-6  # of a difference quotient
# factors on the strains of pin and block ``(2, 3, 1)``: none, one on the pin's, one on the block's
_SHIFTS = 1 + _SMALL * np.array([[[0.0], [1.0], [0.0]], [[0.0], [0.0], [1.0]]])
_NEAREST = 0.05  # x below which eps_rep is no more asked for
_EARLIEST = 1.2  # x of first yield by s_eff over x, above which nothing has yielded
_ALIKE = 0.5  # |ln| of the bodies' s, beyond which it does not matter which is weaker
_SHARP = 0.12  # the same, within which the strain passes from one body to the other
_NEARLY_ALIKE = 0.15  # the same, beyond which the curve of the weaker body alone tells of p0
_TAKEN = 0.1  # of the rise of the pin's curve: ln of what it takes from the s of a stronger block
_LEADS = 0.3  # part of the pin's s that the block's lacks, from which on the block leads
_SPREADS = 0.07  # rise of the block's curve with which yielding spreads: e-fold less of it leads
_LARGEST_GAIN = 0.6  # ln(s_eff/s) beyond which eps_rep does not depend on it
_YIELDED = 0.02  # of P
_PEAK_YIELDED = 0.1  # of p0
_LEAST = 0.5  # ln of the rise that counts where a curve is flat
WIDE = 3.0  # factor on eps_rep, up and down, between which the curve tells the error

Flow = Callable[[Array], Array]  # s of a body by PEEQ
Flows = tuple[Flow | None, Flow | None]  # of pin and block; None: does not harden


class Strains(NamedTuple):
    """What a joint that hardens is at ``x`` ``(k,)``: s_eff and eps_rep of pin and block, each
    ``(2, k)``; of a body that is elastic infinite and 0. ``step`` ``(k,)`` is the size of the last
    step in ln(eps_rep): eps_rep is not found where it is large."""

    s: Array
    strain: Array
    step: Array


@lru_cache(maxsize=64)
def flows(joint: LawJoint) -> Flows:
    """s by PEEQ of pin and block."""
    unit = joint.unit / joint.radius

    def flow(law: Any) -> Flow | None:
        return None if law is None else lambda strain: law.stress(strain) / unit

    return flow(joint.pin_hardening), flow(joint.block_hardening)


def mean_flow(flow: Flow) -> Flow:
    """The mean s of `STRAINS` about strains (any shape)."""

    def mean(strain: Array) -> Array:
        asked = strain[..., None] * STRAINS
        return np.broadcast_to(flow(asked), asked.shape) @ SHARES

    return mean


def mean_flows(given: Flows) -> dict[int, Flow]:
    """`mean_flow` of the bodies that harden, by their places in `BODIES`."""
    return {i: mean_flow(flow) for i, flow in enumerate(given) if flow is not None}


class Curve(NamedTuple):
    """How a `mean_flow` rises about a strain, in logarithms, from a part of the strain to a
    multiple of it, `WIDE`; each of the strain's shape."""

    s: Array  # there
    rise: Array  # its slope on average
    bend: Array  # what it rises more above the strain than below


def curve_at(mean: Flow, strain: Array) -> Curve:
    """A `mean_flow` about ``strain`` (any shape)."""
    below, s, above = mean(np.stack([strain / WIDE, strain, WIDE * strain]))
    rise = np.log(above / below) / (2 * np.log(WIDE))
    bend = np.log(above * below / s**2)
    return Curve(s, rise, bend)


class At(NamedTuple):
    """Where eps_rep of a body is asked for, each ``(..., k)``: x, the body's curve there, and the
    other body's s; and the x of first yield by s."""

    x: Array
    own: Curve
    other: Array
    begins: Callable[[Array], Array]


def terms(numbers: Numbers, body: str, at: At) -> Array:
    """All `TERMS` ``(terms, ..., k)`` of a ``body`` of the joint with these ``numbers``."""
    p, m, n, clearance = numbers.elastic
    share, soft = (p, p * m) if body == "pin" else (1 - p, (1 - p) * n)
    ls = np.log(at.own.s)
    weaker = np.clip(np.log(at.other) - ls, -_ALIKE, _ALIKE)
    gain = ls - np.log(getattr(numbers, body))
    begins = at.begins(at.own.s) / at.x
    of = {
        "1": 1.0,
        "x": np.log(np.maximum(at.x, _NEAREST)),
        "s": ls,
        "share": share - 0.5,
        "soft": soft,
        "weaker": weaker,
        "apart": np.abs(weaker),
        "sharp": np.tanh(weaker / _SHARP),
        "clearance": np.log(clearance / 0.005),
        "rise": at.own.rise,
        "bend": at.own.bend,
        "gain": np.minimum(gain, _LARGEST_GAIN),
        "onset": np.minimum(begins, _EARLIEST) ** 2,
    }
    inputs = np.empty((len(INPUTS), *ls.shape))
    for k, name in enumerate(INPUTS):
        inputs[k] = of[name]
    one, other, third = _FACTORS.T
    return inputs[one] * inputs[other] * inputs[third]


def begins_of(numbers: Numbers) -> Callable[[Array], Array]:
    """About the x of first yield by s of the joint with these ``numbers``."""
    return yield_places(elastic_model(), numbers.strain, numbers.elastic)


def representative(model: Mapping[str, Array], numbers: Numbers, given: Flows, x: Array) -> Strains:
    """s_eff and eps_rep at ``x`` ``(k,)`` of the joint with these ``numbers``, whose bodies harden
    as ``given``; ``model`` has the coefficients by plane and body. Newton's method in ln(eps_rep)
    of both bodies, with difference quotients."""
    begins = begins_of(numbers)
    s = np.empty((2, 3, len(x)))
    s[:] = np.reshape(numbers.yielding, (2, 1, 1))
    strain = np.zeros((2, len(x)))
    means = mean_flows(given)
    hardens = [i for i in means if np.isfinite(numbers.yielding[i])]

    def predicted(i: int, at: At) -> Array:
        return np.tensordot(model[f"{numbers.plane} {BODIES[i]}"], terms(numbers, BODIES[i], at), 1)

    zeros = np.zeros(len(x))
    for i in hardens:
        straight = Curve(s[i, 0], zeros, zeros)
        at = At(x, straight, s[1 - i, 0], begins)
        strain[i] = numbers.clearance * np.exp(predicted(i, at))
    # of a body that does not harden nothing is missed: its row of the Jacobian is the identity's
    miss = np.log(_SHIFTS) + np.zeros_like(s)
    step: Array = np.zeros_like(strain)
    for _ in range(_ITERATIONS):
        shifted = strain[:, None] * _SHIFTS
        curves = {i: curve_at(means[i], shifted[i]) for i in hardens}
        for i, curve in curves.items():
            s[i] = curve.s
        for i, curve in curves.items():
            at = At(x, curve, s[1 - i], begins)
            miss[i] = np.log(shifted[i] / numbers.clearance) - predicted(i, at)
        step = _step(miss, step)
        strain *= np.exp(-step)
        if np.abs(step).max() <= _CLOSE:
            break
    for i in hardens:
        s[i] = means[i](strain[i])
    return Strains(s[:, 0], strain, np.abs(step).max(axis=0))


def _step(miss: Array, last: Array) -> Array:
    """Newton's step ``(2, k)`` by what is missed ``(2, 3, k)`` at the `_SHIFTS`, at most half of
    the ``last`` one where it turns back, which ends cycles around kinks of curves."""
    jacobian = (miss[:, 1:] - miss[:, :1]) / np.log1p(_SMALL)
    (a, b), (c, d) = jacobian
    a = np.maximum(a, _FLATTEST)
    d = np.maximum(d, _FLATTEST)
    pin, block = miss[:, 0]
    determinant = a * d - b * c
    step = np.stack([d * pin - b * block, a * block - c * pin]) / determinant
    turns_back = step * last < 0
    farthest = np.where(turns_back, np.abs(last) / 2, _FARTHEST)
    return np.clip(step, -farthest, farthest)


@lru_cache(maxsize=64)
def strains(numbers: Numbers, given: Flows, x: tuple[float, ...]) -> Strains:
    """`representative` by the model that comes with archord."""
    return representative(hardening_model()["strain"], numbers, given, np.array(x))


def largest_gain(numbers: Numbers, given: Flows, x: Array) -> float:
    """The largest ``s_eff/s`` of the bodies that harden, at the last ``x`` ``(k,)``; one of
    none."""
    hardens = [i for i, flow in enumerate(given) if flow is not None]
    if not hardens:
        return 1.0
    found = strains(numbers, given, tuple(x))
    s = np.array(numbers.yielding)
    return max(1.0, *(found.s[hardens, -1] / s[hardens]))


def hardened_loss(numbers: Numbers, given: Flows, x: Array) -> Loss:
    """What yielding does at ``x`` ``(k,)`` to the joint with these ``numbers``, whose bodies harden
    as ``given``. Raises ValueError where no eps_rep is found."""
    table = hardening_model()
    found = strains(numbers, given, tuple(x))
    if found.step.max() > _FOUND:
        at = x[found.step.argmax()]
        raise ValueError(
            f"archord: the law finds no representative strain at {at:g} dR, as the curves rise in "
            "steep steps; solve this joint instead."
        )
    rises = rises_of(given, found)
    lost = loss(numbers, felt(numbers, found.s, rises), x)
    slope = spline_slopes(np.log(x), lost.force) / x
    peak = lost.peak + table["peak"][numbers.plane] * peak_rise(found, rises, lost)
    wrong = table["error"][kind(numbers)] * unsure(rises, lost)
    error = np.sqrt(lost.deviation**2 + wrong**2)
    way_error = np.hypot(lost.way_error, wrong)  # of the travel, too
    return lost._replace(slope=slope, deviation=error, peak=peak, way_error=way_error)


def kind(numbers: Numbers) -> str:
    """Plane, and which body yields, "pin", "block" or "both"."""
    yields = np.flatnonzero(np.isfinite(numbers.yielding))
    body = "both" if len(yields) > 1 else BODIES[yields[0]]
    return f"{numbers.plane} {body}"


def rises_of(given: Flows, found: Strains) -> Array:
    """The rise of the `Curve` of pin and block at eps_rep ``(2, k)``; 0 of a body that does not
    harden."""
    rises = np.zeros_like(found.s)
    for i, mean in mean_flows(given).items():
        rises[i] = curve_at(mean, found.strain[i]).rise
    return rises


def block_leads(numbers: Numbers, given: Flows, x: Array) -> Array:
    """How far a block that is weaker than the pin leads in plane stress at ``x`` ``(k,)``, from 0
    to 1: then it yields in narrow bands where small strain leaves its thickness out. It leads less
    where it hardens, as bands spread."""
    if numbers.strain or np.isinf(numbers.block):
        return np.zeros_like(x)
    found = strains(numbers, given, tuple(x))
    lacking = 1 - found.s[1] / found.s[0]
    _, rise = rises_of(given, found)
    return np.clip(lacking / _LEADS, 0.0, 1.0) * np.exp(-rise / _SPREADS)


def felt(numbers: Numbers, s: Array, rises: Array) -> Yielding:
    """The ``s`` ``(2, k)`` with which pin and block act on the joint with these ``numbers``. A pin
    that hardens presses more in its middle than a perfectly plastic one does, so that in plane
    strain a stronger block yields earlier. ``rises`` ``(2, k)`` is what `rises_of` tells."""
    pin, block = s
    if numbers.strain:
        block = block * np.exp(-_TAKEN * rises[0] * share_of_pin(pin, block))
    return Yielding(pin, block)


def unsure(rises: Array, lost: Loss) -> Array:
    """By how much P ``(k,)`` would change, roughly and relatively, if eps_rep were `WIDE` times as
    large: ln of the rise of the curves, at least `_LEAST`, where `_YIELDED` of P and more is
    ``lost`` to yielding, and less before. ``rises`` ``(2, k)`` is what `rises_of` tells."""
    across = 2 * np.log(WIDE) * rises
    of_curves = np.sqrt(_LEAST**2 + (across**2).sum(axis=0))
    return of_curves * _share(lost.force, _YIELDED)


def peak_rise(found: Strains, rises: Array, lost: Loss) -> Array:
    """The rise of the curve of the weaker body ``(k,)``, a mean of both where they are nearly
    alike, where `_PEAK_YIELDED` of p0 and more is ``lost`` to yielding, and less before: points
    under the largest pressure strain more than eps_rep. ``rises`` ``(2, k)`` is what `rises_of`
    tells."""
    stronger = np.log(found.s[1]) - np.log(found.s[0])  # block than pin
    of_pin = smooth_step(0.5 + stronger / (2 * _NEARLY_ALIKE))
    rise = of_pin * rises[0] + (1 - of_pin) * rises[1]
    return rise * _share(lost.peak, _PEAK_YIELDED)


def _share(lost: Array, whole: float) -> Array:
    """How far the part that is lost, of which ``lost`` ``(k,)`` is the logarithm of the rest, comes
    to ``whole``; 1 beyond."""
    return np.clip((1 - np.exp(lost)) / whole, 0.0, 1.0)


@cache
def hardening_model() -> dict[str, ByName]:
    """The model that comes with archord: ``strain``, the coefficients of `TERMS` by plane and body;
    ``peak``, the factor on `peak_rise` by plane; and ``error``, the factor on `unsure` that 9 in 10
    errors keep, by `kind`."""
    table = read_json(TABLE)
    strain = {name: np.array(values) for name, values in table["strain"].items()}
    return table | {"strain": strain}
