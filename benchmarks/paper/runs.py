"""The runs behind the paper's figures: scenes, planes and meshes; what is done is not done again.

Hu et al. give neither Poisson's ratio nor the ratio of the moduli: like bodies with nu = 0.3 are taken. The text names
(dR/R, sigY/E*) = (0.5 %, 0.2 %) and (0.1 %, 0.1 %) and the ranges of figure 7; its other pairs are our choice within
them.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mpi4py import MPI

from archord.output.folder import claim_folder
from archord.output.ranks import agreed
from archord.output.run import solve_scene
from archord.scene.file import load_scene, resolved
from archord.scene.scene import Scene

Plane = Literal["strain", "stress"]
PLANES: tuple[Plane, ...] = ("strain", "stress")
MESHES = {"coarse": 0.04, "fine": 0.02}  # element size on the arcs over R
PAIRS = ((0.1, 0.1), (0.5, 0.1), (0.5, 0.2), (0.5, 0.4), (1.0, 0.6))  # dR/R and sigY/E* in percent
_SCENES = Path(__file__).parent
_PLANE_STRESS = ["analysis.plane=stress", "pin.E=2.0", "block.E=2.0"]  # E* = 1


def plastic(pair: tuple[float, float]) -> str:
    """Name of the scene of a (dR/R, sigY/E*) pair in percent."""
    return f"plastic_{pair[0]}_{pair[1]}"


@dataclass(frozen=True)
class Case:
    """One run: a scene of ``benchmarks/paper``, its plane and its mesh."""

    scene: str
    plane: Plane
    mesh: str = "fine"

    @property
    def name(self) -> str:
        """Name of the run folder."""
        return f"{self.scene}-{self.plane}-{self.mesh}"

    def load(self) -> Scene:
        """The checked scene."""
        overrides = [f"joint.relative_element_size={MESHES[self.mesh]}"]
        return load_scene(_SCENES / f"{self.scene}.toml", overrides + (_PLANE_STRESS if self.plane == "stress" else []))

    def is_done(self, folder: Path) -> bool:
        """Whether ``folder`` holds this case, solved to the end."""
        try:
            report = json.loads((folder / self.name / "run.json").read_text(encoding="utf-8"))
            scene = (folder / self.name / "scene.toml").read_text(encoding="utf-8")
        except (OSError, ValueError):
            return False
        return report.get("status") == "done" and scene == resolved(self.load())


def cases(scenes: Iterable[str]) -> list[Case]:
    """All planes and meshes of ``scenes``, the longest runs first."""
    order = sorted(set(scenes), key=lambda name: ("0.1" not in name, name.startswith("elastic"), name))
    return [Case(scene, plane, mesh) for mesh in reversed(MESHES) for scene in order for plane in PLANES]


def solve_missing(
    wanted: list[Case], folder: Path, comm: MPI.Comm, report: Callable[[Case, float], None] = lambda case, P: None
) -> list[str]:
    """Solve the cases that are not done yet into ``folder``, each on one rank, the ranks side by side.

    ``report(case, P)`` follows each on the rank that solved it. Returns the complaints of all that failed. Raises
    `InputError`, before any is solved, if ``folder`` cannot take them. Collective.
    """

    def claimed() -> list[Case]:
        missing = [case for case in wanted if not case.is_done(folder)]
        for case in missing:
            claim_folder(folder / case.name, force=True)
        return missing

    missing = agreed(comm, claimed)
    complaints = []
    for case in missing[comm.rank :: comm.size]:
        run = folder / case.name
        outcome = solve_scene(case.load(), run, MPI.COMM_SELF)
        if outcome.status == "interrupted":
            raise KeyboardInterrupt
        if outcome.status != "done":
            complaints.append(f"{case.name}: {outcome.message}")
            continue
        report(case, outcome.steps[-1].P)
    return [text for texts in comm.allgather(complaints) for text in texts]
