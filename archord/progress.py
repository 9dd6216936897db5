"""A solve and its progress on rank 0: a bar on a terminal, plain lines otherwise."""

from __future__ import annotations

import math
from collections.abc import Callable
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


class Progress:
    """Reports steps as they are accepted; of a scene with an accuracy mesh after mesh, and off a terminal only the
    steps of the last one, at the end. ``done`` steps are there already."""

    def __init__(self, scene: Scene, silent: bool, done: int = 0) -> None:
        self.scene, self.by_mesh = scene, scene.analysis.accuracy is not None
        self.dR, self.force_unit = scene.joint.dR, scene.E_star * scene.joint.radius
        self.silent, self.shown = silent, not silent and on_terminal()  # shown: as a bar
        if self.shown:
            from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
            from rich.progress import Progress as Bar

            columns = (MofNCompleteColumn(), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
            self._bar = Bar(TextColumn("step"), *columns)
            self._task = self._bar.add_task("meshing", total=len(scene.targets), completed=done)
        kind = "elastic-plastic" if scene.plastic else "elastic"
        self._joint = f"{kind} joint, plane {scene.analysis.plane}, dR/R = {self.dR / scene.joint.radius:g}"
        if self.by_mesh:
            name, last = ("delta", "delta/dR") if scene.force_controlled else ("P", "P/(E* R)")
            self.print(f"{self._joint}: {name} to {scene.analysis.accuracy:g} of its largest value")
            costs = f"substeps     dofs  {last:>10s}  error of mesh  error of steps  seconds"
            self.print(f" mesh  elements/R  growth  {costs}")

    def __enter__(self) -> Self:
        """Show the bar."""
        if self.shown:
            self._bar.start()
        return self

    def __exit__(self, *what) -> None:
        """Leave the bar as it is."""
        if self.shown:
            self._bar.stop()

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

    def start(self, joint) -> None:
        """Say what is going to be solved."""
        if not self.by_mesh:
            ranks = f"{joint.comm.size} rank{'s' if joint.comm.size > 1 else ''}"
            self.print(f"{self._joint}: {joint.n_cells} curved triangles, {joint.n_dofs} dofs, {ranks}")
            self._print_heading()
        elif self.shown:
            self._bar.reset(self._task, description=f"{joint.n_dofs} dofs")

    def attempt(self, load: float, iterations: int) -> None:
        """Show a solve that ended."""
        self.update(f"{'P' if self.scene.force_controlled else 'delta'} = {load:.6g}, {iterations} iterations")

    def step(self, m) -> None:
        """Show an accepted output step."""
        text = f"delta/dR {m.delta / self.dR:.4g}, P/(E* R) {m.P / self.force_unit:.6g}, {m.iterations} iterations"
        self.update(text, advance=1)
        if not self.by_mesh:
            self._print_step(m)

    def level(self, level: Level) -> None:
        """Show a mesh that is solved."""
        unit = self.dR if self.scene.force_controlled else self.force_unit
        mesh, steps = ("" if e is None else f"{e:.1e}" for e in (level.mesh_error, level.step_error))
        self.print(
            f"{level.mesh:5d}  {level.element_size:10.4g}  {level.growth:6.4g}  {level.substeps:8d}  {level.dofs:7d}  "
            f"{level.last / unit:10.7f}  {mesh:>13s}  {steps:>14s}  {level.seconds:7.1f}"
        )

    def finish(self, outcome: Outcome) -> None:
        """Show what is known only now."""
        if self.by_mesh:
            self._print_heading()
            for m in outcome.steps:
                self._print_step(m)

    def _print_heading(self) -> None:
        if not self.shown:
            self.print(" step   delta/dR     P/(E* R)   eps/deg   p0/E*      PEEQ max  iterations  cutbacks")

    def _print_step(self, m) -> None:
        if not self.shown:
            P = round(m.P / self.force_unit, 7) + 0.0  # no minus before a zero
            self.print(
                f"{m.step:5d}  {m.delta / self.dR:9.5g}  {P:11.7f}  {math.degrees(m.eps):8.3f}  "
                f"{m.p0 / self.scene.E_star:9.6f}  {m.peeq_max:9.2e}  {m.iterations:10d}  {m.cutbacks:8d}"
            )


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

    report = Progress(scene, silent or comm.rank != 0, start.checkpoint.step if start else 0)
    if report.by_mesh:
        options["on_level"] = report.level
    elif begun is not None:
        options["timer"] = Timer({"start-up": perf_counter() - begun})
    options |= {"on_start": report.start, "on_step": report.step, "on_attempt": report.attempt}
    with report:
        outcome = solve_as_asked(scene, folder, comm, start=start, **options)
    report.finish(outcome)
    return scene, outcome
