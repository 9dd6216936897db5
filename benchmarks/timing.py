"""Whole processes timed from outside, in turn.

As a program, ``python3 -I -S timing.py SECONDS COMMAND...``, it runs one command in the current
folder with one thread, stops it after SECONDS, and prints as JSON what it took. What the command
prints goes to stdout.txt and stderr.txt. This file imports the standard library alone: Linux counts
the memory of the process that a command is started from as the command's own.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import statistics
import subprocess
import sys
from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

LIMIT = 600.0  # seconds
THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "CCX_NPROC_EQUATION_SOLVER",
)


class Failure(RuntimeError):
    """A process that did not give a result; the message is one sentence."""


@dataclass(frozen=True)
class Process:
    """A ``command`` to be timed in its ``folder``, for ``limit`` seconds at most; ``name`` tells it
    from others.

    ``read`` gives the result of a process that ended with code 0, and raises `Failure` if there is
    none. The files and folders ``clear`` of an earlier run are removed before. The first process of
    a ``kind`` runs once before all, untimed, so that what is compiled on first use is there.
    """

    name: str
    command: tuple[str, ...]
    folder: Path
    read: Callable[[], Any] = lambda: None
    limit: float = LIMIT
    clear: tuple[str, ...] = ()
    kind: Hashable = None


@dataclass(frozen=True)
class Run:
    """Wall and processor time in seconds, largest resident memory in bytes, and result of one
    process."""

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
    def median(self) -> float:
        """Median wall time."""
        return statistics.median(run.seconds for run in self.runs)

    @property
    def middle(self) -> Run:
        """The run with the median time; of two the quicker."""
        return sorted(self.runs, key=lambda run: run.seconds)[(len(self.runs) - 1) // 2]


Said = Callable[[str], None]


def solving(scene: str, output: str, *options: str) -> tuple[str, ...]:
    """The command with which a user solves a ``scene`` into the folder ``output``."""
    command = (sys.executable, "-m", "archord", "solve", scene, "-o", output, "--force", "-q")
    return command + options


def time_all(
    processes: Sequence[Process], repeats: int, said: Said = lambda sentence: None
) -> list[Timing]:
    """Run every process ``repeats`` times, in turn, so that noise hits all alike; one that fails is
    not tried again.

    ``said(sentence)`` follows every run. After Ctrl-C what was timed is kept, and the others have a
    failure; it is raised again before the first result.
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
            if not (timing.failure or timing.runs):
                timing.failure = "interrupted before its first run"
    return timings


def _add(timing: Timing, repeat: int, said: Said) -> None:
    try:
        run = run_once(timing.process)
        if repeat:
            timing.runs.append(run)
        counted = f"run {repeat}" if repeat else "not counted"
        text = f"{run.seconds:.2f} s, {counted}"
    except Failure as failure:
        text = timing.failure = str(failure)
    said(f"{timing.process.name}: {text}")


def run_once(process: Process) -> Run:
    """One run. Raises `Failure`."""
    folder = process.folder
    folder.mkdir(parents=True, exist_ok=True)
    for name in process.clear:
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).unlink(missing_ok=True)
    command = (sys.executable, "-I", "-S", __file__, repr(process.limit), *process.command)
    launched = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if launched.returncode:
        raise Failure(_last_line(launched.stderr) or f"cannot be started: {process.command[0]}")
    found = json.loads(launched.stdout)
    if found["late"]:
        raise Failure(f"more than the {process.limit:g} s allowed")
    if found["exit"]:
        for name in ("stderr.txt", "stdout.txt"):
            if said := _last_line((folder / name).read_text(errors="replace")):
                raise Failure(said)
        raise Failure(f"ended with code {found['exit']}")
    return Run(found["seconds"], found["cpu"], found["memory"], process.read())


def _last_line(text: str) -> str:
    return next((line.strip() for line in reversed(text.splitlines()) if line.strip()), "")


def main(limit: float, command: list[str]) -> None:
    """Run ``command`` for ``limit`` seconds at most and print what it took."""

    def stop(number: int, frame: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, stop)
    environment = (
        os.environ | dict.fromkeys(THREADS, "1") | {"ARCHORD_KEEP_MESHES": "0"}
    )  # each makes its own
    with open("stdout.txt", "w") as out, open("stderr.txt", "w") as err:
        start = perf_counter()
        process = subprocess.Popen(
            command, stdout=out, stderr=err, env=environment, start_new_session=True
        )
        signal.setitimer(signal.ITIMER_REAL, limit)
        try:
            with suppress(TimeoutError):
                process.wait()
                signal.setitimer(signal.ITIMER_REAL, 0)
        finally:
            seconds = perf_counter() - start
            late = process.poll() is None
            if late:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    found = {
        "seconds": seconds,
        "cpu": used.ru_utime + used.ru_stime,
        "memory": used.ru_maxrss * 1024,
    }
    print(json.dumps(found | {"exit": process.returncode, "late": late}))


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(143))
    main(float(sys.argv[1]), sys.argv[2:])
