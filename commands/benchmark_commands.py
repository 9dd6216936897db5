"""``archord benchmark`` and ``archord reproduce``: how the solver fares over many scenes."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from time import perf_counter

import click

from archord.commands.options import Group, argument, complain, output, quiet
from archord.report.by_name import Names
from archord.report.errors import InputError

Say = Callable[[str], None]


def _repeats(default: int, of: str) -> Callable:
    help = f"runs of {of}; the median counts"
    return click.option("--repeats", type=click.IntRange(1), default=default, help=help)


def _telling(quiet: bool) -> Say:
    """Prints sentences with the time since now; on stderr, as ranks other than 0 tell, too, and
    stdout has tables."""
    begun = perf_counter()

    def say(sentence: str) -> None:
        if not quiet:
            print(f"{perf_counter() - begun:7.1f} s  {sentence}", file=sys.stderr, flush=True)

    return say


def _conclude(printed: str, files: Iterable[Path], faults: list[str], quiet: bool) -> int:
    """Print a benchmark's tables, what it wrote, and what is wrong; the exit code."""
    if not quiet:
        print(printed, *files, sep="\n")
    complain(*faults)
    return int(bool(faults))


@click.command()
@argument("figures", "[FIGURE]...", "fig2 ... fig9, or all", nargs=-1, type=str)
@output("folder for runs, tables, pictures, report", "runs/paper")
@click.option(
    "--strain",
    type=click.Choice(["small", "large"]),
    default="small",
    help="analysis.strain of all runs",
)
@quiet()
def reproduce(figures: Names, output: Path, strain: str, quiet: bool) -> int:
    """Solve what the paper's figures need, and write each as CSV and picture; all of them with a
    report.

    Runs that are there already are not solved again. Under mpirun the ranks solve different runs
    side by side.
    """
    from mpi4py import MPI

    from archord.benchmarks.paper.reproduce import reproduce as make

    comm = MPI.COMM_WORLD
    try:
        files = make(figures or ["all"], output, comm, _telling(quiet), strain)
    except RuntimeError as error:
        if comm.rank == 0:
            complain(str(error))
        return 3
    if not quiet:
        print(*files, sep="\n")
    return 0


@click.group(cls=Group)
def benchmark() -> None:
    """Benchmarks of the solver."""


@benchmark.command()
@output("folder for runs and table", "runs/stability")
@click.option("--only", metavar="PATTERN", help="cases or groups with such a name")
@quiet("what is wrong")
def stability(output: Path, only: str | None, quiet: bool) -> int:
    """Solve a table of extreme scenes, each within a budget, and hold every line against what it
    must give.

    Under mpirun the ranks solve different scenes side by side. Exit code 0 only if every scene is
    as it should be.
    """
    from mpi4py import MPI

    from archord.benchmarks.stability import run as table

    comm = MPI.COMM_WORLD
    lines = table.run(table.chosen(only), output / "runs", comm, _telling(quiet))
    wrong = [
        f"{line.case.group}: {line.case.name}: {line.verdict}" for line in lines if line.faults
    ]
    return int(bool(wrong)) if comm.rank else _conclude(*table.write(lines, output), wrong, quiet)


@benchmark.command()
@output("folder for runs and table", "runs/scaling")
@click.option(
    "--largest",
    type=click.FloatRange(5000),
    default=1_000_000,
    metavar="N",
    help="dofs of the largest mesh",
)
@click.option(
    "--ranks", type=click.IntRange(1), default=2, metavar="N", help="solve on 1, 2, 4, ... N ranks"
)
@_repeats(1, "each case")
@quiet("what is wrong")
def scaling(output: Path, largest: float, ranks: int, repeats: int, quiet: bool) -> int:
    """Solve the paper's joint on ever finer meshes and several ranks: time by part and memory per
    rank.

    Exit code 0 only if every run finishes, with the same force on any number of ranks.
    """
    from archord.benchmarks.cost import scaling as table

    costs, faults = table.run(
        table.settings(largest, ranks), output / "runs", repeats, _telling(quiet)
    )
    return _conclude(*table.write(costs, output), faults, quiet)


@benchmark.command()
@click.argument(
    "group", type=click.Choice(["joint", "sweep", "yielding", "strategies"]), default="joint"
)
@output("folder for runs and table", "runs/variants")
@_repeats(3, "each variant")
@quiet("what is wrong")
def variants(group: str, output: Path, repeats: int, quiet: bool) -> int:
    """Solve scenes with one thing switched, by turns, and tell what each variant loads, needs and
    writes.

    GROUP is joint (one scene in variants), sweep (on two ranks and on one), yielding (a sweep of
    joints that yield, with and without what a sweep leaves out) or strategies (without each linear
    strategy, for hours). Exit code 0 only if none loads what it does not use.
    """
    from archord.benchmarks.case import write_table
    from archord.benchmarks.cost import variants as table

    rows, faults = table.run(table.variants(group), output / "runs", repeats, _telling(quiet))
    return _conclude(*write_table(output, "variants", rows), faults, quiet)


@benchmark.command()
@output("folder for runs and table", "runs/accuracy")
@click.option(
    "--only", default="", show_default=False, metavar="PATTERN", help="joints with such a name"
)
@quiet("what is wrong")
def accuracy(output: Path, only: str, quiet: bool) -> int:
    """Solve several joints to several accuracies, and compare what was asked, estimated and true.

    Exit code 0 only if all errors are below what was asked.
    """
    from archord.benchmarks.case import matches, write_table
    from archord.benchmarks.cost import accuracy as table

    cases = tuple(case for case in table.CASES if matches(only, case.name))
    if not cases:
        raise InputError(
            f"--only {only}: must be part of {', '.join(case.name for case in table.CASES)}."
        )
    rows, faults = table.run(output / "runs", cases, _telling(quiet))
    return _conclude(*write_table(output, "accuracy", rows), faults, quiet)


@benchmark.command("work-precision")
@output("folder for runs, tables and diagrams", "runs/work_precision")
@click.option(
    "--only",
    multiple=True,
    metavar="PATTERN",
    help='part of "case: code, series, mesh"; may be repeated',
)
@_repeats(3, "every point")
@click.option(
    "--limit", type=click.FloatRange(1.0), default=600.0, help="seconds that a process may take"
)
@quiet("what failed")
def work_precision(output: Path, only: Names, repeats: int, limit: float, quiet: bool) -> int:
    """Time series of meshes, elastic and elasto-plastic, archord's and other codes', and set error
    against time.

    Every point is a whole process with one thread, the median of all repeats. Exit code 0 if all of
    archord's points were solved.
    """
    from archord.benchmarks.cost import work_precision as table

    lines = table.run(output / "runs", only, repeats, limit, _telling(quiet))
    failed = [line for line in lines if line.timing.failure and line.point.code == "archord"]
    faults = [f"{line.point.name}: {line.timing.failure}" for line in failed]
    return _conclude(*table.write(lines, output), faults, quiet)


@benchmark.command()
@output("folder for the table", "runs/outside")
@click.option(
    "--only", default="", show_default=False, metavar="PATTERN", help="problems with such a name"
)
@quiet()
def outside(output: Path, only: str, quiet: bool) -> int:
    """Solve problems that others have set, on several meshes, and print them beside the published
    values."""
    from archord.benchmarks.outside import table

    problems = table.chosen(only)
    if not problems:
        names = ", ".join(problem.name for problem in table.PROBLEMS)
        raise InputError(f"--only {only}: must be part of {names}.")
    rows = table.run(problems, _telling(quiet))
    return _conclude(*table.write(rows, problems, output), [], quiet)
