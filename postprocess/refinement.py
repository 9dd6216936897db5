"""The discretisation error of a run, from runs of the same scene on other meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from archord.geometry.basis import Array
from archord.postprocess.run_curve import RunCurve
from archord.scene.errors import InputError
from archord.scene.scene import Scene

_ASSUMED = 1.0  # P converges faster, but peak pressures and perfect plasticity do not for certain
_LOWEST, _HIGHEST = 0.5, 2.0  # below, extrapolation multiplies noise; above, the error would be told too small
_TELLABLE = (0.05, 12.0)


@dataclass(frozen=True)
class Order:
    """Order of convergence taken for a curve; ``estimate`` is what three meshes say, None if they cannot, or if there
    are but two."""

    value: float
    estimate: float | None
    meshes: int

    @property
    def words(self) -> str:
        """The order and where it comes from."""
        if self.meshes < 3:
            return f"{self.value:g} (assumed)"
        if self.estimate is None:
            return f"{self.value:g} (assumed: the differences of three meshes show none)"
        bounded = "" if self.value == self.estimate else f", which give {self.estimate:.1f}: bounded"
        return f"{self.value:.2g} (from three meshes{bounded})"


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
        """Order of convergence of a curve, given on all meshes, finest first, each ``(n,)``.

        From the three finest: p of ``(h3^p - h2^p)/(h2^p - h1^p) = |f3 - f2|/|f2 - f1|``, norms over the steps they
        have in common (Roache 1998, section 5.10), bounded to 0.5 .. 2. The first order is assumed with two meshes,
        and where the differences have no common sign or do not shrink.
        """
        if len(curves) < 3:
            return Order(_ASSUMED, None, len(curves))
        n = min(map(len, curves[:3]))
        first, second = curves[1][:n] - curves[0][:n], curves[2][:n] - curves[1][:n]
        estimate = None
        if first @ second > 0:
            h = np.array([run.scene.joint.h for run in self.runs[:3]]) / self.run.scene.joint.h
            goal = np.sqrt((second @ second) / (first @ first))
            low, high = ((h[2] ** p - h[1] ** p) / (h[1] ** p - 1) for p in _TELLABLE)
            if low < goal < high:
                estimate = float(brentq(lambda p: (h[2] ** p - h[1] ** p) / (h[1] ** p - 1) / goal - 1, *_TELLABLE))
        value = _ASSUMED if estimate is None else min(max(estimate, _LOWEST), _HIGHEST)
        return Order(value, estimate, len(curves))

    def shift(self, curves: Sequence[Array]) -> Array:
        """What refinement still adds to the finest of ``curves`` ``(n,)``, by Richardson's extrapolation.

        ``(fine - coarse)/((h_coarse/h_fine)^p - 1)`` from the next coarser run, with the order p of `order`. Steps that
        the coarser run does not have get the relative shift of its last one.
        """
        fine, coarse = curves[:2]
        ratio = (self.coarser[0].scene.joint.h / self.run.scene.joint.h) ** self.order(curves).value
        n = min(len(fine), len(coarse))
        relative = (fine[:n] - coarse[:n]) / (ratio - 1) / np.where(fine[:n] == 0, 1.0, fine[:n])
        return fine * np.append(relative, np.full(len(fine) - n, relative[-1]))


def group(runs: list[RunCurve]) -> list[Refined]:
    """Runs of one scene that differ only in element size, together; in the order of the first of each.

    Raises `InputError` for two runs of the same scene on the same mesh.
    """
    scenes: dict[tuple, list[RunCurve]] = {}
    for run in runs:
        scenes.setdefault(_without_mesh(run.scene), []).append(run)
    groups = []
    for same in scenes.values():
        same.sort(key=lambda run: run.scene.joint.h)
        for a, b in pairwise(same):
            if np.isclose(a.scene.joint.h, b.scene.joint.h, rtol=1e-9, atol=0):
                raise InputError(f"{b.name}: is the same scene on the same mesh as {a.name}; give one of them.")
        groups.append(Refined(same[0], tuple(same[1:])))
    return groups


def _without_mesh(scene: Scene) -> tuple:
    """Everything of a scene but its element size and its words."""
    joint = scene.joint
    sizes = (
        joint.radius,
        joint.dR / joint.radius,
        joint.W / joint.radius,
        joint.growth,
        joint.size_ratio,
        scene.target,
    )
    rounded = tuple(float(f"{size:.9g}") for size in sizes)
    return (*rounded, tuple(scene.load.leg_steps), tuple(scene.load.legs),
            scene.pin.model_dump_json(), scene.block.model_dump_json(),
            scene.analysis.plane, scene.analysis.kinematics, scene.analysis.integration)  # fmt: skip
