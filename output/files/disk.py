"""Files that survive a kill and a full disk: written beside the old one, which they then replace in
one move.

The HDF5 library is kept away from the disk: it leaves files unreadable when a process dies while it
writes them, drops what does not fit onto a full disk from its buffers without an error, and crashes
when it closes such a file. Files are composed in memory, and what goes wrong on disk is an
`OSError` that names the file.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class WriteError(Exception):
    """A file of the run could not be written; the message names it and the reason."""


def new_name(path: Path) -> Path:
    """Where the successor of ``path`` grows before it takes its place; a kill may leave it
    behind."""
    return path.with_name(path.name + ".new")


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """An `OSError` of what is done to ``path`` names it."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


def replace_file(path: Path, content: bytes | str, *, durable: bool = False) -> None:
    """Put a file with ``content`` in the place of ``path``, in one move; if ``durable``, also a
    power cut then leaves it. Raises `OSError` naming ``path``, which then is what it was."""
    new = new_name(path)
    try:
        with naming(path):
            with new.open("wb") as file:
                file.write(content.encode() if isinstance(content, str) else content)
                if durable:
                    file.flush()
                    os.fsync(file.fileno())
            new.replace(path)
    except OSError:
        new.unlink(missing_ok=True)
        raise
