"""How much faster several ranks finish a sweep than one: both in turn, each a command of its own, timed from outside.

``python3 -m archord.benchmarks.cost.sweep_speed scenes/stiffness.sweep.toml`` takes some minutes. Nothing else
should run.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median

from archord.benchmarks.cost.scaling import launcher
from archord.benchmarks.timing import Process, Run, time_all
from archord.report.table import Table

_A_DAY = 86400.0  # seconds


def measure(
    sweep: Path, ranks: int, pairs: int, said: Callable[[str], None] = lambda sentence: None
) -> tuple[list[Run], list[Run]]:
    """The runs of ``sweep`` on one rank and on ``ranks``, in turn; ``said`` follows each. Raises RuntimeError if one
    failed, `InputError` without mpirun."""
    archord = (sys.executable, "-m", "archord", "sweep", str(sweep.resolve()), "-q", "-o", "sweep")
    with tempfile.TemporaryDirectory() as place:
        # what is there is not solved again
        processes = [Process((*launcher(n), *archord), Path(place), limit=_A_DAY, clear=("sweep",)) for n in (1, ranks)]
        timings = time_all(processes, pairs, lambda process, repeat, text: said(f"pair {repeat} of {pairs}: {text}"))
    for n, timing in zip((1, ranks), timings, strict=True):
        if timing.failure:
            raise RuntimeError(f"{sweep} on {n} ranks: {timing.failure}")
    return timings[0].runs, timings[1].runs


def table(alone: list[Run], together: list[Run], ranks: int) -> Table:
    """The pairs and their medians."""
    found = Table(
        "pair", "1 rank [s]", f"{ranks} ranks [s]", "times faster", "CPU, 1 rank [s]", f"CPU, {ranks} ranks [s]"
    )
    pairs = [(a.seconds, b.seconds, a.seconds / b.seconds, a.cpu, b.cpu) for a, b in zip(alone, together, strict=True)]
    rows: list[tuple[object, tuple]] = [*enumerate(pairs, 1), ("median", tuple(map(median, zip(*pairs, strict=True))))]
    for name, (first, second, faster, *cpu) in rows:
        found.add(name, f"{first:.1f}", f"{second:.1f}", f"{faster:.2f}", *(f"{seconds:.1f}" for seconds in cpu))
    return found


def main() -> int:
    """Time the pairs and print their table."""
    parser = argparse.ArgumentParser(prog="python3 -m archord.benchmarks.cost.sweep_speed", description=main.__doc__)
    parser.add_argument("sweep", type=Path, help="its .sweep.toml")
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--pairs", type=int, default=7)
    options = parser.parse_args()
    if min(options.ranks, options.pairs) < 1:
        parser.error("--ranks and --pairs must be at least 1")
    runs = measure(options.sweep, options.ranks, options.pairs, lambda text: print(text, file=sys.stderr, flush=True))
    print(table(*runs, options.ranks).markdown(), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
