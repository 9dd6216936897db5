"""Files that survive a kill and a full disk: replaced in one move, or written in place by plain system calls.

The HDF5 library is kept away from the disk: it leaves files unreadable when a process dies while it writes them, drops
what does not fit onto a full disk from its buffers without an error, and crashes when it closes such a file. Files are
composed in memory, and what goes wrong on disk is an `OSError` that names the file.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from archord.scene.errors import InputError

if TYPE_CHECKING:
    from mpi4py import MPI

T = TypeVar("T")
Buffer = bytes | memoryview


class WriteError(Exception):
    """A file of the run could not be written; the message names it and the reason."""


def new_name(path: Path) -> Path:
    """Where the successor of ``path`` grows before it takes its place; a kill may leave it behind."""
    return path.with_name(path.name + ".new")


def replace_file(path: Path, pieces: Iterable[tuple[int, Buffer]], size: int, *, durable: bool = False) -> None:
    """Put ``pieces`` (offset, bytes) into a file of ``size`` bytes and that in the place of ``path``, in one move.

    What lies between the pieces is a hole. ``durable`` waits until the disk has it, so that it also survives a power
    cut. Raises `OSError` naming ``path``, which then is what it was.
    """
    new = new_name(path)
    try:
        with naming(path):
            descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
            try:
                os.ftruncate(descriptor, size)
                for offset, piece in pieces:
                    write_at(descriptor, offset, piece)
                if durable:
                    os.fsync(descriptor)
            finally:
                os.close(descriptor)
            os.replace(new, path)
    except OSError:
        new.unlink(missing_ok=True)
        raise


def replace_text(path: Path, text: str) -> None:
    """Make ``text`` the content of ``path``, in one move. Raises `OSError` naming ``path``."""
    content = text.encode()
    replace_file(path, [(0, content)], len(content))


def write_at(descriptor: int, offset: int, data: Buffer) -> None:
    """Write all of ``data`` at ``offset``."""
    rest = memoryview(data).cast("B")
    while len(rest):
        n = os.pwrite(descriptor, rest, offset)
        rest, offset = rest[n:], offset + n


class naming:
    """Within this context every `OSError` names ``path``."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> None:
        """Nothing to prepare."""

    def __exit__(self, kind, error, traceback) -> None:
        """Raise the error again with the file's name."""
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), str(self.path)) from None


def on_root(comm: MPI.Comm, write: Callable[[], T]) -> T | None:
    """What ``write()`` returns on rank 0, None elsewhere. Collective.

    Raises on every rank what ``write`` raises: `InputError`, and for an `OSError` `WriteError`.
    """
    result, fault, kind = None, "", WriteError
    if comm.rank == 0:
        try:
            result = write()
        except InputError as error:
            fault, kind = str(error), InputError
        except OSError as error:
            fault = f"{error.filename} cannot be written: {error.strerror or error}"
    fault, kind = comm.bcast((fault, kind))
    if fault:
        raise kind(fault)
    return result
