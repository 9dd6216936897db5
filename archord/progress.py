"""Progress on rank 0: a bar on a terminal, plain lines otherwise."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

from archord.ranks import on_terminal
from archord.scene.scene import Scene

if TYPE_CHECKING:
    from mpi4py import MPI

    from archord.output.restart import Start
    from archord.output.run import Outcome
    from archord.studies.accuracy import Level
    from archord.studies.sweep import Job
    from archord.studies.tables import Result


def say(text: str) -> None:
    """Print a line; if nobody reads any more, that is no reason to stop, nor to leave other ranks waiting."""
    try:
        print(text, flush=True)
    except OSError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115


class _Bar:
    """``done`` of ``total`` things as a bar, where somebody watches; ``shown`` tells whether there is one."""

    def __init__(self, thing: str, total: int, done: int, text: str, *, silent: bool) -> None:
        self.silent = silent
        self.shown = not silent and on_terminal()
        self._bar: Any = nullcontext()
        if self.shown:
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

            columns = (MofNCompleteColumn(), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
            self._bar = Progress(TextColumn(thing), *columns)
            self._task = self._bar.add_task(text, total=total, completed=done)

    def __enter__(self) -> Self:
        """Show the bar."""
        self._bar.__enter__()
        return self

    def __exit__(self, *what) -> None:
        """Leave the bar as it is."""
        self._bar.__exit__(*what)

    def update(self, text: str, advance: int = 0) -> None:
        """Put ``text`` beside the bar."""
        if self.shown:
            self._bar.update(self._task, advance=advance, description=text)

    def print(self, text: str) -> None:
        """Print a line, above the bar."""
        if self.shown:
            self._bar.console.print(text, highlight=False)
        elif not self.silent:
            print(text, flush=True)


class Progress(_Bar):
    """Reports steps as they are accepted."""

    def __init__(self, scene: Scene, silent: bool, done: int = 0) -> None:
        super().__init__("step", len(scene.targets), done, "meshing", silent=silent)
        self.scene = scene
        self.dR, self.force_unit = scene.joint.dR, scene.E_star * scene.joint.radius

    def _joint(self) -> str:
        kind = "elastic-plastic" if self.scene.plastic else "elastic"
        return f"{kind} joint, plane {self.scene.analysis.plane}, dR/R = {self.dR / self.scene.joint.radius:g}"

    def start(self, joint) -> None:
        """Say what is going to be solved."""
        ranks = joint.comm.size
        mesh = f"{joint.n_cells} curved triangles, {joint.n_dofs} dofs, {ranks} rank{'s' if ranks > 1 else ''}"
        self.print(f"{self._joint()}: {mesh}")
        if not self.shown:
            self._print_heading()

    def _print_heading(self) -> None:
        self.print(" step   delta/dR     P/(E* R)   eps/deg   p0/E*      PEEQ max  iterations  cutbacks")

    def attempt(self, load: float, iterations: int) -> None:
        """Show a solve that ended."""
        self.update(f"{'P' if self.scene.force_controlled else 'delta'} = {load:.6g}, {iterations} iterations")

    def step(self, m) -> None:
        """Show an accepted output step."""
        text = f"delta/dR {m.delta / self.dR:.4g}, P/(E* R) {m.P / self.force_unit:.6g}, {m.iterations} iterations"
        self.update(text, advance=1)
        if not self.shown:
            self._print_step(m)

    def finish(self, outcome: Outcome) -> None:
        """Show what is known only now."""

    def _print_step(self, m) -> None:
        P = round(m.P / self.force_unit, 7) + 0.0  # no minus before a zero
        self.print(
            f"{m.step:5d}  {m.delta / self.dR:9.5g}  {P:11.7f}  {math.degrees(m.eps):8.3f}  "
            f"{m.p0 / self.scene.E_star:9.6f}  {m.peeq_max:9.2e}  {m.iterations:10d}  {m.cutbacks:8d}"
        )


class _MeshProgress(Progress):
    """Reports mesh after mesh of a scene with an accuracy; off a terminal the steps of the last one at the end."""

    _headed = False

    def start(self, joint) -> None:
        """Begin a mesh."""
        force_controlled = self.scene.force_controlled
        if not self._headed:
            name, last = ("delta", "delta/dR") if force_controlled else ("P", "P/(E* R)")
            self.print(f"{self._joint()}: {name} to {self.scene.analysis.accuracy:g} of its largest value")
            costs = f"substeps     dofs  {last:>10s}  error of mesh  error of steps  seconds"
            self.print(f" mesh  elements/R  growth  {costs}")
            self._headed = True
        if self.shown:
            self._bar.reset(self._task, description=f"{joint.n_dofs} dofs")

    def level(self, level: Level) -> None:
        """Show a mesh that is solved."""
        unit = self.dR if self.scene.force_controlled else self.force_unit
        mesh, steps = ("" if e is None else f"{e:.1e}" for e in (level.mesh_error, level.step_error))
        self.print(
            f"{level.mesh:5d}  {level.element_size:10.4g}  {level.growth:6.4g}  {level.substeps:8d}  {level.dofs:7d}  "
            f"{level.last / unit:10.7f}  {mesh:>13s}  {steps:>14s}  {level.seconds:7.1f}"
        )

    def step(self, m) -> None:
        """Show an accepted output step where a bar can."""
        if self.shown:
            super().step(m)

    def finish(self, outcome: Outcome) -> None:
        """Print the steps of the last mesh."""
        if not self.shown:
            self._print_heading()
            for m in outcome.steps:
                self._print_step(m)


def solve_and_report(
    load: Callable[[], Scene],
    folder: Path,
    comm: MPI.Comm,
    *,
    force: bool,
    silent: bool,
    start: Start | None = None,
    begun: float | None = None,
    **options: Any,
) -> tuple[Scene, Outcome]:
    """Solve the scene that ``load`` gives rank 0 into ``folder``, claimed by ``force`` if it has to be, or go on from
    ``start``, and report it on rank 0 unless ``silent``. Collective.

    If this process is for it alone, it has ``begun`` at that time of `perf_counter`.
    """
    from archord.output.folder import claim_folder
    from archord.output.ranks import agreed

    def claimed() -> Scene:
        scene = load()
        claim_folder(folder, force)
        return scene

    scene = agreed(comm, claimed)
    from archord.solver.timer import Timer
    from archord.studies.accuracy import solve_as_asked  # with all of dolfinx: bad input is told before

    if begun is not None:
        options |= {"begun": begun, "timer": Timer({"start-up": perf_counter() - begun})}
    silent = silent or comm.rank != 0
    calls: dict[str, Any] = {}
    if scene.analysis.accuracy is None:
        report = Progress(scene, silent, start.checkpoint.step if start else 0)
    else:
        report = _MeshProgress(scene, silent)
        calls["on_level"] = report.level
    calls |= {"on_start": report.start, "on_step": report.step, "on_attempt": report.attempt}
    with report:
        outcome = solve_as_asked(scene, folder, comm, start=start, **calls, **options)
    report.finish(outcome)
    return scene, outcome


class SweepProgress(_Bar):
    """Reports cases as they end: of ``jobs``, with those that had ``ended`` before. ``results`` keeps what ended.

    The time left is the expected cost of what is left, by the time that what has ended took on ``workers``.
    """

    def __init__(self, jobs: list[Job], ended: list[Result], workers: int, begun: float, *, silent: bool) -> None:
        self._total = len(jobs) + len(ended)
        super().__init__("case", self._total, len(ended), "starting", silent=silent)
        self.results: list[Result] = []
        self.begun, self.workers = begun, workers
        self._cost = {job.folder.name: job.cost for job in jobs}
        self._left = sum(self._cost.values())
        self._spent = self._cost_spent = 0.0
        self._done = sum(result.status == "done" for result in ended)
        self._failed = len(ended) - self._done
        self._running = 0
        if ended and not silent:
            say(f"{len(ended)} of {self._total} cases are there already")

    def running(self, number: int) -> None:
        """Show how many cases are being solved."""
        self._running = number
        self.update(self._counts())

    def ended(self, result: Result) -> None:
        """Show a case that ended."""
        self._done += result.status == "done"
        self._failed += result.status in ("stopped", "failed")
        self.results.append(result)
        cost = self._cost.get(result.run, 0.0)
        self._left = max(0.0, self._left - cost) if len(self.results) < len(self._cost) else 0.0
        self._spent += result.seconds
        self._cost_spent += cost
        self.update(self._counts(), advance=1)
        if not self.silent and not self.shown and result.message != "not begun":
            word = f"{result.status}, {result.steps} steps in {result.seconds:.1f} s"
            say(f"{perf_counter() - self.begun:7.1f} s  {result.run} {word}; {self._counts()}")

    def _counts(self) -> str:
        """Done, running, failed, and the time left."""
        told = f"{self._done} of {self._total} done"
        if self.shown and len(self.results) < len(self._cost):
            told += f", {self._running} running"
        if self._failed:
            told += f", {self._failed} failed"
        if self._left and self._cost_spent:
            left = self._left * self._spent / self._cost_spent / self.workers
            told += f", about {left:.0f} s left" if left < 100 else f", about {left / 60:.0f} min left"
        return told
