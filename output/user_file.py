"""Files that a user names for results: checked before the work, and one sentence if they cannot be
written."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from archord.output.folder import CHECKPOINT, FILES, MESH
from archord.report.errors import InputError
from archord.report.figure import save
from archord.report.files import is_device, replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def check_target(path: Path, inputs: Iterable[Path] = (), *, force: bool = True) -> None:
    """Raise `InputError` if ``path`` cannot become a file: no folder for it, a folder itself, no
    permission, a file that a run folder is made of, or one of the ``inputs`` of the command;
    without ``force`` also if it is there."""
    fault = None
    if not path.parent.is_dir():
        fault = f"{path.parent} is not a folder"
    elif path.is_dir():
        fault = "it is a folder"
    elif path.name in (*FILES, MESH, CHECKPOINT) and (path.parent / "scene.toml").is_file():
        fault = f"it belongs to the run in {path.parent}"
    elif not os.access(path if path.exists() else path.parent, os.W_OK):
        fault = "permission denied"
    elif path.exists() and any(given.exists() and path.samefile(given) for given in inputs):
        fault = "it is an input of the command"
    if fault:
        raise InputError(path, f"cannot be written: {fault}.")
    if path.is_file() and not force and not is_device(path):
        raise InputError(
            path, "is there already; choose another file, or overwrite it with --force."
        )


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """A path to write to, which takes the place of ``path`` when all has gone well (`replacing`);
    else ``path`` is what it was. Raises `InputError` as `check_target`, and for what the system
    refuses all the same."""
    check_target(path)
    try:
        with replacing(path) as new:
            yield new
    except OSError as error:
        raise InputError(path, f"cannot be written: {error.strerror or error}.") from None


def save_figure(figure: Figure, target: Path) -> Path:
    """Write ``figure`` as ``target``; returns it. Raises `InputError` if that cannot be written."""
    try:
        with writing(target) as new:
            save(figure, new)
    except ValueError as error:
        raise InputError(error) from None
    return target
