"""How much memory a rank needed."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

_KILOBYTES = 1 if sys.platform == "darwin" else 1024  # unit of ru_maxrss in bytes


def peak_memory() -> int:
    """The largest resident set of this process so far, in bytes.

    Linux hands ``ru_maxrss`` down to the programs that a process starts; its file of the process itself begins anew.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        return 1024 * next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM:"))
    except (OSError, StopIteration, ValueError):
        return _KILOBYTES * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
