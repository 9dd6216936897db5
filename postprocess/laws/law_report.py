"""The closed-form laws for people: numbers of one law for a joint, all laws in words, and a picture."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from archord.output.user_file import writing
from archord.postprocess.laws import elastic_laws as elastic
from archord.postprocess.laws.joint import Array, LawJoint, LawRangeWarning
from archord.postprocess.laws.law import Law, LawState, Outside
from archord.postprocess.laws.laws import LAWS
from archord.report.figure import new_figure, save
from archord.report.table import Table

_POINTS = 400  # of a line of the picture


def sample(law: Law, joint: LawJoint, by: str, to: float, points: int, outside: Outside) -> LawState:
    """``points`` states of ``law`` in equal steps up to delta = ``to`` clearances, or P = ``to`` E* dR (by "load").

    Outside the range the steps themselves remain, all that the law would say of them is nan.
    """
    steps = np.arange(1, points + 1) * (to / points) * joint.clearance
    if by == "load":
        load = steps * joint.E_star
        return replace(law.at_load(joint, load, outside), load=load)
    return replace(law.at_displacement(joint, steps, outside), delta=steps)


def law_columns(
    law: Law, joint: LawJoint, by: str, to: float, points: int, outside: Outside, units: dict[str, str] | None = None
) -> dict[str, Array]:
    """Columns ``(points,)`` of a table of ``law`` with their headings; without those that the law says nothing of."""
    state = sample(law, joint, by, to, points, outside)

    def named(what: str, kind: str) -> str:
        return f"{what} [{units[kind]}]" if units else what

    columns: dict[str, Array] = {}
    if law.gives_displacement:
        columns = {named("delta", "length"): state.delta, "delta/dR": state.delta / joint.clearance}
    columns[named("P", "force")] = state.load
    columns["P/(E* R)"] = state.load / (joint.E_star * joint.radius)
    columns["P/(E* dR)"] = state.load / (joint.E_star * joint.clearance)
    if law.gives_displacement:
        columns[named("dP/ddelta", "stress")] = state.stiffness
    if "pressure" in law.gives:
        columns[named("p0", "stress")] = state.peak_pressure
    if "contact angle" in law.gives:
        columns["eps/deg"] = np.degrees(state.angle)
    return columns


def laws_as_markdown() -> str:
    """Every law in words, the laws against each other, the load limits, and the readings of Radzimovsky's d."""
    parts = [_description(law) for law in LAWS.values()]
    parts.append(
        "### P/(E* dR) against each other\n\ndR/R = 0.5 %, sigY/E* = 0.2 %, k = 0.85, length 2 R, plane strain, nu = "
        "0.3; in brackets: outside the range.\n\n" + _comparison().markdown()
    )
    parts += [f"### Load limits\n\n{_limits().markdown()}"]
    rows = [(words, f"{width:.4f}", f"{16 * math.exp(-1 / 3) / width**2:.4f}")
            for words, width in elastic.READINGS.items()]  # fmt: skip
    readings = Table("d", "d/(R* P/E*)^(1/2)", "load limit/(E* dR)", rows=rows)
    return "\n".join([*parts, f"### Readings of Radzimovsky's d\n\n{readings.markdown()}"])


def _description(law: Law) -> str:
    needs = f" Needs {', '.join(law.needs)}." if law.needs else ""
    title = f"{law.title[0].upper()}{law.title[1:]}.{needs}"
    points = f"- Range: {law.range}.\n- Source: {law.source}.\n- {law.remarks}\n"
    return f"### {law.name}\n\n{title}\n\n    {law.formula}\n\n{points}"


def _comparison() -> Table:
    """P/(E* dR) of all laws with displacements in a thin joint, formulas outside their range in brackets."""
    joint = LawJoint(radius=1.0, clearance=0.005, E_star=1.0, yield_stress=0.002, length=2.0, plane="strain", nu=0.3)
    loads = np.array([0.05, 0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0])
    table = Table("delta/dR", *(f"{load:g}" for load in loads))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LawRangeWarning)
        for law in LAWS.values():
            if law.gives_displacement:
                inside = law.force(joint, loads * joint.clearance, "nan") / joint.clearance
                formula = law.force(joint, loads * joint.clearance, "extrapolate") / joint.clearance
                cells = (f"{p:.4f}" if np.isfinite(q) else "" if np.isnan(p) else f"({p:.4f})"
                         for p, q in zip(formula, inside, strict=True))  # fmt: skip
                table.add(law.name, *cells)
    return table


def _limits() -> Table:
    joint = LawJoint(radius=1.0, clearance=0.005, E_star=1.0)
    table = Table("law", "P/(E* dR)", "delta/dR")
    for name in ("johnson", "radzimovsky", "radzimovsky-width", "radzimovsky-2.41", "esdu-78035"):
        deepest = LAWS[name].limit(joint)
        load = float(LAWS[name].force(joint, deepest))
        table.add(name, f"{load / joint.clearance:.4f}", f"{deepest / joint.clearance:.4f}")
    return table


def draw_laws(
    laws: Sequence[Law],
    joint: LawJoint,
    target: str | Path,
    by: str = "displacement",
    to: float = 2.0,
    outside: Outside = "nan",
) -> Path:
    """Draw force, peak pressure and contact angle of ``laws`` as ``target``; returns the file.

    Without displacements (``by`` "load") pressure and angle are drawn over the force. Raises `InputError` if ``target``
    cannot be written.
    """
    target, figure = Path(target), new_figure(14, 4.4)
    axes = figure.subplots(1, 3)
    force = joint.E_star * joint.clearance
    for law in laws:
        state = sample(law, joint, by, to, _POINTS, outside)
        x, other = state.delta / joint.clearance, state.load / force
        if by == "load":
            x, other = other, x
        ends = np.isnan(other).any()
        for axis, y in zip(axes, (other, state.peak_pressure / joint.E_star, np.degrees(state.angle)), strict=True):
            (line,) = axis.plot(x, y, label=law.name)
            drawn = np.flatnonzero(~np.isnan(x) & ~np.isnan(y))
            if ends and len(drawn):
                axis.plot(x[drawn[-1]], y[drawn[-1]], "o", ms=4, color=line.get_color())
    names = ("P / (E* ΔR)", "δ / ΔR") if by == "load" else ("δ / ΔR", "P / (E* ΔR)")
    for axis, label in zip(axes, (names[1], "p0 / E*", "contact semi-angle [°]"), strict=True):
        axis.set(xlabel=names[0], ylabel=label, xlim=(0, to), ylim=(0, None))
        axis.grid(alpha=0.3)
    axes[0].legend(frameon=False)
    with writing(target):
        return save(figure, target)
