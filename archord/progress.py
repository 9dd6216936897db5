"""A solve and its progress on rank 0: a bar on a terminal, plain lines otherwise."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

from archord.ranks import on_terminal
from archord.scene.errors import InputError
from archord.scene.file import AnyScene
from archord.scene.problem import ProblemScene
from archord.scene.scene import Scene

_LOADS_SHOWN = 3

if TYPE_CHECKING:
    from mpi4py import MPI

    from archord.output.restart import Start
    from archord.output.run import Outcome
    from archord.studies.accuracy import Level


class JointView:
    """What is shown of a joint."""

    heading = " delta/dR     P/(E* R)   eps/deg   p0/E*      PEEQ max"

    def __init__(self, scene: Scene) -> None:
        self.dR, self.E_star = scene.joint.dR, scene.E_star
        self.force_unit = scene.E_star * scene.joint.radius * scene.thickness
        kind = "elastic-plastic" if scene.plastic else "elastic"
        self.title = f"{kind} joint, plane {scene.analysis.plane}, dR/R = {self.dR / scene.joint.radius:g}"
        self.load = "P" if scene.force_controlled else "delta"
        self.last, self.unit = ("delta/dR", self.dR) if scene.force_controlled else ("P/(E* R)", self.force_unit)

    def short(self, m: Any) -> str:
        """A step in few words."""
        return f"delta/dR {m.delta / self.dR:.4g}, P/(E* R) {m.P / self.force_unit:.6g}"

    def row(self, m: Any) -> str:
        """A step as a row."""
        P = round(m.P / self.force_unit, 7) + 0.0  # no minus before a zero
        angle, p0 = math.degrees(m.eps), m.p0 / self.E_star
        return f"{m.delta / self.dR:9.5g}  {P:11.7f}  {angle:8.3f}  {p0:9.6f}  {m.peeq_max:9.2e}"


class ProblemView:
    """What is shown of a general problem: displacement and force of each load."""

    load, last, unit = "load factor", "last value", 1.0

    def __init__(self, scene: ProblemScene) -> None:
        kind = "elastic-plastic" if scene.plastic else "elastic"
        bodies = "1 body" if len(scene.body) == 1 else f"{len(scene.body)} bodies"
        self.title = f"{bodies}, {kind}, plane {scene.analysis.plane}"
        loads = [load.name for load in scene.load][:_LOADS_SHOWN]
        self.columns = [f"{name} {what}" for name in loads for what in ("displacement", "force")]
        self.heading = "  ".join(["load factor", *(f"{name:>14s}" for name in self.columns), " PEEQ max"])

    def short(self, m: Any) -> str:
        """A step in few words."""
        return f"load factor {m.at:.4g}, {self.columns[1]} {m.values[self.columns[1]]:.6g}"

    def row(self, m: Any) -> str:
        """A step as a row."""
        largest = max((value for name, value in m.values.items() if name.endswith("peeq_max")), default=0.0)
        shown = (f"{m.values[name]:{max(14, len(name))}.6g}" for name in self.columns)
        return "  ".join([f"{m.at:11.5g}", *shown, f"{largest:9.2e}"])


class Progress:
    """Reports steps as they are accepted; of a scene with an accuracy mesh after mesh, and off a terminal only the
    steps of the last one, at the end. ``done`` steps are there already."""

    def __init__(self, scene: AnyScene, silent: bool, done: int = 0) -> None:
        self.view = JointView(scene) if isinstance(scene, Scene) else ProblemView(scene)
        self.scene, self.by_mesh = scene, scene.analysis.accuracy is not None
        self.silent, self.shown = silent, not silent and on_terminal()  # shown: as a bar
        if self.shown:
            from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
            from rich.progress import Progress as Bar

            columns = (MofNCompleteColumn(), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
            self._bar = Bar(TextColumn("step"), *columns)
            self._task = self._bar.add_task("meshing", total=len(scene.targets), completed=done)
        if self.by_mesh:
            self.print(f"{self.view.title}: {scene.accurate} to {scene.analysis.accuracy:g} of its largest value")
            costs = f"substeps     dofs  {self.view.last:>10s}  error of mesh  error of steps  seconds"
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
            self.print(f"{self.view.title}: {joint.n_cells} {joint.cell_kind}, {joint.n_dofs} dofs, {ranks}")
            self._print_heading()
        elif self.shown:
            self._bar.reset(self._task, description=f"{joint.n_dofs} dofs")

    def attempt(self, load: float, iterations: int) -> None:
        """Show a solve that ended."""
        self.update(f"{self.view.load} = {load:.6g}, {iterations} iterations")

    def step(self, m) -> None:
        """Show an accepted output step."""
        self.update(f"{self.view.short(m)}, {m.iterations} iterations", advance=1)
        if not self.by_mesh:
            self._print_step(m)

    def level(self, level: Level) -> None:
        """Show a mesh that is solved."""
        mesh, steps = ("" if e is None else f"{e:.1e}" for e in (level.mesh_error, level.step_error))
        self.print(
            f"{level.mesh:5d}  {level.element_size:10.4g}  {level.growth:6.4g}  {level.substeps:8d}  {level.dofs:7d}  "
            f"{level.last / self.view.unit:10.7f}  {mesh:>13s}  {steps:>14s}  {level.seconds:7.1f}"
        )

    def finish(self, outcome: Outcome) -> None:
        """Show what is known only now."""
        if self.by_mesh:
            self._print_heading()
            for m in outcome.steps:
                self._print_step(m)

    def _print_heading(self) -> None:
        if not self.shown:
            self.print(f" step  {self.view.heading}  iterations  cutbacks")

    def _print_step(self, m) -> None:
        if not self.shown:
            self.print(f"{m.step:5d}  {self.view.row(m)}  {m.iterations:10d}  {m.cutbacks:8d}")


def solve_and_report(
    load: Callable[[], AnyScene],
    folder: Path,
    comm: MPI.Comm,
    *,
    force: bool,
    silent: bool,
    start: Start | None = None,
    begun: float | None = None,
    **options: Any,
) -> tuple[AnyScene, Outcome]:
    """Solve the scene that ``load`` gives rank 0 into ``folder``, claimed by ``force`` if it has to be, or go on from
    ``start``, and report it on rank 0 unless ``silent``. Collective.

    If this process is for it alone, it has ``begun`` at that time of `perf_counter`.
    """
    from archord.output.folder import claim_folder
    from archord.output.ranks import agreed

    def claimed() -> tuple[AnyScene, bool]:
        scene, new = load(), not folder.exists()
        claim_folder(folder, force)
        return scene, new

    scene, new = agreed(comm, claimed)
    from archord.report.timer import Timer
    from archord.studies.accuracy import solve_as_asked  # with all of dolfinx: bad input is told before

    report = Progress(scene, silent or comm.rank != 0, start.checkpoint.step if start else 0)
    if report.by_mesh:
        options["on_level"] = report.level
    elif begun is not None:
        options["timer"] = Timer({"start-up": perf_counter() - begun})
    options |= {"on_start": report.start, "on_step": report.step, "on_attempt": report.attempt}
    try:
        with report:
            outcome = solve_as_asked(scene, folder, comm, start=start, **options)
    except InputError:  # found by the mesh: nothing is left of a scene that is refused
        if new and comm.rank == 0:
            with suppress(OSError):
                folder.rmdir()
        raise
    report.finish(outcome)
    return scene, outcome
