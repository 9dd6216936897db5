"""A solve and its progress on rank 0: a line for every step, and on a terminal one that moves until
the next."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext, suppress
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import TYPE_CHECKING, Any

from archord.commands.options import warn
from archord.commands.ranks import on_terminal
from archord.presets.views import view_of
from archord.report.errors import InputError
from archord.scene.file import AnyScene

_LONG_SILENCE = 20.0  # seconds after which a solve that has said nothing says where it is
_LONG_STEP = 5.0  # seconds that a step takes at least which is told to be long
_MUCH_LONGER = 20.0  # times the median of the steps before it
_ENOUGH_STEPS = 3  # that a median is made of
_LARGE = 50_000  # cells from which every phase before the first step is told

if TYPE_CHECKING:
    from mpi4py import MPI

    from archord.output.restart import Start
    from archord.output.run import Outcome
    from archord.solver.path.newton import Newton
    from archord.studies.accuracy import Level


class Progress:
    """Reports steps as they are accepted; of a scene with an accuracy mesh after mesh, and only the
    steps of the last one, at the end."""

    def __init__(self, scene: AnyScene, silent: bool, verbose: bool = False) -> None:
        self.silent = silent
        self.verbose = verbose and not silent
        self.by_mesh = scene.analysis.accuracy is not None
        self.iterations = 0
        self._done = 0
        self._substep = 1
        self._seconds: list[float] = []
        self._begun = self._spoken = perf_counter()
        self.materials = scene.materials
        self.moving = None
        if not silent and on_terminal():
            from rich.progress import Progress as Moving
            from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

            self.moving = Moving(
                SpinnerColumn(),
                TextColumn("{task.description}"),
                TimeElapsedColumn(),
                transient=True,
            )
            self.moving.add_task("meshing", total=None)
        self.cells = 0.0 if self.by_mesh else scene.expected_cells
        view = view_of(scene)
        self.title = view.title
        self.columns = view.printed
        last, self.unit = view.last_value
        if self.by_mesh:
            self.print(
                f"{self.title}: {scene.accurate} to {scene.analysis.accuracy:g} of its largest "
                "value"
            )
            self.strengths()
            costs = f"substeps     dofs  {last:>10s}  error of mesh  error of steps  seconds"
            self.print(f" mesh  {view.size_heading:>10s}  growth  {costs}")

    def show(self, load: float, iterations: int) -> None:
        """Show on a terminal the load that was tried last, and the Newton iterations so far."""
        self.iterations += iterations
        self._substep += 1
        self.move(f"load {load:.6g}, {self.iterations} Newton iterations")

    def iterate(self, load: float, result: Newton) -> None:
        """Show where the present solve is: moving on a terminal; by a line of each iteration if
        ``verbose``, and where nothing was said for long."""
        if self.silent:
            return
        seconds = perf_counter() - self._begun
        said = (
            f"step {self._done + 1}, attempt {self._substep}, load {load:.6g}, iteration "
            f"{len(result.residuals) - 1}, residual {result.residuals[-1]:.1e}, "
            f"{result.active_set_changes[-1]} points changed, "
        )
        if result.krylov_iterations:
            said += f"{result.krylov_iterations} GMRES iterations, "
        said += f"{seconds:.0f} s"
        self.move(said)
        long_silent = self.moving is None and perf_counter() - self._spoken > _LONG_SILENCE
        if self.verbose or long_silent:
            self.print(f"      {said}")

    def move(self, said: str, at_once: bool = False) -> None:
        """Show on a terminal what is being done: with the next picture, or ``at_once``."""
        if self.moving is not None:
            self.moving.update(self.moving.task_ids[0], description=said, refresh=at_once)

    def phase(self, name: str) -> None:
        """Show a phase before the first load is tried: on a terminal, or of a large mesh by a
        line."""
        said = {"mesh": "meshing", "setup": "setting up"}.get(name)
        if said is None:
            return
        if name == "mesh" and self.cells:
            said += f" about {float(f'{self.cells:.2g}'):.0f} triangles"
        self.move(said, at_once=True)
        if self.moving is None and self.cells > _LARGE:
            self.print(f"{said} ...")

    def print(self, text: str) -> None:
        """Print a line."""
        if not self.silent:
            print(text, flush=True)
            self._spoken = perf_counter()

    def strengths(self) -> None:
        """Say where each body yields."""
        for name, found in self.materials.items():
            if found["yield_stress"] is not None:
                self.print(f"{name} {found['strength']}")

    def start(self, system: Any) -> None:
        """Say what is going to be solved."""
        ranks = f"{system.comm.size} rank{'s' if system.comm.size > 1 else ''}"
        self.print(
            f"{self.title}: {system.n_cells} {system.cell_kind}, {system.n_dofs} dofs, {ranks}"
        )
        self.strengths()
        self.headings()

    def level(self, level: Level) -> None:
        """Show a mesh that is solved."""
        mesh, steps = (
            "" if e is None else f"{e:.1e}" for e in (level.mesh_error, level.step_error)
        )
        self.print(
            f"{level.mesh:5d}  {level.element_size:10.4g}  {level.growth:6.4g}  "
            f"{level.substeps:8d}  {level.dofs:7d}  {level.last / self.unit:10.7f}  {mesh:>13s}  "
            f"{steps:>14s}  {level.seconds:7.1f}"
        )

    def headings(self) -> None:
        """Print the headings of steps."""
        headings = [f"{column.heading:>{column.width}s}" for column in self.columns]
        self.print("  ".join([" step", *headings, "iterations  cutbacks"]))

    def step(self, m: Any) -> None:
        """Show an accepted output step."""
        cells = [f"{column.value(m):{column.form}}" for column in self.columns]
        cost = [f"{m.iterations:10d}", f"{m.cutbacks:8d}"]
        self.print("  ".join([f"{m.step:5d}", *cells, *cost]))
        self._done = m.step
        self._substep = 1
        self._warn_of_long(m)
        self._seconds.append(m.seconds)

    def _warn_of_long(self, m: Any) -> None:
        """Warn of a step that took much longer than the steps before it."""
        if self.silent or len(self._seconds) < _ENOUGH_STEPS or m.seconds < _LONG_STEP:
            return
        usual = median(self._seconds)
        if m.seconds > _MUCH_LONGER * usual:
            warn(
                f"step {m.step} took {m.seconds:.0f} s, {m.seconds / usual:.0f} "
                f"times the median of the steps before it: {m.iterations} iterations and "
                f"{m.cutbacks} cutbacks; smaller steps may be quicker"
            )


def solve_and_report(
    load: Callable[[], AnyScene],
    folder: Path,
    comm: MPI.Comm,
    *,
    force: bool,
    silent: bool,
    verbose: bool = False,
    start: Start | None = None,
    begun: float | None = None,
    **options: Any,
) -> tuple[AnyScene, Outcome]:
    """Solve the scene that ``load`` gives rank 0 into ``folder``, claimed by ``force`` if it has to
    be, or go on from ``start``, and report it on rank 0 unless ``silent``, each iteration if
    ``verbose``. Collective.

    If this process is for it alone, it has ``begun`` at that time of `perf_counter`.
    """
    from archord.output.folder import claim_folder
    from archord.output.ranks import agreed

    def claimed() -> tuple[AnyScene, list[Path]]:
        scene = load()
        made = [path for path in (folder, *folder.parents) if not path.exists()]
        claim_folder(folder, force)
        return scene, made

    scene, made = agreed(comm, claimed)
    from archord.report.timer import Timer
    from archord.studies.accuracy import (
        solve_to_accuracy,
    )  # with all of dolfinx: bad input is told before

    report = Progress(scene, silent or comm.rank != 0, verbose)
    options |= {"on_attempt": report.show, "on_iteration": report.iterate}
    if report.by_mesh:
        options["on_level"] = report.level
    else:
        options |= {"on_start": report.start, "on_step": report.step}
        seconds = {"start-up": perf_counter() - begun} if begun is not None else {}
        options["timer"] = Timer(seconds, entered=report.phase)
    try:
        with report.moving or nullcontext():
            outcome = solve_to_accuracy(scene, folder, comm, start=start, **options)
    except InputError:  # found by the mesh: nothing is left of a scene that is refused
        if comm.rank == 0:
            with suppress(OSError):
                for path in made:
                    path.rmdir()
        raise
    if report.by_mesh:
        report.headings()
        for m in outcome.steps:
            report.step(m)
    return scene, outcome
