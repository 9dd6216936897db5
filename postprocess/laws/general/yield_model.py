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

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from archord.postprocess.laws.general.elastic_model import Elastic, ElasticModel
from archord.postprocess.laws.general.gaussian_process import Kernel, Process
from archord.postprocess.laws.general.joint import Array

DATA = Path(__file__).parent / "yield_model.npz"
KERNELS = Path(__file__).parent / "yield_model.json"
MULTIPLES = np.array([0.95, 1.05, 1.15, 1.27, 1.4, 1.55, 1.75, 2, 2.3, 2.65, 3.05, 3.5, 4.1, 4.8, 5.7, 6.8, 8.2, 10,
                      12.3, 15.2, 19, 24, 30])  # fmt: skip
PIN_ALONE, PIN_WEAKER = "strain pin alone", "strain pin weaker"
SIDES = (
    PIN_ALONE,
    PIN_WEAKER,
    "strain block",
    "stress pin",
    "stress block",
)  # plane, and the body that yields first
ELASTIC_BELOW = 0.8  # u: nothing has yielded
# Parts by which the other body is stronger, within which it matters by how much: beyond the last it
# stays elastic. In plane stress the first is that of a contact at the largest pressure of plastic
# flow, 2/sqrt(3) sigY.
_STRONGER = {"strain": (0.5,), "stress": (1 - np.sqrt(0.75), 0.2)}
_FELT, _DEEPER = 0.3, 3.0  # exponent of what a yielded pin leaves; x/x0 where that is asked
_CURVES = ("force", "peak", "angle")
_NINE_IN_TEN = 1.645  # standard deviations
_STEP, _UNKNOWN = 1e-4, -32768  # of stored logarithms, and what stands for nan
_GRID = np.geomspace(0.03, 3.8, 300)  # x, among which first yield is found


class Yielding(NamedTuple):
    """What decides joints that yield, each ``(m,)``, beside `Elastic`: ``s = sigY R/(E* dR)`` of
    pin and block, infinite of a body that stays elastic."""

    pin: Array
    block: Array

    def of(self, side: str) -> Array:
        """s of the body from whose first yield one of `SIDES` tells."""
        return self.pin if side in (PIN_ALONE, "stress pin") else self.block


class Loss(NamedTuple):
    """What yielding does at ``x`` ``(m, k)``: ``ln(P/P_el)`` with its slope by x and its error,
    ``ln(p0/p0_el)``, ``ln(eps/eps_el)``, ``travel`` back and its ``toe``, and the error of P on
    that way over the largest P; errors are those of 9 in 10 joints."""

    force: Array
    slope: Array
    deviation: Array
    peak: Array
    angle: Array
    travel: Array
    toe: Array
    way_error: Array


def first_yield(
    model: ElasticModel, strain: bool, joints: Elastic, s: Array, left: Array | float = 1.0
) -> Array:
    """About the x ``(m,)`` of first yield: where the elastic p0, times what is ``left`` of it, is
    ``g`` sigY, with g of Hertz's contact at first and less in wide ones; at the end of the range or
    beyond for a larger s, infinite for an infinite one."""
    over = np.maximum.accumulate(
        left * model.at(joints, _GRID).peak / _pressure_at_yield(strain, _GRID), axis=1
    )
    found = [
        np.interp(np.log(own), np.log(row), np.log(_GRID)) for own, row in zip(s, over, strict=True)
    ]
    return np.where(np.isfinite(s), np.exp(found), np.inf)


def onset(
    side: str, model: ElasticModel, joints: Elastic, yielding: Yielding, x: Array, lost: Array
) -> tuple[Array, Array]:
    """About the x ``(m,)`` of first yield of the body of one of `SIDES`, and how far
    ``ln(p0/p0_el)`` is lost ``(m,)`` to a weaker pin some way beyond; ``lost`` ``(m, k)`` is that
    at ``x`` ``(k,)``."""
    strain, s = side.startswith("strain"), yielding.of(side)
    if side != PIN_WEAKER:
        return first_yield(model, strain, joints, s), np.zeros(len(s))
    left = np.stack([np.exp(np.interp(_GRID, x, row)) for row in lost]) * _GRID / 0.7
    x0 = first_yield(model, strain, joints, s, left**_FELT)
    return x0, np.array([np.interp(_DEEPER * at, x, row) for at, row in zip(x0, lost, strict=True)])


def _pressure_at_yield(strain: bool, x: Array) -> Array:
    return 0.95 + (0.5 if strain else 0.12) * np.exp(-x / 0.35)


def features(side: str, joints: Elastic, yielding: Yielding, lost: Array) -> Array:
    """The inputs of the process of a side ``(m, d)``, each of a size of about one; the last ones
    tell how much stronger the other body is, and what is ``lost`` ``(m,)`` to it (see `onset`)."""
    p, m, n, clearance = joints
    s = yielding.of(side)
    inputs = [p, p * m, (1 - p) * n, np.log(clearance / 0.005) / 1.5, np.log(s)]
    if side == PIN_WEAKER:
        inputs += [np.log(yielding.pin / s), lost]
    elif side != PIN_ALONE:
        share = s / (yielding.block if side == "stress pin" else yielding.pin)
        inputs += [np.minimum((1 - share) / within, 1.0) for within in _STRONGER[side.split()[0]]]
    return np.stack(inputs, axis=-1)


@dataclass(frozen=True)
class YieldModel:
    """The processes of a ``side``: ``inputs`` ``(n, d)`` of its joints, from the one known to most
    `MULTIPLES` down, and their curves ``force``, ``peak``, ``angle`` ``(n, multiples)``, nan beyond
    what is known; ``back_inputs`` ``(k, d + 1)``, of which the last is ln u of the deepest point,
    and ``back`` ``(k, 4)``, the last columns of `SolvedJoints.back`. ``kernels`` by the names of
    `processes`, and ``spread``, the factors on standard deviations below which 9 in 10 errors
    are."""

    side: str
    inputs: Array
    force: Array
    peak: Array
    angle: Array
    back_inputs: Array
    back: Array
    kernels: Mapping[str, Kernel]
    spread: Mapping[str, float]

    @cached_property
    def processes(self) -> dict[str, Process]:
        """The process of each name."""
        shape = np.concatenate([self.peak, self.angle], axis=1)
        return {
            "force": Process(self.kernels["force"], self.inputs, self.force),
            "shape": Process(self.kernels["shape"], self.inputs, shape),
            "back": Process(self.kernels["back"], self.back_inputs, self.back - [1, 0, 0, 0]),
        }

    def at(self, inputs: Array, x0: Array, x: Array) -> Loss:
        """What yielding does to joints with these `features`, of which ``x0`` ``(m,)`` is about
        first yield, at ``x`` ``(k,)``; of side `PIN_WEAKER` what that of the block adds, but for
        the way back."""
        u = np.log(x / x0[:, None])
        (force, deviation), (shape, _) = (
            self.processes[name].predict(inputs) for name in ("force", "shape")
        )
        rows = np.stack([force, *np.split(shape, 2, axis=1), deviation], axis=2)
        found = np.stack(
            [
                _between(row, own, float(x[-1] / at))
                for row, own, at in zip(rows, u, x0, strict=True)
            ]
        )
        deep = np.concatenate([np.repeat(inputs, len(x), axis=0), u.reshape(-1, 1)], axis=1)
        way, uncertain = self.processes["back"].predict(deep)
        travel, toe, misfit, again = way.T
        error = np.linalg.norm(
            [self.spread["back"] * uncertain[:, 0], _NINE_IN_TEN * misfit, again], axis=0
        )
        force, slope, peak, angle, deviation = np.moveaxis(found, -1, 0)
        back = (part.reshape(u.shape) for part in (1 + travel, toe, error))
        return Loss(force, slope / x, self.spread["force"] * deviation, peak, angle, *back)


def loss(side: str, model: ElasticModel, joints: Elastic, yielding: Yielding, x: Array) -> Loss:
    """What yielding does to ``joints`` of one side at ``x`` ``(k,)``, with the processes that come
    with archord."""
    return total_loss(
        {name: yield_model(name) for name in needed(side)}, model, joints, yielding, x
    )


def needed(side: str) -> tuple[str, ...]:
    """The sides whose processes tell what yielding does to joints of ``side``."""
    return (PIN_ALONE, PIN_WEAKER) if side == PIN_WEAKER else (side,)


def total_loss(
    models: Mapping[str, YieldModel],
    model: ElasticModel,
    joints: Elastic,
    yielding: Yielding,
    x: Array,
) -> Loss:
    """The sum of what ``models`` tell at ``x``; each begins where its body yields."""
    none = np.zeros((len(joints.p), len(x)))
    total = Loss(none, none, none, none, none, none + 1, none, none)
    for side, told in models.items():
        x0, lost = onset(side, model, joints, yielding, x, total.peak)
        some = ELASTIC_BELOW * x0 < x[-1]
        if not some.any():
            continue
        own = told.at(features(side, joints, yielding, lost)[some], x0[some], x)
        begun = np.clip(np.log(x / (ELASTIC_BELOW * x0[some, None])) / 0.2, 0.0, 1.0)
        found = Loss(*(values.copy() for values in total))
        for name in ("force", "slope", "peak", "angle"):
            getattr(found, name)[some] += getattr(own, name)
        found.deviation[some] = np.hypot(total.deviation[some], own.deviation)
        for name in ("travel", "toe", "way_error"):
            getattr(found, name)[some] += begun * (getattr(own, name) - getattr(total, name)[some])
        total = found
    return total


def _between(nodes: Array, u: Array, most: float) -> Array:
    """The first of four columns of ``nodes`` ``(multiples, 4)`` at ``ln(x/x0) = u`` ``(k,)``, its
    slope by u, and the others ``(k, 5)``: smooth between nodes, of which only those up to ``most``
    x0 and one beyond are known."""
    known = int(np.searchsorted(MULTIPLES, most)) + 1
    at = np.log([ELASTIC_BELOW, *MULTIPLES[:known]])
    spline = CubicSpline(
        at,
        np.concatenate([np.zeros((1, 4)), nodes[:known]]),
        bc_type=((1, np.zeros(4)), "not-a-knot"),
    )
    values = np.insert(spline(u), 1, spline(u, 1)[:, 0], axis=1)
    values[:, 4] = np.interp(u, at, [0.0, *nodes[:known, 3]])
    return np.where(u[:, None] > at[0], values, 0.0)


@dataclass(frozen=True)
class SolvedJoints:
    """Joints that yield, ``(n, ...)``, as yield_model.npz has them: ``side`` is the index in
    `SIDES` of the process that a row is for (joints of like bodies have two), ``numbers`` are plane
    (1: strain), p, m, n, dR/R, s of pin and of block; ``x0`` and ``lost`` are those of `onset`;
    ``count`` how many `MULTIPLES` are known; ``force``, ``peak`` and ``angle`` there; ``back``
    ``(k, 6)`` the row of a joint, u of its deepest point, its travel back and toe, and over the
    largest force how far P is from that way, rms, and on reloading; those that tell of it first."""

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

    def compact(self) -> dict[str, Array]:
        """Arrays for a small file: curves in steps of `_STEP`."""
        found = {name: np.asarray(value, np.float32) for name, value in vars(self).items()}
        for name in _CURVES:
            found[name] = np.where(
                np.isnan(found[name]), _UNKNOWN, np.round(found[name] / _STEP)
            ).astype(np.int16)
        return found

    def rows(self, side: str) -> npt.NDArray[np.intp]:
        """Those of one of `SIDES`, from the joint known to most `MULTIPLES` down."""
        chosen = np.flatnonzero(self.side == SIDES.index(side))
        return chosen[np.lexsort((self.x0[chosen], -self.count[chosen]))]

    def of(self, side: str) -> dict[str, Array]:
        """What `YieldModel` takes of the joints of one of `SIDES`."""
        chosen = self.rows(side)
        beyond = np.arange(len(MULTIPLES)) >= self.count[chosen, None]
        curves = {name: np.where(beyond, np.nan, getattr(self, name)[chosen]) for name in _CURVES}
        own = self.numbers[chosen].T
        inputs = features(side, Elastic(*own[1:5]), Yielding(*own[5:]), self.lost[chosen])
        row = np.full(len(self.numbers), -1)
        row[chosen] = np.arange(len(chosen))
        back = self.back[row[self.back[:, 0].astype(int)] >= 0]
        back = back[back[:, 1] > ELASTIC_BELOW]
        deep = np.column_stack([inputs[row[back[:, 0].astype(int)]], np.log(back[:, 1])])
        return {"inputs": inputs, **curves, "back_inputs": deep, "back": back[:, 2:]}


def sides_of(numbers: Any) -> tuple[str, ...]:
    """The `SIDES` that a joint with these ``numbers`` (see `SolvedJoints`) belongs to, of which the
    first tells its law."""
    strain, *_, pin, block = numbers
    plane, weaker = ("strain", PIN_WEAKER) if strain else ("stress", "stress pin")
    if strain and np.isinf(block):
        return (PIN_ALONE,)
    if np.isclose(pin, block, rtol=1e-4):
        return f"{plane} block", weaker
    return (weaker,) if pin < block else (f"{plane} block",)


def _numbers(compact: Mapping[str, Array]) -> dict[str, Array]:
    found = {name: values.astype(float) for name, values in compact.items()}
    for name in _CURVES:
        found[name] = np.where(found[name] == _UNKNOWN, np.nan, found[name] * _STEP)
    return found


def side_model(solved: SolvedJoints, side: str, told: Mapping[str, Any]) -> YieldModel:
    """The processes of a side of ``solved`` joints, with what yield_model.json tells of it."""
    kernels = {
        name: Kernel(np.array(own["lengths"]), own["noise"])
        for name, own in told["kernels"].items()
    }
    return YieldModel(side, **solved.of(side), kernels=kernels, spread=told["spread"])


def stored_joints() -> SolvedJoints:
    """The solved joints that come with archord."""
    with np.load(DATA) as data:
        return SolvedJoints(**_numbers(data))


@cache
def yield_model(side: str) -> YieldModel:
    """The model of one of `SIDES` that comes with archord."""
    return side_model(stored_joints(), side, json.loads(KERNELS.read_text(encoding="utf-8"))[side])
