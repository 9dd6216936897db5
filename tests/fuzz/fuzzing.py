"""`archord solve` on files gone wrong, and what it must never do.

Whatever is in a scene file, the command ends with 0 (solved), 2 (refused) or 3 (could not go on), without traceback or
warning of a library, writes nothing when it refuses, and only finite numbers when it does not. Each case runs in a
process of its own, with limits on memory, files and time; a case that a signal stops in order after the time limit
counts as slow, not as failed. The files of slow and failed cases are kept.
"""

from __future__ import annotations

import multiprocessing.process
import os
import resource
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from random import Random

from archord.benchmarks.stability.run import not_finite
from tests.forked import start
from tests.fuzz.mutations import base_scenes, mutate

_MEMORY, _FILE = 8 * 2**30, 2 * 2**30  # bytes that a case may use
_GRACE = 10.0  # seconds between the time limit's SIGTERM and SIGKILL
_STOPPED = 128 + signal.SIGTERM
_NOISE = ("Traceback", "PETSC ERROR", "RuntimeWarning", "Error:", "Warning :", "terminate called")


@dataclass(frozen=True)
class FuzzCase:
    """One mutated scene and how ``archord solve`` ended on it; ``faults`` is empty if all is well."""

    number: int
    base: str
    kind: str
    code: int
    seconds: float
    faults: list[str]

    @property
    def slow(self) -> bool:
        """Whether the time limit stopped it."""
        return self.code == _STOPPED


def scene_of(seed: int, number: int) -> tuple[str, str, bytes]:
    """Base, kind of mutation and content of case ``number`` under ``seed``; the same wherever it is asked for."""
    rng = Random(f"{seed}/{number}")
    bases = base_scenes()
    base = rng.choice(list(bases))
    return base, *mutate(rng, bases[base])


def run_case(seed: int, number: int, folder: Path, limit: float, ranks: int = 0) -> FuzzCase:
    """Solve case ``number`` in ``folder``, which is made for it, within ``limit`` seconds.

    With ``ranks``, mpirun runs the command; without, a forked process, which is quick.
    """
    base, kind, content = scene_of(seed, number)
    folder.mkdir(parents=True)
    (folder / "scene.toml").write_bytes(content)
    begun = time.perf_counter()
    arguments = ["solve", str(folder / "scene.toml"), "-o", str(folder / "run")]
    out, err = folder / "stdout", folder / "stderr"
    if ranks:
        code = _code_of_mpirun(ranks, arguments, out, err, limit)
    else:
        code = _code_of_fork(start(arguments, folder, out, err, before=limit_resources), limit)
    return FuzzCase(number, base, kind, code, time.perf_counter() - begun, faults(folder, code))


def limit_resources() -> None:
    """Limit what this process may use."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (_FILE, _FILE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _code_of_fork(process: multiprocessing.process.BaseProcess, limit: float) -> int:
    """Exit code of the process, minus the signal's number if one killed it; SIGTERM after ``limit`` seconds."""
    process.join(limit)
    for end in (process.terminate, process.kill):
        if process.exitcode is None:
            end()
            process.join(_GRACE)
    assert process.exitcode is not None
    return process.exitcode


def _code_of_mpirun(ranks: int, arguments: list[str], out: Path, err: Path, limit: float) -> int:
    launcher = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    command = [*launcher, sys.executable, "-m", "archord", *arguments]
    with out.open("wb") as stdout, err.open("wb") as stderr:
        # the environment as it was: this process may have added to it what tells mpirun that it is a rank
        process = subprocess.Popen(
            command, stdout=stdout, stderr=stderr, preexec_fn=limit_resources, env=dict(os.environ)
        )
    for seconds, end in ((limit, process.terminate), (_GRACE, process.kill)):
        try:
            return process.wait(seconds)
        except subprocess.TimeoutExpired:
            end()
    return process.wait()


def faults(folder: Path, code: int) -> list[str]:
    """What is wrong with a case that ended with ``code`` in ``folder``."""
    said = (folder / "stderr").read_text(encoding="utf-8", errors="replace")
    run, lines = folder / "run", said.splitlines()
    found = [f"{word!r} on stderr" for word in _NOISE if word in said]
    if code == 2:
        wrong = {
            "refused, yet a run folder was left": run.exists(),
            "refused without a word": not lines,
            "refused in something that is no sentence": any(not line.endswith(".") for line in lines),
            "refused at great length": len(said) > 20000 or any(len(line) > 2000 for line in lines),
        }
        return found + [fault for fault, seen in wrong.items() if seen]
    if code not in (0, 3, _STOPPED):
        return [*found, f"exit code {code}"]
    if code == 3 and "archord: " not in said:
        found.append("stopped without a reason")
    return found + (not_finite(run)[:5] if run.exists() else [])
