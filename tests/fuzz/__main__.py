"""``python3 -m tests.fuzz`` solves thousands of scenes gone wrong (see `tests.fuzz.fuzzing`)."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.fuzz.fuzzing import SLOW, run_case


def main(arguments: list[str] | None = None) -> int:
    """Solve the cases, print the failed and the slow ones, whose files are kept, and a tally; returns 1 if any
    failed."""
    parser = argparse.ArgumentParser(prog="python3 -m tests.fuzz", description=main.__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="number of the first case [0]")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    kinds: Counter[str] = Counter()
    failed = 0
    for number in range(given.first, given.first + given.cases):
        case = run_case(given.seed, number, folder / str(number))
        kinds[f"exit code {case.code}: {case.kind}"] += 1
        failed += bool(case.faults)
        if case.faults or case.code == SLOW:
            print(f"case {number} ({case.kind}): {'; '.join(case.faults) or 'slow'}", flush=True)
        else:
            shutil.rmtree(folder / str(number))
    print(f"{given.cases} cases, seed {given.seed}: {failed} failed; files in {folder}")
    print("\n".join(f"  {kind} {number}" for kind, number in sorted(kinds.items())))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
