"""A scene solved into a run folder: scene.toml, history.csv, fields.xdmf/.h5, contact.h5, checkpoint.h5, run.json."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

from archord.output.checkpoint import RunState, halt, resume
from archord.output.checkpoint import write as write_checkpoint
from archord.output.contact import ContactWriter
from archord.output.disk import WriteError, naming, replace_file
from archord.output.folder import CHECKPOINT, clear, occupied
from archord.output.history import History
from archord.output.ranks import agreed
from archord.output.restart import Start
from archord.output.run_json import Report, peak_memory
from archord.output.stale_jit import without_stale_forms
from archord.presets.arc import ArcProfile
from archord.presets.joint import Joint
from archord.presets.joint_report import UNSEEN, step_warnings
from archord.presets.measures import Measures, Work, arc_profiles, measure
from archord.scene.file import resolved
from archord.scene.scene import Scene
from archord.solver.coarse_start import coarse_start
from archord.solver.interrupt import Interrupt, Interrupted
from archord.solver.load_path import Position
from archord.solver.mesh_order import MeshOrder
from archord.solver.stepping import Step, StepFailure, StepRules, march
from archord.solver.timer import Timer

if TYPE_CHECKING:
    from archord.output.fields import FieldWriter


@dataclass
class Outcome:
    """How a run ended: ``status`` is "done", "stopped" or "interrupted" (``message`` says why), and its steps.

    ``signal`` interrupted it. ``warnings`` are known on rank 0 only. ``unseen`` says that the mesh was too coarse to
    notice the contact, ``accuracy`` how accurate a run is that was asked for it (`studies.accuracy.Accuracy`).
    """

    folder: Path
    status: str
    message: str
    steps: list[Measures]
    warnings: list[str]
    signal: int = 0
    unseen: bool = False
    accuracy: Any = None


def solve_scene(
    scene: Scene,
    folder: Path,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    start: Start | None = None,
    debug: bool = False,
    timer: Timer | None = None,
    begun: float | None = None,
    interrupt: Interrupt | None = None,
    on_start: Callable[[Joint], None] = lambda joint: None,
    on_step: Callable[[Measures], None] = lambda measures: None,
    on_attempt: Callable[[float, int], None] = lambda load, iterations: None,
) -> Outcome:
    """Solve ``scene`` and write everything to the existing ``folder`` (see `folder.claim_folder`). Collective.

    ``start``, needed on rank 0 only, continues the run in ``folder`` (see `restart`). ``on_start``, ``on_step`` and
    ``on_attempt(load, Newton iterations)`` report progress on every rank. ``begun`` is the ``perf_counter`` from which
    the seconds count. ``debug`` writes the fields of a step that cannot be solved to debug.xdmf. A step that cannot be
    solved, or a file that cannot be written, ends the run with status "stopped", Ctrl-C, SIGTERM and SIGHUP with
    "interrupted"; what was accepted before stays. ``interrupt``, if given, is one that the caller heeds, too. Raises
    `InputError` if another process solves into ``folder``, what is there cannot be continued, or the scene leaves the
    mesh to `studies.accuracy.solve_to_accuracy`.
    """
    begun = perf_counter() if begun is None else begun
    with ExitStack() as stack:
        agreed(comm, lambda: bool(stack.enter_context(occupied(folder))), asleep=False)
        joint = without_stale_forms(lambda: Joint(scene, comm, timer=timer))
        on_start(joint)
        output = _Output(folder, joint, begun)
        status, message, failed, received = "done", "", None, 0
        try:
            with nullcontext(interrupt) if interrupt else Interrupt() as joint.equilibrium.interrupt:
                position, work = output.begin(start)
                # what a coarse mesh went through before a halt is not kept
                coarse = coarse_start(joint) if position is None else None

                def target_done(step: Step, position: Position) -> None:
                    on_step(output.add(step, position, work))

                march(
                    joint.load_path(position, coarse),
                    scene.targets,
                    rules=StepRules(**scene.stepping.model_dump()),
                    substep_done=lambda load: work.add(joint.delta(), joint.driving_force()),
                    target_done=target_done,
                    attempted=on_attempt,
                    gave_up=output.debug if debug else lambda load: None,
                )
        except StepFailure as failure:
            status, message, failed = "stopped", str(failure), failure.attempt
        except WriteError as error:
            status, message = "stopped", str(error)
        except Interrupted as interrupted:
            status, message = "interrupted", f"{interrupted} after step {len(output.steps)}"
            received = interrupted.number
        # pressed together, but no contact point ever noticed
        pressed, noticed = any(m.delta > 0 for m in output.steps), any(m.contact_area for m in output.steps)
        unseen = status == "done" and pressed and not noticed
        if unseen:
            status, message = "stopped", UNSEEN
        try:
            warnings = output.finish(status, message, failed)
        except WriteError as error:
            status, message, warnings = "stopped", message if status == "stopped" else str(error), []
        return Outcome(folder, status, message, output.steps, warnings, received, unseen)


class _Output:
    """Everything that a run writes; rank 0 writes, all ranks take part. Raises `WriteError` on all of them.

    A step counts once the checkpoint has it: the other files follow, and a run that goes on writes what they lack.
    """

    def __init__(self, folder: Path, joint: Joint, begun: float) -> None:
        self.folder, self.joint = folder, joint
        self.steps: list[Measures] = []
        self._begun = self._last = begun
        self._report: Report | None = None  # of rank 0
        self._on_root = partial(agreed, joint.comm, asleep=False)

    def begin(self, start: Start | None) -> tuple[Position | None, Work]:
        """Make the files, or open those of the run that goes on from ``start`` (known on rank 0) and give its state to
        the joint. Collective."""
        joint, comm = self.joint, self.joint.comm
        with joint.timer("output"):
            self._order = MeshOrder(joint)
            self.steps = comm.bcast(start.done if start else [])
            self._on_root(lambda: self._prepare(start))
            self._fields: FieldWriter | None = None
            if joint.scene.output.fields:
                from archord.output.fields import FieldWriter

                numbered = joint.scene.force_controlled or not joint.scene.monotonic
                self._fields = FieldWriter(self.folder, self._order, after=len(self.steps), numbered=numbered)
            self._on_root(self._write_scene)
        self._last = perf_counter()
        if not comm.bcast(start is not None):
            self._on_root(self._write_tables)
            return None, Work()
        with joint.timer("checkpoint"):
            at = resume(self._order, self.folder / CHECKPOINT, start.checkpoint if start else None)
        self._write(at.measures, at.step, arc_profiles(joint))
        return at.position, at.work

    def _prepare(self, start: Start | None) -> None:
        if start is None:
            with naming(self.folder):
                clear(self.folder)
            self._write_scene()
        before = start.report if start else None
        self._history = History(self.folder / "history.csv", self.joint.scene, self.steps)
        self._report = Report(self.folder / "run.json", self.joint, self._begun, self.steps, before)
        self._contact = ContactWriter(self.folder)

    def _write_scene(self) -> None:
        replace_file(self.folder / "scene.toml", resolved(self.joint.scene))

    def _write_tables(self) -> None:
        assert self._report is not None
        self._history.write()
        self._report.write()

    def add(self, step: Step, position: Position, work: Work) -> Measures:
        """Write an accepted output step, and return its measures. Collective."""
        joint = self.joint
        with joint.timer("output"):
            profiles = arc_profiles(joint)
            seconds, self._last = perf_counter() - self._last, perf_counter()
            largest = max((abs(m.P) for m in self.steps), default=0.0)
            m = measure(joint, len(self.steps) + 1, step, profiles, work, seconds, largest)
        with joint.timer("checkpoint"):
            checkpoint = halt(self._order, resolved(joint.scene), RunState(m, step, position, work))
            self._on_root(lambda: write_checkpoint(self.folder / CHECKPOINT, checkpoint))
        self._write(m, step, profiles)
        return m

    def _write(self, m: Measures, step: Step, profiles: dict[str, ArcProfile]) -> None:
        """Make ``m`` the last step of all files but the checkpoint. Collective."""
        warnings = step_warnings(self.joint, profiles, m, step.residual)

        def add() -> None:
            assert self._report is not None
            self._contact.write(m.step, m.delta, profiles)
            self._history.add(m)
            self._report.add(m, step, warnings)

        with self.joint.timer("output"):
            if self._fields is not None:
                self._fields.write(m.delta)
            self._note_memory()
            self._on_root(add)
        self.steps.append(m)

    def _note_memory(self) -> None:
        memory = self.joint.comm.gather(peak_memory())
        if self._report is not None:
            self._report.peak_memory = memory or []

    def debug(self, load: float) -> None:
        """Write the state that the last solve left, without success at ``load``. Collective."""
        from archord.output.fields import FieldWriter

        FieldWriter(self.folder, self._order, debug=True).write(load)

    def finish(self, status: str, message: str, failed: Step | None) -> list[str]:
        """Note how the run ended; returns the warnings on rank 0. Collective."""
        self._note_memory()
        found = self._on_root(lambda: self._report.finish(status, message, failed) if self._report else [])
        return found if self.joint.comm.rank == 0 else []
