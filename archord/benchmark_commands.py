"""``archord benchmark`` and ``archord reproduce``: how the solver fares over many scenes."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from time import perf_counter

import click

from archord.options import argument, flag, output, quiet
from archord.scene.errors import InputError

Say = Callable[[str], None]


def _repeats(help: str, default: int) -> Callable:
    return click.option("--repeats", type=click.IntRange(1), default=default, help=help)


def _telling(quiet: bool) -> Say:
    """Prints sentences with the time since now; on stderr, as ranks other than 0 tell, too, and stdout has tables."""
    begun = perf_counter()

    def say(sentence: str) -> None:
        if not quiet:
            print(f"{perf_counter() - begun:7.1f} s  {sentence}", file=sys.stderr, flush=True)

    return say


def _conclude(printed: str, files: Iterable[Path], faults: Iterable[str], quiet: bool) -> int:
    """Print a benchmark's tables, what it wrote, and what is wrong; the exit code."""
    faults = list(faults)
    if not quiet:
        print(printed)
        for file in files:
            print(file)
    for fault in faults:
        print(f"archord: {fault}.", file=sys.stderr)
    return 1 if faults else 0


@click.command()
@argument("figures", "[FIGURE]...", "fig2 ... fig9, or all", nargs=-1, type=str)
@output("folder for runs, tables, pictures, report", "runs/paper")
@quiet()
def reproduce(figures: tuple[str, ...], output: Path, quiet: bool) -> int:
    """Solve what the paper's figures need, and write each as CSV and picture; all of them with a report.

    Runs that are there already are not solved again. Under mpirun the ranks solve different runs side by side.
    """
    from mpi4py import MPI

    from archord.benchmarks.paper.reproduce import chosen
    from archord.benchmarks.paper.reproduce import reproduce as make

    comm, say = MPI.COMM_WORLD, _telling(quiet)
    wanted = chosen(list(figures) or ["all"])
    try:
        files = make(wanted, output, comm, lambda case, P: say(f"{case.name:34s} P(2 dR)/(E* R) = {P:.6f}"))
    except RuntimeError as error:
        if comm.rank == 0:
            print(f"archord: {error}.", file=sys.stderr)
        return 3
    if not quiet:
        for file in files:
            print(file)
    return 0


@click.group()
def benchmark() -> None:
    """Benchmarks of the solver."""


@benchmark.command()
@output("folder for runs, table and heat map", "runs/stability")
@click.option("--only", metavar="PATTERN", help="cases or groups with such a name")
@quiet("what is wrong")
def stability(output: Path, only: str | None, quiet: bool) -> int:
    """Solve a table of extreme scenes, each within a budget, and hold every line against what it must give.

    Writes stability.csv, stability.md and stability.png. Under mpirun the ranks solve different scenes side by side.
    Exit code 0 only if every scene is as it should be.
    """
    from mpi4py import MPI

    from archord.benchmarks.stability import run as table
    from archord.benchmarks.stability.report import markdown, write

    comm, say = MPI.COMM_WORLD, _telling(quiet)

    def said(case, result) -> None:
        say(
            f"{case.group}: {case.name}: {result.status}, {result.steps} steps, "
            f"{result.iterations} iterations, {result.cutbacks} cutbacks, {result.seconds:.1f} s"
        )

    lines = table.run(table.chosen(only), output / "runs", comm, said)
    wrong = [f"{line.case.group}: {line.case.name}: {line.verdict}" for line in lines if line.faults]
    if comm.rank != 0:
        return 1 if wrong else 0
    return _conclude(markdown(lines), write(lines, output), wrong, quiet)


@benchmark.command()
@output("folder for runs, tables and picture", "runs/scaling")
@click.option(
    "--largest", type=float, default=1_000_000, metavar="N", help="dofs of the largest mesh, 1 million at most"
)
@click.option("--ranks", default="1,2", metavar="1,2", help="numbers of ranks, 1 first")
@_repeats("runs of each case, 3 of a million dofs; the median counts", 1)
@quiet("what is wrong")
def scaling(output: Path, largest: float, ranks: str, repeats: int, quiet: bool) -> int:
    """Solve the paper's joint on ever finer meshes and several ranks: time by part and memory per rank.

    Writes scaling.csv, scaling.md and scaling.png. Exit code 0 only if every run finishes, with the same force on any
    number of ranks.
    """
    from archord.benchmarks.cost import scaling as table
    from archord.benchmarks.cost.scaling_report import markdown, write

    if not all(part.strip().isdecimal() for part in ranks.split(",")):
        raise InputError(f"--ranks {ranks}: must be whole numbers with commas between them, like 1,2.")
    say = _telling(quiet)

    def said(cost) -> None:
        what = cost.fault or f"{cost.dofs} dofs, {cost.total:.1f} s, {cost.peak / 1e6:.0f} MB"
        say(f"{cost.setting.name}: {what}")

    costs = table.Costs(table.run(largest, [int(part) for part in ranks.split(",")], output / "runs", repeats, said))
    return _conclude(markdown(costs), write(costs, output), costs.faults(), quiet)


@benchmark.command()
@output("folder for runs and table", "runs/variants")
@_repeats("runs of each variant; the median counts", 3)
@quiet("what is wrong")
def variants(output: Path, repeats: int, quiet: bool) -> int:
    """Solve one scene in variants, and tell what each loads, needs and writes.

    Writes variants.csv and variants.md. Exit code 0 only if none loads what it does not use.
    """
    from archord.benchmarks.cost import variants as table

    uses = table.run(table.variants(), output / "runs", repeats, _telling(quiet))
    faults = [fault for use in uses for fault in use.faults()]
    return _conclude(*table.write(uses, output), faults, quiet)


@benchmark.command()
@output("folder for runs and table", "runs/accuracy")
@click.option("--only", default="", show_default=False, metavar="PATTERN", help="joints with such a name")
@quiet("what is wrong")
def accuracy(output: Path, only: str, quiet: bool) -> int:
    """Solve several joints to several accuracies, and compare what was asked, estimated and true.

    Writes accuracy.csv and accuracy.md. Exit code 0 only if all errors are below what was asked.
    """
    from archord.benchmarks.case import matches
    from archord.benchmarks.cost import accuracy as table

    cases = tuple(case for case in table.CASES if matches(only, case.name))
    if not cases:
        raise InputError(f"--only {only}: must be part of {', '.join(case.name for case in table.CASES)}.")
    lines = table.run(output / "runs", cases, _telling(quiet))
    faults = [fault for line in lines if (fault := line.fault())]
    return _conclude(*table.write(lines, output), faults, quiet)


@benchmark.command("work-precision")
@output("folder for runs, tables and diagrams", "runs/work_precision")
@click.option("--case", default="both", help="elastic, plastic or both")
@click.option("--only", multiple=True, metavar="PATTERN", help='codes, series or "code, series, mesh"; may be repeated')
@_repeats("timed runs of every point", 3)
@click.option("--peers/--no-peers", default=True, help="CalculiX and other codes that are here")
@click.option("--limit", type=click.FloatRange(1.0), default=600.0, help="seconds that a process may take")
@flag("--quick", "the coarsest meshes alone, to see that it works")
@flag("--warm", "time curves within one process, too")
@flag("--reference", "solve the fine meshes and store the reference values, nothing else")
@quiet("what failed")
def work_precision(output: Path, case: str, reference: bool, quiet: bool, **options) -> int:
    """Time series of meshes, elastic and elasto-plastic, archord's and other codes', and set error against time.

    Writes work_precision.csv, work_precision.md and a diagram for each case. Every point is a whole process on one core
    with one thread, the median of all repeats. Exit code 0 if all of archord's points were solved.
    """
    from archord.benchmarks.cost.work_precision_cases import CASES

    say, cases = _telling(quiet), [known for known in CASES.values() if case in (known.name, "both")]
    if not cases:
        raise InputError(f"--case {case}: must be {', '.join(CASES)} or both.")
    try:
        if reference:
            return _store_reference(cases, output / "reference", say)
        return _work_precision(cases, output, say, quiet=quiet, **options)
    except RuntimeError as error:
        print(f"archord: {error}.", file=sys.stderr)
        return 3


def _store_reference(cases, folder: Path, say: Say) -> int:
    from archord.benchmarks.cost.work_precision_reference import FILE, compute
    from archord.benchmarks.cost.work_precision_report import reference_table

    for case in cases:
        for kinematics in ("current", "reference"):
            compute(case, kinematics, folder, say)
    print(reference_table(cases).markdown(), end="")
    print(FILE)
    return 0


def _work_precision(
    cases,
    output: Path,
    say: Say,
    *,
    only: tuple[str, ...],
    repeats: int,
    peers: bool,
    limit: float,
    quick: bool,
    warm: bool,
    quiet: bool,
) -> int:
    from archord.benchmarks.cost.work_precision import judge, warm_seconds
    from archord.benchmarks.cost.work_precision_codes import chosen, tasks
    from archord.benchmarks.cost.work_precision_report import markdown, write
    from archord.benchmarks.timing import INTERRUPTED, time_all
    from archord.output.folder import claim_folder

    claim_folder(output, force=True)
    found = [t for case in cases for t in tasks(case, output / "runs", quick=quick, peers=peers, limit=limit)]

    def said(task, repeat: int, sentence: str) -> None:
        counted = f"{repeat} of {repeats}" if repeat else "not counted"
        say(f"{task.case}: {task.name}: {sentence} ({counted})")

    lines = [judge(timing) for timing in time_all(chosen(found, only), repeats, said)]
    whole = all(len(line.timing.runs) == repeats for line in lines if line.timing.failure in ("", INTERRUPTED))
    seconds = warm_seconds(repeats) if warm and whole else None
    failed = [line for line in lines if line.timing.failure not in ("", INTERRUPTED)]
    faults = [f"{line.task.case}: {line.task.name}: {line.timing.failure}" for line in failed]
    _conclude(markdown(lines, seconds), write(lines, output, seconds), faults, quiet)
    if not whole:
        print("archord: interrupted; the tables have what was timed before.", file=sys.stderr)
        return 130
    return 1 if any(line.task.code == "archord" for line in failed) else 0
