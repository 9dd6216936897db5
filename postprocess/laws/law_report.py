"""The closed-form laws for people: a table of one law for a joint, and a picture of several."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from archord.output.user_file import save_figure
from archord.postprocess.laws.general.general_law import law_of_joint
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.law import NOTHING, Law, LawState
from archord.report.by_name import Words
from archord.report.figure import new_figure
from archord.report.table import Table


def sample(
    law: Law,
    joint: LawJoint,
    by_load: bool,
    to: float,
    points: int,
    extrapolate: bool,
    deepest: float = 0.0,
) -> LawState:
    """``points`` states of ``law`` in equal steps up to delta = ``to`` clearances, or P = ``to`` E*
    dR (``by_load``); outside the range nan but for the steps themselves. With archord's law the
    joint may have been at ``deepest`` clearances before."""
    steps = np.arange(1, points + 1) * (to / points) * joint.clearance
    if by_load:
        load = steps * joint.E_star
        return law.at_load(joint, load, extrapolate)._replace(load=load)
    state = law.at_displacement(joint, steps, extrapolate)._replace(delta=steps)
    if deepest:
        found = law_of_joint(joint, extrapolate=True).at(steps, deepest * joint.clearance)
        error = found.error if np.isfinite(state.error).any() else NOTHING
        quantities = found.load, found.stiffness, found.peak_pressure, found.angle, error
        state = LawState(
            steps, *(np.where(np.isnan(state.load), np.nan, values) for values in quantities)
        )
    return state


def says_nothing(state: LawState, by_load: bool) -> bool:
    """Whether a law has no number at any of the points of its `sample`."""
    found = state.delta if by_load else state.load
    told = (found, state.peak_pressure, state.angle)
    return not any(np.isfinite(values).any() for values in told)


def too_elastic(law: Law, joint: LawJoint, state: LawState) -> list[str]:
    """A sentence if a ``law`` that knows no yielding has a pressure above the weaker body's yield
    stress."""
    p0 = float(np.max(state.peak_pressure, where=np.isfinite(state.peak_pressure), initial=0.0))
    if law.plastic or joint.yield_stress is None or p0 <= joint.yield_stress:
        return []
    over = p0 / joint.yield_stress
    return [f"{law.name}: knows no yielding, and its p0 reaches {over:.3g} times the yield stress"]


def law_table(law: Law, joint: LawJoint, state: LawState, units: Words, thickness: float) -> str:
    """The law's title and its `sample`, a row for each point, in ``units`` of length, force,
    stiffness and stress where they are known, forces of a joint of this ``thickness``; without
    columns that the law says nothing of."""
    moving = law.gives_displacement
    one = joint.clearance
    columns = [
        ("delta", "length", state.delta, moving),
        ("delta/dR", "", state.delta / one, moving),
        ("P", "force", state.load * thickness, True),
        ("P/(E* R)", "", state.load / (joint.E_star * joint.radius), True),
        ("P/(E* dR)", "", state.load / joint.unit, True),
        ("dP/ddelta", "stiffness", state.stiffness * thickness, moving),
        ("p0", "stress", state.peak_pressure, "pressure" in law.gives),
        ("eps/deg", "", np.degrees(state.angle), "contact angle" in law.gives),
        ("+-P", "force", state.error * thickness, bool(np.isfinite(state.error).any())),
    ]
    headings = []
    shown = []
    for name, of, values, given in columns:
        if given:
            headings.append(f"{name} [{units[of]}]" if of in units else name)
            shown.append(values)
    rows = [[f"{value:.6g}" for value in row] for row in np.transpose(shown)]
    table = Table(*headings, rows=rows)
    return f"{law.name}: {law.title}\n{table}"


def draw_laws(
    states: Sequence[tuple[Law, LawState]], joint: LawJoint, target: Path, by_load: bool, to: float
) -> Path:
    """Draw force, peak pressure and contact angle of laws with their `sample`, ``by_load``
    displacement, pressure and angle over the force, as ``target``; returns the file. Raises
    `InputError` if it cannot be written."""
    figure = new_figure(14, 4.4)
    axes = figure.subplots(1, 3)
    for law, state in states:
        x = state.delta / joint.clearance
        y = state.load / joint.unit
        if by_load:
            x, y = y, x
        curves = (y, state.peak_pressure / joint.E_star, np.degrees(state.angle))
        for axis, values in zip(axes, curves, strict=True):
            axis.plot(x, values, label=law.name)
    over = "δ / ΔR"
    of = "P / (E* ΔR)"
    if by_load:
        over, of = of, over
    for axis, label in zip(axes, (of, "p0 / E*", "contact semi-angle [°]"), strict=True):
        axis.set(xlabel=over, ylabel=label, xlim=(0, to), ylim=(0, None))
        axis.grid(alpha=0.3)
    axes[0].legend(frameon=False)
    return save_figure(figure, target)
