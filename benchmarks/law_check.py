"""The general law on joints that it has not seen: errors of P, stiffness, p0, eps and the way back,
and its own word.

    python3 -m archord.studies.law_design --fresh 200 --seed 1 > fresh.sweep.toml
    mpirun -n 2 archord sweep fresh.sweep.toml -o runs/fresh
    python3 -m archord.benchmarks.law_check runs/fresh

A joint solved with one and with two steps between its nodes counts with what both extrapolate to.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import trapezoid
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.optimize import minimize_scalar

from archord.postprocess.laws.calibration import fit
from archord.postprocess.laws.chord_laws import plastic_winkler
from archord.postprocess.laws.general.general_law import law_of_numbers
from archord.postprocess.laws.general.joint import Array, LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.general.law_fit import (
    SOFT,
    NodeRun,
    complete,
    first_loading,
    rms_largest,
    solved_joints,
)
from archord.postprocess.run import Run
from archord.report.table import Table

_RANGES = {
    "P to 0.1 dR": (0.0, 0.099),
    "P 0.1 to 2 dR": (0.099, 2.001),
    "P 2 to 3 dR": (2.001, 3.001),
}
_LEFT = {"3 % left": 0.03, "1 % left": 0.01}  # parts of the largest force on the way back


@dataclass(frozen=True)
class Off:
    """Errors of one joint: by quantity an array, relative in per cent but for eps [degrees]; of the
    stiffness over the larger of itself and P/delta, as it vanishes where the whole contact yields
    in plane stress, and over itself. ``kind`` is plane and what yields; ``inside`` which errors of
    P are within the expected ones."""

    kind: str
    errors: dict[str, Array]
    inside: Array


def off(numbers: tuple[float, ...], runs: list[NodeRun]) -> Off:
    """The errors of the law on the joint with these ``numbers``, solved in ``runs``."""
    law, nodes = law_of_numbers(numbers), first_loading(runs)
    nodes = nodes[nodes[:, 0] <= 3.001]
    x, y, peak, angle = nodes.T
    said = law.at(x[None])
    load, stiffness, error, p0, eps = (values[0] for values in said)
    relative = 100 * (load / y - 1)
    errors = {name: relative[(x > low) & (x <= high)] for name, (low, high) in _RANGES.items()}
    usual = (x > 0.099) & (x <= 2.001)
    slope = CubicSpline(np.log(x), np.log(y))(np.log(x), 1) * y / x
    before = usual & (x < x[-1])
    errors["stiffness"] = (100 * (stiffness - slope) / np.maximum(slope, y / x))[before]
    errors["own stiffness"] = (100 * (stiffness / slope - 1))[before]
    errors["p0"], errors["eps"] = (100 * (p0 / peak - 1))[usual], np.degrees(eps - angle)[usual]
    for run in runs:
        if run.steps == 1 and len(run.back) > 3 and run.back[0, 0] <= 3.001:
            for name, value in _back(law, run).items():
                errors[name] = np.append(errors.get(name, []), value)
    return Off(kind_of(numbers), errors, np.abs(load - y)[usual] <= error[usual])


def kind_of(numbers: tuple[float, ...]) -> str:
    """Plane and what yields of the joint with these ``numbers``, in words; and whether the pin is
    soft."""
    strain, p, m, _, _, *stresses = numbers
    pin, block = stresses
    if np.isinf(stresses).all():
        body = "elastic"
    elif np.isclose(pin, block):
        body = "both"
    else:
        body = f"{'pin' if pin < block else 'block'} {'alone' if np.isinf(stresses).any() else 'weaker'}"
    soft = ", soft pin" if p * m > SOFT else ""
    return f"{'strain' if strain else 'stress'} {body}{soft}"


def _back(law: JointCurve, run: NodeRun) -> dict[str, Array]:
    """Errors of a way back, in per cent: of P over the largest P, of the displacements at which
    parts of it are left over dR, of the energy lost over the work of loading, of P on reloading;
    and where P is within what is expected."""
    (x, y), largest = run.back.T, run.back[0, 1]
    state = law.at(x[None], x[0])
    load = state.load[0]
    fine = np.linspace(0.0, x[0], 2000)
    loading = PchipInterpolator(*np.vstack([[0.0, 0.0], run.nodes[: run.loading, :2]]).T)(fine)
    ways = [
        PchipInterpolator(np.append(-1.0, x[::-1]), np.append(0.0, values[::-1]))(fine)
        for values in (y, load)
    ]
    left = {
        name: [fine[np.searchsorted(way, share * largest)] for way in ways]
        for name, share in _LEFT.items()
        if y[-1] < share * largest
    }
    returned = [trapezoid(way, fine) for way in ways]
    off = 100 * (load - y)[1:] / largest
    again = run.nodes[run.loading + len(x) - 1 :, :2]
    again = again[again[:, 0] <= x[0]]
    reloaded = law.at(again[None, :, 0], x[0])
    return {
        "back": np.array([np.sqrt(np.mean(off**2))]),
        **{name: np.array([100 * (said - solved)]) for name, (solved, said) in left.items()},
        "energy": np.array([100 * (returned[0] - returned[1]) / trapezoid(loading, fine)]),
        "reloaded": 100 * (reloaded.load[0] - again[:, 1]) / largest,
        "back inside": np.abs(off) <= 100 * state.error[0, 1:] / largest,
    }


def table_of(found: list[Off]) -> Table:
    """rms and largest of every quantity by kind of joint; and the share of P within the expected
    error."""
    names = [
        *_RANGES,
        "stiffness",
        "own stiffness",
        "p0",
        "eps",
        "back",
        *_LEFT,
        "energy",
        "reloaded",
    ]
    table = Table("joints", "number", *names, "inside", "back inside")
    kinds = defaultdict(list)
    for one in found:
        soft = ", soft pin" if "soft" in one.kind else ""
        together = (
            one.kind if "elastic" in one.kind else f"{one.kind.split()[0]} yielding{soft}, all"
        )
        for kind in {one.kind, together, "all"}:
            kinds[kind].append(one)
    for kind in sorted(kinds):
        values = {
            name: np.concatenate([one.errors.get(name, np.zeros(0)) for one in kinds[kind]])
            for name in (*names, "back inside")
        }
        shown = [values[name] for name in names]
        cells = [rms_largest(v) for v in shown]
        inside = np.concatenate([one.inside for one in kinds[kind]]), values["back inside"]
        cells += [f"{share.mean():.0%}" if len(share) else "-" for share in inside]
        table.add(kind, len(kinds[kind]), *cells)
    return table


def other_laws(solved: dict[tuple[float, ...], list[NodeRun]]) -> Table:
    """rms and largest error of P from 0.1 to 2 dR, in per cent, of the paper's law with k = 0.85,
    with the k that is best for all joints together, and with each joint's own k and c; and of the
    general law."""
    data = []
    for numbers, runs in solved.items():
        x, y = first_loading(runs)[:, :2].T
        usual = (x > 0.099) & (x <= 2.001)
        if usual.sum() > 3:
            data.append((numbers, x[usual], y[usual]))

    def squares(k: float) -> float:
        return sum(float(((_paper(numbers, x, k) / y - 1) ** 2).sum()) for numbers, x, y in data)

    best = float(minimize_scalar(squares, bounds=(0.4, 1.4)).x)
    laws = {
        "paper, k = 0.85": lambda numbers, x, y: _paper(numbers, x, 0.85),
        f"paper, k = {best:.3f}, best for all": lambda numbers, x, y: _paper(numbers, x, best),
        "paper, own k and c": _paper_fitted,
        "archord": lambda numbers, x, y: law_of_numbers(numbers).at(x[None]).load[0],
    }
    table = Table("law", "elastic", "plane strain, yielding", "plane stress, yielding", left=1)
    for name, law in laws.items():
        off = defaultdict(list)
        for numbers, x, y in data:
            kind = (
                "elastic" if np.isinf(numbers[5:]).all() else "strain" if numbers[0] else "stress"
            )
            off[kind].append(100 * (law(numbers, x, y) / y - 1))
        cells = [np.concatenate(off[kind]) for kind in ("elastic", "strain", "stress")]
        table.add(name, *map(rms_largest, cells))
    return table


def _paper(numbers: tuple[float, ...], x: Array, k: float, c: float = 1.0) -> Array:
    """y of the paper's law, of the weaker body's yield stress."""
    clearance, s = numbers[4], min(numbers[5:])
    stress = None if np.isinf(s) else s * clearance
    joint = LawJoint(1.0, clearance, 1.0, stress, stress, k=k, c=c)
    return plastic_winkler(joint, x * clearance).load / clearance


def _paper_fitted(numbers: tuple[float, ...], x: Array, y: Array) -> Array:
    """y of the paper's law with this joint's best k, and c where it yields."""
    starts = [[0.8]] if np.isinf(min(numbers[5:])) else [[0.8, c] for c in (0.8, 1.2, 2.0)]
    return _paper(
        numbers, x, *fit(lambda values: _paper(numbers, x, *map(float, values)), starts, y)[0]
    )


def main(folder: Path) -> None:
    """Print the tables of the sweep in ``folder``."""
    runs = (
        Run(run).curve
        for run in sorted((folder / "cases").iterdir())
        if (run / "run.json").exists()
    )
    solved = {
        numbers: nodes for numbers, nodes in solved_joints(runs).items() if complete(numbers, nodes)
    }
    print(table_of([off(numbers, nodes) for numbers, nodes in solved.items()]).markdown())
    print(other_laws(solved).markdown())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
