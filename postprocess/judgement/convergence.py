"""Orders of convergence and errors of discretisation, from results on several meshes or in steps of
several lengths.

All assume ``f(h) = f(0) + C h^p`` (Richardson 1911). `Refined` extrapolates the curves of runs,
with the order p of three meshes; `mesh_error` and `step_error` bound the error of a curve, for a
solver that refines until it is small.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from archord.materials.material import Array
from archord.postprocess.curve import RunCurve
from archord.report.errors import InputError
from archord.scene.presets.joint import Scene

Curve = Sequence[float] | np.ndarray

_ASSUMED = 1.0  # P converges faster, but peak pressures and perfect plasticity do not for certain
_LOWEST = 0.5  # below, extrapolation multiplies noise
_HIGHEST = 2.0  # above, the error would be told too small
_SHOWN = (0.05, 12.0)  # orders that three meshes can show
_SLOWEST = 1.5  # order that `mesh_error` takes at least
_USUAL = 3.0  # order of P on meshes that are refined everywhere (docs/accuracy.md)


def richardson(difference: Any, ratio: float, order: float) -> Any:
    """Error of the finer of two results that differ by ``difference``, the element size by the
    factor ``ratio``."""
    return difference / (ratio**order - 1)


def observed_order(sizes: Sequence[float], finer: float, coarser: float) -> float:
    """Order p of three results of the rising ``sizes`` h, the two ``finer`` and the two ``coarser``
    so far apart: ``(h3^p - h2^p)/(h2^p - h1^p) = coarser/finer`` (Roache 1998, section 5.10); -inf
    below 0.05 and inf above 12."""
    from scipy.optimize import brentq

    h2 = sizes[1] / sizes[0]
    h3 = sizes[2] / sizes[0]
    goal = coarser / finer

    def quotient(p: float) -> float:
        return (h3**p - h2**p) / (h2**p - 1)

    low, high = map(quotient, _SHOWN)
    if goal <= low:
        return -math.inf
    if goal >= high:
        return math.inf
    return float(brentq(lambda p: quotient(p) / goal - 1, *_SHOWN))


class Order(NamedTuple):
    """Order of convergence taken for a curve, and in ``words`` where it comes from."""

    value: float
    words: str


@dataclass(frozen=True)
class Refined:
    """The finest run of a scene, with the coarser ones of the same scene, finest first."""

    run: RunCurve
    coarser: tuple[RunCurve, ...] = ()

    @property
    def runs(self) -> tuple[RunCurve, ...]:
        """All runs, finest first."""
        return (self.run, *self.coarser)

    def order(self, curves: Sequence[Array]) -> Order:
        """Order of convergence of a curve, given on all meshes, finest first, each ``(n,)``:
        `observed_order` of the three finest, from norms over their common steps, bounded to 0.5 ..
        2. The first order is assumed with two meshes, and where the differences have no common sign
        or do not shrink."""
        found = math.inf
        if len(curves) > 2:
            _, (fine, middle, coarse) = self._at_common_steps(curves[:3])
            finer = middle - fine
            coarser = coarse - middle
            if finer @ coarser > 0:
                sizes = [run.scene.joint.h for run in self.runs[:3]]
                norms = [float(np.linalg.norm(apart)) for apart in (finer, coarser)]
                found = observed_order(sizes, *norms)
        if not math.isfinite(found):
            return Order(_ASSUMED, f"{_ASSUMED:g} (assumed)")
        value = min(max(found, _LOWEST), _HIGHEST)
        return Order(value, f"{value:.2g} (from three meshes)")

    def shift(self, curves: Sequence[Array]) -> Array:
        """What refinement still adds to the finest of ``curves`` ``(n,)``, by `richardson` from the
        next coarser run; steps that run does not have get the relative shift of its steps beside
        them."""
        common, (fine, coarse) = self._at_common_steps(curves[:2])
        ratio = self.coarser[0].scene.joint.h / self.run.scene.joint.h
        order = self.order(curves).value
        shift = richardson(fine - coarse, ratio, order)
        relative = shift / np.where(fine == 0, 1.0, fine)
        everywhere = np.interp(self.run.numbers, common, relative)
        return curves[0] * everywhere

    def _at_common_steps(self, curves: Sequence[Array]) -> tuple[Array, list[Array]]:
        """The numbers of the steps ``(m,)`` that the finest runs have in common, and the values of
        their ``curves`` there, each ``(m,)``. Under a force, delta differs from mesh to mesh: the
        values are those at the delta of the finest run, along the tangent of each curve."""
        runs = self.runs[: len(curves)]
        common = reduce(np.intersect1d, [run.numbers for run in runs])
        delta = self.run.delta[np.isin(self.run.numbers, common)]
        values = []
        for run, curve in zip(runs, curves, strict=True):
            chosen = np.isin(run.numbers, common)
            value = curve[chosen]
            apart = delta - run.delta[chosen]
            if apart.any():
                slope = _slope(run.delta, curve)[chosen]
                value += slope * apart
            values.append(value)
        return common, values


def _slope(delta: Array, curve: Array) -> Array:
    """Slope ``(n,)`` of a ``curve`` ``(n,)`` that begins at the origin and rises in ``delta``."""
    along = [0.0, *delta]
    values = [0.0, *curve]
    if len(delta) == 1:
        return np.gradient(values, along)[1:]
    return np.gradient(values, along, edge_order=2)[1:]


def group(runs: list[RunCurve]) -> list[Refined]:
    """Runs of one scene that differ only in element size, together; in the order of the first of
    each. Raises `InputError` for two runs of the same scene on the same mesh."""
    for run, first in twins(runs):
        raise InputError(
            run.name, f"is the same scene on the same mesh as {first.name}; give one of them."
        )
    groups = _by_scene(runs).values()
    return [Refined(same[0], tuple(same[1:])) for same in groups]


def twins(runs: list[RunCurve]) -> list[tuple[RunCurve, RunCurve]]:
    """The runs that are of the same scene on the same mesh as one before them, each with that
    one."""
    found = []
    for same in _by_scene(runs).values():
        first = same[0]
        for run in same[1:]:
            if math.isclose(first.scene.joint.h, run.scene.joint.h, rel_tol=1e-9):
                found.append((run, first))
            else:
                first = run
    return found


def _by_scene(runs: list[RunCurve]) -> dict[tuple, list[RunCurve]]:
    """The runs of each scene, the finest mesh first."""
    scenes: dict[tuple, list[RunCurve]] = {}
    for run in runs:
        scenes.setdefault(_without_mesh(run.scene), []).append(run)
    for same in scenes.values():
        same.sort(key=lambda run: run.scene.joint.h)
    return scenes


def _without_mesh(scene: Scene) -> tuple:
    """Everything of a scene but its element size and its words."""
    g = scene.joint
    analysis = scene.analysis
    sizes = [g.radius, g.dR / g.radius, g.W / g.radius, g.growth, g.size_ratio, scene.targets[-1]]
    shown = [f"{size:.9g}" for size in (*sizes, analysis.friction)]
    stages = (*scene.load.stage_steps, "to", *scene.load.stages)
    substeps = scene.stepping.model_dump_json()  # bodies that yield go other ways in others
    bodies = (scene.pin.model_dump_json(), scene.block.model_dump_json())
    if scene.force_controlled:
        shown.append(f"{scene.thickness:.9g}")
    how = (analysis.plane, analysis.strain, analysis.kinematics, analysis.integration)
    method = (analysis.degree, analysis.gamma_factor, g.edge_angle, g.edge_ratio)
    return (*shown, *stages, substeps, *bodies, *how, *method)


def difference(one: Curve, other: Curve, largest: float) -> float:
    """The largest difference of two curves over ``largest``; where that is nothing, 0 if they agree
    and 1 if not."""
    apart = float(np.abs(np.subtract(one, other)).max())
    return apart / largest if largest else float(apart > 0)


def mesh_error(curves: Sequence[Curve], ratio: float, highest: float = _HIGHEST) -> float | None:
    """Relative error of the last of ``curves``, from coarse to fine, the element size falling by
    ``ratio`` the last time, and before as if by the same.

    A curve is one number for each output step. The order of joints is 3 in the mean, but
    differences scatter by a factor of two or three, as the contact ends anywhere in an element. So
    `richardson` takes the order of the last two within 1.5 and ``highest``, which it is with one
    difference; and where the last one is small by luck, the one before, at order 3, says what the
    error is at least. None with one curve.
    """
    if len(curves) < 2:
        return None
    largest = float(np.abs(curves[-1]).max())
    d = [difference(a, b, largest) for a, b in pairwise(curves)]
    p = highest
    if len(d) > 1 and d[-2] and d[-1]:
        observed = observed_order((1, ratio, ratio**2), d[-1], d[-2])
        p = min(highest, max(_SLOWEST, observed))
    error = richardson(d[-1], ratio, p)
    if len(d) > 1:
        error = max(error, richardson(d[-2] / ratio**_USUAL, ratio, _HIGHEST))
    return error


def step_error(coarse: Curve, fine: Curve) -> float:
    """Relative error of ``fine``, whose steps are half as long as the steps of ``coarse``: their
    difference, as backward Euler is of first order."""
    return difference(coarse, fine, float(np.abs(fine).max()))
