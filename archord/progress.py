"""Solving with progress on rank 0: a bar on a terminal, plain lines otherwise."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from archord.postprocess.run_warnings import first_of_each_kind
from archord.ranks import on_terminal
from archord.solver.scene import Scene

if TYPE_CHECKING:
    from archord.solver.restart import Start


def solve_with_progress(
    load: Callable[[], Scene],
    folder: Path,
    *,
    force: bool,
    debug: bool,
    quiet: bool,
    begun: float,
    start: Start | None = None,
) -> int:
    """Solve the scene that ``load`` gives rank 0 into ``folder`` on all ranks of MPI_COMM_WORLD and report; returns the
    exit code. ``start`` continues the run in ``folder``."""
    from mpi4py import MPI

    from archord.solver.ranks import agreed
    from archord.solver.run_folder import claim_folder

    def claimed() -> Scene:
        scene = load()
        claim_folder(folder, force)
        return scene

    comm = MPI.COMM_WORLD
    scene = agreed(comm, claimed)
    from archord.solver.run import solve_scene
    from archord.solver.timer import Timer

    timer = Timer()
    timer.seconds["start-up"] = perf_counter() - begun
    report = Progress(scene, silent=quiet or comm.rank != 0, done=start.checkpoint.step if start else 0)
    with report:
        outcome = solve_scene(
            scene,
            folder,
            comm,
            start=start,
            debug=debug,
            timer=timer,
            begun=begun,
            on_start=report.start,
            on_step=report.step,
            on_attempt=report.attempt,
        )
    for warning in first_of_each_kind(outcome.warnings):
        print(f"archord: warning: {warning}.", file=sys.stderr)
    if comm.rank == 0 and outcome.status != "done":
        print(f"archord: {outcome.message}.", file=sys.stderr)
        print(f"archord: {outcome.status}; {len(outcome.steps)} accepted steps are in {folder}.", file=sys.stderr)
    elif comm.rank == 0 and not quiet:
        print(f"{len(outcome.steps)} steps in {perf_counter() - begun:.1f} s, results in {folder}")
    return {"done": 0, "stopped": 3, "interrupted": 128 + outcome.signal}[outcome.status]


class Progress:
    """Reports steps as they are accepted."""

    def __init__(self, scene: Scene, silent: bool, done: int = 0) -> None:
        self.scene, self.silent = scene, silent
        self._bar: Any = nullcontext()
        self._task: Any = None
        if not silent and on_terminal():
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

            self._bar = Progress(
                TextColumn("step"),
                MofNCompleteColumn(),
                BarColumn(),
                TextColumn("{task.description}"),
                TimeElapsedColumn(),
            )
            self._task = self._bar.add_task("meshing", total=len(scene.targets), completed=done)

    def __enter__(self) -> Progress:
        """Show the bar."""
        self._bar.__enter__()
        return self

    def __exit__(self, *what) -> None:
        """Leave the bar as it is."""
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
        P = round(m.P / (E * R), 7) + 0.0  # no minus before a zero
        print(
            f"{m.step:5d}  {m.delta / dR:9.5g}  {P:11.7f}  {m.eps * 57.29577951:8.3f}  {m.p0 / E:9.6f}  "
            f"{m.peeq_max:9.2e}  {m.iterations:10d}  {m.cutbacks:8d}",
            flush=True,
        )

    def _print(self, text: str) -> None:
        if self._task is not None:
            self._bar.console.print(text, highlight=False)
        else:
            print(text, flush=True)
