"""The general law on joints that it has not seen: errors of P, stiffness, p0, eps and the way back,
and its own word.

    python3 -m archord.studies.law_design --fresh 200 --seed 1 > fresh.sweep.toml
    mpirun -n 2 archord sweep fresh.sweep.toml -o runs/fresh
    python3 -m archord.benchmarks.law_check runs/fresh

Joints that harden (`archord.studies.hardening_design`) are checked in the same way. A joint solved
with one and with two steps between its nodes counts with what both extrapolate to.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import trapezoid
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.optimize import minimize_scalar

from archord.materials.material import Array, Arrays
from archord.postprocess.curve import rms
from archord.postprocess.laws.calibration import fit
from archord.postprocess.laws.chord_laws import plastic_winkler
from archord.postprocess.laws.general.general_law import joint_numbers, law_of_numbers
from archord.postprocess.laws.general.hardening_model import flows
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.general.law_fit import (
    JUDGED,
    SOFT,
    NodeRun,
    by_joint,
    first_loading,
    rms_largest,
    solved_in,
    within,
)
from archord.postprocess.laws.general.yield_model import Numbers
from archord.report.table import Table

# x of the ranges of P that are told apart
_RANGES = {
    "P to 0.1 dR": (0.0, 0.099),
    "P 0.1 to 2 dR": JUDGED,
    "P 2 to 3 dR": (2.001, 3.001),
}
_END = 3.001
_LEFT = {"3 % left": 0.03, "1 % left": 0.01}  # parts of the largest force on the way back
_LOADING = [*_RANGES, "stiffness", "own stiffness", "p0", "eps"]
_UNLOADING = ["back", *_LEFT, "energy", "reloaded"]


@dataclass(frozen=True)
class Off:
    """Errors of one joint: by quantity an array, relative in per cent but for eps [degrees]; of the
    stiffness over the larger of itself and P/delta, as it vanishes where the whole contact yields
    in plane stress, and over itself. ``kind`` is plane and what yields; ``inside`` which errors of
    P are within the expected ones."""

    kind: str
    errors: Arrays
    inside: Array


def off(joint: LawJoint, runs: list[NodeRun]) -> Off:
    """The errors of the law on ``joint``, solved in ``runs``."""
    numbers = joint_numbers(joint)
    law = law_of_numbers(numbers, flows(joint), joint.friction, large_strain=joint.large_strain)
    kind = kind_of(numbers)
    kind += ", hardens" if joint.hardens else ""
    kind += ", friction" if joint.friction else ""
    kind += ", large strain" if joint.large_strain else ""
    nodes = first_loading(runs)
    x, y, peak, angle = nodes[nodes[:, 0] <= _END].T
    told = law.at(x)
    relative = _per_cent(told.load, y)
    errors = {name: relative[within(x, ends)] for name, ends in _RANGES.items()}
    usual = within(x, JUDGED)
    before = usual & (x < x[-1])
    ln_x = np.log(x)
    ln_y = CubicSpline(ln_x, np.log(y))
    slope = ln_y(ln_x, 1) * y / x
    of_stiffness = 100 * (told.stiffness - slope) / np.maximum(slope, y / x)
    errors["stiffness"] = of_stiffness[before]
    errors["own stiffness"] = _per_cent(told.stiffness, slope)[before]
    errors["p0"] = _per_cent(told.peak_pressure, peak)[usual]
    errors["eps"] = np.degrees(told.angle - angle)[usual]
    for run in runs:
        if run.steps == 1 and len(run.back) > 3 and run.back[0, 0] <= _END:
            for name, value in _back(law, run).items():
                errors[name] = np.append(errors.get(name, []), value)
    inside = np.abs(told.load - y) <= told.error
    return Off(kind, errors, inside[usual])


def _per_cent(told: Array, solved: Array) -> Array:
    """The relative error of what is ``told``."""
    return 100 * (told / solved - 1)


def kind_of(numbers: Numbers) -> str:
    """Plane and what yields of the joint with these ``numbers``, in words; and whether the pin is
    soft."""
    pin, block = numbers.yielding
    weaker = "pin" if pin < block else "block"
    body = f"{weaker} {'alone' if np.isinf(pin + block) else 'weaker'}"
    if np.isinf(min(pin, block)):
        body = "elastic"
    elif np.isclose(pin, block):
        body = "both"
    soft = ", soft pin" if numbers.p * numbers.m > SOFT else ""
    return f"{numbers.plane} {body}{soft}"


def _back(law: JointCurve, run: NodeRun) -> Arrays:
    """Errors of a way back, in per cent: of P over the largest P, of the displacements at which
    parts of it are left over dR, of the energy lost over the work of loading, of P on reloading;
    and where P is within what is expected."""
    x, y = run.back.T
    largest = y[0]
    state = law.at(x, x[0])
    fine = np.linspace(0.0, x[0], 2000)

    def way(values: Array) -> Array:
        return PchipInterpolator([-1.0, *x[::-1]], [0.0, *values[::-1]])(fine)

    solved = way(y)
    told = way(state.load)
    errors = {}
    for name, share in _LEFT.items():
        left = share * largest
        if y[-1] < left:
            told_end = fine[np.searchsorted(told, left)]
            solved_end = fine[np.searchsorted(solved, left)]
            errors[name] = np.array([100 * (told_end - solved_end)])
    nodes = np.insert(run.nodes[: run.loading, :2], 0, 0.0, axis=0)
    loading = PchipInterpolator(*nodes.T)(fine)
    returned = trapezoid(solved, fine) - trapezoid(told, fine)
    work = trapezoid(loading, fine)
    off = 100 * (state.load - y)[1:] / largest
    again = run.nodes[run.loading + len(x) - 1 :, :2]
    x_again, y_again = again[again[:, 0] <= x[0]].T
    told_again = law.at(x_again, x[0]).load
    return errors | {
        "back": np.array([rms(off)]),
        "energy": np.array([100 * returned / work]),
        "reloaded": 100 * (told_again - y_again) / largest,
        "back inside": np.abs(off) <= 100 * state.error[1:] / largest,
    }


def table_of(found: list[Off]) -> Table:
    """rms and largest of every quantity by kind of joint; and the share of P within the expected
    error."""
    names = [*_LOADING, *_UNLOADING]
    table = Table("joints", "number", *names, "inside", "back inside")
    kinds = defaultdict(list)
    for one in found:
        plane = one.kind.split()[0]
        _, *marks = one.kind.split(", ")
        together = ", ".join([f"{plane} yielding", *marks, "all"])
        if "elastic" in one.kind:
            together = one.kind
        for kind in {one.kind, together, "all"}:
            kinds[kind].append(one)
    for kind, members in sorted(kinds.items()):
        cells = []
        for name in names:
            errors = _joined(one.errors.get(name) for one in members)
            cells.append(rms_largest(errors))
        inside = _joined(one.inside for one in members)
        back_inside = _joined(one.errors.get("back inside") for one in members)
        cells += [f"{part.mean():.0%}" if len(part) else "-" for part in (inside, back_inside)]
        table.add(kind, len(members), *cells)
    return table


def largest_table(found: list[Off]) -> Table:
    """The largest error of P from 0.1 to 2 dR of each joint, in per cent: what half and nine in ten
    of the joints stay below, and the largest of all."""
    shares = ("half {:.2f}", "9 in 10 {:.2f}", "all {:.2f}")
    table = Table("largest error of P, 0.1 to 2 dR", "number", *shares, left=1)
    kinds = defaultdict(list)
    for one in found:
        usual = one.errors["P 0.1 to 2 dR"]
        if len(usual):
            kinds[one.kind.split()[0]].append(float(np.abs(usual).max()))
    for plane, largest in sorted(kinds.items()):
        table.add(plane, len(largest), *np.quantile(largest, [0.5, 0.9, 1.0]))
    return table


def _joined(parts: Iterable[Array | None]) -> Array:
    """All ``parts`` that are there, one after the other."""
    return np.concatenate([np.zeros(0), *(part for part in parts if part is not None)])


def other_laws(solved: dict[Numbers, list[NodeRun]]) -> Table:
    """rms and largest error of P from 0.1 to 2 dR, in per cent, of the paper's law with k = 0.85,
    with the k that is best for all joints together, and with each joint's own k and c; and of the
    general law."""
    data = []
    for numbers, runs in solved.items():
        x, y, *_ = first_loading(runs).T
        usual = within(x, JUDGED)
        if usual.sum() > 3:
            data.append((numbers, x[usual], y[usual]))

    def squares(k: float) -> float:
        return sum(float(((_paper(numbers, x, k) / y - 1) ** 2).sum()) for numbers, x, y in data)

    best = float(minimize_scalar(squares, bounds=(0.4, 1.4)).x)
    laws = {
        "paper, k = 0.85": lambda numbers, x, y: _paper(numbers, x, 0.85),
        f"paper, k = {best:.3f}, best for all": lambda numbers, x, y: _paper(numbers, x, best),
        "paper, own k and c": _paper_fitted,
        "archord": lambda numbers, x, y: law_of_numbers(numbers).at(x).load,
    }
    table = Table("law", "elastic", "plane strain, yielding", "plane stress, yielding", left=1)
    for name, law in laws.items():
        off = defaultdict(list)
        for numbers, x, y in data:
            is_elastic = np.isinf(numbers.yielding).all()
            kind = "elastic" if is_elastic else numbers.plane
            off[kind].append(100 * (law(numbers, x, y) / y - 1))
        table.add(
            name, *(rms_largest(_joined(off[kind])) for kind in ("elastic", "strain", "stress"))
        )
    return table


def _paper(numbers: Numbers, x: Array, k: float, c: float = 1.0) -> Array:
    """y of the paper's law, of the weaker body's yield stress."""
    clearance = numbers.clearance
    s = min(numbers.yielding)
    stress = None if np.isinf(s) else s * clearance
    joint = LawJoint(1.0, clearance, 1.0, stress, stress, k=k, c=c)
    return plastic_winkler(joint, x * clearance).load / clearance


def _paper_fitted(numbers: Numbers, x: Array, y: Array) -> Array:
    """y of the paper's law with this joint's best k, and c where it yields."""
    is_elastic = np.isinf(min(numbers.yielding))
    starts = [[0.8]] if is_elastic else [[0.8, c] for c in (0.8, 1.2, 2.0)]
    best, _ = fit(lambda values: _paper(numbers, x, *map(float, values)), starts, y)
    return _paper(numbers, x, *best)


def main(folder: Path) -> None:
    """Print the tables of the sweep in ``folder``."""
    found = [off(joint, runs) for joint, runs in by_joint(folder).items()]
    print(table_of(found).markdown())
    print(largest_table(found).markdown())
    perfect = solved_in(folder)
    if perfect:
        print(other_laws(perfect).markdown())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
