"""The law of any pin joint like those solved, reduced to a table: first loading, way back, expected
error."""

from __future__ import annotations

import math
import warnings
from dataclasses import fields, replace
from functools import lru_cache

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.elastic_model import Elastic, elastic_model
from archord.postprocess.laws.general.factor_model import (
    FRICTION,
    LARGE_STRAIN,
    LARGEST,
    Gain,
    Plain,
    gain,
)
from archord.postprocess.laws.general.hardening_model import (
    Flows,
    block_leads,
    flows,
    hardened_loss,
    largest_gain,
)
from archord.postprocess.laws.general.joint import (
    ROUGH_PRESSURE,
    LawJoint,
    LawRangeWarning,
    keys_of,
)
from archord.postprocess.laws.general.joint_curve import JointCurve, bent, line_contact_level
from archord.postprocess.laws.general.spline import monotone_slopes, spline_slopes
from archord.postprocess.laws.general.yield_model import (
    ELASTIC_BELOW,
    Loss,
    Numbers,
    first_yield,
    loss,
)
from archord.report.by_name import ByName
from archord.report.version import VERSION

NODES = np.concatenate([[0.0], np.geomspace(0.02, 3.0, 60)])  # x = delta/dR
# the range
NU = (0.0, 0.49)
CLEARANCES = (1e-3, 0.02)
RATIOS = (1 / 3, 10.0)
SMALLEST_S = {"strain": 0.15, "stress": 0.2}
_LAST_DIGITS = 1e-3  # of the bounds, and of moduli that a scene has rounded
# of P, relative, which 9 in 10 joints keep: of small x, and else of what is elastic
_EARLY_ERROR = 1e-3
_SMALL = 0.1
_ELASTIC_ERRORS = (1.6e-4, 3.2e-4)
_SOFT = (0.5, 0.6)  # p m of pins, between which the elastic error goes from one to the other
LARGEST_GAIN = 3.2  # of s_eff/s at 3 dR; solved joints reach 2.6
# secant of the way back over the elastic joint's steepest slope: then it is a straight line
_STEEPEST = 0.999


def general_law(joint: LawJoint, extrapolate: bool = False) -> JointCurve:
    """The law of a joint, from the joints that archord has solved.

    Parameters
    ----------
    joint : LawJoint
        The joint, with ``plane`` and ``nu``.
    extrapolate : bool
        Give the law even if the joint is `outside` the range; its expected errors are nan.

    Returns
    -------
    JointCurve
        The law in the units of ``joint``, with forces per unit length along its axis.

    Raises
    ------
    ValueError
        For a joint without ``plane`` or ``nu``; and, without ``extrapolate``, for a ring and for a
        joint outside the range.

    Warns
    -----
    LawRangeWarning
        Of a joint whose forces are others than the law's, as in a small block or with a whole pin.

    Examples
    --------
    >>> from archord.postprocess.laws.general.general_law import general_law
    >>> from archord.postprocess.laws.general.joint import LawJoint, LawRangeWarning
    >>> joint = LawJoint(radius=10.0, clearance=0.05, E_star=115e3, plane="strain", nu=0.3)
    >>> law = general_law(joint)
    >>> print(f"{law.at(0.05).load:.0f}")
    6342
    """
    for said in joint.unlike_solved:
        warnings.warn(LawRangeWarning(f"archord: is a law {said}"), stacklevel=2)
    return law_of_joint(joint, extrapolate)


@lru_cache(maxsize=64)
def law_of_joint(joint: LawJoint, extrapolate: bool = False) -> JointCurve:
    """As `general_law`, without a warning."""
    plane_and_nu(joint)
    reason = "this is a ring, and the law is of a pin in a block" if joint.ring else outside(joint)
    if reason and not extrapolate:
        error = ValueError(f"archord: {reason}.")
        keys = keys_of(reason) or "the joint"
        error.add_note(f"Change {keys} in its scene, or take general_law(joint, extrapolate=True).")
        raise error
    law = law_of_numbers(
        joint_numbers(joint), flows(joint), joint.friction, large_strain=joint.large_strain
    )
    unlike = "; ".join(f"is a law {said}" for said in joint.unlike_solved)
    about = {
        "title": f"a pin joint in plane {joint.plane}, by archord's law of solved joints",
        "archord": VERSION,
        "joint": _in_numbers(joint),
        "outside": reason or unlike or "nothing: inside the range of solved joints",
        "expected error": "unknown" if reason else _error_in_words(law, joint.friction),
    }
    if reason:
        unknown = np.full(len(NODES), np.nan)
        law = replace(law, error=unknown, back_error=unknown)
    pressure = joint.unit / joint.radius
    return replace(
        law,
        length=joint.clearance,
        force=joint.unit,
        pressure=pressure,
        about=about,
        radius=joint.radius,
    )


def _in_numbers(joint: LawJoint) -> ByName:
    """What decides ``joint``, as JSON has it: a hardening curve as points [PEEQ, yield stress]."""
    usual = {field.name: field.default for field in fields(joint)}
    told = {name: value for name, value in vars(joint).items() if value or value != usual[name]}
    for name in ("pin_hardening", "block_hardening"):
        if name in told:
            peeq = told[name].knots()
            told[name] = np.column_stack([peeq, told[name].stress(peeq)]).tolist()
    return told


def _error_in_words(law: JointCurve, friction: float) -> str:
    """The errors that 9 in 10 joints like the joint of ``law`` with this ``friction`` keep, at
    most."""
    usual, most = (law.error[(NODES >= 0.1) & (end >= NODES)].max() for end in (2.0, 3.0))
    said = f"9 in 10 such joints are within {usual:.2%} of P from 0.1 to 2 dR, {most:.2%} to 3 dR"
    if law.yields:
        said += f", and on the way back within {law.back_error.max():.1%} of the largest P"
    return f"{said}; {ROUGH_PRESSURE}" if friction else said


def law_of_numbers(
    numbers: Numbers,
    given: Flows = (None, None),
    friction: float = 0.0,
    *,
    large_strain: bool = False,
) -> JointCurve:
    """The law of a joint with these ``numbers`` in units of dR, E* dR and E* dR/R, whose bodies
    harden as ``given``; a body that yields beyond the range is elastic. The coefficient of
    ``friction`` and ``large_strain`` add to it."""
    numbers = within_range(numbers)
    joint = numbers.elastic
    lost = None
    if np.isfinite(numbers.yielding).any():
        lost = _lost(numbers, given)
    kinds = [FRICTION] * bool(friction) + [LARGE_STRAIN] * large_strain
    if not kinds:
        return reduce_joint(joint, lost)
    leads = block_leads(numbers, given, NODES[1:])
    added, of_elastic = (
        Gain.together([gain(plain, kind) for kind in kinds])
        for plain in (_plain(numbers, friction, leads, own) for own in (lost, None))
    )
    return reduce_joint(joint, lost, added, of_elastic)


def within_range(numbers: Numbers) -> Numbers:
    """The ``numbers`` of a joint in which a body that yields beyond the range is elastic."""
    stresses = np.array(numbers.yielding)
    begins = first_yield(elastic_model(), numbers.strain, numbers.elastic, stresses)
    stresses[ELASTIC_BELOW * begins >= NODES[-1]] = np.inf
    return Numbers(*numbers[:5], *stresses.tolist())


def _lost(numbers: Numbers, given: Flows) -> Loss:
    """What yielding takes from a joint at the nodes."""
    x = NODES[1:]
    stresses = numbers.yielding
    hardens = [flow is not None and np.isfinite(s) for flow, s in zip(given, stresses, strict=True)]
    if any(hardens):
        return hardened_loss(numbers, given, x)
    return loss(numbers, stresses, x)


def _plain(numbers: Numbers, friction: float, leads: Array, lost: Loss | None) -> Plain:
    """A joint at the nodes, which ``friction`` and large strain change."""
    x = NODES[1:]
    angle = elastic_model().at(numbers.elastic, x).angle
    fallen = np.zeros_like(x)
    if lost is not None:
        angle = angle * np.exp(lost.angle)
        fallen = lost.force
    return Plain(numbers.plane, friction, numbers.elastic, x, x[0], angle, fallen, leads)


def outside(joint: LawJoint) -> str:
    """What puts a joint outside the range of the general law.

    Parameters
    ----------
    joint : LawJoint
        The joint, with ``plane`` and ``nu``.

    Returns
    -------
    str
        The parameter, its value and the range; empty if the joint is inside.

    Raises
    ------
    ValueError
        For a joint without ``plane`` or ``nu``.

    Examples
    --------
    >>> from archord.postprocess.laws.general.general_law import outside
    >>> from archord.postprocess.laws.general.joint import LawJoint, LawRangeWarning
    >>> outside(LawJoint(radius=10.0, clearance=1.0, E_star=115e3, plane="strain", nu=0.3))
    'dR/R = 0.1 is outside 0.001 to 0.02'
    """
    if joint.kinematic:
        return (
            "a body has back stresses, and the law is of isotropic hardening; archord fit RUN "
            "--table makes the law of one joint"
        )
    numbers = joint_numbers(joint)
    pin_nu, nu = numbers.poisson
    p = numbers.p
    stiffness = math.inf
    if p:
        stiffness = (1 - p) / p * ((1 - pin_nu**2) / (1 - nu**2) if numbers.strain else 1.0)
    softest, stiffest = RATIOS
    if joint.pin_yield is None:
        stiffest = math.inf
    weakest = SMALLEST_S[numbers.plane]
    checks = [
        ("nu of the pin", pin_nu, *NU),
        ("nu of the block", nu, *NU),
        ("dR/R", numbers.clearance, *CLEARANCES),
        ("E(pin)/E(block)", stiffness, softest, stiffest),
        ("sigY R/(E* dR)", min(numbers.yielding), weakest, math.inf),
        ("friction", joint.friction, 0.0, LARGEST),
    ]
    for name, value, low, high in checks:
        if not low * (1 - _LAST_DIGITS) <= value <= high * (1 + _LAST_DIGITS):
            to = f"to {high:g}" if high < math.inf else "and more"
            return f"{name} = {value:.4g} is outside {low:g} {to}"
    gain = largest_gain(numbers, flows(joint), NODES[1:])
    if gain > LARGEST_GAIN:
        said = f"{gain:.3g} times the yield stress, at most {LARGEST_GAIN:g} times is covered"
        return f"a body hardens by 3 dR to {said}"
    return ""


def plane_and_nu(joint: LawJoint) -> tuple[str, float]:
    """Plane and Poisson's ratio of the block. Raises ValueError for a joint without."""
    plane = joint.plane
    nu = joint.nu
    if plane is None:
        raise ValueError("archord: this law needs plane.")
    if nu is None:
        raise ValueError("archord: this law needs nu.")
    return plane, nu


def joint_numbers(joint: LawJoint) -> Numbers:
    """What decides a joint. Raises ValueError without plane or nu."""
    plane, nu = plane_and_nu(joint)
    strain = plane == "strain"
    pin_nu = nu if joint.pin_nu is None else joint.pin_nu
    m, n = (ratio / (1 - ratio) if strain else ratio for ratio in (pin_nu, nu))
    clearance = joint.clearance / joint.radius
    numbers = [float(strain), joint.pin_share, m if joint.pin_share else 0.0, n, clearance]
    unit = joint.unit / joint.radius
    for stress in (joint.pin_yield, joint.block_yield):
        numbers.append(math.inf if stress is None else stress / unit)
    return Numbers(*numbers)


def reduce_joint(
    joint: Elastic,
    lost: Loss | None,
    added: Gain | None = None,
    of_elastic: Gain | None = None,
) -> JointCurve:
    """The law of ``joint`` in units of dR, E* dR and E* dR/R, with what is ``lost`` to yielding
    (None: elastic) and what friction and large strain have ``added``, and add ``of_elastic``
    bodies, whose curve ways back follow (None: neither), at the nodes above zero."""
    x = NODES[1:]
    base = elastic_model().at(joint, x)
    back = base.y
    dback = base.slope
    if of_elastic is not None:
        back, dback = _raised(x, back, dback, of_elastic)
    y = back
    dy = dback
    peak = base.peak
    angle = base.angle
    error = np.full_like(y, _EARLY_ERROR)
    ratio = np.ones_like(y)
    toe = np.zeros_like(y)
    back_error: Array = np.zeros(len(NODES))
    error[x >= _SMALL] = elastic_error(joint)
    if lost is not None:
        y = base.y * np.exp(lost.force)
        dy = (base.slope / base.y + lost.slope) * y
        y, dy = _rising(x, y, dy)
        peak = peak * np.exp(lost.peak)
        angle = angle * np.exp(lost.angle)
        error = np.hypot(error, lost.deviation)
        unit = x * y / base.y
        travel = np.clip(lost.travel * unit, 1e-3 * x, x)
        travel = x - np.maximum.accumulate(x - travel)
        toe = np.clip(lost.toe * unit, 0.0, x - travel)
        back_error = _from(0.0, np.hypot(error, lost.way_error))
        if added is not None:
            y, dy = _raised(x, y, dy, added)
        ratio = _ratio(x, back, dback, y, travel)
    if added is not None:
        peak = peak * np.exp(added.peak)
        angle = angle * np.exp(added.angle)
        error = np.hypot(error, added.deviation)
        back_error = np.hypot(back_error, _from(0.0, added.way_error))
    root = np.sqrt(y)
    ratio = _from(1.0, ratio)
    peak = _from(peak[0] / root[0], peak / root)
    angle = np.minimum(angle, np.pi / 2) / root
    angle = _from(angle[0], angle)
    return JointCurve(
        x=NODES,
        y=_from(0.0, y),
        dy=_from(0.0, dy),
        back=_from(0.0, back),
        dback=_from(0.0, dback),
        ratio=ratio,
        dratio=monotone_slopes(NODES, ratio),
        toe=_from(0.0, toe),
        touch=_touch(joint, back[0], dback[0]),
        peak=peak,
        dpeak=monotone_slopes(NODES, peak),
        angle=angle,
        dangle=monotone_slopes(NODES, angle),
        error=_from(error[0], error),
        back_error=back_error,
    )


def elastic_error(joint: Elastic) -> float:
    """The expected error of P of an elastic ``joint``, relative: larger where a pin is soft."""
    return float(np.interp(joint.p * joint.m, _SOFT, _ELASTIC_ERRORS))


def _raised(x: Array, y: Array, dy: Array, added: Gain) -> tuple[Array, Array]:
    """``y`` and ``dy`` ``(n,)`` at ``x`` with what friction and large strain have ``added``."""
    slope = spline_slopes(np.log(x), added.force) / x
    raised = y * np.exp(added.force)
    return _rising(x, raised, (dy / y + slope) * raised)


def _touch(joint: Elastic, y: float, dy: float) -> Array:
    """a, b, c of the logarithmic law up to the first node: F at first touch, and F and its slope
    at the node, where the force is ``y`` and its slope ``dy``."""
    (F0,), _ = elastic_model().F.at(joint, np.zeros(1))
    x = NODES[1]
    F, end = line_contact_level(x, y, dy)
    rise = F - F0
    return np.array([F0, 2 * rise / x - end, end / x - rise / x**2])


def _from(first: float, values: Array) -> Array:
    """``values`` ``(n,)`` with the ``first`` one, at zero, before them."""
    return np.append(first, values)


def _rising(x: Array, y: Array, dy: Array) -> tuple[Array, Array]:
    """``y`` and ``dy`` ``(n,)`` with as little changed as makes the cubics between nodes rise
    (Fritsch and Carlson 1980): values that fall are held, slopes are at most three times the
    secants beside them."""
    y = np.maximum.accumulate(y)
    secants = np.diff(y) / np.diff(x)
    before = np.append(secants[0], secants)
    after = np.append(secants, secants[-1])
    return y, np.clip(dy, 0.0, 3 * np.minimum(before, after))


def _ratio(x: Array, base: Array, slope: Array, y: Array, travel: Array) -> Array:
    """The ratio r of ways back of ``travel`` from ``y`` (any shape): with ``a = travel/r`` the
    elastic joint's ``base(a)/a`` is ``y/travel``, a rising function of a; beyond the last node base
    goes straight on."""
    secant = y / travel
    last = base[-1] / x[-1]
    steepest = slope[-1]
    off = steepest * x[-1] - base[-1]
    far = off / (steepest - np.minimum(secant, _STEEPEST * steepest))
    return travel / np.where(secant > last, far, np.interp(secant, base / x, x))


def way_back(
    x: Array, base: Array, slope: Array, below: Array, largest: float, travel: float, toe: float
) -> Array:
    """y ``(k,)`` at ``below`` the deepest point, negative, where it is ``largest``, of a joint with
    this ``travel`` and ``toe``; of the elastic joint ``base`` with its ``slope`` at ``x``
    ``(n,)``."""
    ratio = float(_ratio(x, base, slope, np.array(largest), np.array(travel)))
    u = bent(below + travel, np.asarray(travel), np.asarray(toe))[0] / ratio
    straight = base[-1] + slope[-1] * (u - x[-1])
    curve = np.interp(u, _from(0.0, x), _from(0.0, base))
    return ratio * np.where(u > x[-1], straight, curve)
