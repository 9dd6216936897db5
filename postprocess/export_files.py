"""Folders that results are exported to."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from archord.output.output_file import check_output
from archord.scene.errors import InputError


def check_new(files: Sequence[Path], folder: Path, force: bool) -> None:
    """Make ``folder`` and check that all ``files`` in it can be written, over others only with ``force``.

    Raises `InputError`.
    """
    present = [file for file in files if file.exists()]
    if present and not force:
        more = f" (and {len(present) - 1} more)" if len(present) > 1 else ""
        raise InputError(f"{present[0]}: is there already{more}; choose another folder, or overwrite with --force.")
    make_folder(folder)
    for file in files:
        check_output(file)


def make_folder(folder: Path) -> None:
    """Make ``folder`` unless it is there. Raises `InputError` if it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror or error}.") from None
