"""What is told of a scene's solution: an account of every step, of the joint or of a general problem."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Protocol

from mpi4py import MPI

from archord.materials.material import Array
from archord.presets.edge import EdgeProfile
from archord.presets.joint import Joint
from archord.presets.joint_report import JointAccount
from archord.presets.measures import Measures
from archord.report.timer import Timer
from archord.scene.file import AnyScene
from archord.scene.scene import Scene
from archord.solver.stepping import Step
from archord.solver.system import System

Column = tuple[str, Callable[[Any], float | int]]  # heading, and its value of a step


class Account(Protocol):
    """The account of ``system``, which is that of ``scene``; steps are of the class ``record``, a dataclass."""

    record: ClassVar[type]
    fixed: ClassVar[tuple[str, ...]]  # arrays of a profile that no step changes
    per_step: ClassVar[tuple[str, ...]]  # those that a step does

    @property
    def system(self) -> System:
        """What is solved."""
        ...

    @property
    def scene(self) -> Any:
        """What it was made of."""
        ...

    def columns(self) -> Sequence[Column]:
        """The columns of history.csv."""
        ...

    def driven(self) -> tuple[Array | float, Array | float]:
        """Displacements driven and the forces that drive them, whose work is that of the load. Collective."""
        ...

    def profiles(self) -> Mapping[str, EdgeProfile]:
        """The contact along the surfaces at the last evaluation. Collective."""
        ...

    def step(self, before: Sequence[Any], step: Step, profiles: Mapping[str, Any], work: float, seconds: float) -> Any:
        """The record of the last accepted state, which follows the steps ``before``. Collective."""
        ...

    def facts(self) -> dict[str, Any]:
        """Sizes of the mesh and what was made of the scene, for run.json."""
        ...

    def warnings(self) -> list[str]:
        """What to warn of before the first step."""
        ...

    def step_warnings(self, m: Any, profiles: Mapping[str, Any], residual: float) -> list[str]:
        """What to warn of after the step ``m``, which Newton's method left with a ``residual``. Collective."""
        ...

    def ending(self, steps: Sequence[Any]) -> tuple[str, list[str]]:
        """Why a run that came to its end does not count as done, or nothing, and what to warn of at its end."""
        ...

    def energy_balance(self, steps: Sequence[Any]) -> float | None:
        """How far work and energies are apart over the largest work; None where nothing tells."""
        ...


def account_of(scene: AnyScene, comm: MPI.Comm, timer: Timer | None = None, partitioner=None) -> Account:
    """The problem of ``scene``, ready to be solved, and its account. Collective over ``comm``; raises `InputError`."""
    if isinstance(scene, Scene):
        return JointAccount(Joint(scene, comm, timer=timer, partitioner=partitioner))
    from archord.presets.general import GeneralAccount  # which joints do without

    return GeneralAccount(scene, comm, timer=timer, partitioner=partitioner)


def record_type(scene: AnyScene) -> type:
    """The class of the steps' records of ``scene``."""
    if isinstance(scene, Scene):
        return Measures
    from archord.presets.general import Record

    return Record
