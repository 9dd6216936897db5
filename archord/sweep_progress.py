"""Progress of a sweep on rank 0: a bar on a terminal, a line for each case otherwise."""

from __future__ import annotations

import os
import sys
from contextlib import nullcontext
from time import perf_counter
from typing import TYPE_CHECKING, Any

from archord.ranks import on_terminal

if TYPE_CHECKING:
    from archord.studies.case_run import Result
    from archord.studies.farm import Job


def say(text: str) -> None:
    """Print a line; if nobody reads any more, that is no reason to stop, nor to leave other ranks waiting."""
    try:
        print(text, flush=True)
    except OSError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115


class SweepProgress:
    """Reports cases as they end: of ``jobs``, with those that had ``ended`` before. ``results`` keeps what ended.

    The time left is the expected cost of what is left, by the time that what has ended took on ``workers``.
    """

    def __init__(self, jobs: list[Job], ended: list[Result], workers: int, begun: float, *, silent: bool) -> None:
        self.results: list[Result] = []
        self.silent, self.begun, self.workers = silent, begun, workers
        self._cost = {job.folder.name: job.cost for job in jobs}
        self._left = sum(self._cost.values())
        self._spent = self._cost_spent = 0.0
        self._total = len(jobs) + len(ended)
        self._done = sum(result.status == "done" for result in ended)
        self._failed = len(ended) - self._done
        self._running = self._made = self._reused = 0
        self._bar: Any = nullcontext()
        self._task: Any = None
        if silent:
            return
        if ended:
            say(f"{len(ended)} of {self._total} cases are there already")
        if on_terminal():
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

            columns = (MofNCompleteColumn(), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
            self._bar = Progress(TextColumn("case"), *columns)
            self._task = self._bar.add_task("starting", total=self._total, completed=len(ended))

    def __enter__(self) -> SweepProgress:
        """Show the bar, if there is one."""
        self._bar.__enter__()
        return self

    def __exit__(self, *what) -> None:
        """Take it away."""
        self._bar.__exit__(*what)

    def running(self, number: int) -> None:
        """Show how many cases are being solved."""
        self._running = number
        if self._task is not None:
            self._bar.update(self._task, description=self._counts())

    def ended(self, result: Result) -> None:
        """Show a case that ended."""
        self._done += result.status == "done"
        self._failed += result.status in ("stopped", "failed")
        self.results.append(result)
        self._made += result.meshes
        self._reused += result.reused
        cost = self._cost.get(result.run, 0.0)
        self._left = max(0.0, self._left - cost) if len(self.results) < len(self._cost) else 0.0
        self._spent += result.seconds
        self._cost_spent += cost
        if self.silent:
            return
        if self._task is not None:
            self._bar.update(self._task, advance=1, description=self._counts())
        elif result.message != "not begun":
            word = f"{result.status}, {result.steps} steps in {result.seconds:.1f} s"
            say(f"{perf_counter() - self.begun:7.1f} s  {result.run} {word}; {self._counts()}")

    def _counts(self) -> str:
        """Done, running, failed, and the time left."""
        told = f"{self._done} of {self._total} done"
        if self._task is not None and len(self.results) < len(self._cost):
            told += f", {self._running} running"
        if self._failed:
            told += f", {self._failed} failed"
        if self._left and self._cost_spent:
            left = self._left * self._spent / self._cost_spent / self.workers
            told += f", about {left:.0f} s left" if left < 100 else f", about {left / 60:.0f} min left"
        return told

    @property
    def meshes(self) -> str:
        """A sentence about the meshes that were shared."""
        return f"{self._made} mesh{'' if self._made == 1 else 'es'} made, {self._reused} used again"
