"""``python3 -m archord.benchmarks.stability.fuzz``: `archord solve` on files gone wrong, and what it must never do.

Whatever is in a scene file, the command ends with 0 (solved), 2 (refused) or 3 (could not go on), without traceback or
warning of a library, writes nothing when it refuses, and no number that is not one when it does not. Each case runs in
a process of its own, forked from one that has the solver loaded, with limits on memory, files and time; a case that a
signal stops in order after the time limit counts as slow, not as failed. The files of slow and failed cases are kept.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random

import h5py
import numpy as np

from archord.benchmarks.stability.mutations import base_scenes, mutate
from archord.output.step_file import all_arrays

_MEMORY, _FILE = 8 * 2**30, 2 * 2**30  # bytes that a case may use
_GRACE = 10.0  # seconds between the time limit's SIGTERM and SIGKILL
_STOPPED = 128 + signal.SIGTERM
_NOISE = ("Traceback", "PETSC ERROR", "RuntimeWarning", "Error:", "Warning :", "terminate called")
Launch = Callable[[Path, Path], int]


@dataclass(frozen=True)
class Case:
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


def run_case(seed: int, number: int, folder: Path, limit: float, ranks: int = 0) -> Case:
    """Solve case ``number`` in ``folder``, which is made for it, within ``limit`` seconds.

    With ``ranks``, mpirun runs the command; without, it is called in a forked process (`preload` makes that quick).
    """
    base, kind, content = scene_of(seed, number)
    folder.mkdir(parents=True)
    (folder / "scene.toml").write_bytes(content)
    begun = time.perf_counter()
    process = _mpirun(folder, ranks) if ranks else _fork(folder)
    code = _wait(process, limit)
    seconds = time.perf_counter() - begun
    return Case(number, base, kind, code, seconds, faults(folder, code))


def preload() -> None:
    """Import what a solve needs, so that forked cases do not."""
    import gmsh  # noqa: F401


def _command(folder: Path) -> list[str]:
    return ["solve", str(folder / "scene.toml"), "-o", str(folder / "run")]


def _limit_resources() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (_FILE, _FILE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _fork(folder: Path) -> int:
    """Run the command in a child; returns its process id."""
    sys.stdout.flush()
    pid = os.fork()
    if pid:
        return pid
    code = 70
    try:
        _limit_resources()
        for stream, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(folder / name, os.O_WRONLY | os.O_CREAT), stream)
        from archord.cli import run

        code = run(_command(folder))
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


def _mpirun(folder: Path, ranks: int) -> int:
    launcher = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    command = [*launcher, sys.executable, "-m", "archord", *_command(folder)]
    with (folder / "stdout").open("wb") as out, (folder / "stderr").open("wb") as err:
        return subprocess.Popen(command, stdout=out, stderr=err, preexec_fn=_limit_resources).pid


def _wait(pid: int, limit: float) -> int:
    """Exit code of the process, minus the signal's number if one killed it; SIGTERM after ``limit`` seconds."""
    deadline, sent = time.monotonic() + limit, False
    pause = 1e-3
    while True:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > deadline:
            os.kill(pid, signal.SIGKILL if sent else signal.SIGTERM)
            deadline, sent = time.monotonic() + _GRACE, True
        time.sleep(pause)
        pause = min(0.05, 1.2 * pause)


def faults(folder: Path, code: int) -> list[str]:
    """What is wrong with a case that ended with ``code`` in ``folder``."""
    said = (folder / "stderr").read_text(encoding="utf-8", errors="replace")
    run = folder / "run"
    found = [f"{word!r} on stderr" for word in _NOISE if word in said]
    if code not in (0, 2, 3, _STOPPED):
        found.append(f"exit code {code}")
    if code == 2:
        if run.exists():
            found.append("refused, yet a run folder was left")
        lines = said.splitlines()
        if not lines:
            found.append("refused without a word")
        if any(not line.endswith(".") for line in lines):
            found.append("refused in something that is no sentence")
        if len(said) > 20000 or any(len(line) > 2000 for line in lines):
            found.append("refused at great length")
    elif code == 3 and "archord: " not in said:
        found.append("stopped without a reason")
    if code in (0, 3, _STOPPED) and run.exists():
        found += not_numbers(run)
    return found


def not_numbers(run: Path) -> list[str]:
    """Places in a run folder's files, as far as its steps were accepted, that hold nan or infinity."""
    found = []
    history = run / "history.csv"
    if history.exists():
        names, *rows = [line.split(",") for line in history.read_text(encoding="utf-8").splitlines()]
        found += sorted({f"{n} in history.csv" for row in rows for n, v in zip(names, row, strict=True) if _bad(v)})
    if (run / "run.json").exists():
        constants: list[str] = []
        json.loads((run / "run.json").read_text(encoding="utf-8"), parse_constant=constants.append)
        found += [f"{name} in run.json" for name in sorted(set(constants))]
    for name in ("fields.h5", "contact.h5"):
        if (run / name).exists():
            found += _bad_datasets(run / name)
    return found


def _bad(entry: str) -> bool:
    return not math.isfinite(float(entry))


def _bad_datasets(path: Path) -> list[str]:
    with h5py.File(path, "r") as file:
        found = [f"{name} in {path.name}" for name, values in all_arrays(file) if not np.isfinite(values).all()]
    return found[:3]


def main() -> int:
    """Run the cases, print the failed and the slow ones and a tally; returns 1 if any failed."""
    parser = argparse.ArgumentParser(prog="python3 -m archord.benchmarks.stability.fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0, help="number of the first case [0]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=float, default=20.0, help="seconds a case may take [20]")
    parser.add_argument("--ranks", type=int, default=0, help="run the command under mpirun instead (slow)")
    parser.add_argument("--keep", type=Path, help="folder for the files of failed and slow cases [a temporary one]")
    given = parser.parse_args()
    keep = given.keep or Path(tempfile.mkdtemp(prefix="fuzz-"))
    keep.mkdir(parents=True, exist_ok=True)
    if not given.ranks:
        preload()
    codes: Counter[int] = Counter()
    kinds: Counter[tuple[str, int]] = Counter()
    failed = 0
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
        for number in range(given.first, given.first + given.cases):
            folder = Path(scratch) / str(number)
            case = run_case(given.seed, number, folder, given.limit, given.ranks)
            codes[case.code] += 1
            kinds[case.kind, case.code] += 1
            failed += bool(case.faults)
            if case.faults or case.slow:
                shutil.rmtree(keep / str(number), ignore_errors=True)
                shutil.copytree(
                    folder,
                    keep / str(number),
                    ignore=lambda _, names: [n for n in names if n in ("fields", "fields.h5")],
                )
                what = "; ".join(case.faults) or "slow"
                print(f"case {number} ({case.base}, {case.kind}, {case.seconds:.1f} s): {what}", flush=True)
            shutil.rmtree(folder, ignore_errors=True)
            if sys.stderr.isatty():
                print(f"\r{number + 1 - given.first} of {given.cases}", end="", file=sys.stderr)
    print(
        f"{given.cases} cases, seed {given.seed}, in {time.perf_counter() - begun:.0f} s: "
        f"{failed} failed; files in {keep}"
    )
    for code, count in sorted(codes.items()):
        by_kind = ", ".join(f"{kind} {n}" for (kind, c), n in sorted(kinds.items()) if c == code)
        print(f"  exit code {code}: {count} ({by_kind})")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
