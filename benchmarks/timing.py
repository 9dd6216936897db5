"""Whole processes timed from outside, in turn.

As a program, ``python3 -I -S timing.py SECONDS CORE COMMAND...``, it runs one command in the current folder, on CORE
alone (on any if it is negative) with one thread, stops it after SECONDS, and prints as JSON what it took. What the
command prints goes to stdout.txt and stderr.txt. This file imports the standard library alone: Linux counts the memory
of the process that a command is started from as the command's own.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import threading
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

INTERRUPTED = "interrupted before its first run"
LIMIT = 600.0  # seconds
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "NUMEXPR_NUM_THREADS",
           "CCX_NPROC_EQUATION_SOLVER")  # fmt: skip


class Failure(RuntimeError):
    """A process that did not give a result; the message is one sentence."""


@dataclass(frozen=True)
class Process:
    """A ``command`` to be timed in its ``folder``, on one ``core`` (on any if negative), for ``limit`` seconds at most.

    ``read`` gives the result of a process that ended with code 0, and raises `Failure` if there is none. The files
    and folders ``clear`` of an earlier run are removed before. The first process of a ``kind`` runs once before all,
    untimed, so that what is compiled on first use is there.
    """

    command: tuple[str, ...]
    folder: Path
    read: Callable[[], Any] = lambda: None
    limit: float = LIMIT
    core: int = -1
    clear: tuple[str, ...] = ()
    kind: Hashable = None


@dataclass(frozen=True)
class Run:
    """Wall and processor time in seconds, largest resident memory in bytes, and result of one process."""

    seconds: float
    cpu: float
    memory: int
    result: Any


@dataclass
class Timing:
    """A process and its runs; ``failure`` is the sentence that ended them."""

    process: Process
    runs: list[Run] = field(default_factory=list)
    failure: str = ""

    @property
    def done(self) -> bool:
        """Whether there is a result."""
        return bool(self.runs) and not self.failure

    @property
    def median(self) -> float:
        """Median wall time."""
        return statistics.median(run.seconds for run in self.runs)

    @property
    def middle(self) -> Run:
        """The run with the median time; of two the quicker."""
        return sorted(self.runs, key=lambda run: run.seconds)[(len(self.runs) - 1) // 2]


Said = Callable[[Process, int, str], None]


def last_core() -> int:
    """The last core allowed to this process; -1 where the system knows no such thing."""
    return max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else -1


def time_all(
    processes: Sequence[Process], repeats: int, said: Said = lambda process, repeat, text: None
) -> list[Timing]:
    """Run every process ``repeats`` times, in turn, so that noise hits all alike; one that fails is not tried again.

    ``said(process, repeat, sentence)`` follows every run (0: untimed). After Ctrl-C what was timed is kept, and the
    others have a failure; it is raised again before the first result.
    """
    timings = [Timing(process) for process in processes]
    kinds: set[Hashable] = {None}
    try:
        for timing in timings:
            if timing.process.kind not in kinds:
                kinds.add(timing.process.kind)
                _add(timing, 0, said)
        for repeat in range(1, repeats + 1):
            for timing in (t for t in timings if not t.failure):
                _add(timing, repeat, said)
    except KeyboardInterrupt:
        if not any(timing.runs for timing in timings):
            raise
        for timing in timings:
            timing.failure = timing.failure or ("" if timing.runs else INTERRUPTED)
    return timings


def _add(timing: Timing, repeat: int, said: Said) -> None:
    try:
        run = run_once(timing.process)
    except Failure as failure:
        timing.failure = str(failure)
        said(timing.process, repeat, timing.failure)
        return
    if repeat:
        timing.runs.append(run)
    said(timing.process, repeat, f"{run.seconds:.2f} s")


def run_once(process: Process) -> Run:
    """One run. Raises `Failure`."""
    process.folder.mkdir(parents=True, exist_ok=True)
    for old in (process.folder / name for name in process.clear):
        if old.is_dir():
            shutil.rmtree(old)
        else:
            old.unlink(missing_ok=True)
    command = (sys.executable, "-I", "-S", __file__, repr(process.limit), str(process.core), *process.command)
    launched = subprocess.run(command, cwd=process.folder, capture_output=True, text=True)
    if launched.returncode:
        raise Failure(_last_line(launched.stderr) or f"cannot be started: {process.command[0]}")
    found = json.loads(launched.stdout)
    if found["late"]:
        raise Failure(f"more than the {process.limit:g} s allowed")
    if found["exit"]:
        texts = ((process.folder / name).read_text(errors="replace") for name in ("stderr.txt", "stdout.txt"))
        said = next((line for line in map(_last_line, texts) if line), "")
        raise Failure(said or f"ended with code {found['exit']}")
    return Run(found["seconds"], found["cpu"], found["memory"], process.read())


def _last_line(text: str) -> str:
    return next((line.strip() for line in reversed(text.splitlines()) if line.strip()), "")


def main(arguments: list[str]) -> int:
    """Run the command that ``arguments`` name and print what it took; returns 0."""
    limit, core, *command = arguments
    if int(core) >= 0:
        os.sched_setaffinity(0, {int(core)})
    with open("stdout.txt", "w") as out, open("stderr.txt", "w") as err:
        start = perf_counter()
        environment = os.environ | dict.fromkeys(THREADS, "1") | {"ARCHORD_KEEP_MESHES": "0"}  # each makes its own
        process = subprocess.Popen(command, stdout=out, stderr=err, env=environment, start_new_session=True)
        late, ended = threading.Event(), False

        def stop() -> None:
            late.set()
            os.killpg(process.pid, signal.SIGKILL)

        timer = threading.Timer(float(limit), stop)
        timer.start()
        try:
            _, status, usage = os.wait4(process.pid, 0)
            seconds, ended = perf_counter() - start, True
        finally:
            timer.cancel()
            if not ended:
                os.killpg(process.pid, signal.SIGKILL)
    process.returncode = os.waitstatus_to_exitcode(status)
    found = {"seconds": seconds, "cpu": usage.ru_utime + usage.ru_stime, "memory": usage.ru_maxrss * 1024}
    print(json.dumps(found | {"exit": process.returncode, "late": late.is_set()}))
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(143))
    sys.exit(main(sys.argv[1:]))
