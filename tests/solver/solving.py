"""Scenes for the solver's tests: the paper's joint in units of R = E* = 1, and its solution step by
step."""

from __future__ import annotations

from dataclasses import dataclass

from mpi4py import MPI

from archord.benchmarks.case import E, paper_joint
from archord.kernels.compiled import CompilerError
from archord.presets.arc import ArcProfile
from archord.presets.joint import Joint
from archord.presets.joint_account import JointAccount
from archord.presets.measures import Measures, Work
from archord.scene.scene import Scene
from archord.solver.linear.substructured import schur_kernels
from archord.solver.path.coarse_start import coarse_start
from archord.solver.path.stepping import march

__all__ = ["SEVERAL", "E", "Solution", "scene", "solve"]

try:
    schur_kernels()
    MUMPS_FROM_C = True
except CompilerError:  # PyPI's dolfinx has no headers
    MUMPS_FROM_C = False
SEVERAL = (
    MPI.COMM_WORLD.size > 1
)  # on one rank all cuts of a mesh are the same, and one of them is enough

scene = paper_joint


@dataclass
class Solution:
    joint: Joint
    steps: list[Measures]
    profiles: list[dict[str, ArcProfile]]


def solve(scene: Scene, comm: MPI.Comm = MPI.COMM_SELF, partitioner=None) -> Solution:
    """Solve without writing anything."""
    joint = Joint(scene, comm, partitioner=partitioner)
    account, solution, work = JointAccount(joint), Solution(joint, [], []), Work()

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
