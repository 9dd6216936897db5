"""One point of the work-precision diagram: a whole process, timed from outside, again and again."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from archord.benchmarks.cost import timed_process
from archord.benchmarks.cost.work_precision_cases import Kinematics
from archord.geometry.basis import Array

INTERRUPTED = "interrupted before its first run"
LIMIT = 600.0  # seconds that a process may take


class RunFailure(RuntimeError):
    """A process that did not give a result; the message is one sentence."""


@dataclass(frozen=True)
class Values:
    """What a code found at the last step: ``quantities`` (P/(E* R), p0/E*, eps [rad], dissipation/(E* R2)) and the
    pressure ``profile`` ``(401,)`` over E*, of the ``side`` "pin" or "hole", or "both", their mean; what it does
    not tell is absent."""

    quantities: dict[str, float]
    dofs: int
    kinematics: Kinematics = "current"
    iterations: int | None = None
    factorisations: int | None = None
    profile: Array | None = None
    side: str = "hole"


@dataclass(frozen=True)
class Task:
    """A process to be timed: ``code`` on the mesh ``label`` of a ``series`` of ``case``.

    ``read`` gives the values after a process that ended with code 0, and raises `RunFailure` if there are none.
    ``size`` is the element size over R, ``export`` the seconds that writing its input took before.
    """

    case: str
    code: str
    series: str
    label: str
    size: float
    steps: int
    command: tuple[str, ...]
    folder: Path
    read: Callable[[], Values]
    limit: float = LIMIT
    export: float = 0.0
    clear: tuple[str, ...] = ()  # files of an earlier run, removed before each
    version: str = ""


@dataclass
class Point:
    """A task and what became of it: wall times in seconds of all repeats, or the ``failure`` that ended them."""

    task: Task
    seconds: list[float] = field(default_factory=list)
    memory: int = 0
    values: Values | None = None
    failure: str = ""

    @property
    def median(self) -> float:
        """Median wall time."""
        return statistics.median(self.seconds)

    @property
    def done(self) -> bool:
        """Whether there is a result."""
        return not self.failure and self.values is not None


def pinned_core() -> int:
    """The core that everything timed is pinned to: the last one allowed; -1 where the system knows no such thing."""
    return max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else -1


def run_once(task: Task, core: int) -> tuple[float, int, Values]:
    """Wall time in seconds, largest resident memory in bytes and the values. Raises `RunFailure`."""
    task.folder.mkdir(parents=True, exist_ok=True)
    for name in task.clear:
        (task.folder / name).unlink(missing_ok=True)
    launcher = (sys.executable, "-I", "-S", timed_process.__file__, repr(task.limit), str(core))
    launched = subprocess.run([*launcher, *task.command], cwd=task.folder, capture_output=True, text=True)
    if launched.returncode:
        raise RunFailure(_last_line(launched.stderr) or f"cannot be started: {task.command[0]}")
    found = json.loads(launched.stdout)
    if found["late"]:
        raise RunFailure(f"more than the {task.limit:g} s allowed")
    if found["exit"]:
        raise RunFailure(_said(task.folder) or f"ended with code {found['exit']}")
    return found["seconds"], found["memory"], task.read()


def run_all(
    tasks: Sequence[Task],
    repeats: int,
    said: Callable[[Task, int, str], None] = lambda task, repeat, sentence: None,
    core: int | None = None,
) -> list[Point]:
    """Time every task ``repeats`` times, in turn, so that noise hits all alike.

    The first task of each code, case and series runs once before, untimed, so that what is compiled on first use is
    there. A task that fails once is not tried again. ``said(task, repeat, sentence)`` follows every run (0: untimed).
    After Ctrl-C the points are those that were timed, and the others have a failure; it is raised again before the
    first.
    """
    core = pinned_core() if core is None else core
    points = [Point(task) for task in tasks]
    try:
        _time_all(points, repeats, core, said)
    except KeyboardInterrupt:
        if not any(point.seconds for point in points):
            raise
        for point in points:
            point.failure = point.failure or ("" if point.seconds else INTERRUPTED)
    return points


def _time_all(points: list[Point], repeats: int, core: int, said: Callable[[Task, int, str], None]) -> None:
    kinds: set[tuple[str, str, str]] = set()
    for point in points:
        kind = point.task.code, point.task.case, point.task.series
        if kind not in kinds:
            kinds.add(kind)
            _run(point, 0, core, said)
    for repeat in range(1, repeats + 1):
        for point in points:
            if not point.failure:
                _run(point, repeat, core, said)


def _run(point: Point, repeat: int, core: int, said: Callable[[Task, int, str], None]) -> None:
    try:
        seconds, memory, point.values = run_once(point.task, core)
    except RunFailure as failure:
        point.failure = str(failure)
        said(point.task, repeat, point.failure)
        return
    if repeat:
        point.seconds.append(seconds)
        point.memory = max(point.memory, memory)
    said(point.task, repeat, f"{seconds:.2f} s")


def _said(folder: Path) -> str:
    """The last line that a process wrote to stderr, or else to stdout."""
    texts = ((folder / name).read_text(errors="replace") for name in ("stderr.txt", "stdout.txt"))
    return next((line for line in map(_last_line, texts) if line), "")


def _last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""
