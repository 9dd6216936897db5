"""One case of a sweep: solved in its run folder, or continued. Imports PETSc, which all ranks must do together.

Nothing that goes wrong in a case leaves `solve_case` as an exception: it is the case's result.
"""

from __future__ import annotations

import gc
import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

from archord.output.disk import replace_file
from archord.output.folder import claim_folder
from archord.output.ranks import agreed, arrived_before
from archord.output.restart import Plan, plan_restart
from archord.scene.errors import InputError
from archord.scene.scene import Scene
from archord.solver.interrupt import Interrupted
from archord.studies.accuracy import solve_as_asked
from archord.studies.tables import FAILURE, Result, result_of

_PATIENCE = 20.0  # seconds that the ranks of a group wait for each other after an error


def solve_case(scene: Scene, folder: Path, comm: MPI.Comm, received: Callable[[], int] = lambda: 0) -> Result:
    """Solve ``scene`` into ``folder``, or finish what is there. Collective over ``comm``.

    ``received`` tells a signal that came while no run took it.
    """
    begun = time.perf_counter()
    if comm.size > 1:
        gc.disable()  # destructors of PETSc and dolfinx are collective: all ranks collect at one place, below
    try:
        found = _solve(scene, folder, comm, received)
    finally:
        gc.collect()
        gc.enable()
    return replace(
        found,
        seconds=time.perf_counter() - begun,
        steps=result_of(folder).steps if comm.rank == 0 else 0,
    )


def _solve(scene: Scene, folder: Path, comm: MPI.Comm, received: Callable[[], int]) -> Result:
    for from_start in (False, True):
        try:
            return _attempt(scene, folder, comm, received, from_start=from_start)
        except Interrupted as interrupted:
            return Result(folder.name, "interrupted", str(interrupted), signal=interrupted.number)
        except InputError as error:
            # the scene is sound: the folder is taken, or what is there cannot be continued, e.g. by another gmsh
            if "another archord" in str(error):
                return Result(folder.name, "busy", str(error))
            fault: Exception = error
        except Exception as error:
            return _failed(folder, comm, error)
    return _failed(folder, comm, fault)


def _attempt(scene: Scene, folder: Path, comm: MPI.Comm, received: Callable[[], int], *, from_start: bool) -> Result:
    """Solve, from the beginning if ``from_start``. Raises whatever went wrong."""

    def check(_: Any) -> None:
        number = max(comm.allgather(received()))
        if number:
            raise Interrupted(number)

    # what is there of a scene that asks for an accuracy is one of its meshes: it cannot be continued
    plan = agreed(comm, lambda: _plan(scene, folder, from_start or scene.analysis.accuracy is not None))
    if plan is not None and plan.finished:
        return Result(folder.name, "done")
    outcome = solve_as_asked(scene, folder, comm, start=plan.start if plan else None, on_start=check, on_step=check)
    return Result(folder.name, outcome.status, outcome.message, signal=outcome.signal)


def _plan(scene: Scene, folder: Path, from_start: bool) -> Plan | None:
    """Make the folder ready; how its run goes on, None if from the beginning."""
    claim_folder(folder, force=True)
    (folder / FAILURE).unlink(missing_ok=True)
    return None if from_start else plan_restart(folder, scene)


def _failed(folder: Path, comm: MPI.Comm, error: Exception) -> Result:
    """Note the error in the run folder. In a group all ranks must have it, or none of them could go on."""
    sentence = " ".join(f"{type(error).__name__}: {error}".split())
    text = "".join(traceback.format_exception(error))
    if comm.rank == 0:
        try:
            replace_file(folder / FAILURE, f"{sentence}\n\n{text}")
        except OSError as unwritten:
            sentence += f" ({folder / FAILURE} cannot be written: {unwritten.strerror})"
    if not arrived_before(comm, _PATIENCE):
        print(f"archord: {folder.name}: {sentence}, on one rank of several.", flush=True)
        MPI.COMM_WORLD.Abort(1)
    return Result(folder.name, "failed", sentence)
