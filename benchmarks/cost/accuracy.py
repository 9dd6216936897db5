"""Accuracies asked, estimated and true, over several joints. ``archord benchmark accuracy``."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from pathlib import Path

import numpy as np

from archord.benchmarks.case import Case, E, paper_joint, varied
from archord.benchmarks.timing import Said
from archord.materials.kinematics import Array
from archord.output.run import Outcome
from archord.postprocess.judgement.convergence import difference
from archord.presets.mesh_family import RATIO, MeshFamily
from archord.scene.presets.joint import Scene

ELASTIC = 1e-2, 3e-3, 1e-3, 3e-4, 1e-4
PLASTIC = 1e-2, 3e-3, 1e-3
_FINE = 6  # meshes finer than the coarsest
_STEPS = 8  # of a plastic joint an output step


def open_joint(
    name: str, steps: int = 4, yield_stress: float | None = None, **sections: dict
) -> Case:
    """The paper's joint with other ``sections``, its mesh left open, to be solved to the coarsest
    accuracy."""
    analysis = {"accuracy": ELASTIC[0], **sections.pop("analysis", {})}
    scene = paper_joint(0.04, steps, yield_stress, output={"fields": False}, **sections)
    return Case(name, varied(scene, joint={"element_size": None}, analysis=analysis))


CASES = (
    open_joint("paper's joint"),
    open_joint("small load, 0.05 dR", load={"displacement": 0.05}),
    open_joint("rigid pin", pin={"rigid": True}),
    open_joint("pin three times as stiff", pin={"E": 3 * E, "nu": 0.3}),
    open_joint("plane stress", analysis={"plane": "stress"}),
    open_joint("by force, 0.005 E* R", load={"displacement": None, "relative_force": 0.005}),
    open_joint("plastic", 10, 0.002),
    open_joint("plastic, plane stress", 10, 0.002, analysis={"plane": "stress"}),
    open_joint("plastic, pressed and let go", 10, 0.002, load={"displacement": [1.5, 0.5]}),
)


def run(
    folder: Path, cases: Sequence[Case], said: Said, asked: Sequence[float] = ()
) -> tuple[list[dict[str, object]], list[str]]:
    """Solve ``cases`` below ``folder`` to the accuracies ``asked``, or the accuracies of their
    material, references first.

    Returns the entries of each accuracy by heading, with the true error of the curve, over its
    largest value, and a sentence for every estimate or error that is larger than what was asked.
    Raises `RuntimeError` if a run fails.
    """
    rows = list[dict[str, object]]()
    faults = []
    for case in cases:
        known = reference(case, folder, said)
        for wanted in asked or (PLASTIC if case.scene.plastic else ELASTIC):
            scene = varied(case.scene, analysis={"accuracy": wanted})
            outcome = Case(f"{case.name} {wanted:g}", scene).solve(folder)
            found = outcome.accuracy
            largest = float(np.abs(known).max())
            error = difference(_curve(case.scene, outcome), known, largest)
            said(f"{case.name}: {wanted:g}: {found.estimated} estimated, {error:.1e} true")
            if found.estimated is None or found.estimated > wanted:
                faults.append(f"{case.name}: {wanted:g} was not reached")
            elif error > wanted:
                faults.append(f"{case.name}: the error is {error:.1e}, {wanted:g} was asked")
            level = found.levels[-1]
            row = {
                "joint": case.name,
                "asked": f"{wanted:g}",
                "estimated": f"{found.estimated or nan:.1e}",
                "true": f"{error:.1e}",
                "of the mesh": f"{found.mesh_error or nan:.1e}",
                "of the steps": f"{found.step_error:.1e}" if found.step_error else "",
                "meshes": level.mesh,
                "element size / R": f"{level.element_size:.3g}",
                "substeps": found.substeps,
                "dofs": level.dofs,
                "seconds": f"{found.seconds:.1f}",
            }
            rows.append(row)
    return rows, faults


def reference(case: Case, folder: Path, said: Said) -> Array:
    """The curve on a much finer mesh, extrapolated with order 3 from it and the one before; of a
    plastic joint in steps an eighth as long, whose error is extrapolated with order 1 from steps
    twice as long on the mesh before."""
    family = MeshFamily(case.scene, 1.0)

    def curve(mesh: int, substeps: int) -> Array:
        level = family.scene_of(mesh, substeps)
        assert level is not None
        outcome = Case(f"{case.name} {mesh} {substeps}", level).solve(folder)
        found = np.array(_curve(level, outcome))
        said(f"{case.name}: reference on mesh {mesh}, {substeps} substeps: {found[-1]:.9g}")
        return found

    finest, steps = (_FINE - 1, _STEPS) if case.scene.plastic else (_FINE, 1)
    before = curve(finest - 1, steps)
    last = curve(finest, steps)
    limit = last + (last - before) / (RATIO**3 - 1)
    if not case.scene.plastic:
        return limit
    return limit + (before - curve(finest - 1, steps // 2))


def _curve(scene: Scene, outcome: Outcome) -> list[float]:
    name = "delta" if scene.force_controlled else "P"
    return [measures[name] for measures in outcome.steps]
