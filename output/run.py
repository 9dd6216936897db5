"""A scene solved into a run folder: scene, history, fields for ParaView, contact, checkpoint,
run.json."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack, nullcontext
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

from archord.kernels.interrupt import Interrupt, Interrupted
from archord.kernels.stale_jit import without_stale_forms
from archord.output.checkpoint import halt, resume
from archord.output.checkpoint import write as write_checkpoint
from archord.output.files.disk import WriteError, replace_file
from archord.output.files.step_file import StepFile
from archord.output.folder import CHECKPOINT, clear, occupied
from archord.output.history import write_history
from archord.output.own_mesh import given_mesh, mesh_in_use, scene_text, write_mesh
from archord.output.ranks import agreed
from archord.output.restart import Start
from archord.output.run_json import Report, peak_memory
from archord.presets.account import Account, account_of
from archord.presets.edge import EdgeProfile
from archord.presets.measures import Work
from archord.report.timer import Timer
from archord.scene.file import AnyScene
from archord.solver.path.coarse_start import coarse_start
from archord.solver.path.load_path import Position
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.path.newton import Newton
from archord.solver.path.stepping import Step, StepFailure, StepRules, march
from archord.solver.path.system import System
from archord.solver.problem import Problem

if TYPE_CHECKING:
    from archord.geometry.meshes.plane_mesh import PlaneMesh


@dataclass
class Outcome:
    """How a run ended: ``status`` is "done", "stopped" or "interrupted" (``message`` says why), and
    its steps.

    ``signal`` interrupted it. ``warnings`` are known on rank 0 only, ``accuracy`` of a run that was
    asked for it (`studies.accuracy.Accuracy`).
    """

    folder: Path
    status: str
    message: str
    steps: list[Any]
    warnings: list[str]
    signal: int = 0
    accuracy: Any = None


def solve_scene(
    scene: AnyScene,
    folder: Path,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    problem: Problem | None = None,
    start: Start | None = None,
    timer: Timer | None = None,
    interrupt: Interrupt | None = None,
    on_start: Callable[[System], None] = lambda system: None,
    on_step: Callable[[Any], None] = lambda record: None,
    on_attempt: Callable[[float, int], None] = lambda load, iterations: None,
    on_iteration: Callable[[float, Newton], None] = lambda load, result: None,
) -> Outcome:
    """Solve ``scene`` and write everything to the existing ``folder`` (see `folder.claim_folder`).
    Collective.

    A ``problem`` from Python, of which the scene tells, is solved in the place of the scene.
    ``start``, needed on rank 0 only, continues the run in ``folder`` (see `restart`). ``on_start``,
    ``on_step`` and ``on_attempt(load, Newton iterations)`` report progress on every rank, and
    ``on_iteration(load, result)`` what the present solve did so far. ``timer`` has the seconds
    spent before. A step that cannot be solved, or a file that cannot be written, ends the run with
    status "stopped", Ctrl-C, SIGTERM and SIGHUP with "interrupted"; what was accepted before stays.
    ``interrupt``, if given, is one that the caller heeds, too. Raises `InputError` if another
    process solves into ``folder``, what is there cannot be continued, or the scene leaves the mesh
    to `studies.accuracy.solve_to_accuracy`.
    """
    timer = timer or Timer()
    begun = perf_counter() - sum(timer.seconds.values())
    with ExitStack() as stack:
        agreed(comm, lambda: bool(stack.enter_context(occupied(folder))))
        account = without_stale_forms(lambda: account_of(scene, comm, timer, problem))
        system = account.system
        system.solver.newton.watch = on_iteration
        on_start(system)
        output = _Output(folder, account, begun, start, problem)
        status, message, received = "done", "", 0
        failed: dict[str, Any] = {}
        try:
            with (
                nullcontext(interrupt)
                if interrupt
                else Interrupt() as system.equilibrium.evaluation.interrupt
            ):
                position, work = output.begin()
                # what a coarse mesh went through before a halt is not kept
                coarse = coarse_start(system) if position is None else None

                def target_done(step: Step, position: Position) -> None:
                    on_step(output.add(step, position, work))
                    if refused := account.refusal(output.steps):
                        raise StepFailure(refused, step)

                march(
                    system.load_path(position, coarse),
                    scene.targets,
                    rules=StepRules(**scene.stepping.model_dump()),
                    substep_done=lambda load: work.add(*account.driven()),
                    target_done=target_done,
                    attempted=on_attempt,
                )
        except StepFailure as failure:
            status, message, failed = (
                "stopped",
                str(failure),
                {"failed_step": asdict(failure.attempt)},
            )
        except WriteError as error:
            status, message = "stopped", str(error)
        except Interrupted as interrupted:
            status, message = "interrupted", f"{interrupted} after step {len(output.steps)}"
            received = interrupted.number
        told = account.work_doubts(output.steps)
        if status == "done":
            message, ending = account.ending(output.steps)
            told += ending
            status = "stopped" if message else status
        try:
            warnings = output.finish(told, status=status, message=message, **failed)
        except WriteError as error:
            status, message, warnings = (
                "stopped",
                message if status == "stopped" else str(error),
                [],
            )
        return Outcome(folder, status, message, output.steps, warnings, received)


class _Output:
    """Everything that a run writes; rank 0 writes, all ranks take part. Raises `WriteError` on all
    of them.

    A step counts once the checkpoint has it: the other files follow, and a run that goes on writes
    what they lack.
    """

    def __init__(
        self,
        folder: Path,
        account: Account,
        begun: float,
        start: Start | None,
        problem: Problem | None,
    ) -> None:
        self._problem = problem
        self.folder, self.account, self.system, self._start = folder, account, account.system, start
        comm = self.system.comm
        self._on_root = partial(agreed, comm)
        self._scene, self._last = scene_text(account.scene, folder), perf_counter()
        self.steps: list[Any] = comm.bcast(start.done if start else [])
        asked = account.scene.output
        self._at_points = asked.fields in ("nodes", "points")
        with self.system.timer("output"):
            self._order = MeshOrder(self.system)
            if asked.fields:
                from archord.output import fields as of_fields

                self._of_fields, self._mesh = (
                    of_fields,
                    of_fields.collect_mesh(self._order, self._at_points),
                )
        self._fields: Any = None  # a `FieldWriter` with the first step, on rank 0
        self._contact: StepFile | None = None
        if comm.rank == 0:
            self._report = Report(
                folder / "run.json", account, begun, self.steps, start.report if start else {}
            )

    def begin(self) -> tuple[Position | None, Work]:
        """Make the files, or write the step that the run goes on from, and give its state to the
        joint. Collective."""
        system = self.system
        if not system.comm.bcast(self._start is not None):
            mesh = given_mesh(self._problem, system.comm)
            self._on_root(lambda: self._make(mesh))
            return None, Work()
        with system.timer("checkpoint"):
            checkpoint = self._start.checkpoint if self._start else None
            known, step, position, work = resume(self._order, self.folder / CHECKPOINT, checkpoint)
        self._on_root(lambda: self._report.unseal())
        self._write(self.account.record(**known), step, self.account.profiles())
        self._on_root(lambda: replace_file(self.folder / "scene.toml", self._scene))
        return position, work

    def _make(self, given: PlaneMesh | None) -> None:
        clear(self.folder, kept=mesh_in_use(self.account.scene, self.folder))
        if given is not None:
            write_mesh(given, self.folder)
        replace_file(self.folder / "scene.toml", self._scene)
        write_history(self.folder / "history.csv", self.account.columns(), [])
        self._report.write()

    def add(self, step: Step, position: Position, work: Work) -> Any:
        """Write an accepted output step, and return its record. Collective."""
        account = self.account
        with self.system.timer("output"):
            profiles = account.profiles()
            seconds, self._last = perf_counter() - self._last, perf_counter()
            m = account.step(self.steps, step, profiles, work.total, seconds)
        with self.system.timer("checkpoint"):
            checkpoint = halt(self._order, self._scene, m, step, position, work)
            self._on_root(lambda: write_checkpoint(self.folder / CHECKPOINT, checkpoint))
        self._write(m, step, profiles)
        return m

    def _write(self, m: Any, step: Step, profiles: Mapping[str, EdgeProfile]) -> None:
        """Make ``m`` the last step of all files but the checkpoint. Collective."""
        account, after = self.account, len(self.steps)
        scene = account.scene
        with self.system.timer("output"):
            warnings = account.step_warnings(m, profiles, step.residual, self.steps)
            if scene.output.fields:
                fields = self._of_fields.collect_fields(self._order, self._at_points)

            def write() -> None:
                if scene.output.fields:
                    if not self._fields:
                        points = scene.output.fields == "points"
                        where = (self.folder, self._order, self._mesh)
                        self._fields = self._of_fields.FieldWriter(*where, after, points=points)
                    self._fields.write(m.at, fields)
                if not self._contact:
                    self._contact = StepFile(
                        self.folder / "contact.h5", _arrays(profiles, account.fixed), after
                    )
                self._contact.write(m.at, _arrays(profiles, account.per_step))
                write_history(self.folder / "history.csv", account.columns(), self.steps)
                self._report.add(step, warnings)

            self.steps.append(m)
            self._on_root(write)

    def finish(self, warnings: list[str], **ending: Any) -> list[str]:
        """Note how the run ended, with ``warnings`` beside those of the steps; returns all on rank
        0. Collective."""
        ending["peak_memory"] = self.system.comm.gather(peak_memory())
        found = self._on_root(lambda: self._report.finish(warnings, **ending))
        return found if self.system.comm.rank == 0 else []


def _arrays(profiles: Mapping[str, EdgeProfile], names: tuple[str, ...]) -> dict[str, Any]:
    """The arrays of all ``profiles`` that have these ``names``, as contact.h5 names them."""
    return {
        f"{side}/{name}": getattr(profile, name)
        for side, profile in profiles.items()
        for name in names
    }
