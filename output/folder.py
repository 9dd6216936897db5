"""The folder of a run: what lies in it, and whether a run may be written there."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from archord.output.files.disk import new_name
from archord.output.files.seal import read_report
from archord.report.by_name import ByName
from archord.report.errors import InputError

FILES = (
    "scene.toml",
    "history.csv",
    "fields.xdmf",
    "fields.h5",
    "contact.h5",
    "run.json",
)
MESH = "mesh.npz"  # of a run whose mesh was given from Python
APART = "fields"  # the folder of the files that fields.h5 has links to
CHECKPOINT = "checkpoint.h5"
PICTURE = "picture.png"  # drawn later, from the others
_OLDER = "fields.vtkhdf"  # of version 0.2
_UNFINISHED = {
    "running": "did not end, unless archord works there still",
    "interrupted": "was interrupted",
    "stopped": "could not go on",
}


def clear(folder: Path, kept: str = "") -> None:
    """Remove an old run's files but the one that is ``kept``, and what a kill left half done of
    them. Raises `OSError`."""
    for name in {CHECKPOINT, *FILES, MESH, PICTURE, _OLDER} - {kept}:
        (folder / name).unlink(missing_ok=True)
        new_name(folder / name).unlink(missing_ok=True)
    for file in (folder / APART).glob("[0-9]*.h5*"):
        file.unlink()
    with suppress(OSError):  # there is none, or it holds something else, too
        (folder / APART).rmdir()


@contextmanager
def occupied(folder: Path, wait: bool = False) -> Iterator[None]:
    """Keep other processes from writing to ``folder``; a kill ends that, too. If one does already,
    ``wait`` until it has ended, or raise `InputError`."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):  # a file system without locks
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            except BlockingIOError:
                raise InputError(folder, "another archord is solving into it.") from None
        yield
    finally:
        os.close(descriptor)


def claim_folder(folder: Path, force: bool) -> None:
    """Make ``folder`` ready for results. Raises `InputError` if it cannot be, or holds something,
    without ``force``."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        empty = not any(folder.iterdir())
        fault = "" if os.access(folder, os.W_OK) else "Permission denied"
    except OSError as error:
        empty = True
        fault = error.strerror or str(error)
    if fault:
        raise InputError(folder, f"cannot be used for results: {fault}.")
    if not (empty or force):
        said = "is not empty; choose another folder with -o, or overwrite a run in it with --force"
        if (status := report_of(folder).get("status")) in _UNFINISHED:
            how = "continue it with --restart, or overwrite it with --force"
            said = f"holds a run that {_UNFINISHED[status]}; {how}"
        raise InputError(folder, f"{said}.")


def refuse_folder(scene: Path) -> None:
    """Raise `InputError` if ``scene`` is a folder, with what can be done with it instead of solving
    it."""
    if not scene.is_dir():
        return
    said = "is no scene but a folder, and no run is in it"
    if is_sweep(scene):
        said = f"is a sweep; archord sweep {scene} solves what it lacks"
    elif (scene / "scene.toml").is_file():
        said = (
            f"is a run; --restart or --extend continues it, and its scene is {scene / 'scene.toml'}"
        )
    raise InputError(scene, f"{said}.")


def report_of(folder: Path) -> ByName:
    """The run.json in ``folder``; empty if there is none that can be read."""
    with suppress(OSError, ValueError):
        if isinstance(report := read_report(folder / "run.json"), dict):
            return report
    return {}


def is_sweep(folder: str | Path) -> bool:
    """Whether ``folder`` is a sweep's."""
    return (Path(folder) / "sweep.toml").is_file()
