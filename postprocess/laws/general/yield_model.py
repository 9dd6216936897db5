"""What yielding takes from a joint's elastic law, and how the joint comes back: Gaussian processes
over solved joints.

Everything is told at multiples ``u = x/x0`` of about the displacement x0 of first yield, and
relative to the elastic joint: ``ln(P/P_el)``, ``ln(p0/p0_el)``, ``ln(eps/eps_el)`` on first
loading, and, by the deepest x, the way from there to where the joint would open, ``travel = (x -
z)/(x P/P_el)``, which is 1 without yielding, and its ``toe``, in that unit. How far that is from
the way that a joint was solved on, and from the one on reloading, goes into the expected error.

There is a process for each of `SIDES`. In plane stress the weaker body limits the pressure. In
plane strain a weak pin is held by the hole and loses little: one process tells of pins that yield
alone, and another what yielding of the stronger block adds, with x0 the block's, which the yielded
pin delays. yield_model.npz has the solved joints, yield_model.json the processes' lengths;
law_fit.py makes both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from archord.materials.kinematics import Bools, Ints
from archord.materials.material import Array, Arrays
from archord.postprocess.laws.general.elastic_model import Elastic, ElasticModel, elastic_model
from archord.postprocess.laws.general.gaussian_process import Kernel, Process
from archord.postprocess.laws.general.joint_curve import Piece, interval
from archord.postprocess.laws.general.spline import smooth_step, spline_slopes
from archord.report.by_name import Names
from archord.report.files import read_json

DATA = Path(__file__).parent / "yield_model.npz"
KERNELS = Path(__file__).parent / "yield_model.json"
# fmt: off
MULTIPLES = np.array([
    0.95, 1.05, 1.15, 1.27, 1.4, 1.55, 1.75, 2, 2.3, 2.65, 3.05, 3.5, 4.1, 4.8, 5.7, 6.8, 8.2, 10,
    12.3, 15.2, 19, 24, 30,
])
# fmt: on
PIN_ALONE = "strain pin alone"
PIN_WEAKER = "strain pin weaker"
# plane, and the body that yields first
SIDES = (PIN_ALONE, PIN_WEAKER, "strain block", "stress pin", "stress block")
ELASTIC_BELOW = 0.8  # u: nothing has yielded
_AT = np.log([ELASTIC_BELOW, *MULTIPLES])  # ln u, between which curves are cubic
# Parts by which the other body is stronger, within which it matters by how much: beyond the last it
# stays elastic. In plane stress the first is the part for a contact at the largest pressure of
# plastic flow, 2/sqrt(3) sigY.
_STRONGER = {"strain": (0.5, 0.8), "stress": (1 - np.sqrt(0.75), 0.2)}
# Kinds of joints whose errors scatter unlike: the other body is as strong, stronger, or elastic.
KINDS = ("both", "weaker", "alone")
_APART = (0.0, 0.1, 0.9, 1.0)  # parts of `_STRONGER` between which a joint goes over to the next
_OTHER = 5  # the place of the input of `features` that tells of the other body
_SOFTER = (0.45, 0.5)  # p m of pins, between which they come to count as soft
# exponent of what a yielded pin leaves; x/x0 where that is asked
_FELT = 0.3
_DEEPER = 3.0
# ln of the block's s over the pin's, between 0 and which the processes of the two sides are mixed
_BLENDED = 0.05
# of P, relative, of the solved joints: what is left of the error of the mesh (see `mesh_excess`)
SOLVED_ERROR = dict.fromkeys(SIDES, 0.0) | {"stress block": 2.5e-3, "stress pin": 5e-4}
_MOST_EXCESS = 3.3e-3
_EXCESS_BEGINS = 1.5  # u
_EXCESS_GROWS = 0.5  # in ln u
_CURVES = ("force", "peak", "angle")
_NINE_IN_TEN = 1.645  # standard deviations
_DIGITS = 17  # binary ones of the numbers in yield_model.npz, five decimal ones
_DIGITS_BACK = 14  # of ways back, four decimal ones
# of stored logarithms, and what stands for nan
CURVE_STEP = 1e-4
_UNKNOWN = -32768
_GRID = np.geomspace(0.03, 3.8, 300)  # x, among which first yield is found


Asked = np.ndarray | bool


class Yielding(NamedTuple):
    """What decides a joint that yields, or ``(m,)`` joints, beside `Elastic`: ``s = sigY R/(E*
    dR)`` of pin and block, infinite of a body that stays elastic. Of a joint that hardens both are
    ``(k,)``, the s at each x."""

    pin: Any
    block: Any

    def of(self, side: str) -> Any:
        """s of the body from whose first yield one of `SIDES` tells."""
        return self.pin if side in (PIN_ALONE, "stress pin") else self.block


class Numbers(NamedTuple):
    """What decides a joint: plane (1: strain), p, m, n, dR/R, and s of pin and block, infinite of
    an elastic body."""

    strain: Any
    p: Any
    m: Any
    n: Any
    clearance: Any
    pin: Any
    block: Any

    @property
    def plane(self) -> str:
        """The plane."""
        return "strain" if self.strain else "stress"

    @property
    def poisson(self) -> tuple[float, float]:
        """Poisson's ratios of pin and block."""
        ratios = self.m, self.n
        pin, block = (ratio / (1 + ratio) if self.strain else ratio for ratio in ratios)
        return pin, block

    @property
    def elastic(self) -> Elastic:
        """Those of an elastic joint."""
        return Elastic(*self[1:5])

    @property
    def yielding(self) -> Yielding:
        """s of both bodies."""
        return Yielding(*self[5:])


class Loss(NamedTuple):
    """What yielding does to a joint at ``x`` ``(k,)``; errors are the errors of 9 in 10 joints."""

    force: Array  # ln(P/P_el)
    slope: Array  # its slope by x
    deviation: Array  # its error
    peak: Array  # ln(p0/p0_el)
    angle: Array  # ln(eps/eps_el)
    travel: Array  # the way back
    toe: Array
    way_error: Array  # of P on the way back, over the largest P


def first_yield(
    model: ElasticModel, strain: bool, joint: Elastic, s: npt.ArrayLike, left: Array | float = 1.0
) -> Array:
    """About the x of first yield by ``s`` (any shape): where the elastic p0, times what is ``left``
    of it, is ``g`` sigY, with g of Hertz's contact at first and less in wide ones; at the end of
    the range or beyond for a larger s, infinite for an infinite one."""
    return yield_places(model, strain, joint, left)(s)


def yield_places(
    model: ElasticModel, strain: bool, joint: Elastic, left: Array | float = 1.0
) -> Callable[[npt.ArrayLike], Array]:
    """`first_yield` of a joint by s."""
    pressure = left * elastic_pressure(model, joint) / _pressure_at_yield(strain, _GRID)
    rising = np.maximum.accumulate(pressure)
    over = np.log(rising)

    def place(s: npt.ArrayLike) -> Array:
        found = np.interp(np.log(s), over, np.log(_GRID))
        return np.where(np.isfinite(s), np.exp(found), np.inf)

    return place


@lru_cache(maxsize=16)
def elastic_pressure(model: ElasticModel, joint: Elastic) -> Array:
    """p0 R/(E* dR) on the grid among which first yield is found: the law of one joint asks for it
    some five times."""
    return model.pressure(joint, _GRID)


def onset(
    side: str, model: ElasticModel, joint: Elastic, yielding: Yielding, x: Array, lost: Array
) -> tuple[Any, Any]:
    """About the x of first yield of the body of one of `SIDES`, for each of its s (any shape), and
    how far ``ln(p0/p0_el)`` is lost to a weaker pin some way beyond; ``lost`` ``(k,)`` is the loss
    at ``x`` ``(k,)``."""
    strain = side.startswith("strain")
    s = yielding.of(side)
    if side != PIN_WEAKER:
        x0 = first_yield(model, strain, joint, s)
        return x0, np.zeros_like(x0)
    left = np.exp(np.interp(_GRID, x, lost)) * _GRID / 0.7
    x0 = first_yield(model, strain, joint, s, left**_FELT)
    return x0, np.interp(_DEEPER * x0, x, lost)


def mesh_excess(side: str, yielding: Yielding, u: Array) -> Array:
    """ln of P and of p0 of elements of 5 %R over P and p0 of 2 %R, by multiples ``u`` ``(k,)`` of
    about the x of first yield. It is felt in plane stress where a block yields before the pin
    (benchmarks/law_meshes.py); if the mesh's error is of first order, two thirds of it are left."""
    if side != "stress block" or np.isinf(yielding.block):
        return np.zeros_like(u)
    pins_lead = (1 - yielding.block / yielding.pin) / _STRONGER["stress"][0]
    beyond = np.log(np.maximum(u / _EXCESS_BEGINS, 1.0))
    grown = 1 - np.exp(-beyond / _EXCESS_GROWS)
    return _MOST_EXCESS * min(pins_lead, 1.0) * grown


def _pressure_at_yield(strain: bool, x: Array) -> Array:
    of_hertz = 0.5 if strain else 0.12
    return 0.95 + of_hertz * np.exp(-x / 0.35)


def features(side: str, joints: Elastic, yielding: Yielding, lost: npt.ArrayLike) -> Array:
    """The inputs of the process of a side ``(..., d)``, each of a size of about one; the last ones
    tell how much stronger the other body is, and what is ``lost`` to it (see `onset`)."""
    p, m, n, clearance = joints
    s = yielding.of(side)
    inputs = [p, p * m, (1 - p) * n, np.log(clearance / 0.005) / 1.5, np.log(s)]
    if side == PIN_WEAKER:
        inputs += [np.log(yielding.pin / s), lost]
    elif side != PIN_ALONE:
        other = yielding.block if side == "stress pin" else yielding.pin
        weaker = 1 - s / other
        plane = side.split()[0]
        inputs += [np.minimum(weaker / within, 1.0) for within in _STRONGER[plane]]
    return np.stack(np.broadcast_arrays(*inputs), axis=-1)


def kind_of_scatter(side: str, inputs: Array) -> Array:
    """The place in `KINDS` of joints of these `features` ``(..., d)``, between two where joints go
    over from one kind to the next."""
    if side == PIN_ALONE:
        apart: Array = np.ones(inputs.shape[:-1])
    elif side == PIN_WEAKER:
        apart = np.minimum(-inputs[..., _OTHER], _APART[2])
    else:
        apart = inputs[..., _OTHER]
    return np.interp(apart, _APART, (0, 1, 1, 2))


def softness(inputs: Array) -> Array:
    """How far the pins of joints of these `features` ``(..., d)`` count as soft, 0 to 1."""
    return np.interp(inputs[..., 1], _SOFTER, (0.0, 1.0))


def scatter(side: str, inputs: Array, spread: Mapping[str, float]) -> Array:
    """The factor on standard deviations of P of joints of these `features` ``(..., d)``."""
    factors = [spread[kind] for kind in KINDS]
    usual = np.interp(kind_of_scatter(side, inputs), range(len(KINDS)), factors)
    return usual * (1 + softness(inputs) * (spread["soft"] - 1))


@dataclass(frozen=True)
class YieldModel:
    """The processes of a ``side``.

    - ``inputs`` ``(n, d)``: `features` of its joints, from the one known to most `MULTIPLES` down
    - ``force``, ``peak``, ``angle`` ``(n, multiples)``: their curves, nan beyond what is known
    - ``back_inputs`` ``(k, d + 1)``: features, and ln u of the deepest point
    - ``back`` ``(k, 4)``: the last columns of `SolvedJoints.back`
    - ``kernels``: by the names of `processes`
    - ``spread``: factors on standard deviations below which 9 in 10 errors are, of the force by the
      kind of joint (see `scatter`)
    """

    side: str
    inputs: Array
    force: Array
    peak: Array
    angle: Array
    back_inputs: Array
    back: Array
    kernels: Mapping[str, Kernel]
    spread: Mapping[str, Any]

    @cached_property
    def processes(self) -> dict[str, Process]:
        """The process of each name."""
        shape = np.concatenate([self.peak, self.angle], axis=1)
        back = self.back - [1, 0, 0, 0]
        return {
            "force": Process(self.kernels["force"], self.inputs, self.force),
            "shape": Process(self.kernels["shape"], self.inputs, shape),
            "back": Process(self.kernels["back"], self.back_inputs, back),
        }

    def at(self, inputs: Array, x0: Array, x: Array, asked: Asked = True) -> Loss:
        """What yielding does to a joint with these `features` ``(d,)``; ``x0`` ``()`` is about
        first yield, at ``x`` ``(k,)``; of side `PIN_WEAKER` what the block's yielding adds, but for
        the way back. Of a joint that hardens inputs are ``(k, d)``, x0 ``(k,)``. Nothing where it
        is not ``asked`` ``(k,)``."""
        u = np.log(x / x0)
        begun = asked & (u > _AT[0])  # the others are not computed, which takes half the time
        # of all x alike, or P would jump where one node more is known
        reached = np.searchsorted(np.log(MULTIPLES), u.max())
        known = min(reached + 1, len(MULTIPLES))
        u = u[begun]
        each = np.broadcast_to(inputs, (len(x), inputs.shape[-1]))[begun]
        rows = each if inputs.ndim > 1 else inputs[None]
        force, deviation = self.processes["force"].predict(rows)
        shape = self.processes["shape"].means(rows)
        nodes = np.stack([force, *np.split(shape, 2, axis=1), deviation], axis=-1)
        force, slope, peak, angle, deviation = _curves(nodes[:, :known], u).T
        way, uncertain = self.processes["back"].predict(np.column_stack([each, u]))
        travel, toe, misfit, again = way.T
        of_travel = self.spread["back"] * uncertain[:, 0]
        errors = [of_travel, _NINE_IN_TEN * misfit, again]
        told = Loss(
            force=force,
            slope=slope / x[begun],
            deviation=scatter(self.side, each, self.spread["force"]) * deviation,
            peak=peak,
            angle=angle,
            travel=travel,
            toe=toe,
            way_error=np.linalg.norm(errors, axis=0),
        )
        everywhere = np.zeros((len(told), len(x)))
        everywhere[:, begun] = told
        found = Loss(*everywhere)
        return found._replace(travel=1 + found.travel)


def loss(numbers: Numbers, yielding: Yielding, x: Array) -> Loss:
    """What yielding does at ``x`` ``(k,)`` to a joint with these ``numbers``, but for its
    ``yielding``, with the processes that come with archord. The weaker body at each x tells of it;
    where bodies are nearly alike, the two processes are mixed, so that P does not jump where the
    other body becomes the weaker one."""
    pin, block, _ = np.broadcast_arrays(*yielding, x)
    pins = share_of_pin(pin, block)
    if numbers.strain:
        pin_weaker = PIN_ALONE if np.isinf(block).all() else PIN_WEAKER
        shares = {"strain block": 1 - pins, pin_weaker: pins}
    else:
        shares = {"stress block": 1 - pins, "stress pin": pins}
    found: list[Array] = [np.zeros(len(x))] * len(Loss._fields)
    for side, share in shares.items():
        asked = share > 0
        if asked.any():
            models = {name: yield_model(name) for name in needed(side)}
            told = total_loss(models, elastic_model(), numbers.elastic, yielding, x, asked)
            found = [total + share * own for total, own in zip(found, told, strict=True)]
    return Loss(*found)


def share_of_pin(pin: Array, block: Array) -> Array:
    """The share of the process of joints with the weaker pin in what is told of joints with these s
    ``(k,)``: 0 where the bodies are alike or the block is weaker, 1 where the pin is weaker by
    `_BLENDED` and more."""
    excess = np.zeros(len(pin))
    weaker = (pin < block) & ~_alike(pin, block)
    ratio = block[weaker] / pin[weaker]
    excess[weaker] = np.log(ratio) / _BLENDED
    return smooth_step(excess)


def needed(side: str) -> Names:
    """The sides whose processes tell what yielding does to joints of ``side``."""
    return (PIN_ALONE, PIN_WEAKER) if side == PIN_WEAKER else (side,)


def total_loss(
    models: Mapping[str, YieldModel],
    model: ElasticModel,
    joint: Elastic,
    yielding: Yielding,
    x: Array,
    asked: Asked = True,
) -> Loss:
    """The sum of what ``models`` tell at ``x`` ``(k,)``; each begins where its body yields. The
    last one tells nothing where it is not ``asked`` ``(k,)``."""
    *_, last = models
    none = np.zeros(len(x))
    total = Loss(none, none, none, none, none, none + 1, none, none)
    for side, told in models.items():
        x0, lost = onset(side, model, joint, yielding, x, total.peak)
        begins = ELASTIC_BELOW * x0
        if (begins >= x[-1]).all():
            continue
        inputs = features(side, joint, yielding, lost)
        own = told.at(inputs, x0, x, asked if side == last else True)
        begun = np.clip(np.log(x / begins) / 0.2, 0.0, 1.0)
        deviations = [total.deviation, own.deviation, begun * SOLVED_ERROR[side]]
        total = Loss(
            force=total.force + own.force,
            slope=total.slope + own.slope,
            deviation=np.linalg.norm(deviations, axis=0),
            peak=total.peak + own.peak,
            angle=total.angle + own.angle,
            travel=total.travel + begun * (own.travel - total.travel),
            toe=total.toe + begun * (own.toe - total.toe),
            way_error=total.way_error + begun * (own.way_error - total.way_error),
        )
    return total


def _curves(nodes: Array, u: Array) -> Array:
    """The first of four curves of ``nodes`` ``(1 or k, known, 4)`` at ``ln(x/x0) = u`` ``(k,)``,
    its slope by u, and the others ``(k, 5)``: smooth between nodes."""
    values = np.concatenate([np.zeros_like(nodes[:, :1]), nodes], axis=1)
    at = _AT[: values.shape[1]]
    slopes = _spline(len(at)) @ values
    i = interval(at, u)
    row = np.arange(len(u)) if len(nodes) == len(u) else 0
    begin = at[i]
    width = (at[i + 1] - begin)[:, None]
    t = (u - begin)[:, None] / width
    first = values[row, i]
    last = values[row, i + 1]
    piece = Piece.between(width, first, last, slopes[row, i], slopes[row, i + 1])
    curves, rises = piece.at(t)
    slope = rises[:, :1] / width
    deviation = first + np.clip(t, 0.0, 1.0) * (last - first)
    return np.column_stack([curves[:, 0], slope, curves[:, 1:3], deviation[:, 3]])


@cache
def _spline(n: int) -> Array:
    """The matrix ``(n, n)`` from values at the first nodes of curves to slopes."""
    return spline_slopes(_AT[:n], np.eye(n), flat=True)


@dataclass(frozen=True)
class SolvedJoints:
    """Joints that yield, ``(n, ...)``, as yield_model.npz has them. Joints of like bodies have two
    rows.

    - ``side`` ``(n,)``: the index in `SIDES` of the process that a row is for
    - ``numbers`` ``(n, 7)``: `Numbers`
    - ``x0``, ``lost`` ``(n,)``: what `onset` tells
    - ``count`` ``(n,)``: how many `MULTIPLES` are known
    - ``force``, ``peak``, ``angle`` ``(n, multiples)``: the curves there
    - ``back`` ``(k, 6)``: the row of a joint, u of its deepest point, its travel back and toe, and
      over the largest force how far P is from that way, rms, and on reloading; those that tell of
      reloading first
    """

    side: Array
    numbers: Array
    x0: Array
    lost: Array
    count: Array
    force: Array
    peak: Array
    angle: Array
    back: Array

    def stored(self) -> SolvedJoints:
        """Itself with the digits that yield_model.npz keeps."""
        return SolvedJoints(**_numbers(self.compact()))

    def compact(self) -> Arrays:
        """Arrays for a small file: curves in steps of `CURVE_STEP`, and numbers in few digits."""
        found = {name: _rounded(value, _DIGITS) for name, value in vars(self).items()}
        found["back"] = _rounded(self.back, _DIGITS_BACK)
        for name in _CURVES:
            steps = np.round(getattr(self, name) / CURVE_STEP)
            found[name] = np.where(np.isnan(steps), _UNKNOWN, steps).astype(np.int16)
        return found

    def rows(self, side: str) -> Ints:
        """Those of one of `SIDES`, from the joint known to most `MULTIPLES` down."""
        chosen = np.flatnonzero(self.side == SIDES.index(side))
        order = np.lexsort((self.x0[chosen], -self.count[chosen]))
        return chosen[order]

    def of(self, side: str) -> Arrays:
        """What `YieldModel` takes of the joints of one of `SIDES`."""
        chosen = self.rows(side)
        beyond = np.arange(len(MULTIPLES)) >= self.count[chosen, None]
        curves = {name: np.where(beyond, np.nan, getattr(self, name)[chosen]) for name in _CURVES}
        own = Numbers(*self.numbers[chosen].T)
        inputs = features(side, own.elastic, own.yielding, self.lost[chosen])
        place = np.full(len(self.numbers), -1)
        place[chosen] = np.arange(len(chosen))
        rows = place[self.back[:, 0].astype(int)]
        u = self.back[:, 1]
        told = (rows >= 0) & (u > ELASTIC_BELOW)
        deep = np.column_stack([inputs[rows[told]], np.log(u[told])])
        back = self.back[told, 2:]
        return {"inputs": inputs, **curves, "back_inputs": deep, "back": back}


def sides_of(numbers: Numbers) -> Names:
    """The `SIDES` that a joint with these ``numbers`` belongs to; the first tells its law."""
    first = str(telling_side(bool(numbers.strain), *numbers.yielding))
    alike = np.isfinite(numbers.block) and _alike(*numbers.yielding)
    if not alike:
        return (first,)
    return first, PIN_WEAKER if numbers.strain else "stress pin"


def telling_side(strain: bool, pin: npt.ArrayLike, block: npt.ArrayLike) -> npt.NDArray[np.str_]:
    """The one of `SIDES` that tells the law of a joint with these s of pin and block (any
    shape)."""
    pin, block = np.broadcast_arrays(pin, block)
    pin_weaker = (pin < block) & ~_alike(pin, block)
    if not strain:
        return np.where(pin_weaker, "stress pin", "stress block")
    told = np.where(pin_weaker, PIN_WEAKER, "strain block")
    return np.where(np.isinf(block), PIN_ALONE, told)


def _alike(pin: npt.ArrayLike, block: npt.ArrayLike) -> Bools:
    return np.isclose(pin, block, rtol=1e-4)


def _rounded(values: Array, digits: int) -> Array:
    """``values`` in so many binary digits, as numbers of single precision, which compress well."""
    mantissa, exponent = np.frexp(values)
    steps = np.round(np.ldexp(mantissa, digits))
    return np.ldexp(steps, exponent - digits).astype(np.float32)


def _numbers(compact: Mapping[str, Array]) -> Arrays:
    found = {name: values.astype(float) for name, values in compact.items()}
    for name in _CURVES:
        curves = found[name]
        curves[curves == _UNKNOWN] = np.nan
        curves *= CURVE_STEP
    return found


def side_model(solved: SolvedJoints, side: str, told: Mapping[str, Any]) -> YieldModel:
    """The processes of a side of ``solved`` joints, with what yield_model.json tells of it."""
    kernels = {
        name: Kernel(np.array(own["lengths"]), own["noise"])
        for name, own in told["kernels"].items()
    }
    return YieldModel(side, **solved.of(side), kernels=kernels, spread=told["spread"])


@cache
def stored_joints() -> SolvedJoints:
    """The solved joints that come with archord."""
    with np.load(DATA) as data:
        return SolvedJoints(**_numbers(data))


@cache
def yield_model(side: str) -> YieldModel:
    """The model of one of `SIDES` that comes with archord."""
    return side_model(stored_joints(), side, read_json(KERNELS)[side])
