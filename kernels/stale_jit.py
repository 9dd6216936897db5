"""Forms whose compilation a kill ended: ffcx leaves a file behind that makes every later process
wait, and fail."""

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
    """What ``make()`` returns, which compiles forms, after removing files that a kill left in ffcx'
    cache, unless another process has just begun to compile."""
    for _ in range(_TRIES - 1):
        try:
            return make()
        except (TimeoutError, RuntimeError) as error:
            named = re.search(r"JIT compilation timed out.*remove (.*?)\)", str(error), re.DOTALL)
            if named is None and "just-in-time compilation" not in str(
                error
            ):  # as the group's other ranks say
                raise
            with suppress(OSError):
                if named is not None and time.time() - Path(named[1]).stat().st_mtime > _WAIT:
                    Path(named[1]).unlink()
    return make()
