"""A scene solved into a run folder: scene.toml, history.csv, fields.xdmf/.h5, contact.h5 and run.json."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from mpi4py import MPI

from archord.solver.contact_file import ContactWriter
from archord.solver.fields import FieldWriter
from archord.solver.history import History
from archord.solver.interrupt import Interrupt, Interrupted
from archord.solver.joint import Joint
from archord.solver.measures import Measures, Work, arc_profiles, measure
from archord.solver.report import Report
from archord.solver.run_folder import FILES
from archord.solver.scene import Scene
from archord.solver.scene_file import resolved
from archord.solver.stepping import Position, Step, StepFailure, march
from archord.solver.timer import Timer

_UNSEEN = (
    "no contact point was ever pressed, though delta was positive: the contact is smaller than the mesh can see; "
    "reduce joint.element_size or increase the load"
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
    output = _Output(folder, joint, begun)
    work = Work()

    def target_done(step: Step, position: Position) -> None:
        on_step(output.add(step, work))

    status, message, failed, received = "done", "", None, 0
    try:
        with Interrupt() as joint.equilibrium.interrupt:
            march(
                joint.equilibrium,
                scene.targets,
                joint.rigid_translation,
                rules=scene.stepping,
                substep_done=lambda load: work.add(joint.delta(), joint.forces()["pin"]),
                target_done=target_done,
                attempted=on_attempt,
            )
    except StepFailure as failure:
        status, message, failed = "stopped", str(failure), failure.attempt
    except Interrupted as interrupted:
        status, message, received = "interrupted", f"{interrupted} after step {len(output.steps)}", interrupted.number
    if status == "done" and output.unseen():
        status, message = "stopped", _UNSEEN
    warnings = output.finish(status, message, failed)
    return Outcome(folder, status, message, output.steps, warnings, received)


class _Output:
    """Everything that a run writes; rank 0 writes, all ranks take part."""

    def __init__(self, folder: Path, joint: Joint, begun: float) -> None:
        self.joint = joint
        self.steps: list[Measures] = []
        self._root = joint.comm.rank == 0
        n = len(joint.scene.targets)
        with joint.timer("output"):
            if self._root:
                for name in FILES:
                    (folder / name).unlink(missing_ok=True)
                (folder / "scene.toml").write_text(resolved(joint.scene), encoding="utf-8")
                self._history = History(folder / "history.csv", joint.scene)
                self._report = Report(folder / "run.json", joint, begun)
                self._report.write()
                self._contact = ContactWriter(folder, n)
            self._fields = FieldWriter(folder, joint, n)
        self._last = perf_counter()

    def add(self, step: Step, work: Work) -> Measures:
        """Write an accepted output step, and return its measures. Collective."""
        with self.joint.timer("output"):
            profiles = arc_profiles(self.joint)
            seconds, self._last = perf_counter() - self._last, perf_counter()
            largest = max((abs(m.P) for m in self.steps), default=0.0)
            m = measure(self.joint, len(self.steps) + 1, step, profiles, work, seconds, largest)
            self.steps.append(m)
            self._fields.write(m.step, m.delta)
            if self._root:
                self._contact.write(m.step, m.delta, profiles)
                self._history.add(m)
                self._report.add(m, step, profiles)
        return m

    def unseen(self) -> bool:
        """Whether the pin was pressed into the hole but no contact point ever noticed."""
        return max(m.delta for m in self.steps) > 0 and not any(m.contact_area for m in self.steps)

    def finish(self, status: str, message: str, failed: Step | None) -> list[str]:
        """Note how the run ended; returns the warnings on rank 0."""
        if not self._root:
            return []
        self._report.finish(status, message, failed)
        return self._report.content["warnings"]
