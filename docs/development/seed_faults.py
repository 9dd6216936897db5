"""Seeds the faults of seeded_faults.toml, one at a time, and says which test catches each.

    python3 docs/development/seed_faults.py [-j JOBS] [WORD...]

Each fault replaces one text of one file in a copy of the tree, in a temporary folder; the tests
that it names run there. With words, only faults whose names hold one of them are seeded. A fault
with ``ranks`` is run under mpirun on as many ranks, by the tests that are marked mpi.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
FAULTS = Path(__file__).with_name("seeded_faults.toml")
_BROKEN = 1  # pytest's exit code where tests have failed
_SLOWEST = 600  # seconds: a fault that makes a solver run for ever is caught, too


def copy_tree(target: Path) -> None:
    """Copy what git knows of the tree, and the compiled forms, into ``target``."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True)
    for name in filter(None, listed.stdout.decode().split("\0")):
        place = target / name
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, place, follow_symlinks=False)
    if (ROOT / ".cache").is_dir():
        shutil.copytree(ROOT / ".cache", target / ".cache")


def command(fault: dict[str, Any]) -> list[str]:
    """The tests of a ``fault``."""
    options = ["-q", "-x", "-n", "0", "--color=no", "-p", "no:cacheprovider", *fault["tests"]]
    ranks = fault.get("ranks", 1)
    if ranks == 1:
        return ["docker/run", "python3", "-m", "pytest", *options]
    launch = ["docker/run", "mpirun", "-n", str(ranks), "python3", "-m", "pytest", "-m", "mpi"]
    return [*launch, *options]


def seed(fault: dict[str, Any], tree: Path) -> str:
    """Seed a ``fault`` in a copy of the tree; returns the test that catches it, "" for none."""
    path = tree / fault["file"]
    right = path.read_text(encoding="utf-8")
    if right.count(fault["old"]) != 1:
        return f"cannot be seeded: its old text is there {right.count(fault['old'])} times"
    path.write_text(right.replace(fault["old"], fault["new"]), encoding="utf-8")
    try:
        done = subprocess.run(
            command(fault), cwd=tree, capture_output=True, text=True, timeout=_SLOWEST, check=False
        )
    except subprocess.TimeoutExpired:
        return f"no end within {_SLOWEST} s"
    finally:
        path.write_text(right, encoding="utf-8")
    found = re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, re.MULTILINE)
    if found:
        return found[0]
    return "" if done.returncode == 0 else f"exit code {done.returncode}: {done.stdout[-300:]}"


def main() -> None:
    """Seed the faults and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    parser.add_argument("words", nargs="*")
    given = parser.parse_args()
    faults = tomllib.loads(FAULTS.read_text(encoding="utf-8"))["fault"]
    chosen = [f for f in faults if not given.words or any(w in f["name"] for w in given.words)]
    trees: Queue[Path] = Queue()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(given.jobs):
            tree = Path(folder) / str(number)
            copy_tree(tree)
            trees.put(tree)

        def judge(fault: dict[str, Any]) -> bool:
            tree = trees.get()
            caught_by = seed(fault, tree)
            trees.put(tree)
            print(f"{fault['name']}: {caught_by or 'NOT CAUGHT'}", flush=True)
            return bool(caught_by)

        with ThreadPoolExecutor(given.jobs) as pool:
            caught = sum(pool.map(judge, chosen))
    print(f"{caught} of {len(chosen)} caught")


if __name__ == "__main__":
    main()
