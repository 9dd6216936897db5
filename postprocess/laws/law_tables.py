"""Tables of the closed-form laws: numbers of one law for a joint, and all laws in words as Markdown."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from archord.postprocess.laws import logarithmic_laws as log
from archord.postprocess.laws.law import Law, LawState, Outside
from archord.postprocess.laws.law_joint import Array, LawJoint
from archord.postprocess.laws.laws import LAWS


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

    columns = {
        named("delta", "length"): state.delta,
        "delta/dR": state.delta / joint.clearance,
        named("P", "force"): state.load,
        "P/(E* R)": state.load / (joint.E_star * joint.radius),
        "P/(E* dR)": state.load / (joint.E_star * joint.clearance),
        named("dP/ddelta", "stress"): state.stiffness,
    }
    if not law.gives_displacement:
        columns = {name: value for name, value in columns.items() if name.startswith("P")}
    if law.peak_at or law.peak_of:
        columns[named("p0", "stress")] = state.peak_pressure
    if law.angle_at or law.angle_of:
        columns["eps/deg"] = np.degrees(state.angle)
    return columns


def laws_as_markdown() -> str:
    """Every law in words, the laws against each other, the load limits, and the readings of Radzimovsky's d."""
    return "\n".join([*_descriptions(), *_comparison(), *_limits(), *_readings()]) + "\n"


def _descriptions() -> list[str]:
    lines = []
    for law in LAWS.values():
        needs = f" Needs {', '.join(law.needs)}." if law.needs else ""
        lines += [f"### {law.name}", "", f"{law.title[0].upper()}{law.title[1:]}.{needs}", "", f"    {law.formula}", ""]
        lines += [f"- Range: {law.range}.", f"- Source: {law.source}.", f"- {law.remarks}", ""]
    return lines


def _comparison() -> list[str]:
    """P/(E* dR) of all laws with displacements in a thin joint, formulas outside their range in brackets."""
    import warnings

    from archord.postprocess.laws.law_joint import LawRangeWarning

    joint = LawJoint(radius=1.0, clearance=0.005, E_star=1.0, yield_stress=0.002, length=2.0, plane="strain", nu=0.3)
    delta = np.array([0.05, 0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0]) * joint.clearance
    lines = ["### P/(E* dR) against each other", ""]
    lines += [
        "dR/R = 0.5 %, sigY/E* = 0.2 %, k = 0.85, length 2 R, plane strain, nu = 0.3; in brackets: outside the range.",
        "",
    ]
    lines += [
        f"| delta/dR | {' | '.join(f'{d:g}' for d in delta / joint.clearance)} |",
        "|---" * (len(delta) + 1) + "|",
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LawRangeWarning)
        for law in LAWS.values():
            if law.gives_displacement:
                inside = law.force(joint, delta)
                formula = law.force(joint, delta, "extrapolate") / (joint.E_star * joint.clearance)
                cells = [_cell(p, bool(np.isnan(q))) for p, q in zip(formula, inside, strict=True)]
                lines.append(f"| {law.name} | {' | '.join(cells)} |")
    return [*lines, ""]


def _cell(value: float, outside: bool) -> str:
    if np.isnan(value):
        return ""
    return f"({value:.4f})" if outside else f"{value:.4f}"


def _limits() -> list[str]:
    joint = LawJoint(radius=1.0, clearance=0.005, E_star=1.0)
    lines = ["### Load limits", "", "| law | P/(E* dR) | delta/dR |", "|---|---|---|"]
    laws = {
        "johnson": log.johnson(joint),
        "radzimovsky": log.radzimovsky(joint),
        "radzimovsky-width": log.radzimovsky(joint, log.ROARK_WIDTH),
        "radzimovsky-2.41": log.radzimovsky(joint, log.IMPLIED_WIDTH),
        "esdu-78035": log.esdu(joint),
    }
    for name, law in laws.items():
        limit = law.load_limit / (joint.E_star * joint.clearance)
        lines.append(f"| {name} | {limit:.4f} | {law.delta_limit / joint.clearance:.4f} |")
    return [*lines, ""]


def _readings() -> list[str]:
    lines = ["### Readings of Radzimovsky's d", "", "| d | d/(R* P/E*)^(1/2) | load limit/(E* dR) |", "|---|---|---|"]
    for words, width in log.READINGS.items():
        lines.append(f"| {words} | {width:.4f} | {16 * math.exp(-1 / 3) / width**2:.4f} |")
    return lines
