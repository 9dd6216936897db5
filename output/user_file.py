"""Files that a user names for results: checked before the work, and one sentence if they cannot be written."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from archord.output.folder import CHECKPOINT, FILES
from archord.scene.errors import InputError


def check_output(path: Path) -> None:
    """Raise `InputError` if ``path`` cannot become a file: no folder for it, a folder itself, no permission, or a file
    that a run folder is made of. Another file in its place will be overwritten."""
    fault = None
    if not path.parent.is_dir():
        fault = f"{path.parent} is not a folder"
    elif path.is_dir():
        fault = "it is a folder"
    elif path.name in (*FILES, CHECKPOINT) and (path.parent / "scene.toml").is_file():
        fault = f"it belongs to the run in {path.parent}"
    elif not os.access(path if path.exists() else path.parent, os.W_OK):
        fault = "permission denied"
    if fault:
        raise InputError(f"{path}: cannot be written: {fault}.")


def check_target(path: Path, inputs: Iterable[Path], *, force: bool = False) -> None:
    """`check_output` for a file that the user names: raise `InputError` also for one of the ``inputs`` of the command,
    and, without ``force``, for a file that is there."""
    check_output(path)
    for given in inputs:
        if path.exists() and given.exists() and path.samefile(given):
            raise InputError(f"{path}: cannot be written: it is an input of the command.")
    if path.is_file() and not force:
        raise InputError(f"{path}: is there already; choose another file, or overwrite it with --force.")


def make_folder(folder: Path) -> None:
    """Make ``folder`` unless it is there. Raises `InputError` if it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror or error}.") from None


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Around the writing of ``path``: `check_output` before, and `InputError` for what the system refuses all the
    same."""
    check_output(path)
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}.") from None
