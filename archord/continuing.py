"""``archord solve --restart`` and ``--extend``: rank 0 reads what a run left, and all ranks go on from there."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from archord.solver.scene import SceneError
from archord.solver.scene_file import load_scene


def continue_with_progress(
    source: Path, overrides: list[str], output: Path | None, *, extend: bool, quiet: bool, begun: float
) -> int:
    """Continue the run of ``source``, a scene file or the run folder itself; returns the exit code. Collective.

    Raises `SceneError` on every rank if that cannot be.
    """
    from mpi4py import MPI

    from archord.solver.disk import on_root

    comm = MPI.COMM_WORLD
    plan = on_root(comm, lambda: _plan(source, overrides, output, extend))
    folder = _folder(source, output)
    shared = comm.bcast(replace(plan, start=None) if plan else None)
    plan = plan or shared
    if comm.rank == 0 and not quiet:
        print(f"{plan.said}.", file=sys.stdout, flush=True)
    if plan.finished:
        return 0
    from archord.progress import solve_with_progress

    return solve_with_progress(plan.scene, folder, force=False, quiet=quiet, begun=begun, plan=plan)


def _folder(source: Path, output: Path | None) -> Path:
    return source if source.is_dir() else output or Path("runs") / source.stem


def _plan(source: Path, overrides: list[str], output: Path | None, extend: bool):
    from archord.solver.restart import plan_extension, plan_restart

    folder = _folder(source, output)
    if source.is_dir() and output is not None and output.resolve() != source.resolve():
        raise SceneError(f"-o {output}: does not go with a run folder, {source}.")
    if extend and not (folder / "scene.toml").exists():
        raise SceneError(f"{folder}: is not a run folder: scene.toml is missing.")
    scene = load_scene(source / "scene.toml" if source.is_dir() else source, overrides)
    return plan_extension(folder, scene) if extend else plan_restart(folder, scene)
