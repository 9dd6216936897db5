"""``archord`` in processes of its own that start in no time: forked from one that has the solver
loaded.

Exit code, signals, open files and what is printed are those of a process; the start-up, a second,
is not repeated.
"""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

_FORKS = multiprocessing.get_context("forkserver")
_FORKS.set_forkserver_preload(
    [
        "gmsh",
        "archord.cli",
        "archord.materials.j2",
        "archord.commands.progress",
        "archord.commands.solve_commands",
        "archord.geometry.meshes.check",
        "archord.output.fields",
        "archord.output.restart",
        "archord.output.run",
        "archord.presets.general",
        "archord.presets.held",
        "archord.presets.joint_measures",
        "archord.studies.accuracy",
    ]
)


def start(
    arguments: list[str],
    folder: Path,
    out: Path,
    err: Path,
    before: Callable[[], None] | None = None,
) -> multiprocessing.process.BaseProcess:
    """``archord`` with these ``arguments`` in ``folder``, told to write to the files ``out`` and
    ``err``, after a call of ``before``."""
    process = _FORKS.Process(
        target=_run, args=(arguments, str(folder), str(out), str(err), before), daemon=True
    )
    process.start()
    return process


def archord(*arguments: str, cwd: Path) -> subprocess.CompletedProcess:
    """Run ``archord`` to its end, which must come within five minutes."""
    with tempfile.TemporaryDirectory() as place:
        out = Path(place, "out")
        err = Path(place, "err")
        process = start(list(arguments), cwd, out, err)
        process.join(300)
        assert process.exitcode is not None
        return subprocess.CompletedProcess(
            arguments, process.exitcode, out.read_text(), err.read_text()
        )


def _run(
    arguments: list[str], folder: str, out: str, err: str, before: Callable[[], None] | None
) -> None:
    if before is not None:
        before()
    for stream, name in ((1, out), (2, err)):
        os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_APPEND), stream)
    os.chdir(folder)
    from archord.cli import run

    code = run(arguments)
    sys.stdout.flush()
    sys.exit(code)


class Run:
    """An ``archord solve`` in a process of its own; ``printed`` is the last step that it
    reported."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.out = folder / "out"
        self.err = folder / "err"
        for file in (self.out, self.err):
            file.write_text("")
        self.process = start(["solve", *arguments], folder, self.out, self.err)
        while self.process.is_alive() and not self.out.stat().st_size:
            time.sleep(0.002)
        self.begun = time.monotonic()

    def end(self, after: float | None = None) -> int:
        """Wait until it ends, or for ``after`` seconds and kill it; the exit code."""
        self.process.join(after)
        self.process.kill()
        self.process.join()
        code = self.process.exitcode
        if code not in (0, -9):
            raise AssertionError(self.err.read_text())
        return code

    @property
    def printed(self) -> int:
        lines = self.out.read_text().rpartition("\n")[0].splitlines()
        first = [line.split()[0] for line in lines if line.strip() and "steps in" not in line]
        return max((int(word) for word in first if word.isdigit()), default=0)
