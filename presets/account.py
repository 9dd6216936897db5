"""Scenes as problems that are ready to be solved, with the accounts of their steps."""

from __future__ import annotations

from mpi4py import MPI

from archord.measures.account import Account
from archord.presets.joint_measures import joint_account
from archord.report.timer import Timer
from archord.scene.file import AnyScene
from archord.scene.presets.joint import Scene
from archord.solver.problem import Problem


def account_of(
    scene: AnyScene,
    comm: MPI.Comm,
    timer: Timer | None = None,
    given: Problem | None = None,
) -> Account:
    """The problem of ``scene``, ready to be solved, and its account; or the problem that was
    ``given`` from Python, which the scene tells about. Collective over ``comm``; raises
    `InputError`."""
    timer = timer or Timer()
    if isinstance(scene, Scene):
        return joint_account(scene, comm, timer)
    from archord.presets.general import general_account  # joints do without it

    return general_account(scene, comm, timer, given)
