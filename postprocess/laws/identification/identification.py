"""A joint identified from a measured curve: robust least squares through the general law.

The machine reads ``u = delta + offset + c P`` with its compliance c. History is the deepest
displacement. The fit minimises Huber's loss of the residuals of P (Huber 1964). Covariances are of
M-estimators, ``A^-1 B A^-1`` with ``A = J' W J`` and ``B`` of the residuals themselves (Huber
1967), so that noise may grow with the force. Intervals are checked by a profile of the loss at
their ends.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.special import stdtrit

from archord.materials.material import Array
from archord.postprocess.laws.general.general_law import law_of_joint, outside
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.identification.measured import MeasuredCurve
from archord.postprocess.laws.identification.unknowns import (
    COMPLIANCE,
    OFFSET,
    Unknown,
    changed,
    of_machine,
    of_scene,
)
from archord.report.by_name import Amounts
from archord.report.errors import InputError
from archord.scene.presets.joint import Scene

_BEGINS = 0.01  # share of the largest force at which contact is seen
_EXACT = 1e-6  # of the least loss, and of z
_STEP = 1e-4  # of finite differences
_ITERATIONS = 12  # of Newton's method for the joint's share of a displacement
_CLOSE = 1e-6  # over the clearance: one more iteration is exact
# factors on the scene's values, and compliances of the machine in their unit, with which fits begin
_FACTORS = (1.0, 0.6, 1.7, 0.35, 2.8)
_COMPLIANCES = (0.0, 0.1, 0.4, 1.5)
_TRIED = 4  # unknowns of the scene that are tried so
_ALL_FACTORS = 2  # unknowns up to which all factors are tried, of more the first three
_FITS = 10  # begun, of which the best goes on: others may end at the curve of another joint
_FIRST_ITERATIONS = 8
_BETTER = 0.9  # of the loss: the fit of a worse beginning is no better by noise alone
_ROBUST = 2.5  # standard deviations beyond which a residual counts less
_LEAST = 1e-6  # standard deviation over the largest force
_BOUND = 1e-3  # in z: nearer is at the bound
_FLAT = 1e-8  # sensitivity over the largest: the curve does not depend on it
_WIDEST = 5.0  # by how much a profile widens an interval at most
_PROFILE = 6  # iterations at an end of an interval
_CONFIDENCE = 0.975  # two-sided 95 %


class Predicted(NamedTuple):
    """What the law says of a measured curve ``(n,)``: displacements of the joint, forces, and
    errors that 9 in 10 joints keep."""

    delta: Array
    load: Array
    error: Array


@dataclass(frozen=True)
class Model:
    """A ``scene`` whose ``unknowns`` are sought, with what is ``fixed`` of the machine."""

    scene: Scene
    curve: MeasuredCurve
    unknowns: Sequence[Unknown]
    fixed: Mapping[str, float]

    def values(self, z: Array) -> Amounts:
        """The value of each unknown."""
        pairs = zip(self.unknowns, z, strict=True)
        return {unknown.name: float(unknown.value(at)) for unknown, at in pairs}

    def scene_at(self, z: Array) -> Scene:
        """The scene with these values."""
        found = {}
        for unknown, at in zip(self.unknowns, z, strict=True):
            found.update(dict.fromkeys(unknown.keys, float(unknown.value(at))))
        return changed(self.scene, found)

    def is_outside(self, z: Array) -> bool:
        """Whether the joint with these values is outside the range of the law."""
        return bool(outside(LawJoint.from_scene(self.scene_at(z))))

    def predicted(self, z: Array) -> Predicted:
        """The forces at the readings of the curve."""
        scene = self.scene_at(z)
        thickness = scene.thickness
        machine = {**self.fixed, **self.values(z)}
        softness = machine[COMPLIANCE] * thickness
        curve = self.curve
        begin = curve.load / thickness
        with warnings.catch_warnings(action="ignore"):
            law = law_of_joint(LawJoint.from_scene(scene), extrapolate=True)
            total = curve.deepest - machine[OFFSET]
            deepest = _of_joint(law, total, softness, np.maximum.accumulate(begin))
            deepest = np.where(curve.displacement < curve.deepest, deepest, 0.0)
            total = curve.displacement - machine[OFFSET]
            delta = _of_joint(law, total, softness, begin, deepest)
            state = law.at(delta, deepest)
        return Predicted(delta, state.load * thickness, state.error * thickness)

    def residuals(self, z: Array) -> Array:
        """Law less measured forces over the largest measured force ``(n,)``."""
        return (self.predicted(z).load - self.curve.load) / self.curve.largest

    def jacobian(self, z: Array, chosen: Iterable[int], base: Array) -> Array:
        """Derivatives ``(n, k)`` of the residuals, ``base`` at ``z``, by the ``chosen`` unknowns; a
        step leads away from the nearer bound."""
        columns = []
        for k in chosen:
            low, high = self.bounds[:, k]
            step = _STEP if high - z[k] > z[k] - low else -_STEP
            moved = z + step * (np.arange(len(z)) == k)
            columns.append((self.residuals(moved) - base) / step)
        return np.stack(columns, axis=1)

    @cached_property
    def bounds(self) -> Array:
        """The least and the largest z ``(2, m)``."""
        ends = [(unknown.z(unknown.low), unknown.z(unknown.high)) for unknown in self.unknowns]
        return np.array(ends).T

    def fit(self, z: Array, scale: float = 1.0, held: int | None = None, most: int = 60) -> Any:
        """The least loss from ``z`` on, with one unknown ``held`` or none, in at ``most`` so many
        iterations; residuals beyond ``scale`` count less."""
        chosen = np.flatnonzero(np.arange(len(z)) != held)
        low, high = self.bounds[:, chosen]
        known = {}  # residuals of this fit, which the Jacobian needs again

        def whole(part: Array) -> Array:
            found = z.copy()
            found[chosen] = part
            return found

        def residuals(part: Array) -> Array:
            if part.tobytes() not in known:
                known[part.tobytes()] = self.residuals(whole(part))
            return known[part.tobytes()]

        found = least_squares(
            residuals,
            np.clip(z[chosen], low + 1e-6, high - 1e-6),
            jac=lambda part: self.jacobian(whole(part), chosen, residuals(part)),
            bounds=(low, high),
            loss="huber",
            f_scale=scale,
            max_nfev=most,
            ftol=_EXACT,
            xtol=_EXACT,
        )
        found.x = whole(found.x)
        return found


def _of_joint(
    law: JointCurve, total: Array, softness: float, begin: Array, deepest: Array | float = 0.0
) -> Array:
    """The displacements delta of the joint with ``delta + softness P(delta) = total`` ``(n,)``,
    where P is about what it is to ``begin`` with."""
    if softness == 0:
        return total
    delta = total - softness * begin
    last = law.dy[-1] * law.force / law.length
    for _ in range(_ITERATIONS):
        state = law.at(delta, deepest)
        miss = delta + softness * state.load - total
        slope = np.where(np.isnan(state.stiffness), last, state.stiffness)
        delta = delta - miss / (1 + softness * slope)
        if np.abs(miss).max() < _CLOSE * law.length:
            break
    return delta


@dataclass(frozen=True)
class Estimate:
    """What is known of an unknown: ``value``, its 95 % interval ``low`` to ``high``, by how much
    the law's own error may move it, ``by_law``, nan where that is unknown, whether it ``is_bound``
    to the end of what was allowed, and whether the curve is ``blind`` to it."""

    unknown: Unknown
    value: float
    low: float
    high: float
    by_law: float
    is_bound: bool
    blind: bool


@dataclass(frozen=True)
class Identification:
    """A fit: its ``model``, the solution ``z`` ``(m,)``, ``predicted`` forces, the ``estimates``
    and their ``correlation`` ``(m, m)``, nan of an unknown that is at its bound or blind."""

    model: Model
    z: Array
    predicted: Predicted
    estimates: Sequence[Estimate]
    correlation: Array

    @property
    def scene(self) -> Scene:
        """The identified scene."""
        return self.model.scene_at(self.z)

    @property
    def residuals(self) -> Array:
        """Law less measured forces ``(n,)``."""
        return self.predicted.load - self.model.curve.load


def identify(
    scene: Scene,
    curve: MeasuredCurve,
    frees: Sequence[str],
    offset: float | None = None,
    stiffness: float | None = None,
) -> Identification:
    """The keys ``frees`` of ``scene`` (see `of_scene`) by a measured ``curve``, with the
    ``offset`` of its readings and the ``stiffness`` of the machine, both sought if None. Raises
    `InputError`."""
    first = int(np.argmax(curve.load > _BEGINS * curve.largest))
    begins = float(curve.displacement[max(first - 1, 0)])
    travel = float(np.ptp(curve.displacement))
    machine, fixed = of_machine(scene, begins, travel, offset, stiffness)
    unknowns = [*of_scene(scene, frees), *machine]
    if len(curve.load) <= 2 * len(unknowns):
        said = f"{len(curve.load)} points are too few for {len(unknowns)} unknowns"
        raise InputError(f"{said}; measure more, or fix some.")
    model = Model(scene, curve, unknowns, fixed)
    found = model.fit(_begun(model))
    scale = _ROBUST * _deviation(model.residuals(found.x))
    found = model.fit(found.x, scale)
    return _judged(model, found, scale)


def _begun(model: Model) -> Array:
    """Where the best of some fits is after a few iterations; they begin with the best of some
    points around the values of the scene. A joint outside the range of the law has to be better by
    far."""
    of_scene = [unknown for unknown in model.unknowns if unknown.keys and unknown.unit is None]
    factors = _FACTORS if len(of_scene) <= _ALL_FACTORS else _FACTORS[:3]
    tried: list[Sequence[float]] = []
    for unknown in model.unknowns:
        values: Sequence[float] = (0.0,)
        if unknown in of_scene[:_TRIED]:
            values = [math.log(factor) for factor in factors]
        elif unknown.name == COMPLIANCE:
            values = _COMPLIANCES
        tried.append(values)
    low, high = model.bounds
    points = [np.clip(z, low, high) for z in itertools.product(*tried)]
    points.sort(key=lambda z: float(np.square(model.residuals(z)).sum()))
    fits = [model.fit(z, most=_FIRST_ITERATIONS) for z in points[:_FITS]]
    best, *others = sorted(fits, key=lambda fit: model.is_outside(fit.x))
    for other in others:
        if other.cost < _BETTER * best.cost:
            best = other
    return best.x


def _deviation(residuals: Array) -> float:
    """Standard deviation by the median, which stray points do not move."""
    return max(1.4826 * float(np.median(np.abs(residuals))), _LEAST)


def _judged(model: Model, found: Any, scale: float) -> Identification:
    """The solution with its intervals and correlations."""
    z = found.x
    r = model.residuals(z)
    J = model.jacobian(z, range(len(z)), r)
    size = np.linalg.norm(J, axis=0)
    bound = (np.abs(model.bounds - z) < _BOUND).any(axis=0)
    blind = size <= _FLAT * size.max()  # all of them where the law never touches
    known = ~bound & ~blind
    inside = np.abs(r) <= scale
    J = J[:, known]
    inverse = np.linalg.pinv(J.T @ (J * inside[:, None]), rcond=1e-14, hermitian=True)
    scores = J * np.clip(r, -scale, scale)[:, None]
    freedom = len(r) - known.sum()
    covariance = inverse @ (scores.T @ scores) @ inverse * len(r) / freedom
    deviation = np.full(len(z), np.inf)
    deviation[known] = np.sqrt(np.diag(covariance))
    correlation = np.full((len(z), len(z)), np.nan)
    correlation[np.ix_(known, known)] = covariance / np.outer(deviation[known], deviation[known])
    predicted = model.predicted(z)
    error = np.where(inside, predicted.error, 0.0) / model.curve.largest
    by_law = np.full(len(z), np.nan)
    by_law[known] = np.abs(inverse @ (J.T @ error))
    reach = np.where(known, stdtrit(freedom, _CONFIDENCE) * deviation, np.inf)
    curvature = np.zeros(len(z))
    curvature[known] = 1 / np.diag(inverse)
    estimates = []
    for k, unknown in enumerate(model.unknowns):
        ends = [-reach[k], reach[k]]
        if known[k] and unknown.keys:
            ends = [end * _profile(model, found, scale, k, end, curvature[k]) for end in ends]
        low, high = np.clip(z[k] + ends, *model.bounds[:, k])
        value = float(unknown.value(z[k]))
        estimate = Estimate(
            unknown=unknown,
            value=value,
            low=float(unknown.value(low)),
            high=float(unknown.value(high)),
            by_law=abs(float(unknown.value(z[k] + by_law[k])) - value),
            is_bound=bool(bound[k]),
            blind=bool(blind[k]),
        )
        estimates.append(estimate)
    return Identification(model, z, predicted, estimates, correlation)


def _profile(model: Model, found: Any, scale: float, k: int, end: float, curvature: float) -> float:
    """The factor on an ``end`` of the interval of unknown ``k`` by the loss there, over what its
    ``curvature`` predicts, with all others fitted."""
    z = found.x.copy()
    z[k] = np.clip(z[k] + end, *model.bounds[:, k])
    expected = 0.5 * (z[k] - found.x[k]) ** 2 * curvature
    if len(z) == 1 or expected == 0:
        return 1.0
    rise = model.fit(z, scale, held=k, most=_PROFILE).cost - found.cost
    return min(1 / np.sqrt(max(rise / expected, 1e-12)), _WIDEST)
