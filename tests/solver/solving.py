"""Scenes for the solver's tests: the paper's joint in units of R = E* = 1, and its solution step by
step."""

from __future__ import annotations

from dataclasses import dataclass

from mpi4py import MPI

from archord.benchmarks.case import E, paper_joint
from archord.kernels.compiled import CompilerError
from archord.measures.energies import Work
from archord.measures.record import Record
from archord.presets.arc import ArcProfile
from archord.presets.joint import joint_problem
from archord.presets.joint_measures import JointMeasures, joint_account
from archord.scene.presets.joint import Scene
from archord.solver.linear.substructured import schur_kernels
from archord.solver.path.coarse_start import coarse_start
from archord.solver.path.stepping import march
from archord.solver.path.system import System

__all__ = ["SEVERAL", "E", "Solution", "joint_system", "scene", "small_scene", "solve"]

try:
    schur_kernels()
    MUMPS_FROM_C = True
except CompilerError:  # PyPI's dolfinx has no headers
    MUMPS_FROM_C = False
SEVERAL = (
    MPI.COMM_WORLD.size > 1
)  # on one rank all cuts of a mesh are the same, and one of them is enough

scene = paper_joint


def small_scene(
    element_size: float, steps: int = 4, yield_stress: float | None = None, **sections: dict
) -> Scene:
    """The same on a third of the dofs: elements grow fast away from the contact."""
    joint = {"growth": 1.0} | sections.pop("joint", {})
    return paper_joint(element_size, steps, yield_stress, joint=joint, **sections)


@dataclass
class Solution:
    scene: Scene
    joint: System
    steps: list[Record]
    profiles: list[dict[str, ArcProfile]]

    def forces(self) -> dict[str, float]:
        """Forces at pin, contact and block."""
        return JointMeasures(self.scene, self.joint).forces()


def joint_system(scene: Scene, comm: MPI.Comm, partitioner=None) -> System:
    """The joint of ``scene``, ready to be solved."""
    return System(joint_problem(scene, comm, partitioner))


def solve(scene: Scene, comm: MPI.Comm = MPI.COMM_SELF, partitioner=None) -> Solution:
    """Solve without writing anything."""
    account = joint_account(scene, comm, partitioner=partitioner)
    joint = account.system
    solution = Solution(scene, joint, [], [])
    work = Work()

    def target_done(step, position):
        profiles = account.profiles()
        solution.profiles.append(profiles)
        solution.steps.append(account.step(solution.steps, step, profiles, work.total, 0.0))

    march(
        joint.load_path(coarse=coarse_start(joint)),
        scene.targets,
        rules=scene.stepping,
        substep_done=lambda load: work.add(*account.driven()),
        target_done=target_done,
    )
    return solution
