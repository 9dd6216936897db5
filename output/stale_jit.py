"""Forms whose compilation a kill ended: ffcx leaves a file behind that makes every later process wait, and fail."""

from __future__ import annotations

import re
import time
from pathlib import Path

_WAIT = 9.0  # seconds; ffcx waits 10 for another process to compile a form before it gives up


def forget_half_compiled(said: str) -> bool:
    """Whether ``said`` is ffcx's complaint about a form whose compilation never ended, as a kill leaves it; removes it.

    Unless another process has just begun to compile it anew.
    """
    if "JIT compilation timed out" not in said:
        return "just-in-time compilation" in said  # another rank of the group saw it, and removes it
    named = re.search(r"remove (.*?)\)", said)
    if named is None:
        return False
    path = Path(named[1])
    try:
        if time.time() - path.stat().st_mtime > _WAIT:
            path.unlink()
    except OSError:
        pass
    return True
