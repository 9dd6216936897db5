"""The law of any pin joint like those solved, reduced to a table: first loading, way back, expected
error."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from archord.postprocess.laws.general.elastic_model import Elastic, elastic_model
from archord.postprocess.laws.general.joint import Array, LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve, bent
from archord.postprocess.laws.general.yield_model import (
    ELASTIC_BELOW,
    Yielding,
    first_yield,
    loss,
    sides_of,
)
from archord.report.version import VERSION

NODES = np.concatenate([[0.0], np.geomspace(0.02, 3.0, 60)])  # x = delta/dR
NU, CLEARANCES, RATIOS = (0.0, 0.49), (1e-3, 0.02), (1 / 3, 10.0)  # the range
SMALLEST_S = {"strain": 0.15, "stress": 0.2}
_LAST_DIGITS = 1e-3  # of the bounds, and of moduli that a scene has rounded
_ELASTIC_ERROR = 1e-3  # of P, relative: that of 9 in 10 elastic joints is less
# secant of the way back over the elastic joint's steepest slope: then it is a straight line
_STEEPEST = 0.999


@lru_cache(maxsize=64)
def general_law(joint: LawJoint, extrapolate: bool = False) -> JointCurve:
    """The law of ``joint`` in its units, forces per unit length along its axis. Raises ValueError
    for a joint that does not tell plane and nu, or is a ring, and without ``extrapolate`` for one
    `outside` the range."""
    if joint.plane is None or joint.nu is None:
        raise ValueError(f"archord: this law needs {'plane' if joint.plane is None else 'nu'}.")
    reason = "this is a ring, and the law is of a pin in a block" if joint.ring else outside(joint)
    if reason and not extrapolate:
        raise ValueError(f"archord: {reason}.")
    found = law_of_numbers(joint_numbers(joint))
    tables = {name: value[0] for name, value in vars(found).items() if np.ndim(value) == 2}
    units = {"length": joint.clearance, "force": joint.unit, "pressure": joint.unit / joint.radius}
    title = f"a pin joint in plane {joint.plane}, by archord's law of solved joints"
    about = {"title": title, "archord": VERSION, "joint": {name: value for name, value in vars(joint).items() if value},
             "outside": reason or "nothing: inside the range of solved joints",
             "expected error": "unknown" if reason else _error_in_words(found)}  # fmt: skip
    changes: dict[str, Any] = {**tables, **units, "about": about}
    return replace(found, **changes)


def _error_in_words(law: JointCurve) -> str:
    """The errors that 9 in 10 joints like that of ``law`` keep, at most."""
    usual, most = (law.error[..., (NODES >= 0.1) & (end >= NODES)].max() for end in (2.0, 3.0))
    back = (
        f", and on the way back within {law.back_error.max():.1%} of the largest P"
        if law.yields
        else ""
    )
    return f"9 in 10 such joints are within {usual:.1%} of P from 0.1 to 2 dR, {most:.1%} to 3 dR{back}"


def law_of_numbers(numbers: npt.ArrayLike) -> JointCurve:
    """The laws of joints with these ``numbers`` ``(m, 7)`` (see `joint_numbers`) in units of dR, E*
    dR and E* dR/R, in tables of a row each; a body that yields beyond the range is elastic."""
    rows = np.atleast_2d(np.asarray(numbers, float)).copy()
    for strain in np.unique(rows[:, 0]):
        of = rows[:, 0] == strain
        for body in (5, 6):
            begins = first_yield(
                elastic_model(), bool(strain), Elastic(*rows[of, 1:5].T), rows[of, body]
            )
            rows[of, body] = np.where(ELASTIC_BELOW * begins < NODES[-1], rows[of, body], np.inf)
    sides = np.array(["" if np.isinf(row[5:]).all() else sides_of(row)[0] for row in rows])
    tables: dict[str, Any] = {}
    for side in np.unique(sides):
        of = sides == side
        found = reduce_joints(
            side, Elastic(*rows[of, 1:5].T), Yielding(*rows[of, 5:].T) if side else None
        )
        for name, value in vars(found).items():
            if np.ndim(value) == 2:
                tables.setdefault(name, np.empty((len(rows), value.shape[1])))[of] = value
    return JointCurve(NODES, **tables)


def outside(joint: LawJoint) -> str:
    """What of ``joint`` is outside the range of the law, as parameter, value and range; empty if
    nothing is."""
    strain, p, m, n, clearance, *stresses = joint_numbers(joint)
    pin_nu, nu = (value / (1 + value) if strain else value for value in (m, n))
    stiffness = (
        math.inf if p == 0 else (1 - p) / p * ((1 - pin_nu**2) / (1 - nu**2) if strain else 1.0)
    )
    stiffest = math.inf if joint.pin_yield is None else RATIOS[1]
    checks = [("nu of the pin", pin_nu, *NU), ("nu of the block", nu, *NU), ("dR/R", clearance, *CLEARANCES),
              ("E(pin)/E(block)", stiffness, RATIOS[0], stiffest),
              ("sigY R/(E* dR)", min(stresses), SMALLEST_S["strain" if strain else "stress"], math.inf)]  # fmt: skip
    if joint.hardens:
        return "a body hardens, and the law is of perfect plasticity; archord fit RUN --table makes that of one joint"
    for name, value, low, high in checks:
        if not low * (1 - _LAST_DIGITS) <= value <= high * (1 + _LAST_DIGITS):
            return f"{name} = {value:.4g} is outside {low:g} " + (
                f"to {high:g}" if high < math.inf else "and more"
            )
    return ""


def joint_numbers(joint: LawJoint) -> tuple[float, ...]:
    """What decides a joint: plane (1: strain), p, m, n, dR/R, and s of pin and block, infinite of
    an elastic body, as `SolvedJoints` has them."""
    assert joint.nu is not None
    strain = joint.plane == "strain"
    nus = joint.nu if joint.pin_nu is None else joint.pin_nu, joint.nu
    m, n = (nu / (1 - nu) if strain else nu for nu in nus)
    stresses = (
        math.inf if stress is None else stress for stress in (joint.pin_yield, joint.block_yield)
    )
    unit = joint.unit / joint.radius
    return (
        float(strain),
        joint.pin_share,
        m if joint.pin_share else 0.0,
        n,
        joint.clearance / joint.radius,
        *(s / unit for s in stresses),
    )


def reduce_joints(side: str, joints: Elastic, yielding: Yielding | None = None) -> JointCurve:
    """The laws of ``joints``, of one side (`SIDES` of yield_model.py), as one `JointCurve` with a
    row for each, in units of dR, E* dR and E* dR/R; elastic without ``yielding``, and where first
    yield is beyond the range."""
    x = NODES[1:]
    base = elastic_model().at(joints, x)
    back, dback = _from_zero(base.y), _from_zero(base.slope)
    y, dy, peak, angle = base.y, base.slope, base.peak, base.angle
    error = np.full_like(y, _ELASTIC_ERROR)
    ratio, toe, back_error = np.ones_like(back), np.zeros_like(back), np.zeros_like(back)
    if yielding is not None:
        lost = loss(side, elastic_model(), joints, yielding, x)
        y, dy = y * np.exp(lost.force), (dy / y + lost.slope) * y * np.exp(lost.force)
        y, dy = _rising(x, y, dy)
        peak, angle = peak * np.exp(lost.peak), angle * np.exp(lost.angle)
        error = np.hypot(error, lost.deviation)
        unit = x * y / base.y
        travel = np.clip(lost.travel * unit, 1e-3 * x, x)
        travel = x - np.maximum.accumulate(x - travel, axis=1)
        toe = _from_zero(np.clip(lost.toe * unit, 0.0, x - travel))
        rows = zip(base.y, base.slope, y, travel, strict=True)
        ratio = _from_zero(np.stack([_ratio(x, *map(np.asarray, row)) for row in rows]), 1.0)
        back_error = _from_zero(np.hypot(error, lost.way_error))
    root = np.sqrt(y)
    angle = np.minimum(angle, np.pi / 2)
    F0 = elastic_model().F.at(joints, np.zeros(1))[0][:, 0]
    rise, end = base.F[:, 0] - F0, base.F_slope[:, 0]
    touch = np.stack([F0, 2 * rise / x[0] - end, end / x[0] - rise / x[0] ** 2], axis=1)
    tables: dict[str, Any] = {
        "y": _from_zero(y),
        "dy": _from_zero(dy),
        "back": back,
        "dback": dback,
        "toe": toe,
    }
    tables["touch"] = touch
    for name, values in (
        ("ratio", ratio),
        ("peak", _first_again(peak / root)),
        ("angle", _first_again(angle / root)),
    ):
        tables |= {name: values, f"d{name}": _slopes(values)}
    return JointCurve(NODES, **tables, error=_first_again(error), back_error=back_error)


def _from_zero(values: Array, first: float = 0.0) -> Array:
    """``values`` ``(m, n)`` with the one at zero before them."""
    return np.insert(values, 0, first, axis=1)


def _first_again(values: Array) -> Array:
    """``values`` ``(m, n)`` with the first one at zero, too."""
    return np.insert(values, 0, values[:, 0], axis=1)


def _slopes(values: Array) -> Array:
    """Slopes at the nodes of cubics that rise and fall where ``values`` ``(m, nodes)`` do (Fritsch,
    Butland 1984)."""
    return PchipInterpolator(NODES, values, axis=1).derivative()(NODES)


def _rising(x: Array, y: Array, dy: Array) -> tuple[Array, Array]:
    """``y`` and ``dy`` ``(m, n)`` with as little changed as makes the cubics between nodes rise
    (Fritsch and Carlson 1980): values that fall are held, slopes are at most three times the
    secants beside them."""
    y = np.maximum.accumulate(y, axis=1)
    secants = np.diff(y, axis=1) / np.diff(x)
    steepest = 3 * np.minimum(
        np.insert(secants, 0, secants[:, 0], axis=1), np.append(secants, secants[:, -1:], axis=1)
    )
    return y, np.clip(dy, 0.0, steepest)


def _ratio(x: Array, base: Array, slope: Array, y: Array, travel: Array) -> Array:
    """The ratio r ``(n,)`` of ways back of ``travel`` from ``y``: with ``a = travel/r`` the elastic
    joint's ``base(a)/a`` is ``y/travel``, a rising function of a; beyond the last node base goes
    straight on."""
    secant = y / travel
    last, steepest = base[-1] / x[-1], slope[-1]
    far = (steepest * x[-1] - base[-1]) / (steepest - np.minimum(secant, _STEEPEST * steepest))
    return travel / np.where(secant > last, far, np.interp(secant, base / x, x))


def way_back(
    x: Array, base: Array, slope: Array, below: Array, largest: float, travel: float, toe: float
) -> Array:
    """y ``(k,)`` at ``below`` the deepest point, negative, where it is ``largest``, of a joint with
    this ``travel`` and ``toe``; of the elastic joint ``base`` with its ``slope`` at ``x``
    ``(n,)``."""
    ratio = float(_ratio(x, base, slope, np.array([largest]), np.array([travel]))[0])
    u = bent(below + travel, np.asarray(travel), np.asarray(toe))[0] / ratio
    straight = base[-1] + slope[-1] * (u - x[-1])
    return ratio * np.where(
        u > x[-1], straight, np.interp(u, np.append(0.0, x), np.append(0.0, base))
    )
