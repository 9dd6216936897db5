"""The folder of a run: what lies in it, and whether a run may be written there."""

from __future__ import annotations

import os
from pathlib import Path

from archord.solver.scene import SceneError

FILES = ("scene.toml", "history.csv", "fields.xdmf", "fields.h5", "contact.h5", "run.json")


def claim_folder(folder: Path, force: bool) -> None:
    """Check that a run may be written to ``folder``. Raises `SceneError` if it holds something already, without ``force``."""
    try:
        occupied = folder.exists() and (not folder.is_dir() or any(folder.iterdir()))
    except OSError as error:
        raise SceneError(f"{folder}: cannot be used as run folder: {error.strerror}.") from None
    if occupied and not folder.is_dir():
        raise SceneError(f"{folder}: is a file, not a run folder.")
    if occupied and not force:
        raise SceneError(f"{folder}: already holds results; choose another folder with -o, or overwrite with --force.")
    parent = folder
    while not parent.exists():
        parent = parent.parent
    if not os.access(parent, os.W_OK):
        raise SceneError(f"{folder}: cannot be written: no permission for {parent}.")
