"""What is said of an identified joint: a table, sentences, JSON, and a picture."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from archord.output.user_file import save_figure
from archord.postprocess.curve import rms
from archord.postprocess.laws.general.general_law import outside
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.identification.identification import Estimate, Identification
from archord.postprocess.laws.identification.unknowns import COMPLIANCE, OFFSET
from archord.postprocess.laws.laws import LAWS
from archord.report.by_name import ByName, Words
from archord.report.figure import new_figure
from archord.report.table import Table

_ALIKE = 0.95  # correlation of two unknowns that are hardly told apart
_POOR = 0.3  # half an interval over its value that tells hardly anything
_SERIAL = 0.5  # correlation of neighbouring residuals that noise hardly ever has
_MISSED = 0.05  # rms of residuals over the largest force beyond which something is wrong
_GAP = 3  # points before first touch that show where it is
_LEAD = 5  # points by which a curve begins, at most
_SHORT = 20  # points of a curve for each of them
_ZERO = 0.02  # of the largest force: what noise may leave of none
_RETURNED = 0.1  # share of the largest force by which the way back must leave first loading


def as_read(found: Identification) -> Identification:
    """``found`` with its offset as a reading of the file, whose displacements may have been turned
    round."""
    if not found.model.curve.turned:
        return found
    estimates = []
    sign = np.ones(len(found.estimates))
    for k, one in enumerate(found.estimates):
        if one.unknown.name == OFFSET:
            sign[k] = -1.0
            own = one.unknown
            unknown = replace(own, start=-own.start, low=-own.high, high=-own.low)
            one = replace(one, unknown=unknown, value=-one.value, low=-one.high, high=-one.low)
        estimates.append(one)
    correlation = found.correlation * np.outer(sign, sign)
    return replace(found, estimates=estimates, correlation=correlation)


def units_of(found: Identification) -> Words:
    """The units of displacement and force, and of each unknown."""
    scene = found.scene
    thickness = scene.analysis.thickness
    length = scene.units.length
    force = scene.units.force_of(thickness)
    units = {"displacement": length, "force": force}
    for estimate in found.estimates:
        unknown = estimate.unknown
        heading = scene.heading(unknown.keys[0]) if unknown.keys else ""
        units[unknown.name] = heading.partition("[")[2].rstrip("]")
    return units | {OFFSET: length, COMPLIANCE: f"{length}/{_whole(force)}"}


def _whole(unit: str) -> str:
    """A ``unit`` beside a slash: in brackets if it is a quotient or a product."""
    return f"({unit})" if "/" in unit or " " in unit else unit


def estimates_table(found: Identification) -> Table:
    """A row for each unknown."""
    units = units_of(found)
    columns = ("value {:.5g}", "95 % interval", "error by the law {:.2g}")
    table = Table("unknown", "unit", *columns, left=2)
    for one in as_read(found).estimates:
        name = one.unknown.name
        interval = f"{one.low:.5g} .. {one.high:.5g}"
        by_law = "unknown" if math.isnan(one.by_law) else one.by_law
        table.add(name, units[name], one.value, interval, by_law)
    return table


def correlation_table(found: Identification) -> Table:
    """The correlations of the unknowns' errors."""
    names = [one.unknown.name for one in found.estimates]
    correlation = as_read(found).correlation
    table = Table("correlation", *(f"{name} {{:.2f}}" for name in names), left=1)
    for k, name in enumerate(names):
        table.add(name, *correlation[k, :])
    return table


def notes(found: Identification) -> list[str]:
    """How well the law meets the curve, a sentence each."""
    residuals = found.residuals
    largest = found.model.curve.largest
    worst = np.abs(residuals).max() / largest
    said = [
        f"residuals: {rms(residuals) / largest:.2%} of the largest force rms, {worst:.2%} at "
        f"worst, {len(residuals)} points"
    ]
    softness = next((one for one in found.estimates if one.unknown.name == COMPLIANCE), None)
    if softness is not None and softness.value > 0 and not softness.is_bound:
        units = units_of(found)
        stiffness = f"{1 / softness.value:.4g} {_whole(units['force'])}/{units['displacement']}"
        said.append(f"machine stiffness: {stiffness}")
    return said


def doubts(found: Identification) -> list[str]:
    """What cannot be told, and what is outside of what the law knows, a sentence each."""
    found = as_read(found)
    said = [*found.model.curve.said]
    for one in found.estimates:
        said += _doubts_of(one, found)
    names = [one.unknown.name for one in found.estimates]
    for i, k in itertools.combinations(range(len(names)), 2):
        alike = found.correlation[i, k]
        if abs(alike) > _ALIKE:
            why = _reason({names[i], names[k]}, found)
            said.append(
                f"{names[i]} and {names[k]} can hardly be told apart (correlation {alike:.3f}): "
                f"{why}"
            )
    return [*said, *_doubts_of_zero(found), *_doubts_of_law(found), *_doubts_of_residuals(found)]


def _doubts_of(one: Estimate, found: Identification) -> list[str]:
    """What is to be said of a single unknown."""
    name = one.unknown.name
    if one.blind:
        why = "the curve does not depend on it"
        if name.endswith("yield_stress"):
            why += ", as the joint stays elastic; press deeper"
        return [f"{name}: cannot be told, {why}"]
    if one.is_bound and name == COMPLIANCE:
        return ["machine compliance: is 0 within the noise, or without limit; fix it"]
    if one.is_bound:
        ends = f"{one.unknown.low:.4g} to {one.unknown.high:.4g}"
        cure = "check the units of the curve and the values of the scene"
        said = f"{name} = {one.value:.4g}: is at a bound of what was allowed, {ends}"
        return [f"{said}, and taken as known in the intervals of the others; {cure}"]
    bounds = ((one.low, one.unknown.low), (one.high, one.unknown.high))
    cut = [f"{bound:.4g}" for end, bound in bounds if math.isclose(end, bound)]
    if one.unknown.keys and cut:
        where = " and ".join(cut)
        said = f"{name}: its interval ends at {where}, where it was allowed to, not by the curve"
        return [f"{said}; intervals of the others count on that"]
    half = (one.high - one.low) / 2
    if one.unknown.keys and half > _POOR * abs(one.value):
        return [f"{name}: is known to {half / one.value:.0%} only"]
    return []


def _reason(names: set[str], found: Identification) -> str:
    """Why two unknowns look alike, and what helps."""
    before = (found.predicted.delta < 0).sum()
    if OFFSET in names and before < _GAP:
        return "the curve has no points before first touch; measure some, or give --offset"
    if COMPLIANCE in names and not _returns(found):
        return "the curve has no way back; measure one, or give --machine-stiffness"
    if COMPLIANCE in names:
        return "machine and joint are springs in a row; give --machine-stiffness"
    return "the curve tells a combination of both; give one of them"


def _doubts_of_zero(found: Identification) -> list[str]:
    """A warning of a curve that begins with a force: the machine's own, or behind first touch."""
    curve = found.model.curve
    lead = max(1, min(_LEAD, len(curve.load) // _SHORT))
    begins = float(np.median(curve.load[:lead]))
    if abs(begins) <= _ZERO * curve.largest:
        return []
    share = f"{abs(begins) / curve.largest:.1%} of the largest"
    return [
        f"the curve begins at a force of {abs(begins):.4g}, {share}, where the joint has none: "
        "subtract what the machine reads without a load, and measure from before first touch"
    ]


def _returns(found: Identification) -> bool:
    """Whether the curve has a way back."""
    curve = found.model.curve
    last = int(np.argmax(curve.displacement))
    return bool(curve.load[last:].min() < (1 - _RETURNED) * curve.largest)


def _doubts_of_law(found: Identification) -> list[str]:
    """What the law says of the identified joint."""
    joint = LawJoint.from_scene(found.scene)
    said = []
    reason = outside(joint)
    if reason:
        said.append(f"archord: {reason}: the identified joint is outside the range of the law")
    beyond = found.predicted.delta > 3 * joint.clearance
    if beyond.any():
        said.append(f"{beyond.sum()} points are beyond 3 clearances, where the law ends")
    return said + LAWS["archord"].doubts(joint)


def _doubts_of_residuals(found: Identification) -> list[str]:
    """Residuals that no noise has."""
    r = found.residuals
    largest = found.model.curve.largest
    said = []
    missed = rms(r) / largest
    if missed > _MISSED:
        said.append(
            f"the law misses the curve by {missed:.0%} of its largest force: it is another joint, "
            "or other units"
        )
    alike = np.corrcoef(r[:-1], r[1:])[0, 1]
    if alike > _SERIAL:
        said.append(
            f"residuals of neighbours are alike (correlation {alike:.2f}): the curve has another "
            "shape than the law, and intervals are too small"
        )
    return said


def as_json(found: Identification) -> str:
    """All numbers and sentences as JSON; null for what is unknown. The offset and the displacements
    are readings of the file, delta and forces are positive in compression."""
    found = as_read(found)
    units = units_of(found)
    fixed = dict(found.model.fixed)
    turn = -1.0 if found.model.curve.turned else 1.0
    if OFFSET in fixed:
        fixed[OFFSET] *= turn
    estimates = []
    for one in found.estimates:
        numbers = {"value": one.value, "low": one.low, "high": one.high, "by_law": one.by_law}
        row: ByName = {"unit": units[one.unknown.name]}
        row |= {name: _finite(value) for name, value in numbers.items()}
        row |= {"at_bound": one.is_bound, "without_effect": one.blind}
        estimates.append({"name": one.unknown.name, "keys": [*one.unknown.keys], **row})
    curve = found.model.curve
    known = np.isfinite(found.correlation)
    data = {
        "estimates": estimates,
        "correlation": np.where(known, found.correlation, np.array(None)).tolist(),
        "fixed": fixed,
        "notes": notes(found),
        "doubts": doubts(found),
        "displacement": (turn * curve.displacement).tolist(),
        "load": curve.load.tolist(),
        "law": found.predicted.load.tolist(),
        "delta": found.predicted.delta.tolist(),
    }
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def draw(found: Identification, target: Path, solved: Any = None) -> Path:
    """Draw measured points, the law, what was ``solved`` (delta and P), and residuals as
    ``target``. Raises ValueError for an unknown format."""
    units = units_of(found)
    curve = found.model.curve
    delta = found.predicted.delta
    figure = new_figure(9, 4.2)
    force, residuals = figure.subplots(1, 2)
    force.plot(delta, curve.load, "o", ms=3, mfc="none", color="C0", label="measured")
    force.plot(delta, found.predicted.load, "-", lw=1.4, color="C1", label="law")
    if solved is not None:
        force.plot(*solved, "k+", ms=5, label="solved")
    force.set(ylabel=f"P [{units['force']}]", title="identified joint")
    force.legend(frameon=False, fontsize="small")
    residuals.plot(delta, 100 * found.residuals / curve.largest, "o", ms=3, mfc="none")
    residuals.axhline(0, color="black", lw=0.8)
    residuals.set(ylabel="(law - measured) / largest force [%]", title="residuals")
    for axis in figure.axes:
        axis.set(xlabel=f"displacement of the joint [{units['displacement']}]")
        axis.grid(alpha=0.3)
    return save_figure(figure, target)
