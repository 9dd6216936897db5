"""A scene solved into a run folder: scene, history, fields for ParaView, contact, checkpoint,
run.json."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

from archord.geometry.meshes.quality import worst_cells
from archord.kernels.interrupt import Interrupt, Interrupted
from archord.measures.account import Account
from archord.measures.edge import EdgeProfile
from archord.measures.energies import Work
from archord.measures.record import Record
from archord.output.cell_fields import CellField
from archord.output.checkpoint import halt, resume
from archord.output.checkpoint import write as write_checkpoint
from archord.output.files.disk import WriteError, replace_file
from archord.output.files.step_file import StepFile
from archord.output.folder import CHECKPOINT, clear, occupied
from archord.output.history import write_history
from archord.output.own_mesh import given_mesh, mesh_in_use, scene_text, write_mesh
from archord.output.ranks import agreed
from archord.output.restart import Start, require_balance, require_same_sides
from archord.output.run_json import Report, peak_memory
from archord.presets.account import account_of
from archord.report.by_name import ByName, Names
from archord.report.timer import Timer
from archord.scene.file import AnyScene
from archord.solver.contact.quadrature import points_by
from archord.solver.path.coarse_start import coarse_start
from archord.solver.path.load_path import Position
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.path.newton import Newton
from archord.solver.path.stepping import Step, StepFailure, StepRules, march
from archord.solver.path.system import System
from archord.solver.problem import Problem

if TYPE_CHECKING:
    from archord.geometry.meshes.mesh_arrays import MeshArrays

_SECONDS_BETWEEN_TABLES = 1.0  # of a run without checkpoints


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
    steps: list[Record]
    warnings: list[str]
    signal: int = 0
    accuracy: Any = None


def solve_scene(
    scene: AnyScene,
    folder: Path,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    problem: Problem | None = None,
    own_fields: Sequence[CellField] = (),
    start: Start | None = None,
    timer: Timer | None = None,
    interrupt: Interrupt | None = None,
    on_start: Callable[[System], None] = lambda system: None,
    on_step: Callable[[Record], None] = lambda record: None,
    on_attempt: Callable[[float, int], None] = lambda load, iterations: None,
    on_iteration: Callable[[float, Newton], None] = lambda load, result: None,
) -> Outcome:
    """Solve ``scene`` and write everything to the existing ``folder`` (see `folder.claim_folder`).
    Collective.

    A ``problem`` from Python is solved in the place of the scene, which tells about it.
    ``own_fields`` are written beside the fields of `CELL_FIELDS`.
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
        begun_by = comm.bcast(start.checkpoint.contact_points if start else None)
        if begun_by:
            stack.enter_context(points_by(begun_by))
        account = account_of(scene, comm, timer, problem)
        before = start.report if start else {}
        agreed(comm, partial(require_same_sides, folder, before, account.system))
        account.system.solver.newton.watch = on_iteration
        on_start(account.system)
        output = _Output(folder, account, begun, start, problem, own_fields)
        watched = nullcontext(interrupt) if interrupt else Interrupt()
        status = "done"
        message = ""
        failed = {}
        received = 0
        try:
            with watched as account.system.equilibrium.evaluation.interrupt:
                _follow(account, output, on_step, on_attempt)
        except StepFailure as failure:
            status = "stopped"
            message = str(failure)
            failed["failed_step"] = asdict(failure.attempt)
        except WriteError as error:
            status = "stopped"
            message = str(error)
        except Interrupted as interrupted:
            status = "interrupted"
            message = f"{interrupted} after step {len(output.steps)}"
            received = interrupted.number
        warnings = account.work_doubts(output.steps)
        if status == "done":
            message, of_ending = account.ending(output.steps)
            warnings += of_ending
            status = "stopped" if message else status
        try:
            warnings = output.finish(warnings, status=status, message=message, **failed)
        except WriteError as error:
            message = message if status == "stopped" else str(error)
            status = "stopped"
            warnings = []
        return Outcome(folder, status, message, output.steps, warnings, received)


def _follow(
    account: Account,
    output: _Output,
    on_step: Callable[[Record], None],
    on_attempt: Callable[[float, int], None],
) -> None:
    """Follow the load path to its end, and write every output step. Collective."""
    scene = account.scene
    position, work = output.begin()
    # what a coarse mesh went through before a halt is not kept
    coarse = coarse_start(account.system) if position is None else None

    def target_done(step: Step, position: Position) -> None:
        on_step(output.add(step, position, work))
        if refused := account.refusal(output.steps):
            raise StepFailure(refused, step)

    march(
        account.system.load_path(position, coarse),
        scene.targets,
        rules=StepRules(**scene.stepping.model_dump()),
        substep_done=lambda load: work.add(*account.driven()),
        target_done=target_done,
        attempted=on_attempt,
    )


class _Output:
    """Everything that a run writes; rank 0 writes, all ranks take part. Raises `WriteError` on all
    of them.

    A step counts once the checkpoint has it. Its arrays are on disk by then: what is evaluated from
    an accepted state once more differs from them, where laws and materials of own classes depend on
    the length of the step. The tables follow, and a run that goes on writes what they lack.
    A run without checkpoints never goes on: its tables follow once a second, and when it ends.
    """

    def __init__(
        self,
        folder: Path,
        account: Account,
        begun: float,
        start: Start | None,
        problem: Problem | None,
        own_fields: Sequence[CellField],
    ) -> None:
        self.folder = folder
        self.account = account
        self.system = account.system
        self._problem = problem
        comm = self.system.comm
        self.steps: list[Record] = comm.bcast(start.done if start else [])
        self._start = start
        self._on_root = partial(agreed, comm)
        self._scene = scene_text(account.scene, folder)
        self._last = perf_counter()
        self._tables_written = self._last
        self._fields: Any = None  # a `FieldWriter` with the first step, on rank 0
        self._contact: StepFile | None = None
        asked = account.scene.output.fields
        self._at_points = asked in ("nodes", "points")
        self._own_fields = own_fields
        with self.system.timer("output"):
            self._order = MeshOrder(self.system)
            if asked:
                from archord.output import fields

                self._of_fields = fields
                self._mesh = fields.collect_mesh(self._order, self._at_points)
        worst = worst_cells(self.system.problem.mesh.mesh)
        if comm.rank == 0:
            before = start.report if start else {}
            self._report = Report(folder / "run.json", account, worst, begun, self.steps, before)

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
            m, step, position, work = resume(self._order, self.folder / CHECKPOINT, checkpoint)
        # laws of own classes may depend on the length of the step, and points that had to stay on
        # their facets are let go
        had_to_hold = any(attempt.held for attempt in step.attempts)
        if self._problem is None and not had_to_hold:
            require_balance(self.folder, m.step, system)
        self._on_root(lambda: self._report.unseal())
        profiles = self.account.profiles()
        self._write_arrays(m, profiles)
        self._write_tables(m, step, profiles)
        self._on_root(lambda: replace_file(self.folder / "scene.toml", self._scene))
        return position, work

    def _make(self, given: MeshArrays | None) -> None:
        clear(self.folder, kept=mesh_in_use(self.account.scene, self.folder))
        if given is not None:
            write_mesh(given, self.folder)
        replace_file(self.folder / "scene.toml", self._scene)
        self._replace_tables()

    def add(self, step: Step, position: Position, work: Work) -> Record:
        """Write an accepted output step, and return its record. Collective."""
        with self.system.timer("output"):
            profiles = self.account.profiles()
            now = perf_counter()
            seconds = now - self._last
            self._last = now
            m = self.account.step(self.steps, step, profiles, work.total, seconds)
        self._write_arrays(m, profiles)
        if self.account.scene.output.checkpoint:
            with self.system.timer("checkpoint"):
                checkpoint = halt(self._order, self._scene, m, step, position, work)
                self._on_root(lambda: write_checkpoint(self.folder / CHECKPOINT, checkpoint))
        self._write_tables(m, step, profiles)
        return m

    def _write_arrays(self, m: Record, profiles: Mapping[str, EdgeProfile]) -> None:
        """Make ``m`` the last step of the files of fields and contact. Collective."""
        output = self.account.scene.output
        before = len(self.steps)
        with self.system.timer("output"):
            fields = None
            if output.fields:
                order = self._order
                fields = self._of_fields.collect_fields(order, self._at_points, self._own_fields)

            def write() -> None:
                if output.fields:
                    self._write_fields(m.at, fields, before)
                if output.contact:
                    self._write_contact(m.at, profiles, before)

            self._on_root(write)

    def _write_tables(self, m: Record, step: Step, profiles: Mapping[str, EdgeProfile]) -> None:
        """Make ``m`` the last step of history.csv and run.json. Collective."""
        account = self.account
        with self.system.timer("output"):
            warnings = account.step_warnings(m, profiles, step.residual, self.steps)
            self.steps.append(m)

            def write() -> None:
                self._report.add(step, warnings)
                waiting = perf_counter() - self._tables_written
                if account.scene.output.checkpoint or waiting > _SECONDS_BETWEEN_TABLES:
                    self._replace_tables()

            self._on_root(write)

    def _replace_tables(self) -> None:
        """Make history.csv and run.json have all steps so far."""
        write_history(self.folder / "history.csv", self.account.columns, self.steps)
        self._report.write()
        self._tables_written = perf_counter()

    def _write_fields(self, load: float, fields: Any, before: int) -> None:
        """Add a step to the files of fields, which hold so many steps ``before`` it."""
        if not self._fields:
            points = self.account.scene.output.fields == "points"
            where = (self.folder, self._order, self._mesh)
            self._fields = self._of_fields.FieldWriter(*where, before, points=points)
        self._fields.write(load, fields)

    def _write_contact(self, load: float, profiles: Mapping[str, EdgeProfile], before: int) -> None:
        """Add a step to contact.h5, which holds so many steps ``before`` it."""
        account = self.account
        if not self._contact:
            fixed = _arrays(profiles, account.fixed)
            self._contact = StepFile(self.folder / "contact.h5", fixed, before)
        self._contact.write(load, _arrays(profiles, account.per_step))

    def finish(self, warnings: list[str], **ending: Any) -> list[str]:
        """Note how the run ended, with ``warnings`` beside the steps' own; returns all on rank
        0. Collective."""
        ending["peak_memory"] = self.system.comm.gather(peak_memory())

        def finish() -> list[str]:
            write_history(self.folder / "history.csv", self.account.columns, self.steps)
            return self._report.finish(warnings, **ending)

        found = self._on_root(finish)
        return found if self.system.comm.rank == 0 else []


def _arrays(profiles: Mapping[str, EdgeProfile], names: Names) -> ByName:
    """The arrays of all ``profiles`` that have these ``names``, as contact.h5 names them."""
    return {
        f"{side}/{name}": getattr(profile, name)
        for side, profile in profiles.items()
        for name in names
    }
