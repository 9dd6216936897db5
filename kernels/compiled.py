"""C sources as functions on numpy arrays, declared by a header beside them: compiled once, by the
compiler that dolfinx needs for its forms, and kept in the user's cache. (Numba would cost 0.4 s of
every run: dolfinx imports it if it can.)
"""

from __future__ import annotations

import hashlib
import os
import platform
import shlex
import stat
import subprocess
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import cffi
import numpy as np
import numpy.typing as npt

from archord.report.by_name import Names

_FLAGS = ["-std=c11", "-O3", "-fPIC", "-shared", "-fno-math-errno", "-ffp-contract=off"]
_ffi = cffi.FFI()
_TYPES = {
    np.dtype(a): _ffi.typeof(c)
    for a, c in (("d", "double[]"), ("f", "float[]"), ("i", "int32_t[]"), ("?", "uint8_t[]"))
}


class CompilerError(RuntimeError):
    """The C compiler is missing or failed."""


def library(source: Path, libraries: Names = ()) -> Any:
    """The functions of the C file ``source`` that the header beside it declares; they need other
    ``libraries``. Raises `CompilerError`."""
    return _loaded(source, libraries)[1]


def address(source: Path, name: str) -> int:
    """Where the function of this ``name`` of the C file ``source`` lies. Raises `CompilerError`."""
    ffi, functions = _loaded(source, ())
    return int(ffi.cast("uintptr_t", getattr(functions, name)))


def structure(source: Path, kind: str, members: Mapping[str, int | float | np.ndarray]) -> Any:
    """A pointer to a structure of the type ``kind``, declared in the header of ``source``, with
    numbers and pointers to arrays, which have to live as long as it is used. Raises
    `CompilerError`."""
    values = {name: pointer(m) if isinstance(m, np.ndarray) else m for name, m in members.items()}
    return _loaded(source, ())[0].new(f"{kind} *", values)


@cache
def _loaded(source: Path, libraries: Names) -> tuple[cffi.FFI, Any]:
    compiler = shlex.split(os.environ.get("CC", "cc"))
    header = source.with_suffix(".h").read_text(encoding="utf-8")
    key = "\0".join([*compiler, *_FLAGS, platform.machine(), header]).encode() + source.read_bytes()
    path = cache_folder() / f"{source.stem}-{hashlib.sha256(key).hexdigest()[:16]}.so"
    if not is_private(path):  # missing, or another user's
        _compile([*compiler, *_FLAGS], source, path, libraries)
    ffi = cffi.FFI()
    ffi.cdef("".join(line for line in header.splitlines(keepends=True) if not line.startswith("#")))
    try:
        return ffi, ffi.dlopen(str(path))
    except OSError:  # a library that it needs has another version by now
        _compile([*compiler, *_FLAGS], source, path, libraries)
        return ffi, ffi.dlopen(str(path))


def pointer(array: npt.NDArray[Any]) -> Any:
    """The C-contiguous ``array`` of float64, float32, int32 or bool for a C function."""
    return _ffi.from_buffer(_TYPES[array.dtype], array)


def cache_folder() -> Path:
    """The user's folder for what is made once and used again; one of this process where that cannot
    be written, or where another user may write."""
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "archord"
    with suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if folder.stat().st_uid == os.geteuid() and not is_private(folder):
            folder.chmod(0o700)
    usable = is_private(folder) and os.access(folder, os.W_OK)
    return folder if usable else Path(_temporary().name)


def is_private(path: Path) -> bool:
    """Whether ``path`` is there, belongs to this user, and no other user may write to it."""
    try:
        found = path.stat()
    except OSError:
        return False
    return found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


@cache
def _temporary() -> tempfile.TemporaryDirectory[str]:
    """A folder of this process, removed at its end."""
    return tempfile.TemporaryDirectory(prefix="archord-", ignore_cleanup_errors=True)


def _compile(command: list[str], source: Path, path: Path, libraries: Names) -> None:
    """Several processes may compile at once: each into a file of its own, and the last one
    stays."""
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        made = Path(folder) / path.name
        command = [
            *command,
            "-o",
            str(made),
            str(source),
            *(f"-l{name}" for name in ("m", *libraries)),
        ]
        try:
            result = subprocess.run(command, capture_output=True, text=True)
        except OSError as error:
            raise CompilerError(f"no C compiler ({error}); install gcc, or set CC") from None
        if result.returncode:
            said = [line for line in result.stderr.splitlines() if "error" in line] or [
                f"exit {result.returncode}"
            ]
            raise CompilerError(f"{source.name} could not be compiled: {said[0]}")
        made.chmod(0o700)
        os.replace(made, path)
