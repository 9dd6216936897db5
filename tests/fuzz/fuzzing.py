"""`archord solve` on files gone wrong, and what it must never do.

Whatever is in a scene file, the command ends with 0 (solved), 2 (refused) or 3 (could not go on),
without traceback or warning of a library, writes nothing when it refuses, and only finite numbers
when it does not. Each case runs in a process of its own, with limits on memory, files and time; one
that a signal stops in order after the time limit is slow, which is no fault. ``pytest tests/fuzz
--cases 1000`` solves that many.
"""

from __future__ import annotations

import resource
import shutil
import signal
from pathlib import Path
from random import Random
from typing import NamedTuple

from archord.benchmarks.stability.run import not_finite
from tests.forked import start
from tests.fuzz.mesh_mutations import mutate_mesh
from tests.fuzz.mutations import GENERAL, base_scenes, mutate

# bytes that a case may use
_MEMORY = 8 * 2**30
_FILE = 2 * 2**30
# seconds that a case may take, and between SIGTERM and SIGKILL after them
_LIMIT = 20.0
_GRACE = 10.0
SLOW = 128 + signal.SIGTERM
_NOISE = ("Traceback", "PETSC ERROR", "RuntimeWarning", "Error:", "Warning :", "terminate called")


class FuzzCase(NamedTuple):
    """The kind of a mutated scene and how ``archord solve`` ended on it; ``faults`` is empty if all
    is well."""

    kind: str
    code: int
    faults: list[str]


def scene_of(number: int) -> tuple[str, bytes]:
    """Kind of mutation and content of case ``number``; the same wherever it is asked for."""
    rng = Random(number)
    return mutate(rng, rng.choice(list(base_scenes().values())))


def run_case(number: int, folder: Path) -> FuzzCase:
    """Solve case ``number`` in ``folder``, which is made for it."""
    kind, content = scene_of(number)
    folder.mkdir(parents=True)
    (folder / "scene.toml").write_bytes(content)
    for mesh in GENERAL.glob("*.inp"):
        shutil.copy(mesh, folder)
    return _solved(kind, folder)


def run_mesh_case(number: int, folder: Path) -> FuzzCase:
    """Solve a sound scene on the mesh of case ``number`` in ``folder``, which is made for it."""
    rng = Random(number)
    folder.mkdir(parents=True)
    shutil.copy(GENERAL / "blocks.toml", folder / "scene.toml")
    kind, text = mutate_mesh(rng, (GENERAL / "blocks.inp").read_text(encoding="utf-8"))
    (folder / "blocks.inp").write_text(text, encoding="utf-8")
    return _solved(kind, folder)


def _solved(kind: str, folder: Path) -> FuzzCase:
    """How ``archord solve`` ends in ``folder``."""
    arguments = ["solve", "scene.toml", "-o", "run"]
    process = start(
        arguments, folder, folder / "stdout", folder / "stderr", before=_limit_resources
    )
    process.join(_LIMIT)
    for end in (process.terminate, process.kill):
        if process.exitcode is None:
            end()
            process.join(_GRACE)
    assert process.exitcode is not None
    return FuzzCase(kind, process.exitcode, faults(folder, process.exitcode))


def _limit_resources() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (_FILE, _FILE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def faults(folder: Path, code: int) -> list[str]:
    """What is wrong with a case that ended with ``code`` in ``folder``."""
    said = (folder / "stderr").read_text(encoding="utf-8", errors="replace")
    run = folder / "run"
    lines = said.splitlines()
    wrong = {f"{word!r} on stderr": word in said for word in _NOISE} | {
        f"exit code {code}": code not in (0, 2, 3, SLOW),
        "refused, yet a run folder was left": code == 2 and run.exists(),
        "refused without a word": code == 2 and not lines,
        "refused in something that is no sentence": code == 2
        and any(not line.endswith(".") for line in lines),
        "refused at great length": code == 2
        and (len(said) > 20000 or any(len(line) > 2000 for line in lines)),
        "stopped without a reason": code == 3 and "archord: " not in said,
    }
    found = [fault for fault, seen in wrong.items() if seen]
    return found + (not_finite(run)[:5] if code in (0, 3, SLOW) and run.exists() else [])
