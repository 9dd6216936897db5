"""archord from Python: load results, load scenes, solve them. The names are those of the package: ``archord.load``."""

from __future__ import annotations

import atexit
import logging
import shutil
import signal
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from archord.output.folder import is_sweep
from archord.postprocess.run import Run
from archord.postprocess.sweep import Sweep
from archord.scene.errors import InputError
from archord.scene.file import load_scene as load_scene_file
from archord.scene.keys import toml_value
from archord.scene.scene import Scene, plain

if TYPE_CHECKING:
    from mpi4py import MPI


def load(folder: str | Path) -> Any:
    """The results in ``folder``: a `Run`, or a `Sweep` if it is a sweep's folder. Raises `InputError` for neither.

    As the folder alone tells which, a type checker knows more of ``Run(folder)`` and ``Sweep(folder)``.
    """
    if not Path(folder).is_dir():
        raise InputError(f"{folder}: is not a folder; give the folder of a run or of a sweep.")
    return Sweep(folder) if is_sweep(folder) else Run(folder)


def load_scene(path: str | Path, changes: Sequence[str] | Mapping[str, Any] = ()) -> Scene:
    """Read and check a scene file, with ``changes`` like ``{"joint.clearance": 0.01}`` or as the command line has them,
    ``["joint.clearance=0.01"]``; None or nothing behind the sign drops a key.

    Raises `InputError` with one sentence per fault.
    """
    if isinstance(changes, str):
        raise InputError(f"changes = {changes!r}: must be a list of them, or a dictionary.")
    if isinstance(changes, Mapping):
        changes = [f"{key}={'' if value is None else toml_value(plain(value))}" for key, value in changes.items()]
    return load_scene_file(path, list(changes))


def solve(
    scene: Scene | str | Path,
    folder: str | Path | None = None,
    *,
    force: bool = False,
    progress: bool = False,
    comm: MPI.Comm | None = None,
) -> Run:
    """Solve ``scene`` (or the scene file of that name) into ``folder``, and give back the run. Collective over ``comm``
    (all ranks).

    Without a ``folder`` the results are temporary: they go with the returned run, under MPI with rank 0's process.
    An occupied folder is refused without ``force``. ``progress`` reports steps on rank 0 as ``archord solve`` does. A
    run that could not reach its end has the status "stopped", and the logger "archord" warns of it; its accepted steps
    stay.

    Raises `InputError` for bad input, on all ranks, and KeyboardInterrupt for Ctrl-C (SystemExit for SIGTERM and
    SIGHUP) once the steps accepted so far are on disk.
    """
    from mpi4py import MPI

    from archord.output.folder import claim_folder
    from archord.output.ranks import agreed
    from archord.progress import solve_and_report

    comm = MPI.COMM_WORLD if comm is None else comm

    def claimed() -> tuple[Scene, Path]:
        checked = scene if isinstance(scene, Scene) else load_scene(scene)
        target = Path(tempfile.mkdtemp(prefix="archord-")) if folder is None else Path(folder)
        if target.is_dir() and any(target.iterdir()) and not force:
            raise InputError(f"{target}: is not empty; choose another folder, or overwrite a run in it: force=True.")
        claim_folder(target, force)
        return checked, target

    checked, target = agreed(comm, claimed)
    if folder is None and comm.rank == 0 and comm.size > 1:
        atexit.register(shutil.rmtree, target, ignore_errors=True)
    try:
        outcome = solve_and_report(checked, target, comm, silent=not progress)
        run = _read(target, outcome.message)
    except BaseException:
        if folder is None and comm.rank == 0:
            shutil.rmtree(target, ignore_errors=True)
        raise
    if folder is None and comm.size == 1:
        weakref.finalize(run, shutil.rmtree, target, ignore_errors=True)
    if outcome.status == "interrupted":
        if outcome.signal == signal.SIGINT:
            raise KeyboardInterrupt(outcome.message)
        raise SystemExit(128 + outcome.signal)
    if outcome.status == "stopped" and comm.rank == 0:
        # not warnings.warn: importing ffcx sends warnings to a logger that shows nothing
        logging.getLogger("archord").warning("archord: %s: %s.", target, outcome.message)
    return run


def _read(folder: Path, message: str) -> Run:
    """The run in ``folder``; RuntimeError with ``message``, if that tells why there is nothing to read."""
    try:
        return Run(folder)
    except InputError:
        if message:
            raise RuntimeError(message) from None
        raise
