"""``python3 -m tests.fuzz`` solves thousands of scenes gone wrong (see `tests.fuzz.fuzzing`)."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.fuzz.fuzzing import run_case


def main() -> int:
    """Run the cases, print the failed and the slow ones and a tally; returns 1 if any failed."""
    parser = argparse.ArgumentParser(prog="python3 -m tests.fuzz", description=main.__doc__)
    parser.add_argument("--cases", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0, help="number of the first case [0]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=float, default=20.0, help="seconds a case may take [20]")
    parser.add_argument("--ranks", type=int, default=0, help="run the command under mpirun instead (slow)")
    parser.add_argument("--keep", type=Path, help="folder for the files of failed and slow cases [a temporary one]")
    given = parser.parse_args()
    keep = given.keep or Path(tempfile.mkdtemp(prefix="fuzz-"))
    keep.mkdir(parents=True, exist_ok=True)
    kinds: Counter[tuple[int, str]] = Counter()
    failed, begun = 0, time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
        for number in range(given.first, given.first + given.cases):
            folder = Path(scratch) / str(number)
            case = run_case(given.seed, number, folder, given.limit, given.ranks)
            kinds[case.code, case.kind] += 1
            failed += bool(case.faults)
            if case.faults or case.slow:
                shutil.rmtree(keep / str(number), ignore_errors=True)
                shutil.copytree(folder, keep / str(number), ignore=shutil.ignore_patterns("fields", "fields.h5"))
                what = "; ".join(case.faults) or "slow"
                print(f"case {number} ({case.base}, {case.kind}, {case.seconds:.1f} s): {what}", flush=True)
            shutil.rmtree(folder)
            if sys.stderr.isatty():
                print(f"\r{number + 1 - given.first} of {given.cases}", end="", file=sys.stderr)
    seconds = time.perf_counter() - begun
    print(f"{given.cases} cases, seed {given.seed}, in {seconds:.0f} s: {failed} failed; files in {keep}")
    for code in sorted({code for code, _ in kinds}):
        of_code = {kind: n for (c, kind), n in sorted(kinds.items()) if c == code}
        by_kind = ", ".join(f"{kind} {n}" for kind, n in of_code.items())
        print(f"  exit code {code}: {sum(of_code.values())} ({by_kind})")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
