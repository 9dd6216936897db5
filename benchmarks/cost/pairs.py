"""Two commands by turns, each a process of its own, timed from outside. Nothing else should run.

``python3 -m archord.benchmarks.cost.pairs sweep FILE``: how much faster two ranks finish a sweep than one.
``python3 -m archord.benchmarks.cost.pairs strategies``: what each linear strategy takes off the whole time of a case;
docs/development/linear_strategies.md says what was decided by it. All cases take about twenty minutes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median

from archord.benchmarks.case import matches, paper_joint
from archord.benchmarks.cost.scaling import launcher, refined
from archord.benchmarks.timing import Process, Run, time_all
from archord.report.table import Table
from archord.scene.file import resolved

_A_DAY = 86400.0  # seconds
_LARGE = 300_000  # dofs
_OUTPUT = "out"  # folder of every run; what a sweep finds there is not solved again
WITHOUT = {
    "revised": "from archord.solver.linear import condensed; condensed._MOST_REVISIONS = 0",
    **{
        name: f"from archord.solver.linear.choose import LEFT_OUT; LEFT_OUT.add({name!r})"
        for name in ("condensed", "lagged", "substructured")
    },
}
_CHANGED = "{}; import sys; from archord.cli import run; sys.exit(run(sys.argv[1:]))"


def command(ranks: int, arguments: Sequence[str], change: str = "") -> tuple[str, ...]:
    """``archord ARGUMENTS`` on ``ranks`` ranks, after the Python statement ``change`` if there is one; its output goes
    into `_OUTPUT`. Raises `InputError` without mpirun."""
    program = ("-c", _CHANGED.format(change)) if change else ("-m", "archord")
    return (*launcher(ranks), sys.executable, *program, *arguments, "-q", "-o", _OUTPUT)


def timed(
    one: Sequence[str], other: Sequence[str], pairs: int, said: Callable[[str], None] = lambda text: None
) -> tuple[list[Run], list[Run]]:
    """The ``pairs`` runs of either command, in turn, after one of the first that is not counted; ``said`` follows each.
    Raises `RuntimeError` if one failed."""
    with tempfile.TemporaryDirectory() as place:
        processes = [
            Process(tuple(side), Path(place) / str(k), limit=_A_DAY, clear=(_OUTPUT,), kind="warm")
            for k, side in enumerate((one, other))
        ]
        found = time_all(processes, pairs, lambda process, repeat, text: said(f"pair {repeat} of {pairs}: {text}"))
    for timing in found:
        if timing.failure:
            raise RuntimeError(f"{' '.join(timing.process.command)}: {timing.failure}")
    return found[0].runs, found[1].runs


def sweep_table(alone: Sequence[Run], together: Sequence[Run], ranks: int) -> Table:
    """The pairs and their medians."""
    on = f"{ranks} ranks"
    found = Table("pair", "1 rank [s]", f"{on} [s]", "times faster", "CPU, 1 rank [s]", f"CPU, {on} [s]")
    pairs = [(a.seconds, b.seconds, a.seconds / b.seconds, a.cpu, b.cpu) for a, b in zip(alone, together, strict=True)]
    rows: list[tuple[object, tuple]] = [*enumerate(pairs, 1), ("median", tuple(map(median, zip(*pairs, strict=True))))]
    for name, (first, second, faster, *cpu) in rows:
        found.add(name, f"{first:.1f}", f"{second:.1f}", f"{faster:.2f}", *(f"{seconds:.1f}" for seconds in cpu))
    return found


def saved(kept: Sequence[Run], left: Sequence[Run], what: str) -> float:
    """The part of ``what`` ("seconds" or "cpu") that the runs ``kept`` take less than those ``left``, pair by pair in
    the middle."""
    return 1 - median(getattr(a, what) / getattr(b, what) for a, b in zip(kept, left, strict=True))


def strategy_cases(folder: Path) -> Iterator[tuple[str, int, str, tuple[str, ...]]]:
    """Name, ranks, strategy and arguments of each case; its scene is written into ``folder``."""
    size, growth = refined(_LARGE)
    sweep = ("sweep", str(Path("scenes/stiffness.sweep.toml").resolve()))
    large = paper_joint(size, 4, joint={"growth": growth})
    for name, ranks, strategies, scene in (
        ("elastic, 8 steps", 1, ("condensed", "revised"), paper_joint(0.04, 8)),
        ("plastic, 20 steps", 2, ("substructured",), paper_joint(0.04, 20, 0.002)),
        ("sweep of 24 elastic joints", 2, ("condensed", "revised"), None),
        ("elastic, 300 thousand dofs, 4 steps", 1, ("lagged",), large),
        ("elastic, 300 thousand dofs, 4 steps", 2, ("lagged", "substructured"), large),
    ):
        file = folder / f"{name}.toml"
        if scene is not None:
            file.write_text(resolved(scene), encoding="utf-8")
        for strategy in strategies:
            yield name, ranks, strategy, sweep if scene is None else ("solve", str(file))


def strategy_table(only: str, pairs: int, said: Callable[[str], None]) -> Table:
    """A row for each case and strategy whose name has ``only`` in it."""
    table = Table("case", "ranks", "without", "with [s]", "without [s]", "takes off", "CPU: takes off", left=1)
    with tempfile.TemporaryDirectory() as place:
        for name, ranks, strategy, arguments in strategy_cases(Path(place)):
            if matches(only, name, strategy):
                said(f"{name}, on {ranks}, without {strategy}")
                kept, left = (command(ranks, arguments, change) for change in ("pass", WITHOUT[strategy]))
                runs = timed(kept, left, pairs, said)
                seconds = (f"{median(run.seconds for run in side):.2f}" for side in runs)
                table.add(
                    name, ranks, strategy, *seconds, *(f"{saved(*runs, what):.0%}" for what in ("seconds", "cpu"))
                )
    return table


def main() -> int:
    """Time pairs and print their table; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python3 -m archord.benchmarks.cost.pairs", description=main.__doc__)
    parser.add_argument("--pairs", type=int, default=5)
    commands = parser.add_subparsers(dest="what", required=True)
    sweep = commands.add_parser("sweep", help="a sweep on one rank and on several")
    sweep.add_argument("file", type=Path, help="its .sweep.toml")
    sweep.add_argument("--ranks", type=int, default=2)
    strategies = commands.add_parser("strategies", help="cases with and without each linear strategy")
    strategies.add_argument("--only", default="*", help="a part of the names of cases or strategies")
    options = parser.parse_args()
    if options.pairs < 1 or (options.what == "sweep" and options.ranks < 1):
        parser.error("--ranks and --pairs must be at least 1")

    def said(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    if options.what == "strategies":
        table = strategy_table(options.only, options.pairs, said)
    else:
        alone, together = (command(ranks, ("sweep", str(options.file.resolve()))) for ranks in (1, options.ranks))
        table = sweep_table(*timed(alone, together, options.pairs, said), options.ranks)
    print(table.markdown(), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
