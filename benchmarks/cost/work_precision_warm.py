"""How long a curve takes within a process that has solved before: what calibrations and parameter studies pay."""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import perf_counter

from mpi4py import MPI

from archord.benchmarks.case import paper_joint
from archord.benchmarks.cost.work_precision_cases import edged
from archord.geometry.mesh_cache import MESHES
from archord.output.run import solve_scene
from archord.scene.scene import Scene


def curves() -> dict[str, Scene]:
    """The curves that are timed, up to 2 dR, on the meshes that are good for 1e-4 (elastic) and 3e-4 (plastic) in P."""
    elastic, plastic = edged("elastic", 0.16, growth=0.5, degree=3)[0], edged("plastic", 0.1, growth=0.3)[0]
    return {
        "elastic, 8 steps": paper_joint(steps=8, **elastic),
        "elasto-plastic, sigY/E* = 0.2 %, 20 steps": paper_joint(steps=20, yield_stress=0.002, **plastic),
    }


def warm_seconds(repeats: int, scenes: dict[str, Scene] | None = None) -> dict[str, list[float]]:
    """Seconds of `solve_scene` for each curve, ``repeats`` times in turn, after one solve of each that is not counted.

    Meshes are kept, as in a sweep. Raises RuntimeError if one does not get to its end.
    """
    scenes = curves() if scenes is None else scenes
    found: dict[str, list[float]] = {name: [] for name in scenes}
    MESHES.capacity = 4 * len(scenes)
    try:
        for repeat in range(repeats + 1):
            for name, scene in scenes.items():
                seconds = _seconds(name, scene)
                if repeat:
                    found[name].append(seconds)
    finally:
        MESHES.capacity = 0
        MESHES.forget()
    return found


def _seconds(name: str, scene: Scene) -> float:
    with tempfile.TemporaryDirectory() as folder:
        start = perf_counter()
        outcome = solve_scene(scene, Path(folder), MPI.COMM_SELF)
        seconds = perf_counter() - start
    if outcome.status == "interrupted":
        raise KeyboardInterrupt
    if outcome.status != "done":
        raise RuntimeError(f"{name}: {outcome.message}")
    return seconds
