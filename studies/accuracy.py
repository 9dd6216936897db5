"""A scene solved to an accuracy: on ever finer meshes, in short enough steps, until the estimated
error is below it.

What is estimated is the error of P at the output steps, over the largest; of delta, if the load is
a force. Mesh and steps err independently. The steps of a plastic joint, and of one with friction,
are chosen first, where that is cheap, on the coarsest mesh; then meshes follow until both errors
together are small enough. Each mesh is an ordinary run, and the last one stays.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import asdict, dataclass, replace
from itertools import count
from pathlib import Path
from time import perf_counter
from typing import Any

from mpi4py import MPI

from archord.kernels.interrupt import Interrupt, Interrupted
from archord.output.files.disk import WriteError, replace_file
from archord.output.files.seal import read_report, report_text
from archord.output.ranks import agreed
from archord.output.restart import Start
from archord.output.run import Outcome, solve_scene
from archord.postprocess.judgement.convergence import Curve, mesh_error, richardson, step_error
from archord.presets.joint_doubts import UNSEEN
from archord.presets.views import view_of
from archord.report.by_name import ByName
from archord.report.errors import InputError
from archord.scene.file import AnyScene
from archord.solver.path.system import System

MOST_SUBSTEPS = 64
_ORDER_WITH_FRICTION = 0.5  # of the error of steps, at least (docs/accuracy.md)


@dataclass(frozen=True)
class Level:
    """One mesh, solved.

    ``element_size`` is over R, of a file over the size of its cells. ``last`` is the last value of
    P, or of delta under a force. Beside them stand what it cost, and the errors that were estimated
    with it, if any. ``cutbacks`` count steps that were shorter than the ``substeps`` say, as they
    did not converge.
    """

    mesh: int
    element_size: float
    growth: float
    substeps: int
    dofs: int
    last: float
    seconds: float
    iterations: int
    mesh_error: float | None = None
    step_error: float | None = None
    cutbacks: int = 0


@dataclass(frozen=True)
class Accuracy:
    """What was ``asked`` and is ``estimated`` (None if unknown) of the last level: errors of mesh
    and steps, added."""

    asked: float
    estimated: float | None
    mesh_error: float | None
    step_error: float | None
    substeps: int
    seconds: float
    levels: tuple[Level, ...]


def solve_to_accuracy(
    scene: AnyScene,
    folder: Path,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    start: Start | None = None,
    interrupt: Interrupt | None = None,
    on_start: Callable[[System], None] = lambda system: None,
    on_level: Callable[[Level], None] = lambda level: None,
    **options: Any,
) -> Outcome:
    """Solve ``scene`` to its ``analysis.accuracy`` into ``folder``; as `solve_scene`, whose
    arguments the others are and whose errors it raises, where it has none or a run goes on from
    ``start``. Collective.

    The run that stays has the finest mesh; its scene.toml holds that mesh and the length of its
    steps, its run.json the `Accuracy`, which the outcome has, too. ``on_level`` reports every mesh
    on every rank. If the finest mesh or the shortest steps allowed do not do, a warning says so. A
    mesh that cannot be solved ends everything, as interrupts do.
    """
    if scene.analysis.accuracy is None or start is not None:
        return solve_scene(
            scene, folder, comm, start=start, interrupt=interrupt, on_start=on_start, **options
        )
    with nullcontext(interrupt) if interrupt else Interrupt() as interrupt:
        search = _Search(scene, folder, comm, interrupt, on_start, on_level, options)
        with suppress(_End):
            search.refine()
        return search.finish()


class _End(Exception):
    """No further mesh is to be solved."""


@dataclass
class _Search:
    """The way to the accuracy, the same on all ranks."""

    scene: AnyScene
    folder: Path
    comm: MPI.Comm
    interrupt: Interrupt
    on_start: Callable[[System], None]
    on_level: Callable[[Level], None]
    options: ByName
    outcome: Outcome | None = None
    substeps: int = 1
    mesh_error: float | None = None

    def __post_init__(self) -> None:
        self.asked = self.scene.analysis.accuracy or 0.0
        self.begun = perf_counter()
        self.levels = list[Level]()
        depends_on_steps = self.scene.plastic or self.scene.has_friction
        self.step_error = None if depends_on_steps else 0.0
        self.family = view_of(self.scene).mesh_family(self.asked)

    def refine(self) -> None:
        """Solve until the estimate is as small as asked. Raises `_End` if there is no finer mesh,
        or a run stops."""
        curves: list[
            Curve
        ] = []  # in steps of the final length, on the meshes that resolve the contact
        dofs = []  # of these meshes
        for mesh in count():
            curve, level = self._solve(mesh, self.substeps)
            if curve is None:
                self._tell(level)
                continue
            if self.step_error is None:
                curve, level = self._choose_steps(mesh, curve, level)
            curves.append(curve)
            dofs.append(level.dofs)
            ratio = self.family.ratio_of(*dofs[-2:]) if len(dofs) > 1 else self.family.ratio
            self.mesh_error = mesh_error(curves, ratio, self.family.order)
            self._tell(replace(level, mesh_error=self.mesh_error))
            left = max(self.asked - (self.step_error or 0.0), self.asked / 2)
            is_small = self.mesh_error is not None and self.mesh_error <= left
            if is_small and self.family.are_enough(dofs):
                return

    def _choose_steps(self, mesh: int, curve: Curve, level: Level) -> tuple[Curve, Level]:
        """Halve the steps until what they err by is at most half of what was asked; the curve with
        these steps.

        With friction errors fall more slowly than steps, and the first differences may grow: only
        one that is smaller than the one before says how large the error is. A run whose steps were
        cut may have taken the steps of the finer run: the difference of both tells nothing.
        """
        has_friction = self.scene.has_friction
        order = _ORDER_WITH_FRICTION if has_friction else 1.0
        before = 0.0
        while True:
            finer, finer_level = self._solve(mesh, 2 * self.substeps)
            if finer is None:
                raise _End
            if level.cutbacks and 4 * self.substeps <= MOST_SUBSTEPS:
                self._tell(level)
                curve = finer
                level = finer_level
                self.substeps *= 2
                continue
            apart = step_error(curve, finer)
            is_evidence = apart <= before or not has_friction
            before = apart
            error = richardson(apart, 2.0, order)
            error_before = 2.0**order * error
            self.step_error = error_before
            if is_evidence and 2 * error_before <= self.asked:
                self._tell(replace(finer_level, step_error=error))
                return curve, replace(level, step_error=error_before)
            self._tell(replace(level, step_error=error_before))
            curve = finer
            level = finer_level
            self.substeps *= 2
            self.step_error = error
            if (is_evidence and 2 * error <= self.asked) or self.substeps >= MOST_SUBSTEPS:
                return curve, replace(level, step_error=error)

    def _solve(self, mesh: int, substeps: int) -> tuple[Curve | None, Level]:
        """The curve on ``mesh``, None where that hardly notices the contact. Raises `_End`."""
        scene = self.family.scene_of(mesh, substeps)
        before = self.outcome
        begun = perf_counter()
        if scene is None and before is None:
            raise InputError(
                "analysis.accuracy: no mesh within the limits of its element sizes would do."
            )
        received = self.comm.allreduce(self.interrupt.received, op=MPI.MAX)
        if received and before is not None:
            message = f"{Interrupted(received)} between two meshes"
            self.outcome = replace(before, status="interrupted", message=message, signal=received)
        if scene is None or (received and before is not None):
            raise _End

        def started(system: System) -> None:
            self.family.dofs = system.n_dofs
            self.on_start(system)

        options = {"interrupt": self.interrupt, "on_start": started, **self.options}
        self.outcome = outcome = solve_scene(scene, self.folder, self.comm, **options)
        if outcome.status != "done" and outcome.message != UNSEEN:
            raise _End
        curve = self.comm.bcast(self.family.curve(outcome.steps))
        iterations = sum(m.iterations for m in outcome.steps)
        seconds = round(perf_counter() - begun, 4)
        level = Level(
            mesh + 1,
            *self.family.sizes(scene),
            substeps,
            self.family.dofs,
            curve[-1],
            seconds,
            iterations,
            cutbacks=sum(m.cutbacks for m in outcome.steps),
        )
        return curve if self.family.resolved(scene, outcome.steps) else None, level

    def _tell(self, level: Level) -> None:
        self.levels.append(level)
        self.on_level(level)

    def finish(self) -> Outcome:
        """Note in run.json how accurate the last run is; the outcome. Collective."""
        assert self.outcome is not None
        done = self.outcome.status == "done"
        seconds = round(perf_counter() - self.begun, 4)
        mesh, steps = (self.mesh_error, self.step_error) if done else (None, None)
        estimated = None if mesh is None or steps is None else mesh + steps
        accuracy = Accuracy(
            self.asked, estimated, mesh, steps, self.substeps, seconds, tuple(self.levels)
        )
        outcome = replace(self.outcome, accuracy=accuracy)
        if done and (estimated is None or estimated > self.asked) and self.comm.rank == 0:
            outcome.warnings = [*outcome.warnings, self._shortfall(estimated)]

        def note() -> None:
            path = self.folder / "run.json"
            content = read_report(path)
            content |= {
                "status": outcome.status,
                "message": outcome.message,
                "warnings": outcome.warnings,
            }
            content["accuracy"] = asdict(accuracy)
            content["error_estimates"] |= {"mesh": mesh, "steps": steps}
            replace_file(path, report_text(content))

        try:
            agreed(self.comm, note)
        except WriteError as error:
            if done:
                return replace(outcome, status="stopped", message=str(error))
        return outcome

    def _shortfall(self, estimated: float | None) -> str:
        """Why the error is not ``estimated`` as small as asked, and what to do."""
        said = (
            "the error could not be estimated, as only one mesh within the limits resolves the "
            "contact"
        )
        if estimated is not None:
            said = (
                f"the error is estimated at {estimated:.1e}, not below analysis.accuracy = "
                f"{self.asked:g}"
            )
        if self.step_error is not None and 2 * self.step_error > self.asked:
            return (
                f"accuracy: {said}: {self.substeps} steps an output step are too few; increase the "
                "number of steps"
            )
        return f"accuracy: {said}: a finer mesh would be too large; ask for less accuracy"
