"""Solving with progress on rank 0: a bar on a terminal, plain lines otherwise."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from archord.ranks import on_terminal
from archord.scene.scene import Scene

if TYPE_CHECKING:
    from archord.output.restart import Start
    from archord.output.run import Outcome
    from archord.studies.accuracy import Level


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

    from archord.output.folder import claim_folder
    from archord.output.ranks import agreed

    def claimed() -> Scene:
        scene = load()
        claim_folder(folder, force)
        return scene

    comm = MPI.COMM_WORLD
    scene = agreed(comm, claimed)
    from archord.postprocess.tables import first_of_each_kind
    from archord.solver.timer import Timer
    from archord.studies.accuracy import solve_as_asked

    timer = Timer()
    timer.seconds["start-up"] = perf_counter() - begun
    report, options = reporting(scene, silent=quiet or comm.rank != 0, done=start.checkpoint.step if start else 0)
    with report:
        outcome = solve_as_asked(scene, folder, comm, start=start, debug=debug, timer=timer, begun=begun, **options)
    report.finish(outcome)
    for warning in first_of_each_kind(outcome.warnings):
        print(f"archord: warning: {warning}.", file=sys.stderr)
    if comm.rank == 0 and outcome.status != "done":
        print(f"archord: {outcome.message}.", file=sys.stderr)
        print(f"archord: {outcome.status}; {len(outcome.steps)} accepted steps are in {folder}.", file=sys.stderr)
    elif comm.rank == 0 and not quiet:
        took = f"{len(outcome.steps)} steps in {perf_counter() - begun:.1f} s"
        print(f"{took}{_estimate(scene, outcome)}, results in {folder}")
    return {"done": 0, "stopped": 3, "interrupted": 128 + outcome.signal}[outcome.status]


def reporting(scene: Scene, *, silent: bool, done: int = 0) -> tuple[Progress, dict[str, Callable]]:
    """Who reports a solve of ``scene``, of which ``done`` steps are there, and what the solve has to call."""
    report = Progress(scene, silent, done) if scene.analysis.accuracy is None else _MeshProgress(scene, silent)
    calls: dict[str, Callable] = {"on_start": report.start, "on_step": report.step, "on_attempt": report.attempt}
    if isinstance(report, _MeshProgress):
        calls["on_level"] = report.level
    return report, calls


def _estimate(scene: Scene, outcome: Outcome) -> str:
    """What a run that was asked for an accuracy says of it."""
    accuracy = outcome.accuracy
    if accuracy is None or accuracy.estimated is None:
        return ""
    parts = f"mesh {accuracy.mesh_error:.1e}, steps {accuracy.step_error:.1e}; " if scene.plastic else ""
    name = "delta" if scene.force_controlled else "P"
    return f", estimated error of {name} {accuracy.estimated:.1e} ({parts}asked {accuracy.asked:g})"


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
            self._print_heading()

    def _print_heading(self) -> None:
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
        self._print_step(m)

    def finish(self, outcome: Outcome) -> None:
        """Show what is known only now."""

    def _print_step(self, m) -> None:
        dR, E, R = self.scene.joint.dR, self.scene.E_star, self.scene.joint.radius
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


class _MeshProgress(Progress):
    """Reports mesh after mesh of a scene with an accuracy; off a terminal the steps of the last one at the end."""

    def __init__(self, scene: Scene, silent: bool) -> None:
        super().__init__(scene, silent)
        self._headed = False

    def start(self, joint) -> None:
        """Begin a mesh."""
        if self.silent:
            return
        if not self._headed:
            geometry, kind = self.scene.joint, "elastic-plastic" if self.scene.plastic else "elastic"
            name = "delta" if self.scene.force_controlled else "P"
            self._print(
                f"{kind} joint, plane {self.scene.analysis.plane}, dR/R = {geometry.dR / geometry.radius:g}: "
                f"{name} to {self.scene.analysis.accuracy:g} of its largest value"
            )
            last = "delta/dR" if self.scene.force_controlled else "P/(E* R)"
            costs = f"substeps     dofs  {last:>10s}  error of mesh  error of steps  seconds"
            self._print(f" mesh  elements/R  growth  {costs}")
            self._headed = True
        if self._task is not None:
            self._bar.reset(self._task, description=f"{joint.n_dofs} dofs")

    def level(self, level: Level) -> None:
        """Show a mesh that is solved."""
        if self.silent:
            return
        joint = self.scene.joint
        unit = joint.dR if self.scene.force_controlled else self.scene.E_star * joint.radius
        mesh, steps = ("" if e is None else f"{e:.1e}" for e in (level.mesh_error, level.step_error))
        self._print(
            f"{level.mesh:5d}  {level.element_size:10.4g}  {level.growth:6.4g}  {level.substeps:8d}  {level.dofs:7d}  "
            f"{level.last / unit:10.7f}  {mesh:>13s}  {steps:>14s}  {level.seconds:7.1f}"
        )

    def step(self, m) -> None:
        """Show an accepted output step where a bar can."""
        if self._task is not None:
            super().step(m)

    def finish(self, outcome: Outcome) -> None:
        """Print the steps of the last mesh."""
        if not self.silent and self._task is None:
            self._print_heading()
            for m in outcome.steps:
                self._print_step(m)
