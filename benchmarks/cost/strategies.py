"""What each linear strategy takes off the whole time of a case: ``python3 -m archord.benchmarks.cost.strategies``.

Runs with and without it take turns, each a command of its own, timed from outside. Nothing else should run; all cases
take about twenty minutes. docs/development/linear_strategies.md has the table, and what it decided.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from archord.benchmarks.case import matches, paper_joint
from archord.benchmarks.cost.scaling import launcher, refined
from archord.benchmarks.timing import Process, time_all
from archord.report.table import Table
from archord.scene.file import resolved

_LARGE = 300_000  # dofs
_WITHOUT = {
    "revised": "from archord.solver.linear import condensed; condensed._MOST_REVISIONS = 0",
    **{
        name: f"from archord.solver.linear.choose import LEFT_OUT; LEFT_OUT.add({name!r})"
        for name in ("condensed", "lagged", "substructured")
    },
}
_COMMAND = "{}; import sys; from archord.cli import run; sys.exit(run(sys.argv[1:]))"


@dataclass(frozen=True)
class _Case:
    name: str
    ranks: int
    strategies: tuple[str, ...]
    arguments: tuple[str, ...]


def _cases(folder: Path) -> list[_Case]:
    """The cases; scenes that are made for them lie in ``folder``."""
    size, growth = refined(_LARGE)
    made = {
        "elastic": paper_joint(0.04, 8),
        "plastic": paper_joint(0.04, 20, 0.002),
        "large": paper_joint(size, 4, joint={"growth": growth}),
    }
    for name, scene in made.items():
        (folder / f"{name}.toml").write_text(resolved(scene), encoding="utf-8")
    sweep = Path("scenes/stiffness.sweep.toml").resolve()

    def solve(name: str) -> tuple[str, ...]:
        return "solve", str(folder / f"{name}.toml"), "-q", "--force", "-o", str(folder / "run")

    return [
        _Case("elastic, 8 steps", 1, ("condensed", "revised"), solve("elastic")),
        _Case("plastic, 20 steps", 2, ("substructured",), solve("plastic")),
        _Case("sweep of 24 elastic joints", 2, ("condensed", "revised"), ("sweep", str(sweep), "-q", "-o")),
        _Case("elastic, 300 thousand dofs, 4 steps", 1, ("lagged",), solve("large")),
        _Case("elastic, 300 thousand dofs, 4 steps", 2, ("lagged", "substructured"), solve("large")),
    ]


def main() -> int:
    """Time the pairs and print a row for each case and strategy; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python3 -m archord.benchmarks.cost.strategies", description=main.__doc__)
    parser.add_argument("--only", default="*", help="a part of the names of cases or strategies")
    parser.add_argument("--pairs", type=int, default=5)
    options = parser.parse_args()
    table = Table("case", "ranks", "without", "with [s]", "without [s]", "takes off", "CPU: takes off", left=1)
    with tempfile.TemporaryDirectory() as place:
        for case in _cases(Path(place)):
            for strategy in case.strategies:
                if not matches(options.only, case.name, strategy):
                    continue
                row = _measured(case, strategy, Path(place), options.pairs)
                print(*row, sep=", ", file=sys.stderr, flush=True)
                table.add(*row)
    print(table.markdown(), end="")
    return 0


def _measured(case: _Case, strategy: str, place: Path, pairs: int) -> list[object]:
    """The row of ``strategy`` in ``case``. Raises RuntimeError if a run failed."""
    runs = []
    for name, change in (("with", "pass"), ("without", _WITHOUT[strategy])):
        arguments = [*case.arguments, *(["sweep"] if case.arguments[0] == "sweep" else [])]
        command = (*launcher(case.ranks), sys.executable, "-c", _COMMAND.format(change), *arguments)
        # what a sweep finds is not solved again
        runs.append(Process(command, place / name, clear=("sweep",), kind=case.name))
    timings = time_all(runs, pairs)
    failure = next((t.failure for t in timings if t.failure), "")
    if failure:
        raise RuntimeError(f"{case.name} without {strategy}: {failure}")
    kept, left = (t.runs for t in timings)

    def share(what: str) -> str:
        ratios = [getattr(a, what) / getattr(b, what) for a, b in zip(kept, left, strict=True)]
        return f"{1 - median(ratios):.0%}"

    seconds = (f"{t.median:.2f}" for t in timings)
    return [case.name, case.ranks, strategy, *seconds, share("seconds"), share("cpu")]


if __name__ == "__main__":
    sys.exit(main())
