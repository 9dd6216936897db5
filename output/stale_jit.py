"""Forms whose compilation a kill ended: ffcx leaves a file behind that makes every later process wait, and fail."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
_WAIT = 9.0  # seconds; ffcx waits 10 for another process to compile a form before it gives up
_TRIES = 3


def without_stale_forms(make: Callable[[], T]) -> T:
    """What ``make()`` returns, which compiles forms, after removing files that a kill left in ffcx' cache."""
    for _ in range(_TRIES - 1):
        try:
            return make()
        except (TimeoutError, RuntimeError) as error:
            if not _forget(str(error)):
                raise
    return make()


def _forget(said: str) -> bool:
    """Whether ``said`` is ffcx's complaint about a form whose compilation never ended; removes its file, unless another
    process has just begun to compile the form."""
    if "JIT compilation timed out" not in said:
        return "just-in-time compilation" in said  # another rank of the group saw it, and removes it
    named = re.search(r"remove (.*?)\)", said)
    if named is None:
        return False
    path = Path(named[1])
    with suppress(OSError):
        if time.time() - path.stat().st_mtime > _WAIT:
            path.unlink()
    return True
