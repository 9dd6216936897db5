"""``archord solve`` and ``archord scene``."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import click

from archord.options import SCENE, flag, output, overrides, quiet

if TYPE_CHECKING:
    from archord.output.restart import Plan, Start
    from archord.output.run import Outcome
    from archord.scene.scene import Scene


@click.command()
@SCENE
@overrides()
@output("run folder [runs/<scene name>]")
@flag("--force", "overwrite the results in the run folder")
@flag("--restart", "continue the interrupted run in the run folder")
@flag("--extend", "continue the finished run to the scene's load")
@flag("--debug", "write the fields of a step that cannot be solved to debug.xdmf")
@quiet()
@click.pass_obj
def solve(
    begun: float,
    scene: Path,
    overrides: tuple[str, ...],
    output: Path | None,
    force: bool,
    restart: bool,
    extend: bool,
    debug: bool,
    quiet: bool,
) -> int:
    """Solve a scene into a run folder. Under mpirun, all ranks work on it.

    With --restart and --extend, the run folder may stand in the place of the scene.
    """
    if restart + extend + force > 1:
        raise click.UsageError("choose one of --force, --restart and --extend")
    folder = scene if (restart or extend) and scene.is_dir() else output or Path("runs") / scene.stem
    if restart or extend:
        planned = _planned(scene, overrides, output, folder, extend=extend)
        if not quiet:
            print(f"{planned.said}.", flush=True)
        if planned.finished:
            return 0
        return _solve(lambda: planned.scene, folder, True, debug, quiet, begun, planned.start)
    from archord.scene.file import load_scene

    return _solve(lambda: load_scene(scene, overrides), folder, force, debug, quiet, begun)


def _planned(source: Path, overrides: tuple[str, ...], output: Path | None, folder: Path, *, extend: bool) -> Plan:
    """How the run in ``folder`` goes on, with the scene of ``source``, a scene file or the folder itself. Collective.

    Raises `InputError` on every rank if it cannot.
    """
    from mpi4py import MPI

    from archord.output.ranks import agreed
    from archord.output.restart import plan_extension, plan_restart  # on all ranks: it imports PETSc
    from archord.scene.errors import InputError
    from archord.scene.file import load_scene

    def plan() -> Plan:
        if source.is_dir() and output is not None and output.resolve() != source.resolve():
            raise InputError(f"-o {output}: does not go with a run folder, {source}.")
        scene = load_scene(source / "scene.toml" if source.is_dir() else source, overrides)
        if scene.analysis.accuracy is not None:
            raise InputError(
                f"{source}: analysis.accuracy = {scene.analysis.accuracy:g} does not go with --restart and --extend; "
                f"the last mesh of the run goes on with archord solve {folder} --restart."
            )
        return plan_extension(folder, scene) if extend else plan_restart(folder, scene)

    return agreed(MPI.COMM_WORLD, plan)


def _solve(
    load: Callable[[], Scene],
    folder: Path,
    force: bool,
    debug: bool,
    quiet: bool,
    begun: float,
    start: Start | None = None,
) -> int:
    """Solve the scene that ``load`` gives rank 0 into ``folder`` on all ranks and report; returns the exit code.

    ``start`` continues the run in ``folder``.
    """
    from mpi4py import MPI

    from archord.output.folder import claim_folder
    from archord.output.ranks import agreed
    from archord.progress import solve_and_report

    def claimed() -> Scene:
        scene = load()
        claim_folder(folder, force)
        return scene

    comm = MPI.COMM_WORLD
    scene = agreed(comm, claimed)
    outcome = solve_and_report(scene, folder, comm, silent=quiet, start=start, debug=debug, begun=begun)
    if outcome.warnings:
        from archord.postprocess.tables import first_of_each_kind

        for warning in first_of_each_kind(outcome.warnings):
            print(f"archord: warning: {warning}.", file=sys.stderr)
    if comm.rank == 0 and outcome.status != "done":
        print(f"archord: {outcome.message}.", file=sys.stderr)
        print(f"archord: {outcome.status}; {len(outcome.steps)} accepted steps are in {folder}.", file=sys.stderr)
    elif comm.rank == 0 and not quiet:
        took = f"{len(outcome.steps)} steps in {perf_counter() - begun:.1f} s"
        print(f"{took}{_estimate(scene, outcome)}, results in {folder}")
    return {"done": 0, "stopped": 3, "interrupted": 128 + outcome.signal}[outcome.status]


def _estimate(scene: Scene, outcome: Outcome) -> str:
    """What a run that was asked for an accuracy says of it."""
    accuracy = outcome.accuracy
    if accuracy is None or accuracy.estimated is None:
        return ""
    parts = f"mesh {accuracy.mesh_error:.1e}, steps {accuracy.step_error:.1e}; " if scene.plastic else ""
    name = "delta" if scene.force_controlled else "P"
    return f", estimated error of {name} {accuracy.estimated:.1e} ({parts}asked {accuracy.asked:g})"


@click.command()
@flag("--example", "print a commented example")
@flag("--reference", "print all keys as Markdown tables")
def scene(example: bool, reference: bool) -> int:
    """Print what a scene file may hold."""
    if example == reference:
        raise click.UsageError("choose one of --example and --reference")
    from archord.scene import reference as pages

    print(pages.example() if example else pages.reference(), end="")
    return 0
