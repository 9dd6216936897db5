"""What the work-precision benchmark measures errors against, solved and extrapolated by archord.

    python3 -m archord.benchmarks.cost.references runs/references

Two families of meshes of each case, which refine near and far elements in different shares, are
extrapolated to vanishing elements, each by itself. The value is the mean of both; its error is
their difference or, if that is larger, the change of an extrapolation when one of its meshes is
left out. The pressure profile is the mean of meshes of both families that are four times finer
where the contact ends, and have elements of degree 3 where the joint yields. The command writes
references.json and prints the table of docs/work_precision.md; runs that are there are not solved
again.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from archord.benchmarks.case import Case, paper_joint
from archord.benchmarks.cost.work_precision_codes import (
    CASES,
    DATA,
    REFERENCES,
    profile_error,
    quantities_of,
)
from archord.benchmarks.timing import Said
from archord.geometry.basis import Array
from archord.postprocess.curve import rms
from archord.postprocess.run import Run
from archord.report.by_name import ByName
from archord.report.files import read_json
from archord.report.table import Table, in_digits
from archord.scene.presets.joint import Scene

KINEMATICS = ("current", "reference")
_ORDERS = (1.4, 4.0)  # of an extrapolation; unlike meshes make the order scatter


@dataclass(frozen=True)
class Limit:
    """An extrapolated ``value`` with the ``order`` found, and how far it moves when one mesh is
    left out."""

    value: float
    order: float
    error: float


@dataclass(frozen=True)
class Solved:
    """A mesh of a family: the element size over R, and what was found at the last step."""

    size: float
    found: ByName


@dataclass(frozen=True)
class Reference:
    """A quantity by the limits of all families. ``other`` is the value of another choice that
    serves as well, from which the error is no smaller than the difference."""

    limits: tuple[Limit, ...]
    other: float | None = None

    @property
    def value(self) -> float:
        """The mean of the families."""
        return float(np.mean([limit.value for limit in self.limits]))

    @property
    def error(self) -> float:
        """Relative: what the families differ by, or an extrapolation is unsure of."""
        unsure = [limit.error for limit in self.limits]
        unsure.append(float(np.ptp([limit.value for limit in self.limits])))
        if self.other is not None:
            unsure.append(abs(self.other - self.value))
        return max(unsure) / abs(self.value)


def extrapolated(sizes: Sequence[float], values: Sequence[float]) -> Limit:
    """Fit ``values`` = limit + c ``sizes``^order by least squares, with a free order."""
    h = np.asarray(sizes) / max(sizes)
    v = np.asarray(values)

    def misfit(order: float) -> float:
        _, left = _line(h, v, order)
        return left

    # the misfit over the order can have several minima: the best of a scan, then its neighbourhood
    scan = np.linspace(*_ORDERS, 33)
    best = int(np.argmin([misfit(order) for order in scan]))
    before = scan[max(0, best - 1)]
    after = scan[min(len(scan) - 1, best + 1)]
    precise = {"xatol": 1e-9}
    found = minimize_scalar(misfit, bounds=(before, after), method="bounded", options=precise)
    order = float(min(found.x, scan[best], key=misfit))
    limit, _ = _line(h, v, order)
    without = [_line(np.delete(h, i), np.delete(v, i), order)[0] for i in range(len(h))]
    moved = np.abs(np.array(without) - limit)
    return Limit(limit, order, float(moved.max()))


def _line(h: Array, v: Array, order: float) -> tuple[float, float]:
    """The limit of ``v`` linear in ``h``^order, and the root mean square misfit over the spread of
    ``v``."""
    A = np.stack([np.ones_like(h), h**order], axis=1)
    fit, *_ = np.linalg.lstsq(A, v, rcond=None)
    misfit = rms(A @ fit - v)
    spread = np.ptp(v) or 1.0
    return float(fit[0]), float(misfit / spread)


def mean_profile(families: Sequence[Sequence[Array]]) -> tuple[Array, float]:
    """The mean ``(401,)`` of the profiles of each family's meshes, and its relative error, by which
    the families differ."""
    first, second = (np.mean(family, axis=0) for family in families)
    return (first + second) / 2, profile_error(first, second)


def families(sizes: Sequence[Sequence[float]]) -> list[list[tuple[float, float]]]:
    """Element size and growth, both over R, of the meshes of each family, by their ``sizes``."""
    ratios = DATA["reference_growth"]
    return [
        [(size, round(ratio * size, 6)) for size in of_family]
        for ratio, of_family in zip(ratios, sizes, strict=True)
    ]


def scene_of(case: str, size: float, growth: float, kinematics: str, *, edge: bool) -> Scene:
    """The joint of a ``case`` on a mesh, which may be finer at the ``edge`` of the contact."""
    given = CASES[case]
    mesh = {"growth": growth}
    analysis = {"kinematics": kinematics}
    if edge:
        mesh["edge_angle"] = given["edge_angle"]
        analysis["degree"] = given["profile_degree"]
    yields = given.get("yield_stress")
    return paper_joint(size, given["steps"], yields, joint=mesh, analysis=analysis)


def solve(
    case: str, kinematics: str, folder: Path, said: Said, *, edge: bool = False
) -> list[list[Solved]]:
    """The meshes of each family, solved below ``folder`` unless they are there; with ``edge`` the
    meshes of the profile."""
    solved = []
    sizes = [CASES[case]["profile_sizes"]] * 2 if edge else CASES[case]["families"]
    for meshes in families(sizes):
        found = []
        for size, growth in meshes:
            name = f"{case} {kinematics} {size:g} {growth:g}{' edge' if edge else ''}"
            run = Case(name, scene_of(case, size, growth, kinematics, edge=edge))
            if not run.is_done(folder):
                run.solve(folder)
            found.append(Solved(size, quantities_of(Run(run.folder(folder)))))
            said(f"{name}: {found[-1].found['dofs']} dofs, P {found[-1].found['P']:.9g}")
        solved.append(found)
    return solved


def reference(solved: Sequence[Sequence[Solved]], quantity: str, other: float | None) -> Reference:
    """A ``quantity`` of the families, beside its ``other`` value."""
    limits = tuple(
        extrapolated([mesh.size for mesh in family], [mesh.found[quantity] for mesh in family])
        for family in solved
    )
    return Reference(limits, other)


def references(case: str, folder: Path, said: Said, table: Table) -> ByName:
    """What references.json holds of a ``case``; adds its rows to the ``table``."""
    given = CASES[case]
    entry: ByName = {"profile_error": {}, "profile": {}}
    for kinematics in KINEMATICS:
        solved = solve(case, kinematics, folder, said)
        # fixed pairs can be chosen along the normals of either side
        others = given.get("other_pairs", {}) if kinematics == "reference" else {}
        entry[kinematics] = {}
        for name in given["quantities"]:
            found = reference(solved, name, others.get(name))
            entry[kinematics][name] = [in_digits(found.value, 9), in_digits(found.error, 2)]
            limits = [f"{limit.value:.9g} (order {limit.order:.1f})" for limit in found.limits]
            table.add(case, kinematics, name, found.value, found.error, *limits)
        fine = solve(case, kinematics, folder, said, edge=True)
        samples = [[mesh.found["profile"] for mesh in family] for family in fine]
        profile, error = mean_profile(samples)
        sizes = [", ".join(f"{mesh.size:g}" for mesh in family) for family in fine]
        table.add(case, kinematics, "profile", "", error, *sizes)
        entry["profile_error"][kinematics] = in_digits(error, 2)
        entry["profile"][kinematics] = [in_digits(p, 7) for p in profile]
    return entry


def main(folder: Path, chosen: Sequence[str]) -> None:
    """Make the references of the ``chosen`` cases, of all without any."""
    table = Table(
        *("case", "kinematics", "quantity", "value {:.9g}", "relative error {:.1e}"),
        *("first family", "second family"),
        left=3,
    )
    everything = read_json(REFERENCES)
    folder.mkdir(parents=True, exist_ok=True)
    for case in chosen or everything:
        everything[case] = references(case, folder, lambda line: print(line, flush=True), table)
    text = json.dumps(everything, indent=1)
    # one line for each list of numbers
    text = re.sub(r"\[[^][{}]*\]", lambda numbers: json.dumps(json.loads(numbers[0])), text)
    REFERENCES.write_text(text + "\n", encoding="utf-8")
    print(table.markdown())


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
