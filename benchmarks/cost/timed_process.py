"""One command, timed from outside: ``python3 -I -S timed_process.py SECONDS CORE COMMAND...`` in the command's folder.

Prints as JSON its wall time, its largest resident memory in bytes, its exit code and whether it was stopped after
SECONDS. The command runs on CORE alone (on any if it is negative) with one thread; what it prints goes to stdout.txt
and stderr.txt. A program of its own, of the standard library only: Linux counts the memory of the process that a
command is started from as the command's own.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from time import perf_counter

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "NUMEXPR_NUM_THREADS")


def main(arguments: list[str]) -> int:
    """Run the command that ``arguments`` name and print what it took; returns 0."""
    limit, core, *command = arguments
    if int(core) >= 0 and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core)})
    environment = os.environ | dict.fromkeys((*THREADS, "CCX_NPROC_EQUATION_SOLVER"), "1")
    with open("stdout.txt", "w") as out, open("stderr.txt", "w") as err:
        start = perf_counter()
        process = subprocess.Popen(command, stdout=out, stderr=err, env=environment, start_new_session=True)
        late = threading.Event()

        def stop() -> None:
            late.set()
            os.killpg(process.pid, signal.SIGKILL)

        timer = threading.Timer(float(limit), stop)
        timer.start()
        ended = False
        try:
            _, status, usage = os.wait4(process.pid, 0)
            seconds, ended = perf_counter() - start, True
        finally:
            timer.cancel()
            if not ended:
                os.killpg(process.pid, signal.SIGKILL)
    process.returncode = os.waitstatus_to_exitcode(status)
    found = {"seconds": seconds, "memory": usage.ru_maxrss * 1024, "exit": process.returncode, "late": late.is_set()}
    print(json.dumps(found))
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(143))
    sys.exit(main(sys.argv[1:]))
