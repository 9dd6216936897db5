"""Scenes for the solver's tests: the paper's joint in units of R = E* = 1, and its solution step by step."""

from __future__ import annotations

from dataclasses import dataclass

from mpi4py import MPI

from archord.solver.contact_profile import ArcProfile
from archord.solver.joint import Joint
from archord.solver.measures import Measures, Work, arc_profiles, measure
from archord.solver.scene import Scene
from archord.solver.scene_file import parse_scene
from archord.solver.stepping import march

E = 2 * (1 - 0.3**2)  # E* = 1 for two like bodies in plane strain


def scene(element_size: float = 0.04, steps: int = 4, sigma_y: float | None = None, **sections: dict) -> Scene:
    """The paper's joint: dR/R = 0.5 %, nu = 0.3, like bodies, delta = 2 dR; ``sections`` override."""
    solid = {"E": E, "nu": 0.3} | ({"yield_stress": sigma_y} if sigma_y else {})
    data: dict = {
        "joint": {"radius": 1.0, "clearance": 0.005, "element_size": element_size},
        "pin": solid,
        "block": solid,
        "load": {"displacement": 2.0, "steps": steps},
    }
    for name, values in sections.items():
        data[name] = values if values.get("rigid") else data.get(name, {}) | values
    return parse_scene(data)


@dataclass
class Solution:
    joint: Joint
    steps: list[Measures]
    profiles: list[dict[str, ArcProfile]]


def solve(scene: Scene, comm: MPI.Comm = MPI.COMM_SELF, partitioner=None) -> Solution:
    """Solve without writing anything."""
    joint = Joint(scene, comm, partitioner=partitioner)
    solution, work = Solution(joint, [], []), Work()

    def target_done(step):
        profiles = arc_profiles(joint)
        solution.profiles.append(profiles)
        solution.steps.append(measure(joint, len(solution.steps) + 1, step, profiles, work, 0.0))

    march(
        joint.equilibrium,
        [scene.delta * k / scene.load.steps for k in range(1, scene.load.steps + 1)],
        joint.rigid_translation,
        max_cutbacks=scene.load.max_cutbacks,
        substep_done=lambda load: work.add(load, joint.forces()["pin"]),
        target_done=target_done,
    )
    return solution
