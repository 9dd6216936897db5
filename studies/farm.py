"""The cases of a sweep on the ranks that mpirun started, each case on one rank.

Rank 0 hands out the cases through mpi4py.futures, whose manager runs in a thread, and solves cases
itself: it takes the last one that has not been handed out by cancelling its future.
(`MPICommExecutor` alone would leave rank 0 idle, half of two ranks.) All ranks must import this
file together: it imports PETSc.
"""

from __future__ import annotations

import gc
import signal
import threading
import traceback
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

from mpi4py import MPI
from mpi4py.futures import MPICommExecutor

from archord.kernels.interrupt import Interrupt
from archord.output.files.disk import replace_file
from archord.output.folder import claim_folder
from archord.output.ranks import arrived_before
from archord.output.restart import plan_restart
from archord.report.errors import InputError
from archord.studies.accuracy import solve_to_accuracy
from archord.studies.cases import Case
from archord.studies.sweep import FAILURE, Result, of_case

_BACKOFF = 0.005  # seconds between two looks of idle ranks and of the manager
_interrupt = Interrupt()  # of this rank


def solve_cases(
    comm: MPI.Intracomm,
    cases: list[Case],
    folder: Path,
    report: Callable[[Result], Any],
    *,
    force: bool = False,
) -> int:
    """Solve ``cases`` (known on rank 0), the longest first, into the sweep's ``folder``; returns
    the signal that interrupted them, or 0. With ``force`` all from the beginning, whatever is
    there. Collective.

    On rank 0 ``report(result)`` follows each, from any thread but never from two at once. After a
    signal no case is begun and those that are running stop at the next iteration.
    """
    global _interrupt
    signal.signal(
        signal.SIGPIPE, signal.SIG_IGN
    )  # PETSc would end the batch where its reader has seen enough
    frozen_before = gc.get_freeze_count()
    gc.collect()
    gc.freeze()  # what the imports made need not be searched after every case
    try:
        with Interrupt() as _interrupt:
            if comm.size == 1:
                for case in cases:
                    report(solve_case(case, folder, force))
            else:
                with MPICommExecutor(comm, root=0, backoff=_BACKOFF) as executor:
                    if executor is not None:
                        _share(executor, cases, folder, report, force)
            arrived_before(comm)  # asleep: those that are done leave their cores to the others
            return max(comm.allgather(_interrupt.received))
    finally:
        if not frozen_before:  # else every later collection would search what the caller froze, too
            gc.unfreeze()


def _share(
    executor: Any, cases: list[Case], folder: Path, report: Callable[[Result], Any], force: bool
) -> None:
    """Hand ``cases`` to the other ranks, and solve here from the end of the list."""
    lock = threading.Lock()

    def ended(future: Future) -> None:
        if not future.cancelled():
            error = future.exception()
            with lock:
                report(Result(of[future].run, "failed", f"{error}") if error else future.result())

    of = {executor.submit(solve_case, case, folder, force): case for case in cases}
    for future in of:
        future.add_done_callback(ended)
    if (
        MPI.Query_thread() == MPI.THREAD_MULTIPLE
    ):  # else the manager's thread must be the only one that calls MPI
        for future, case in reversed(of.items()):
            if future.cancel():
                result = solve_case(case, folder, force)
                with lock:
                    report(result)


def solve_case(case: Case, folder: Path, force: bool = False) -> Result:
    """Solve ``case`` into its run folder on this rank alone, or without ``force`` finish what is
    there; after a signal begin nothing. Whatever goes wrong in a case is its result."""
    if _interrupt.received:
        return Result(case.run, "open")
    begun = perf_counter()
    run = of_case(case, folder)
    try:
        result = _solved(case, run, force)
    except Exception as error:
        kind = "" if isinstance(error, InputError) else f"{type(error).__name__}: "
        sentence = " ".join(f"{kind}{error}".split()).removesuffix(".")
        with suppress(OSError):
            replace_file(
                run / FAILURE, f"{sentence}\n\n{''.join(traceback.format_exception(error))}"
            )
        result = Result(case.run, "failed", sentence)
    gc.collect()
    return replace(result, seconds=perf_counter() - begun)


def _solved(case: Case, run: Path, force: bool) -> Result:
    """Raises whatever goes wrong twice: what is there may not be continued, e.g. by another gmsh,
    and is replaced."""
    # what is there of a scene that asks for an accuracy is one of its meshes: it cannot be
    # continued
    for going_on in (case.scene.analysis.accuracy is None and not force, False):
        try:
            claim_folder(run, force=True)
            (run / FAILURE).unlink(missing_ok=True)
            plan = plan_restart(run, case.scene) if going_on else None
            if plan is not None and plan.finished:
                return Result(case.run, "done", steps=len(case.scene.targets))
            start = plan.start if plan else None
            outcome = solve_to_accuracy(
                case.scene, run, MPI.COMM_SELF, start=start, interrupt=_interrupt
            )
            return Result(case.run, outcome.status, outcome.message, len(outcome.steps))
        except InputError as error:
            if "another archord" in str(error):
                return Result(case.run, "busy", str(error))
            fault = error
    raise fault
