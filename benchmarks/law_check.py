"""The general law on joints that it has not seen: errors of P, stiffness, p0, eps and the way back, and its own word.

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

from archord.postprocess.laws.general.general_law import law_of_numbers
from archord.postprocess.laws.general.joint import Array
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.general.law_fit import NodeRun, first_loading, solved_joints
from archord.postprocess.run import Run
from archord.report.table import Table

_RANGES = {"P to 0.1 dR": (0.0, 0.099), "P 0.1 to 2 dR": (0.099, 2.001), "P 2 to 3 dR": (2.001, 3.001)}
_SOFT = 0.5  # p nu1/(1 - nu1), beyond which the pin is soft and hardly compressible


@dataclass(frozen=True)
class Off:
    """Errors of one joint: by quantity an array, relative in per cent but for eps [degrees]; ``kind`` is its plane and
    what yields; ``inside`` which errors of P are within the expected ones."""

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
    errors["stiffness"] = (100 * (stiffness / slope - 1))[usual & (np.arange(len(x)) < len(x) - 1)]
    errors["p0"], errors["eps"] = (100 * (p0 / peak - 1))[usual], np.degrees(eps - angle)[usual]
    for run in runs:
        if run.steps == 1 and len(run.back) > 3 and run.back[0, 0] <= 3.001:
            for name, value in _back(law, run).items():
                errors[name] = np.append(errors.get(name, []), value)
    return Off(kind_of(numbers), errors, np.abs(load - y)[usual] <= error[usual])


def kind_of(numbers: tuple[float, ...]) -> str:
    """Plane and what yields of the joint with these ``numbers``, in words; and whether the pin is soft."""
    strain, p, m, _, _, *stresses = numbers
    pin, block = stresses
    if np.isinf(stresses).all():
        body = "elastic"
    elif np.isclose(pin, block):
        body = "both"
    else:
        body = f"{'pin' if pin < block else 'block'} {'alone' if np.isinf(stresses).any() else 'weaker'}"
    soft = ", soft pin" if p * m > _SOFT else ""
    return f"{'strain' if strain else 'stress'} {body}{soft}"


def _back(law: JointCurve, run: NodeRun) -> dict[str, Array]:
    """Errors of a way back, in per cent: of P over the largest P, of the residual clearance over dR, of the energy lost
    over the work of loading; and whether P is within what is expected."""
    x, y = run.back.T
    said = law.at(x[None], x[0])
    scale = y[0] / float(law.at([[x[0]]]).load[0, 0])  # the way back is judged by itself: from the same largest P
    load = said.load[0] * scale
    closed = y > 0
    opens = float(np.interp(0.0, y[closed][::-1], x[closed][::-1]))
    if (~closed).any():
        curve = PchipInterpolator(y[closed][::-1], x[closed][::-1], extrapolate=True)
        opens = max(float(curve(0.0)), float(x[~closed].max()))
    fine = np.linspace(0.0, x[0], 400)
    loading = np.vstack([[0.0, 0.0], run.nodes[: run.loading, :2]])
    work = float(trapezoid(PchipInterpolator(*loading.T)(fine), fine))
    solved = np.interp(fine, np.append(opens, x[closed][::-1]), np.append(0.0, y[closed][::-1]))
    returned = [float(trapezoid(values, fine)) for values in (solved, law.at(fine[None], x[0]).load[0] * scale)]
    off = 100 * (load - y)[1:] / y[0]
    return {
        "back": np.array([np.sqrt(np.mean(off**2))]),
        "residual": np.array([100 * (float(law.residual([[x[0]]])[0, 0]) - opens)]),
        "energy": np.array([100 * (returned[0] - returned[1]) / work]),
        "back inside": np.array([float((np.abs(off) <= 100 * said.error[0, 1:] / y[0] + 0.05).mean() >= 0.9)]),
    }


def table_of(found: list[Off]) -> Table:
    """rms and largest of every quantity by kind of joint; and the share of P within the expected error."""
    names = [*_RANGES, "stiffness", "p0", "eps", "back", "residual", "energy"]
    table = Table("joints", "number", *names, "inside", "back inside")
    kinds = defaultdict(list)
    for one in found:
        soft = ", soft pin" if "soft" in one.kind else ""
        together = one.kind if "elastic" in one.kind else f"{one.kind.split()[0]} yielding{soft}, all"
        for kind in {one.kind, together}:
            kinds[kind].append(one)
    for kind in sorted(kinds):
        values = {
            name: np.concatenate([one.errors.get(name, np.zeros(0)) for one in kinds[kind]])
            for name in (*names, "back inside")
        }
        cells = [
            f"{np.sqrt(np.mean(v**2)):.2f}/{np.abs(v).max():.1f}" if len(v) else "-" for v in map(values.get, names)
        ]
        inside = np.concatenate([one.inside for one in kinds[kind]]), values["back inside"]
        cells += [f"{share.mean():.0%}" if len(share) else "-" for share in inside]
        table.add(kind, len(kinds[kind]), *cells)
    return table


def main(folder: Path) -> None:
    """Print the table of the sweep in ``folder``."""
    runs = (Run(run).curve for run in sorted((folder / "cases").iterdir()) if (run / "run.json").exists())
    found = [off(numbers, nodes) for numbers, nodes in solved_joints(runs).items()]
    print(table_of(found).markdown())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
