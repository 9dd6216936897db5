"""Files that a user names for reading: those that never end, or do not fit in memory, are refused
before they are opened."""

from __future__ import annotations

import errno
import json
import os
import stat
from pathlib import Path
from typing import Any

_SHARE = 0.5  # of the machine's memory, which an array of a file may take
_WHAT = (
    (stat.S_ISDIR, "it is a folder"),
    (stat.S_ISFIFO, "it is a pipe, not a file"),
    (stat.S_ISCHR, "it is a device, not a file"),
    (stat.S_ISBLK, "it is a device, not a file"),
    (stat.S_ISSOCK, "it is a socket, not a file"),
)


def require_file(path: str | Path) -> Path:
    """``path``, which is a file with an end. Raises `OSError`, whose ``strerror`` says what else it
    is; ValueError for a name that no file can have."""
    mode = os.stat(path).st_mode
    for is_such, said in _WHAT:
        if is_such(mode):
            raise OSError(errno.EINVAL, said, str(path))
    return Path(path)


def require_memory(size: float) -> None:
    """Raise ValueError for an array of so many bytes that is larger than half of the machine's
    memory."""
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if size > _SHARE * memory:
        gigabytes = 1e9
        raise ValueError(
            f"claims an array of {size / gigabytes:.3g} GB, more than half of the machine's "
            f"{memory / gigabytes:.3g} GB"
        )


def json_of(text: str) -> Any:
    """What the JSON ``text`` holds. Raises ValueError, also where it is nested deeper than Python
    can read."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("is nested too deeply") from None
