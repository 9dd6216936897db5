"""The discretisation error of a run, from a second run of the same scene on another mesh."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from archord.geometry.basis import Array
from archord.postprocess.run_curve import RunCurve
from archord.solver.scene import Scene, SceneError

_ORDER = 1  # assumed: P converges faster, but peak pressures and perfect plasticity do not for certain


@dataclass(frozen=True)
class Refined:
    """The finest run of a scene, with the coarser ones of the same scene, finest first."""

    run: RunCurve
    coarser: tuple[RunCurve, ...] = ()

    def shift(self, fine: Array, coarse: Array) -> Array:
        """What refinement still adds to ``fine`` ``(n,)``, by Richardson's extrapolation from the next coarser run.

        ``(fine - coarse)/(h_coarse/h_fine - 1)`` for an error of the first order. Steps that the coarser run does not
        have get the relative shift of its last one.
        """
        ratio = (self.coarser[0].scene.joint.h / self.run.scene.joint.h) ** _ORDER
        n = min(len(fine), len(coarse))
        relative = (fine[:n] - coarse[:n]) / (ratio - 1) / np.where(fine[:n] == 0, 1.0, fine[:n])
        return fine * np.append(relative, np.full(len(fine) - n, relative[-1]))


def group(runs: list[RunCurve]) -> list[Refined]:
    """Runs of one scene that differ only in element size, together; in the order of the first of each.

    Raises `SceneError` for two runs of the same scene on the same mesh.
    """
    scenes: dict[tuple, list[RunCurve]] = {}
    for run in runs:
        scenes.setdefault(_without_mesh(run.scene), []).append(run)
    groups = []
    for same in scenes.values():
        same.sort(key=lambda run: run.scene.joint.h)
        for a, b in pairwise(same):
            if np.isclose(a.scene.joint.h, b.scene.joint.h, rtol=1e-9, atol=0):
                raise SceneError(f"{b.name}: is the same scene on the same mesh as {a.name}; give one of them.")
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
