"""The cases of a sweep on the ranks that mpirun started: each on one rank, or on a group of them.

Rank 0 hands out the cases through mpi4py.futures, whose manager runs in a thread, and solves cases itself: it takes the
longest one that has not been handed out by cancelling its future. (`MPICommExecutor` alone would leave rank 0 idle,
half of two ranks.) All ranks must import this file together: it imports PETSc.
"""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from functools import partial
from typing import Any, cast

from mpi4py import MPI

from archord.output.ranks import arrived_before
from archord.solver.interrupt import Interrupt
from archord.studies.case_run import solve_case
from archord.studies.sweep import Job
from archord.studies.tables import Result

_LONG_ENOUGH = 0.5  # over the longest case that waits, for one that suits better
_BACKOFF = 0.005  # seconds between two looks of idle ranks and of the manager


class Farm:
    """The ranks of ``comm`` in groups of ``ranks_per_case``, which divides them; ``crew`` is this rank's group.
    Collective."""

    def __init__(self, comm: MPI.Intracomm, ranks_per_case: int = 1) -> None:
        self.comm = comm
        self.crew = MPI.COMM_SELF if ranks_per_case == 1 else comm.Split(comm.rank // ranks_per_case)
        self.leaders = cast(MPI.Intracomm, comm.Split(0 if self.crew.rank == 0 else MPI.UNDEFINED))
        self.workers = comm.size // ranks_per_case

    def run(
        self, jobs: list[Job], report: Callable[[Result], None], running: Callable[[int], None] = lambda n: None
    ) -> int:
        """Solve ``jobs`` (known on rank 0), the longest first; returns the signal that interrupted them, or 0.

        On rank 0 ``report(result)`` follows each, from any thread but never from two at once, and ``running(n)`` tells
        how many are being solved. After a signal no case is begun and those that are running stop at the next
        iteration. Collective.
        """
        global _here
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # PETSc would end the batch where its reader has seen enough
        gc.collect()
        gc.freeze()  # what the imports made need not be searched after every case
        with Interrupt() as interrupt:
            _here = _Here(self.crew, interrupt)
            try:
                if self.crew.rank:
                    _here.follow()
                else:
                    self._lead(jobs, report, running)
                    _here.dismiss()
            finally:
                _here = None
                gc.unfreeze()
            arrived_before(self.comm)  # asleep: those that are done leave their cores to the others
            return max(self.comm.allgather(interrupt.received))

    def _lead(self, jobs: list[Job], report: Callable[[Result], None], running: Callable[[int], None]) -> None:
        assert _here is not None
        if self.leaders.rank == 0:
            jobs = sorted(jobs, key=lambda job: (-job.cost, job.mesh))
        if self.leaders.size == 1:
            for job in jobs:
                if not _here.interrupt.received:
                    running(1)
                    report(_here.solve(job))
            return
        from mpi4py.futures import MPICommExecutor

        with MPICommExecutor(self.leaders, root=0, backoff=_BACKOFF) as executor:
            if executor is not None:
                self._share(executor, jobs, report, running)

    def _share(
        self, executor: Any, jobs: list[Job], report: Callable[[Result], None], running: Callable[[int], None]
    ) -> None:
        """Hand ``jobs`` to the workers and solve those that wait here, too."""
        assert _here is not None
        lock = threading.Lock()
        handed: list[Future] = []
        interrupted = threading.Event()

        def finish(result: Result) -> None:
            with lock:
                if result.status == "interrupted":
                    interrupted.set()
                report(result)
                running(sum(future.running() for future in handed))

        def ended(job: Job, future: Future) -> None:
            if not future.cancelled():
                error = future.exception()
                finish(Result(job.folder.name, "failed", f"{error}") if error else future.result())

        for job in jobs:
            handed.append(executor.submit(_solve_there, job))
            handed[-1].add_done_callback(partial(ended, job))
        threads = MPI.Query_thread() == MPI.THREAD_MULTIPLE
        mine: set[str] = set()
        while waiting := [i for i, future in enumerate(handed) if not (future.running() or future.done())]:
            if interrupted.is_set() or _here.interrupt.received:
                for i in waiting:
                    handed[i].cancel()
                break
            if not threads:
                wait([handed[waiting[0]]])  # the manager's thread must be the only one that calls MPI
                continue
            taken = [i for i, f in enumerate(handed) if (f.running() or f.done()) and not f.cancelled()]
            next_there = waiting[: self.workers - 1]
            theirs = {jobs[i].mesh for i in (*taken, *next_there)}
            i = waiting[suited([jobs[i] for i in waiting], mine, theirs)]
            if handed[i].cancel():
                mine.add(jobs[i].mesh)
                running(1 + sum(f.running() for f in handed))
                finish(_here.solve(jobs[i]))


def suited(jobs: list[Job], mine: set[str], theirs: set[str]) -> int:
    """Which of ``jobs``, the longest first, rank 0 should take: one whose mesh it has, or else one whose mesh the other
    ranks do not have, if it is not much shorter than the longest; that, where there is none."""
    long = [i for i, job in enumerate(jobs) if job.cost >= _LONG_ENOUGH * jobs[0].cost]
    for suits in (lambda mesh: mesh in mine, lambda mesh: mesh not in theirs):
        for i in long:
            if suits(jobs[i].mesh):
                return i
    return 0


class _Here:
    """This rank's part: what solves a job, with the rest of its group following."""

    def __init__(self, crew: MPI.Comm, interrupt: Interrupt) -> None:
        self.crew, self.interrupt = crew, interrupt

    def solve(self, job: Job) -> Result:
        """Solve a job with the whole group; on its first rank. After a signal nothing is begun."""
        if self.interrupt.received:
            return Result(job.folder.name, "interrupted", "not begun", signal=self.interrupt.received)
        if self.crew.size > 1:
            arrived_before(self.crew)
            self.crew.bcast(job)
        return self._solve(job)

    def follow(self) -> None:
        """Solve with the first rank whatever that solves, until it dismisses the group."""
        while arrived_before(self.crew) and (job := self.crew.bcast(None)) is not None:
            self._solve(job)

    def dismiss(self) -> None:
        """Nothing more will come."""
        if self.crew.size > 1:
            arrived_before(self.crew)
            self.crew.bcast(None)

    def _solve(self, job: Job) -> Result:
        result = solve_case(job.scene, job.folder, self.crew, lambda: self.interrupt.received)
        # the run took the signal: the batch has to know it, too
        self.interrupt.received = self.interrupt.received or result.signal
        return result


_here: _Here | None = None


def _solve_there(job: Job) -> Result:
    """Solve a job on the rank that got it."""
    assert _here is not None
    return _here.solve(job)
