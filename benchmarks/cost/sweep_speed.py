"""How much faster several ranks finish a sweep than one: both in turn, each a command of its own, timed from outside.

``python3 -m archord.benchmarks.cost.sweep_speed scenes/stiffness.sweep.toml`` takes some minutes. Nothing else
should run.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from archord.benchmarks.cost.scaling_run import launcher
from archord.benchmarks.report_files import markdown_table


@dataclass(frozen=True)
class Pair:
    """Wall and processor time in seconds of a sweep on one rank and on several, start to end."""

    alone: float
    together: float
    alone_cpu: float
    together_cpu: float

    @property
    def times_faster(self) -> float:
        """Wall time on one rank over that on several."""
        return self.alone / self.together


def timed(sweep: Path, ranks: int) -> tuple[float, float]:
    """Wall and processor time of ``sweep`` on ``ranks``. Raises RuntimeError if it failed."""
    with tempfile.TemporaryDirectory() as folder:
        command = (sys.executable, "-m", "archord", "sweep", str(sweep), "-q", "-o", folder)
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
        ended = subprocess.run([*launcher(ranks), *command], capture_output=True, text=True)
        seconds, after = perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if ended.returncode:
        raise RuntimeError(f"{sweep} on {ranks} ranks ended with code {ended.returncode}: {ended.stderr.strip()}")
    return seconds, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(sweep: Path, ranks: int) -> Pair:
    """One pair. Raises RuntimeError if a sweep failed, `InputError` without mpirun."""
    alone, alone_cpu = timed(sweep, 1)
    together, together_cpu = timed(sweep, ranks)
    return Pair(alone, together, alone_cpu, together_cpu)


def table(pairs: list[Pair], ranks: int) -> list[str]:
    """The pairs and their medians as a table in Markdown."""
    headings = (
        "pair",
        "1 rank [s]",
        f"{ranks} ranks [s]",
        "times faster",
        "CPU, 1 rank [s]",
        f"CPU, {ranks} ranks [s]",
    )

    def cells(name: str, *values: float) -> list[str]:
        return [name, *(f"{v:.2f}" if i == 2 else f"{v:.1f}" for i, v in enumerate(values))]

    columns = [(p.alone, p.together, p.times_faster, p.alone_cpu, p.together_cpu) for p in pairs]
    rows = [cells(str(number), *values) for number, values in enumerate(columns, start=1)]
    rows.append(cells("median", *(statistics.median(column) for column in zip(*columns, strict=True))))
    return markdown_table(headings, rows)


def main() -> int:
    """Time the pairs and print their table."""
    parser = argparse.ArgumentParser(prog="python3 -m archord.benchmarks.cost.sweep_speed", description=main.__doc__)
    parser.add_argument("sweep", type=Path, help="its .sweep.toml")
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--pairs", type=int, default=7)
    options = parser.parse_args()
    if min(options.ranks, options.pairs) < 1:
        parser.error("--ranks and --pairs must be at least 1")
    pairs = []
    for number in range(1, options.pairs + 1):
        pairs.append(measure(options.sweep, options.ranks))
        print(
            f"pair {number} of {options.pairs}: {pairs[-1].times_faster:.2f} times faster", file=sys.stderr, flush=True
        )
    print(*table(pairs, options.ranks), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
