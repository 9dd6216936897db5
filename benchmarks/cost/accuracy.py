"""Accuracies asked, estimated and true, over several joints. ``archord benchmark accuracy``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from archord.benchmarks.case import E, paper_joint
from archord.benchmarks.report_files import rows_table, write_files
from archord.output.folder import claim_folder
from archord.output.run import Outcome, solve_scene
from archord.postprocess.convergence import difference, richardson
from archord.scene.scene import Scene
from archord.studies.accuracy import Accuracy, solve_to_accuracy
from archord.studies.mesh_family import RATIO, MeshFamily

ELASTIC = 1e-2, 3e-3, 1e-3, 3e-4, 1e-4
PLASTIC = 1e-2, 3e-3, 1e-3
_FINE = 6  # meshes finer than the coarsest
_STEPS = 8  # of a plastic joint an output step
Said = Callable[[str], None]


@dataclass(frozen=True)
class Case:
    """The paper's joint (`paper_joint`) in ``steps`` output steps, with other ``sections``, at all accuracies
    ``asked``."""

    name: str
    steps: int = 4
    asked: tuple[float, ...] = ELASTIC
    yield_stress: float | None = None
    sections: Mapping[str, dict] = field(default_factory=dict)

    def scene(self, accuracy: float) -> Scene:
        """The scene with that accuracy."""
        sections: dict[str, dict] = {"joint": {}, "analysis": {}, "output": {"fields": False}, **self.sections}
        sections["joint"] = sections["joint"] | {"element_size": None}
        sections["analysis"] = sections["analysis"] | {"accuracy": accuracy}
        return paper_joint(steps=self.steps, yield_stress=self.yield_stress, **sections)


CASES = (
    Case("paper's joint"),
    Case("small load, 0.05 dR", sections={"load": {"displacement": 0.05}}),
    Case("rigid pin", sections={"pin": {"rigid": True}}),
    Case("pin three times as stiff", sections={"pin": {"E": 3 * E, "nu": 0.3}}),
    Case("plane stress", sections={"analysis": {"plane": "stress"}}),
    Case("by force, 0.005 E* R", sections={"load": {"displacement": None, "relative_force": 0.005}}),
    Case("plastic", 10, PLASTIC, 0.002),
    Case("plastic, plane stress", 10, PLASTIC, 0.002, {"analysis": {"plane": "stress"}}),
    Case("plastic, pressed and let go", 10, PLASTIC, 0.002, {"load": {"displacement": [1.5, 0.5]}}),
)


@dataclass(frozen=True)
class Line:
    """What one accuracy led to; ``true_error`` of the curve against the reference, over its largest value."""

    case: Case
    accuracy: Accuracy
    true_error: float

    @property
    def dofs(self) -> int:
        """Of the mesh that stays."""
        return self.accuracy.levels[-1].dofs

    def fault(self) -> str | None:
        """A sentence if the estimate or the error is larger than what was asked."""
        if self.accuracy.estimated is None or self.accuracy.estimated > self.accuracy.asked:
            return f"{self.case.name}: {self.accuracy.asked:g} was not reached"
        if self.true_error > self.accuracy.asked:
            return f"{self.case.name}: the error is {self.true_error:.1e}, {self.accuracy.asked:g} was asked"
        return None


def run(folder: Path, cases: tuple[Case, ...] = CASES, said: Said = lambda sentence: None) -> list[Line]:
    """Solve ``cases`` below ``folder``, references first; ``said`` follows each run.

    Raises `RuntimeError` if one fails.
    """
    lines = []
    for case in cases:
        known = reference(case, folder, said)
        for asked in case.asked:
            scene = case.scene(asked)
            run_folder = _made(folder, f"{case.name}_{asked:g}")
            outcome = solve_to_accuracy(scene, run_folder)
            curve, accuracy = _curve(scene, outcome), outcome.accuracy
            assert accuracy is not None
            lines.append(Line(case, accuracy, difference(curve, known, float(np.abs(known).max()))))
            said(f"{case.name}: {asked:g}: {accuracy.estimated} estimated, {lines[-1].true_error:.1e} true")
    return lines


def reference(case: Case, folder: Path, said: Said) -> np.ndarray:
    """The curve on a much finer mesh, extrapolated with order 3 from it and the one before.

    Of a plastic joint in steps that are an eighth as long; what their error is, is extrapolated with order 1 from steps
    twice as long on the mesh before.
    """
    scene = case.scene(ELASTIC[-1])
    family = MeshFamily(scene, 1.0)

    def curve(mesh: int, substeps: int) -> np.ndarray:
        level = family.scene_of(mesh, substeps)
        assert level is not None
        found = np.array(_curve(scene, solve_scene(level, _made(folder, f"{case.name}_{mesh}_{substeps}"))))
        said(f"{case.name}: reference on mesh {mesh}, {substeps} substeps: {found[-1]:.9g}")
        return found

    finest, steps = (_FINE - 1, _STEPS) if scene.plastic else (_FINE, 1)
    before, last = curve(finest - 1, steps), curve(finest, steps)
    limit = last + richardson(last - before, RATIO, 3)
    return limit + (before - curve(finest - 1, steps // 2)) if scene.plastic else limit


def _curve(scene: Scene, outcome: Outcome) -> list[float]:
    if outcome.status == "interrupted":
        raise KeyboardInterrupt
    if outcome.status != "done":
        raise RuntimeError(f"{outcome.folder.name}: {outcome.message}")
    return [m.delta if scene.force_controlled else m.P for m in outcome.steps]


def _made(folder: Path, name: str) -> Path:
    made = folder / name.replace(",", "").replace("'", "").replace("*", "").replace(" ", "_")
    claim_folder(made, force=True)
    return made


def row(line: Line) -> dict[str, Any]:
    """The entries of a line by heading."""
    a = line.accuracy
    return {
        "joint": line.case.name,
        "asked": f"{a.asked:g}",
        "estimated": f"{a.estimated or nan:.1e}",
        "true": f"{line.true_error:.1e}",
        "of the mesh": f"{a.mesh_error or nan:.1e}",
        "of the steps": f"{a.step_error:.1e}" if a.step_error else "",
        "meshes": a.levels[-1].mesh,
        "element size / R": f"{a.levels[-1].element_size:.3g}",
        "substeps": a.substeps,
        "dofs": line.dofs,
        "seconds": f"{a.seconds:.1f}",
    }


def markdown(lines: list[Line]) -> str:
    """The lines as a table."""
    return "\n".join([*rows_table([row(line) for line in lines]), ""])


def write_report(lines: list[Line], folder: Path) -> list[Path]:
    """Write accuracy.csv and accuracy.md into ``folder``; returns the files."""
    return write_files(folder, "accuracy", [row(line) for line in lines], markdown(lines))
