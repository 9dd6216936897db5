"""``archord solve --restart`` and ``--extend``: rank 0 reads what a run left, and all ranks go on from there."""

from __future__ import annotations

from pathlib import Path

from archord.scene.errors import InputError
from archord.scene.file import load_scene


def continue_with_progress(
    source: Path, overrides: list[str], output: Path | None, *, extend: bool, debug: bool, quiet: bool, begun: float
) -> int:
    """Continue the run of ``source``, a scene file or the run folder itself; returns the exit code. Collective.

    Raises `InputError` on every rank if that cannot be.
    """
    from mpi4py import MPI

    from archord.output.ranks import agreed
    from archord.output.restart import Plan, plan_extension, plan_restart

    # on all ranks: it imports petsc4py, which is collective
    from archord.progress import solve_with_progress

    folder = source if source.is_dir() else output or Path("runs") / source.stem

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

    planned = agreed(MPI.COMM_WORLD, plan)
    if not quiet:
        print(f"{planned.said}.", flush=True)
    if planned.finished:
        return 0
    return solve_with_progress(
        lambda: planned.scene, folder, force=True, debug=debug, quiet=quiet, begun=begun, start=planned.start
    )
