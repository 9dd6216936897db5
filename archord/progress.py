"""Solving with progress on rank 0: a bar on a terminal, plain lines otherwise."""

from __future__ import annotations

import os
import re
import sys
from contextlib import nullcontext
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from archord.solver.scene import Scene, SceneError

if TYPE_CHECKING:
    from archord.solver.restart import Plan


def solve_with_progress(
    scene: Scene, folder: Path, *, force: bool, quiet: bool, begun: float, plan: Plan | None = None
) -> int:
    """Solve ``scene`` into ``folder`` on all ranks of MPI_COMM_WORLD and report; returns the exit code.

    A ``plan``, the same on all ranks but for its start, which rank 0 has, continues the run in ``folder``.
    """
    from mpi4py import MPI

    comm = MPI.COMM_WORLD
    _claim(comm, folder, force or plan is not None)
    from archord.solver.run import solve_scene
    from archord.solver.timer import Timer

    timer = Timer()
    timer.seconds["start-up"] = perf_counter() - begun
    start = plan.start if plan else None
    report = _Progress(scene, silent=quiet or comm.rank != 0, done=start.checkpoint.step if start else 0)
    with report:
        outcome = solve_scene(
            scene,
            folder,
            comm,
            start=start,
            timer=timer,
            begun=begun,
            on_start=report.start,
            on_step=report.step,
            on_attempt=report.attempt,
        )
    for warning in _shortened(outcome.warnings):
        print(f"archord: warning: {warning}.", file=sys.stderr)
    if comm.rank == 0 and outcome.status != "done":
        print(f"archord: {outcome.message}.", file=sys.stderr)
        print(f"archord: {outcome.status}; {len(outcome.steps)} accepted steps are in {folder}.", file=sys.stderr)
    elif comm.rank == 0 and not quiet:
        print(f"{len(outcome.steps)} steps in {perf_counter() - begun:.1f} s, results in {folder}")
    return {"done": 0, "stopped": 3, "interrupted": 128 + outcome.signal}[outcome.status]


def _shortened(warnings: list[str]) -> list[str]:
    """Each kind of warning once, at the first step that gave it."""
    first: dict[str, str] = {}
    for warning in warnings:
        kind = re.sub(r"[0-9.e+-]+", "#", warning.partition(": ")[2])
        first.setdefault(kind, warning)
    return list(first.values())


def _claim(comm, folder: Path, force: bool) -> None:
    """Let rank 0 look at the folder, and all ranks agree."""
    from archord.solver.run_folder import claim_folder

    fault = None
    if comm.rank == 0:
        try:
            claim_folder(folder, force)
        except SceneError as error:
            fault = str(error)
    fault = comm.bcast(fault)
    if fault:
        raise SceneError(fault)


def _on_terminal() -> bool:
    """Whether somebody watches: Open MPI gives its ranks a terminal of their own even where it writes to a file
    itself."""
    if not sys.stdout.isatty():
        return False
    if "PMIX_RANK" not in os.environ and "OMPI_COMM_WORLD_RANK" not in os.environ:
        return True
    try:
        return os.readlink(f"/proc/{os.getppid()}/fd/1").startswith(("/dev/pts/", "/dev/tty", "/dev/console"))
    except OSError:
        return False


class _Progress:
    """Reports steps as they are accepted."""

    def __init__(self, scene: Scene, silent: bool, done: int = 0) -> None:
        self.scene, self.silent = scene, silent
        self._bar: Any = nullcontext()
        self._task: Any = None
        if not silent and _on_terminal():
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

            self._bar = Progress(
                TextColumn("step"),
                MofNCompleteColumn(),
                BarColumn(),
                TextColumn("{task.description}"),
                TimeElapsedColumn(),
            )
            self._task = self._bar.add_task("meshing", total=len(scene.targets), completed=done)

    def __enter__(self) -> _Progress:
        self._bar.__enter__()
        return self

    def __exit__(self, *what) -> None:
        self._bar.__exit__(*what)

    def start(self, joint) -> None:
        """Say what is going to be solved."""
        if self.silent:
            return
        geometry, ranks = self.scene.joint, joint.comm.size
        kind = "elastic-plastic" if self.scene.plastic else "elastic"
        text = (
            f"{kind} joint, plane {self.scene.analysis.plane}, dR/R = {geometry.dR / geometry.radius:g}: "
            f"{joint.n_cells} curved triangles, {joint.n_dofs} dofs, {ranks} rank{'s' if ranks > 1 else ''}"
        )
        self._print(text)
        if self._task is None:
            print(" step   delta/dR     P/(E* R)   eps/deg   p0/E*      PEEQ max  iterations  cutbacks", flush=True)

    def attempt(self, load: float, iterations: int) -> None:
        """Show a solve that ended."""
        if self._task is not None:
            name = "P" if self.scene.force_controlled else "delta"
            self._bar.update(self._task, description=f"{name} = {load:.6g}, {iterations} iterations")

    def step(self, m) -> None:
        """Show an accepted output step."""
        if self.silent:
            return
        dR, E, R = self.scene.joint.dR, self.scene.E_star, self.scene.joint.radius
        if self._task is not None:
            text = f"delta/dR {m.delta / dR:.4g}, P/(E* R) {m.P / (E * R):.6g}, {m.iterations} iterations"
            self._bar.update(self._task, advance=1, description=text)
            return
        print(
            f"{m.step:5d}  {m.delta / dR:9.5g}  {m.P / (E * R):11.7f}  {m.eps * 57.29577951:8.3f}  {m.p0 / E:9.6f}  "
            f"{m.peeq_max:9.2e}  {m.iterations:10d}  {m.cutbacks:8d}",
            flush=True,
        )

    def _print(self, text: str) -> None:
        if self._task is not None:
            self._bar.console.print(text, highlight=False)
        else:
            print(text, flush=True)
