"""What is told of a scene's solution: an account of every step, of the joint or of a general
problem."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

from mpi4py import MPI

from archord.presets.joint import Joint
from archord.presets.joint_account import JointAccount
from archord.presets.measures import Measures, Record
from archord.report.timer import Timer
from archord.scene.file import AnyScene
from archord.scene.scene import Scene
from archord.solver.problem import Problem

if TYPE_CHECKING:  # joints do without it
    from archord.presets.general_account import GeneralAccount

Account: TypeAlias = "JointAccount | GeneralAccount"
Column = tuple[str, Callable[[Any], float | int]]  # heading, and its value of a step


def account_of(
    scene: AnyScene,
    comm: MPI.Comm,
    timer: Timer | None = None,
    given: Problem | None = None,
) -> Account:
    """The problem of ``scene``, or the one that was ``given`` from Python, of which the scene tells,
    ready to be solved, and its account. Collective over ``comm``; raises `InputError`."""
    if isinstance(scene, Scene):
        return JointAccount(Joint(scene, comm, timer=timer))
    from archord.presets.general_account import GeneralAccount

    return GeneralAccount(scene, comm, timer, given)


def record_type(scene: AnyScene) -> type:
    """The class of the steps' records of ``scene``."""
    return Measures if isinstance(scene, Scene) else Record
