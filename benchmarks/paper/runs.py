"""The runs behind the paper's figures: joints, planes and meshes; what is solved already is not
solved again.

Hu et al. give neither Poisson's ratio nor the ratio of the moduli: like bodies with nu = 0.3 are
taken. The text names (dR/R, sigY/E*) = (0.5 %, 0.2 %) and (0.1 %, 0.1 %) and the ranges of figure
7, within which we chose the other pairs.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from mpi4py import MPI

from archord.benchmarks.case import Case, E, paper_joint, side_by_side
from archord.benchmarks.timing import Said
from archord.materials.material import Plane
from archord.output.ranks import agreed
from archord.postprocess.curve import RunCurve
from archord.postprocess.run import Run
from archord.report.errors import InputError

PLANES: tuple[Plane, ...] = ("strain", "stress")
MESHES = {"coarse": 0.04, "fine": 0.02}  # element size on the arcs over R
STEPS = 20  # twice as many where dR/R = 0.1 %
# dR/R and sigY/E* in percent; longest runs first
JOINTS: dict[str, tuple[float, float | None]] = {
    "plastic_0.1_0.1": (0.1, 0.1),
    "elastic_0.1": (0.1, None),
    "plastic_0.5_0.1": (0.5, 0.1),
    "plastic_0.5_0.2": (0.5, 0.2),
    "plastic_0.5_0.4": (0.5, 0.4),
    "plastic_1.0_0.6": (1.0, 0.6),
    "elastic": (0.5, None),
}
FULL_YIELD = "plastic_0.5_0.2"  # the joint of figure 5
MILD_YIELD = "plastic_0.1_0.1"  # the joint of figure 8


def case(joint: str, plane: Plane, mesh: str = "fine", strain: str = "small") -> Case:
    """One run, delta = 2 dR: E* = 1 in either plane; ``strain`` is "small" or "large"."""
    ratio, strength = JOINTS[joint]
    yields = {} if strength is None else {"yield_stress": strength / 100}
    solid = {"E": E if plane == "strain" else 2.0, "nu": 0.3, **yields}
    size = {"element_size": None, "relative_element_size": MESHES[mesh]}
    scene = paper_joint(
        steps=STEPS if ratio > 0.1 else 2 * STEPS,
        units={"length": "R", "stress": "E*"},
        joint={"clearance": None, "relative_clearance": ratio / 100, **size},
        pin=solid,
        block=solid,
        analysis={"plane": plane, "strain": strain},
    )
    return Case(f"{joint}-{plane}-{mesh}{'-large' if strain == 'large' else ''}", scene)


def cases(joints: Iterable[str], strain: str = "small") -> list[Case]:
    """All planes and meshes of ``joints``, the longest runs first."""
    asked = set(joints)
    wanted = [joint for joint in JOINTS if joint in asked]
    return [
        case(joint, plane, mesh, strain)
        for mesh in ("fine", "coarse")
        for joint in wanted
        for plane in PLANES
    ]


@dataclass(frozen=True)
class Runs:
    """The finished runs in ``folder``, of small or large ``strain``."""

    folder: Path
    strain: str = "small"

    def run(self, joint: str, plane: Plane, mesh: str = "fine") -> Run:
        """One of them."""
        return Run(case(joint, plane, mesh, self.strain).folder(self.folder))

    def curve(self, joint: str, plane: Plane, mesh: str = "fine") -> RunCurve:
        """Its curves."""
        return self.run(joint, plane, mesh).curve


def solve_missing(wanted: list[Case], folder: Path, comm: MPI.Comm, said: Said) -> list[str]:
    """Solve the cases that are not done yet into ``folder``, each on one rank, which says so, the
    ranks side by side. Returns the complaints of all that failed. Collective."""

    def complaint(number: int) -> str:
        try:
            P = wanted[number].solve(folder).steps[-1]["P"]
            said(f"{wanted[number].name}: P(2 dR)/(E* R) = {P:.6f}")
        except (RuntimeError, InputError) as error:
            return str(error).rstrip(".")
        return ""

    missing = agreed(
        comm, lambda: [number for number, case in enumerate(wanted) if not case.is_done(folder)]
    )
    return [text for text in side_by_side(comm, missing, complaint) if text]
