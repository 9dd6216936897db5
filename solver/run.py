"""A scene solved into a run folder: scene.toml, history.csv, fields.xdmf/.h5, contact.h5 and run.json."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from mpi4py import MPI

from archord.solver.checkpoint import collect, write_together
from archord.solver.contact_file import ContactWriter
from archord.solver.contact_profile import ArcProfile
from archord.solver.disk import WriteError, naming, on_root, replace_text
from archord.solver.fields import FieldWriter
from archord.solver.history import History
from archord.solver.interrupt import Interrupt, Interrupted
from archord.solver.joint import Joint
from archord.solver.measures import Measures, Work, arc_profiles, measure
from archord.solver.mesh_order import MeshOrder
from archord.solver.report import Report
from archord.solver.run_folder import CHECKPOINT, clear
from archord.solver.scene import Scene
from archord.solver.scene_file import resolved
from archord.solver.stepping import Step, StepFailure, march
from archord.solver.timer import Timer

_UNSEEN = (
    "no contact point is pressed, even at the largest delta: the contact is smaller than the mesh can see; reduce "
    "joint.element_size or increase load.displacement"
)


@dataclass
class Outcome:
    """How a run ended: ``status`` is "done", "stopped" or "interrupted" (``message`` says why), and its steps.

    ``signal`` interrupted it. ``warnings`` are known on rank 0 only.
    """

    folder: Path
    status: str
    message: str
    steps: list[Measures]
    warnings: list[str]
    signal: int = 0


def solve_scene(
    scene: Scene,
    folder: Path,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    timer: Timer | None = None,
    begun: float | None = None,
    on_start: Callable[[Joint], None] = lambda joint: None,
    on_step: Callable[[Measures], None] = lambda measures: None,
    on_attempt: Callable[[float, int], None] = lambda load, iterations: None,
) -> Outcome:
    """Solve ``scene`` and write everything to the existing ``folder`` (see `run_folder.claim_folder`). Collective.

    ``on_start``, ``on_step`` and ``on_attempt(load, Newton iterations)`` report progress on every rank. ``begun`` is
    the ``perf_counter`` from which the seconds count. A step that cannot be solved ends the run with status "stopped",
    Ctrl-C, SIGTERM and SIGHUP with "interrupted"; what was accepted before stays.
    """
    begun = perf_counter() if begun is None else begun
    joint = Joint(scene, comm, timer=timer)
    on_start(joint)
    work = Work()
    n = scene.load.steps

    def target_done(step: Step) -> None:
        on_step(output.add(step, work))

    try:
        output = _Output(folder, joint, begun)
    except WriteError as error:
        return Outcome(folder, "stopped", str(error), [], [])
    status, message, failed, received = "done", "", None, 0
    try:
        with Interrupt() as joint.equilibrium.interrupt:
            march(
                joint.equilibrium,
                [scene.target * k / n for k in range(1, n)] + [scene.target],
                joint.rigid_translation,
                max_cutbacks=scene.load.max_cutbacks,
                substep_done=lambda load: work.add(joint.delta(), joint.forces()["pin"]),
                target_done=target_done,
                attempted=on_attempt,
            )
    except StepFailure as failure:
        status, message, failed = "stopped", str(failure), failure.attempt
    except WriteError as error:
        status, message = "stopped", str(error)
    except Interrupted as interrupted:
        status, message, received = "interrupted", f"{interrupted} after step {len(output.steps)}", interrupted.number
    if status == "done" and not joint.contact.n_active():
        status, message = "stopped", _UNSEEN
    try:
        warnings = output.finish(status, message, failed)
    except WriteError as error:
        status, message, warnings = "stopped", message or str(error), []
    return Outcome(folder, status, message, output.steps, warnings, received)


class _Output:
    """Everything that a run writes; rank 0 writes, all ranks take part. Raises `WriteError` on all of them.

    A step counts once the checkpoint has it: the other files follow, and a run that goes on writes its last step anew.
    """

    def __init__(self, folder: Path, joint: Joint, begun: float) -> None:
        self.folder, self.joint = folder, joint
        self.steps: list[Measures] = []
        self._scene = resolved(joint.scene)
        with joint.timer("output"):
            self._order = MeshOrder(joint)
            on_root(joint.comm, lambda: self._begin(begun))
            self._fields = FieldWriter(folder, self._order, joint.scene.load.steps)
        self._last = perf_counter()

    def _begin(self, begun: float) -> None:
        with naming(self.folder):
            clear(self.folder)
        replace_text(self.folder / "scene.toml", self._scene)
        self._history = History(self.folder / "history.csv", self.joint.scene)
        self._history.write()
        self._report = Report(self.folder / "run.json", self.joint, begun)
        self._report.write()
        self._contact = ContactWriter(self.folder, self.joint.scene.load.steps)

    def add(self, step: Step, work: Work) -> Measures:
        """Write an accepted output step, and return its measures. Collective."""
        joint = self.joint
        with joint.timer("output"):
            profiles = arc_profiles(joint)
            seconds, self._last = perf_counter() - self._last, perf_counter()
            m = measure(joint, len(self.steps) + 1, step, profiles, work, seconds)
        with joint.timer("checkpoint"):
            state = {"displacement": joint.equilibrium.displacement()}
            checkpoint = collect(self._order, m.step, self._scene, state, {"work": vars(work)})
            write_together(self._order, self.folder / CHECKPOINT, checkpoint)
        with joint.timer("output"):
            self._fields.write(m.step, m.delta)
            on_root(joint.comm, lambda: self._add(m, step, profiles))
        self.steps.append(m)
        return m

    def _add(self, m: Measures, step: Step, profiles: dict[str, ArcProfile]) -> None:
        self._contact.write(m.step, m.delta, profiles)
        self._history.add(m)
        self._report.add(m, step, profiles)

    def finish(self, status: str, message: str, failed: Step | None) -> list[str]:
        """Note how the run ended; returns the warnings on rank 0. Collective."""
        on_root(self.joint.comm, lambda: self._report.finish(status, message, failed))
        return self._report.content["warnings"] if self.joint.comm.rank == 0 else []
