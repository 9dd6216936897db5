"""The general law from solved joints: its elastic polynomials, and what yielding adds, by least
squares and likelihood.

    python3 -m archord.studies.law_design > law.sweep.toml
    mpirun -n 2 archord sweep law.sweep.toml
    python3 -m archord.postprocess.laws.general.law_fit runs/law

A joint that yields is solved with one step between nodes, and with two in plane stress, and where
yielding begins early; steps converge with the first order, so the two extrapolate (Richardson). P
and p0 are corrected for the mesh. What comes back tells the way back.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from collections.abc import Container
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares, minimize

from archord.materials.kinematics import Bools
from archord.materials.material import Array
from archord.postprocess.curve import rms
from archord.postprocess.laws.general.elastic_model import (
    TABLE,
    Elastic,
    ElasticModel,
    ElasticState,
    Polynomials,
    depth,
    products,
)
from archord.postprocess.laws.general.gaussian_process import Kernel, Process
from archord.postprocess.laws.general.general_law import NODES, joint_numbers, way_back
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.yield_model import (
    DATA,
    ELASTIC_BELOW,
    KERNELS,
    KINDS,
    MULTIPLES,
    PIN_ALONE,
    PIN_WEAKER,
    SIDES,
    Numbers,
    SolvedJoints,
    YieldModel,
    kind_of_scatter,
    mesh_excess,
    onset,
    scatter,
    side_model,
    sides_of,
    softness,
    stored_joints,
    total_loss,
)
from archord.postprocess.run import Run
from archord.report.by_name import Amounts, ByName
from archord.report.files import read_json
from archord.report.table import Table, in_digits

# degrees in the joint's numbers and in x/(1 + x), and how many of these terms are taken
_TERMS = {"F": (6, 8, 290), "peak": (6, 8, 120), "angle": (6, 8, 90)}
_STEPS_COUNT_BELOW = {"strain": 0.6, "stress": np.inf}  # s of joints that yield
_DEPENDENT = 1e-6  # what is left of a column that other columns tell
SOFT = 0.5  # p m of soft pins in plane strain
# shares of errors that expected errors are to contain
WITHIN = {"force": 0.91, "shape": 0.9, "back": 0.9}
_USUAL = (0.1, 2.0)  # x of the errors that tell what to expect
FITTED = (0.05, 3.05)  # x of the data of other models
JUDGED = (0.099, 2.001)  # x of their errors
_LAST = 3.0  # x that the law reaches
_SPACING = 1.02  # beyond the last node by which a multiple counts as known
_STARTS = {"force": 1e-5, "shape": 1e-3, "back": 1e-4}  # of the noise
# Fits of a way back begin with these travels, at most that share of the largest, and toes. In plane
# stress they find the best fit. In plane strain deep dents have two; processes follow the
# one near the largest travel.
_WAYS = {
    "strain": ((1.5, 0.99, 1e-3), (1.5, 0.85, 0.2)),
    "stress": ((1.0, 0.99, 1e-3), (1.0, 0.99, 0.7), (0.9, 0.99, 0.3), (0.8, 0.99, 1e-3)),
}
_LITTLE = 0.03  # of the largest force, below which points on the way back count alike
_LENGTHS = (0.7, 0.5, 0.6, 4.0, 1.4, 1.0, 1.0, 1.0)  # with which the search for a kernel's begins
_FINE = np.geomspace(1e-3, 3.8, 400)
_LAW = NODES[1:]


def exponents(degree: int) -> Array:
    """The exponents of all products of four numbers up to ``degree``; the clearance, whose
    influence is small, counts twice."""
    all_products = np.array([*product(range(degree + 1), repeat=4)], float)
    return all_products[all_products @ [1, 1, 1, 2] <= degree]


def fit_elastic(joints: Elastic, x: Array, y: Array, peak: Array, angle: Array) -> ElasticModel:
    """The model of elastic ``joints`` ``(m,)`` from ``y``, p0 R/(E* dR) and eps ``(m, k)`` at ``x``
    ``(k,)``, by least squares of relative errors of y, and of the two others."""
    compliance = np.pi * x / y
    F = compliance + np.log(y / (1 + y))
    F_weights = 1 / (compliance - 1 / (1 + y))  # -d(ln y)/dF
    root = np.sqrt(y)
    return ElasticModel(
        F=_polynomials(joints, x, F, F_weights, *_TERMS["F"]),
        peak=_polynomials(joints, x, peak / root, root / peak, *_TERMS["peak"]),
        angle=_polynomials(joints, x, angle / root, root / angle, *_TERMS["angle"]),
    )


def _polynomials(
    joints: Elastic, x: Array, values: Array, weights: Array, degree: int, order: int, number: int
) -> Polynomials:
    powers = exponents(degree)
    shapes = products(joints, powers)
    series = np.polynomial.chebyshev.chebvander(depth(x), order)
    design = np.einsum("mt,kc,mk->mktc", shapes, series, weights).reshape(values.size, -1)
    right = (values * weights).ravel()
    chosen = most_telling(design, right, number)
    found = np.zeros(design.shape[1])
    found[chosen], *_ = np.linalg.lstsq(design[:, chosen], right, rcond=1e-13)
    coefficients = found.reshape(len(powers), -1)
    used = coefficients.any(axis=1)
    return Polynomials(powers[used], coefficients[used])


def most_telling(design: Array, right: Array, number: int) -> list[int]:
    """Places of ``number`` columns of ``design`` ``(n, m)``, or of all that are independent. Each
    brings least squares nearest to ``right`` ``(n,)`` beside the columns before it (Chen, Billings
    and Luo 1989)."""
    rest = design / np.linalg.norm(design, axis=0)
    missed = right.copy()
    chosen = []
    for _ in range(number):
        length = np.linalg.norm(rest, axis=0)
        if length.max() < _DEPENDENT:
            break
        tells = np.abs(missed @ rest) / np.maximum(length, _DEPENDENT)
        tells[length < _DEPENDENT] = 0.0
        best = int(tells.argmax())
        chosen.append(best)
        direction = rest[:, best] / length[best]
        missed -= direction * (direction @ missed)
        rest -= np.outer(direction, direction @ rest)
    return chosen


@dataclass(frozen=True)
class NodeRun:
    """The ends of a run's stages.

    - ``nodes`` ``(n, 4)``: x, y, p0 R/(E* dR) and eps; the first ``loading`` of them are first
      loading
    - ``steps``: how many lie between two nodes
    - ``cut`` ``(n,)``: whether one of the steps that lead to a node was cut
    """

    nodes: Array
    steps: int
    cut: Bools

    @classmethod
    def of(cls, run: Run) -> NodeRun:
        """That of a ``run`` which has all its steps."""
        curve = run.curve
        each = curve.scene.load.stage_steps
        y = curve.P / curve.unit
        peak = curve.p0 * curve.R / curve.unit
        of_steps = np.column_stack([curve.x, y, peak, curve.eps])
        last_of_stages = np.cumsum(each) - 1
        first_of_stages = [0, *last_of_stages[:-1] + 1]
        cut = np.add.reduceat(run.columns["cutbacks"], first_of_stages) > 0
        return cls(of_steps[last_of_stages], each[0], cut)

    @property
    def loading(self) -> int:
        """Number of nodes of first loading."""
        falls = np.flatnonzero(np.diff(self.nodes[:, 0]) < 0)
        return int(falls[0]) + 1 if len(falls) else len(self.nodes)

    @property
    def back(self) -> Array:
        """x and y ``(k, 2)`` of the first way back, with its deepest point; of a run without one
        that alone."""
        rest = self.nodes[self.loading - 1 :, :2]
        rises = np.flatnonzero(np.diff(rest[:, 0]) > 0)
        return rest[: int(rises[0]) + 1] if len(rises) else rest


def solved_joints(
    folder: Path, names: Container[str] | None = None
) -> dict[LawJoint, list[NodeRun]]:
    """The complete runs of the sweep in ``folder``, by their joints; those of these ``names``, if
    any."""
    found = defaultdict(list)
    for run in sorted((folder / "cases").iterdir()):
        is_left_out = names is not None and run.name not in names
        if is_left_out or not (run / "run.json").exists():
            continue
        solved = Run(run)
        if solved.steps < sum(solved.scene.load.stage_steps):
            continue
        found[LawJoint.from_scene(solved.scene)].append(NodeRun.of(solved))
    return dict(found)


def by_joint(folder: Path, names: Container[str] | None = None) -> dict[LawJoint, list[NodeRun]]:
    """The joints that are solved as far as the law needs them, of `solved_joints`."""
    return {
        joint: nodes
        for joint, nodes in solved_joints(folder, names).items()
        if complete(joint_numbers(joint), nodes)
    }


def solved_in(folder: Path, names: Container[str] | None = None) -> dict[Numbers, list[NodeRun]]:
    """`by_joint` of joints at small strain that do not harden and have no friction, by their
    numbers."""
    found: dict[Numbers, list[NodeRun]] = defaultdict(list)
    for joint, runs in by_joint(folder, names).items():
        if joint.hardens or joint.friction or joint.large_strain:
            continue
        rounded = (in_digits(value, 6) for value in joint_numbers(joint))
        found[Numbers(*rounded)] += runs
    return dict(found)


def fit_law(
    solved: dict[Numbers, list[NodeRun]],
) -> tuple[ElasticModel, SolvedJoints, ByName]:
    """The elastic model, the joints that yield as the processes take them, and the processes'
    kernels by side."""
    elastic = {}
    yielding = {}
    for numbers, runs in solved.items():
        if np.isinf(numbers.yielding).all():
            elastic[numbers] = runs[0].nodes
        else:
            yielding[numbers] = runs
    nodes = np.array([*elastic.values()])
    x, *quantities = np.moveaxis(nodes, -1, 0)
    columns = Numbers(*np.array([*elastic]).T)
    model = fit_elastic(columns.elastic, x[0], *quantities)
    alone = {numbers: runs for numbers, runs in yielding.items() if PIN_ALONE in sides_of(numbers)}
    pins = yielding_joints(model, alone)
    of_pins = fit_side(pins, PIN_ALONE)
    joints = yielding_joints(model, yielding, side_model(pins, PIN_ALONE, of_pins))
    kernels = {side: fit_side(joints, side) for side in SIDES[1:]}
    return model, joints, {PIN_ALONE: of_pins} | kernels


def first_loading(runs: list[NodeRun]) -> Array:
    """Nodes of first loading ``(n, 4)``, extrapolated where there is a run of two steps between the
    same nodes."""
    coarse = max((run for run in runs if run.steps == 1), key=lambda run: run.loading)
    nodes = coarse.nodes[: coarse.loading].copy()
    forces = nodes[:, 1:3]  # and p0
    for run in runs:
        if run.steps == 2 and run.loading == len(nodes):
            finer = run.nodes[: len(nodes), 1:3]
            forces[:] = 2 * finer - forces
    return nodes


def yielding_joints(
    model: ElasticModel,
    solved: dict[Numbers, list[NodeRun]],
    pins: YieldModel | None = None,
) -> SolvedJoints:
    """The joints that yield relative to ``model``, with those digits that yield_model.npz keeps; of
    side `PIN_WEAKER` beside what the process of ``pins`` tells."""
    rows: list[tuple[Any, ...]] = []
    back: list[tuple[float, ...]] = []
    for numbers, runs in solved.items():
        joint = numbers.elastic
        yielding = numbers.yielding
        x, *quantities = first_loading(runs).T
        base = model.at(joint, x)
        over_elastic = np.divide(quantities, [base.y, base.peak, base.angle])
        total = np.log(over_elastic)
        elastic = model.at(joint, _FINE)
        unloaded = [run for run in runs if run.steps == 1 and len(run.back) > 2]
        ways = [way_told(numbers.plane, elastic, run) for run in unloaded]
        for side in sides_of(numbers):
            curves = total
            of_pins: Array = np.zeros(len(_LAW))
            if side == PIN_WEAKER and pins is not None:
                own = total_loss({PIN_ALONE: pins}, model, joint, yielding, x)
                curves = total - [own.force, own.peak, own.angle]
                of_pins = total_loss({PIN_ALONE: pins}, model, joint, yielding, _LAW).peak
            x0, lost = onset(side, model, joint, yielding, _LAW, of_pins)
            back += [(len(rows), deepest / x0, *told) for deepest, *told in ways]
            multiples = x / x0
            excess = mesh_excess(side, yielding, multiples)
            corrected = curves - [excess, excess, 0 * excess]
            told = _at_multiples(multiples, corrected)
            rows.append((SIDES.index(side), numbers, x0, lost, *told))
    columns = (np.array(column) for column in zip(*rows, strict=True))
    indices, given, onsets, of_others, counts, losses = columns
    force, peak, angle = np.moveaxis(losses, 1, 0)
    back.sort(key=lambda way: np.isnan(way[-1]))
    return SolvedJoints(
        indices, given, onsets, of_others, counts, force, peak, angle, np.array(back)
    ).stored()


def _at_multiples(u: Array, lost: Array) -> tuple[int, Array]:
    """How many of the `MULTIPLES` the nodes ``u`` ``(n,)`` reach, and ``lost`` ``(3, n)`` there;
    nan beyond."""
    known = u > ELASTIC_BELOW * 1.05
    reached = u[-1] * _SPACING
    count = int(np.searchsorted(MULTIPLES, reached)) if known.sum() > 1 else 0
    curves = np.full((3, len(MULTIPLES)), np.nan)
    if count:
        at = np.log([ELASTIC_BELOW, *u[known]])
        of = np.insert(lost[:, known], 0, 0.0, axis=1)
        begins_flat = (1, np.zeros(3))
        spline = CubicSpline(at, of, axis=1, bc_type=(begins_flat, "not-a-knot"))
        curves[:, :count] = spline(np.log(MULTIPLES[:count]))
    return count, curves


def way_told(plane: str, elastic: ElasticState, run: NodeRun) -> tuple[float, ...]:
    """Of a way back its deepest x, the travel and toe of `Loss` that fit best by least squares,
    which count more where little is left, and over the largest force how far P is from that way,
    rms, and at the first point of reloading, nan without one."""
    deepest, largest = run.back[0]
    elastic_force = np.interp(deepest, _FINE, elastic.y)
    unit = deepest * largest / elastic_force

    def off(way: Array, points: Array) -> Array:
        x, y = points.T
        below = x - deepest
        told = way_back(_FINE, elastic.y, elastic.slope, below, largest, *(way * unit))
        return (told - y) / largest

    weights = 1 / (_LITTLE + run.back[:, 1] / largest)
    most = min(1.5, deepest / unit)
    tries = [
        least_squares(
            lambda way: weights * off(way, run.back),
            [min(travel, share * most), toe],
            bounds=([0.3, 0.0], [most, 1.0]),
            x_scale=0.1,
        )
        for travel, share, toe in _WAYS[plane]
    ]
    travel, toe = found = min(tries, key=lambda way: way.cost).x
    errors = off(found, run.back[1:])
    first_of_reloading = run.loading + len(run.back) - 1
    reloaded = run.nodes[first_of_reloading:, :2]
    again = abs(off(found, reloaded[:1])[0]) if len(reloaded) else np.nan
    return tuple(map(float, (deepest, travel, toe, rms(errors), again)))


def fit_side(joints: SolvedJoints, side: str) -> ByName:
    """The kernels of one of `SIDES`, largest in likelihood, and the spread of errors of joints left
    out."""
    data = joints.of(side)
    shape = np.concatenate([data["peak"], data["angle"]], axis=1)
    back = data["back"][:, :2] - [1, 0]
    values = {"force": data["force"], "shape": shape, "back": back}
    found: ByName = {"kernels": {}, "spread": {}}
    for name, of in values.items():
        points = data["back_inputs" if name == "back" else "inputs"]
        kernel = fit_kernel(points, of, _STARTS[name])
        found["kernels"][name] = {"lengths": kernel.lengths.tolist(), "noise": kernel.noise}
        off, deviation = Process(kernel, points, of).left_out()
        errors = np.abs(off / deviation)
        if name == "back":  # errors of travel
            errors = errors[:, :1]
        if name == "force":
            x = MULTIPLES * joints.x0[joints.rows(side), None]
            errors[~within(x, _USUAL)] = np.nan
            found["spread"][name] = _spread_by_kind(side, points, errors)
        else:
            found["spread"][name] = _spread(errors, name)
    return found


def _spread(errors: Array, name: str) -> float:
    """What the share `WITHIN` of the known ``errors`` of a process keep."""
    return in_digits(np.nanquantile(errors, WITHIN[name]), 3)


def _spread_by_kind(side: str, inputs: Array, errors: Array) -> Amounts:
    """What `scatter` takes, from ``errors`` ``(n, multiples)`` of the force over their standard
    deviations; a kind without joints has the factor of all."""
    places = kind_of_scatter(side, inputs)
    soft = softness(inputs) > 0.5
    found = {"soft": 1.0}
    for place, kind in enumerate(KINDS):
        own = ~soft & (np.abs(places - place) < 0.5)
        found[kind] = _spread(errors[own] if own.any() else errors, "force")
    if soft.any():
        usual = scatter(side, inputs, found)[:, None]
        found["soft"] = _spread((errors / usual)[soft], "force")
    return found


def fit_kernel(points: Array, values: Array, noise: float) -> Kernel:
    """The kernel of the largest likelihood, in four digits."""

    def cost(logarithms: Array) -> float:
        *lengths, noise = np.exp(logarithms)
        kernel = Kernel(np.array(lengths), noise)
        return -Process(kernel, points, values).likelihood

    inputs = points.shape[1]
    start = np.log([*_LENGTHS[:inputs], noise])
    lengths_within = [(0.1, 60.0)] * inputs
    bounds = np.log([*lengths_within, (1e-7, 0.1)])
    most = {"maxiter": 60}
    found = minimize(cost, start, method="L-BFGS-B", bounds=bounds, options=most).x
    *lengths, noise = (in_digits(value, 4) for value in np.exp(found))
    return Kernel(np.array(lengths), noise)


def within(x: Array, ends: tuple[float, float]) -> Bools:
    """Which ``x`` (any shape) are between the ``ends``."""
    low, high = ends
    return (x >= low) & (x <= high)


def rms_largest(errors: Array) -> str:
    """The cell of ``errors`` ``(n,)``: their root mean square and the largest; a dash of none."""
    if not len(errors):
        return "-"
    return f"{rms(errors):.2f}/{np.abs(errors).max():.1f}"


def error_table(joints: SolvedJoints, kernels: ByName) -> Table:
    """rms and largest errors of P, in per cent, of joints that the others predict; and the share
    within the expected ones from 0.1 to 2 dR, `WITHIN` by construction."""
    table = Table(
        "process", "joints", "P 0.1 to 2 dR", "P 2 to 3 dR", "soft pins, to 3 dR", "inside", left=1
    )
    for side in SIDES:
        force = side_model(joints, side, kernels[side]).processes["force"]
        off, deviation = force.left_out()
        chosen = joints.rows(side)
        x = MULTIPLES * joints.x0[chosen, None]
        strain, p, m, *_ = joints.numbers[chosen].T[..., None]
        known = ~np.isnan(off)
        soft = strain * p * m > SOFT
        usual = within(x, _USUAL)
        parts = [
            ~soft & usual,
            ~soft & (x > _USUAL[1]) & (x <= _LAST),
            soft & (x <= _LAST),
        ]
        cells = [rms_largest(100 * off[part & known]) for part in parts]
        factor = scatter(side, joints.of(side)["inputs"], kernels[side]["spread"]["force"])
        inside = np.abs(off) <= factor[:, None] * deviation
        table.add(side, len(chosen), *cells, f"{inside[known & usual].mean():.0%}")
    return table


def main(folder: Path | None) -> None:
    """Fit the law to the sweep in ``folder``, if one is given, and write its files beside this one;
    print how good it is."""
    if folder:
        model, joints, kernels = fit_law(solved_in(folder))
        TABLE.write_text(model.to_json(), encoding="utf-8")
        KERNELS.write_text(json.dumps(kernels, indent=1) + "\n", encoding="utf-8")
        arrays: ByName = joints.compact()
        np.savez_compressed(DATA, **arrays)
    print(error_table(stored_joints(), read_json(KERNELS)).markdown())


def steps_count(numbers: Numbers) -> bool:
    """Whether a joint is solved in two step sizes, to extrapolate: one that yields in plane stress,
    or early in plane strain."""
    return min(numbers.yielding) < _STEPS_COUNT_BELOW[numbers.plane]


def complete(numbers: Numbers, runs: list[NodeRun]) -> bool:
    """Whether the runs of a joint reach 3 dR, in two step sizes where `steps_count`."""
    reached = {run.steps for run in runs if run.nodes[:, 0].max() >= _LAST - 0.05}
    return 1 in reached and (2 in reached or not steps_count(numbers))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
