"""A scene solved to an accuracy: on ever finer meshes, in short enough steps, until the estimated error is below it.

What is estimated is the error of P at the output steps, over the largest; of delta, if the load is a force. Mesh and
steps err independently. The steps of a plastic joint are chosen first, where that is cheap, on the coarsest mesh; then
meshes follow until both errors together are small enough. Each mesh is an ordinary run, and the last one stays.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from itertools import count
from pathlib import Path
from time import perf_counter
from typing import Any

from mpi4py import MPI

from archord.output.disk import WriteError, naming, replace_file
from archord.output.ranks import agreed
from archord.output.restart import Start
from archord.output.run import Outcome, solve_scene
from archord.postprocess.convergence import Curve, mesh_error, step_error
from archord.presets.joint import Joint
from archord.presets.measures import Measures
from archord.scene.errors import InputError
from archord.scene.scene import Scene
from archord.solver.interrupt import Interrupt, Interrupted
from archord.solver.timer import Timer
from archord.studies.mesh_family import RATIO, MeshFamily

MOST_SUBSTEPS = 64
_FEWEST_FACETS = 3.0  # in contact: of a contact of fewer facets nothing can be learnt


@dataclass(frozen=True)
class Level:
    """One mesh, solved: its sizes (``element_size`` over R), what it cost, the ``last`` value of P (under a force of
    delta), and the errors estimated with it, if it told any."""

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


@dataclass(frozen=True)
class Accuracy:
    """What was ``asked`` and what is ``estimated`` (None if unknown) of the last level: errors of mesh and steps,
    added."""

    asked: float
    estimated: float | None
    mesh_error: float | None
    step_error: float | None
    substeps: int
    seconds: float
    levels: tuple[Level, ...]


def solve_to_accuracy(
    scene: Scene,
    folder: Path,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    debug: bool = False,
    timer: Timer | None = None,
    begun: float | None = None,
    on_start: Callable[[Joint], None] = lambda joint: None,
    on_step: Callable[[Measures], None] = lambda measures: None,
    on_attempt: Callable[[float, int], None] = lambda load, iterations: None,
    on_level: Callable[[Level], None] = lambda level: None,
) -> Outcome:
    """Solve ``scene``, which has an ``analysis.accuracy``, into ``folder``; the other arguments are those of
    `solve_scene`. Collective.

    The run that stays has the finest mesh; its scene.toml holds that mesh and the length of its steps, its run.json the
    `Accuracy`, which the outcome has, too. ``on_level`` reports every mesh on every rank. If the finest mesh or the
    shortest steps allowed do not do, a warning says so. A mesh on which the scene cannot be solved ends everything, as
    does an interrupt. Raises what `solve_scene` raises.
    """
    with Interrupt() as interrupt:
        options = {"debug": debug, "on_start": on_start, "on_step": on_step, "on_attempt": on_attempt}
        search = _Search(scene, folder, comm, on_level, {**options, "interrupt": interrupt})
        search.run({"timer": timer, "begun": begun})
        return search.finish()


def solve_as_asked(
    scene: Scene, folder: Path, comm: MPI.Comm, *, start: Start | None = None, **options: Any
) -> Outcome:
    """`solve_to_accuracy` where ``scene`` asks for an accuracy and no run goes on, else `solve_scene`. Collective."""
    if scene.analysis.accuracy is None or start is not None:
        return solve_scene(scene, folder, comm, start=start, **options)
    return solve_to_accuracy(scene, folder, comm, **options)


class _End(Exception):
    """No further mesh is to be solved."""


class _Search:
    """The way to the accuracy, the same on all ranks."""

    def __init__(
        self,
        scene: Scene,
        folder: Path,
        comm: MPI.Comm,
        on_level: Callable[[Level], None],
        options: dict[str, Any],
    ) -> None:
        if scene.analysis.accuracy is None:
            raise InputError("analysis.accuracy is missing.")
        self.scene, self.folder, self.comm, self.on_level, self.options = scene, folder, comm, on_level, options
        self.asked = scene.analysis.accuracy
        self.family = MeshFamily(scene, self.asked / 2 if scene.plastic else self.asked)
        self.begun = perf_counter()
        self.levels: list[Level] = []
        self.outcome: Outcome | None = None
        self.substeps = 1
        self.mesh_error: float | None = None
        self.step_error: float | None = None if scene.plastic else 0.0
        self.curves: list[Curve] = []  # in steps of the final length, on the meshes that resolve the contact

    def run(self, first: dict[str, Any]) -> None:
        """Solve until the estimate is as small as asked, no finer mesh is allowed, or a run does not get to its end;
        ``first`` are options of the first run alone."""
        self.options_now = self.options | first
        try:
            for mesh in count():
                curve, level = self._solve(mesh, self.substeps)
                if curve is None:
                    self._tell(level)
                    continue
                if self.step_error is None:
                    curve, level = self._choose_steps(mesh, curve, level)
                self.curves.append(curve)
                self.mesh_error = mesh_error(self.curves, RATIO)
                self._tell(replace(level, mesh_error=self.mesh_error))
                if self.mesh_error is not None and self.mesh_error <= self._left_for_the_mesh():
                    break
        except _End:
            pass

    def _left_for_the_mesh(self) -> float:
        return max(self.asked - (self.step_error or 0.0), self.asked / 2)

    def _choose_steps(self, mesh: int, curve: Curve, level: Level) -> tuple[Curve, Level]:
        """Halve the steps until what they err by is at most half of what was asked; the curve with these steps."""
        while True:
            finer, finer_level = self._solve(mesh, 2 * self.substeps)
            if finer is None:
                raise _End
            error = step_error(curve, finer)
            if 4 * error <= self.asked:
                self._tell(replace(finer_level, step_error=error))
                self.step_error = 2 * error
                return curve, replace(level, step_error=2 * error)
            self._tell(replace(level, step_error=2 * error))
            curve, level, self.substeps, self.step_error = finer, finer_level, 2 * self.substeps, error
            if 2 * error <= self.asked or self.substeps >= MOST_SUBSTEPS:
                return curve, replace(level, step_error=error)

    def _solve(self, mesh: int, substeps: int) -> tuple[Curve | None, Level]:
        """The curve on ``mesh``, None where that hardly notices the contact. Raises `_End`."""
        scene = self.family.scene_of(mesh, substeps)
        if scene is None and self.outcome is None:
            raise InputError("analysis.accuracy: no mesh within the limits of the section joint would do.")
        received = self.comm.allreduce(self.options["interrupt"].received, op=MPI.MAX)
        if received and self.outcome is not None:
            message = f"{Interrupted(received)} between two meshes"
            self.outcome = replace(self.outcome, status="interrupted", message=message, signal=received)
            raise _End
        if scene is None:
            raise _End
        begun, dofs = perf_counter(), 0

        def started(joint: Joint) -> None:
            nonlocal dofs
            dofs = joint.n_dofs
            self.options["on_start"](joint)

        outcome = solve_scene(scene, self.folder, self.comm, **(self.options_now | {"on_start": started}))
        self.outcome, self.options_now = outcome, self.options
        steps = outcome.steps
        if outcome.status != "done" and not outcome.unseen:
            raise _End
        by_force, touched = scene.force_controlled, any(m.contact_area for m in steps)
        # P is round-off where nothing touches
        curve = self.comm.bcast([m.delta if by_force else m.P if touched else 0.0 for m in steps])
        geometry = scene.joint
        level = Level(
            mesh=mesh + 1,
            element_size=geometry.h / geometry.radius,
            growth=geometry.growth,
            substeps=substeps,
            dofs=dofs,
            last=curve[-1],
            seconds=round(perf_counter() - begun, 4),
            iterations=sum(m.iterations for m in steps),
        )
        facets = max(m.contact_area for m in steps) / 2 / geometry.h / max(1.0, geometry.size_ratio)
        pressed = max(m.delta for m in steps) > 0
        return curve if facets >= _FEWEST_FACETS or not pressed else None, level

    def _tell(self, level: Level) -> None:
        self.levels.append(level)
        self.on_level(level)

    def finish(self) -> Outcome:
        """Note in run.json how accurate the last run is; the outcome. Collective."""
        assert self.outcome is not None
        outcome = self.outcome
        known = outcome.status == "done" and self.mesh_error is not None and self.step_error is not None
        estimated = self.mesh_error + self.step_error if known else None  # type: ignore[operator]
        accuracy = Accuracy(
            asked=self.asked,
            estimated=estimated,
            mesh_error=self.mesh_error if known else None,
            step_error=self.step_error if known else None,
            substeps=self.substeps,
            seconds=round(perf_counter() - self.begun, 4),
            levels=tuple(self.levels),
        )
        warnings = [*outcome.warnings]
        short = estimated is None or estimated > self.asked
        if outcome.status == "done" and short and self.comm.rank == 0:
            warnings.append(self._shortfall(accuracy))
        outcome = replace(outcome, warnings=warnings, accuracy=accuracy)
        try:
            agreed(self.comm, lambda: self._note(outcome))
        except WriteError as error:
            if outcome.status == "done":
                outcome = replace(outcome, status="stopped", message=str(error))
        return outcome

    def _note(self, outcome: Outcome) -> None:
        path = self.folder / "run.json"
        with naming(path):
            content = json.loads(path.read_text(encoding="utf-8"))
        accuracy = outcome.accuracy
        assert accuracy is not None
        content |= {"status": outcome.status, "message": outcome.message, "warnings": outcome.warnings}
        content["accuracy"] = asdict(accuracy)
        content["error_estimates"] |= {"mesh": accuracy.mesh_error, "steps": accuracy.step_error}
        replace_file(path, json.dumps(content, indent=1, allow_nan=False) + "\n")

    def _shortfall(self, accuracy: Accuracy) -> str:
        """Why the estimate is not as small as asked, and what to do."""
        if accuracy.estimated is None:
            said = "the error could not be estimated, as only one mesh within the limits resolves the contact"
        else:
            said = f"the error is estimated at {accuracy.estimated:.1e}, not below analysis.accuracy = {self.asked:g}"
        if accuracy.step_error is not None and 2 * accuracy.step_error > self.asked:
            return f"accuracy: {said}: {self.substeps} steps an output step are too few; increase load.steps"
        return f"accuracy: {said}: a finer mesh would be beyond the limits of joint.element_size; ask for less accuracy"
