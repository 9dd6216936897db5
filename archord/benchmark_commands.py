"""``archord benchmark``: how the solver fares over many scenes."""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter
from typing import Annotated

from archord.plain_typer import typer

benchmark = typer.Typer(no_args_is_help=True, help="Benchmarks of the solver.", rich_markup_mode=None)


@benchmark.callback()
def _group() -> None:
    """Benchmarks of the solver."""


@benchmark.command()
def stability(
    output: Annotated[Path, typer.Option("-o", "--output", help="folder for runs, table and heat map")] = Path(
        "runs/stability"
    ),
    only: Annotated[
        str | None, typer.Option("--only", metavar="PATTERN", help="cases or groups with such a name")
    ] = None,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print nothing but what is wrong")] = False,
) -> int:
    """Solve a table of extreme scenes, each within a budget, and hold every line against what it must give.

    Writes stability.csv, stability.md and stability.png. Under mpirun the ranks solve different scenes side by side.
    Exit code 0 only if every scene is as it should be.
    """
    from mpi4py import MPI

    from archord.benchmarks.stability import run as table

    begun, comm = perf_counter(), MPI.COMM_WORLD
    names = table.chosen(only)

    def said(case, result) -> None:
        if not quiet:
            # stderr, as ranks other than 0 report their cases too
            print(
                f"{perf_counter() - begun:7.1f} s  {case.group}: {case.name}: {result.status}, {result.steps} steps, "
                f"{result.iterations} iterations, {result.cutbacks} cutbacks, {result.seconds:.1f} s",
                file=sys.stderr,
                flush=True,
            )

    lines = table.run(names, output / "runs", comm, said)
    wrong = [line for line in lines if line.faults]
    if comm.rank == 0:
        from archord.benchmarks.stability.report import markdown, write

        files = write(lines, output)
        if not quiet:
            print(markdown(lines))
            for file in files:
                print(file)
        for line in wrong:
            print(f"archord: {line.case.group}: {line.case.name}: {line.verdict}.", file=sys.stderr)
    return 1 if wrong else 0


@benchmark.command()
def scaling(
    output: Annotated[Path, typer.Option("-o", "--output", help="folder for runs, tables and picture")] = Path(
        "runs/scaling"
    ),
    largest: Annotated[
        float, typer.Option("--largest", metavar="N", help="dofs of the largest mesh, 1 million at most")
    ] = 1_000_000,
    ranks: Annotated[str, typer.Option("--ranks", metavar="1,2", help="numbers of ranks, 1 first")] = "1,2",
    repeats: Annotated[
        int, typer.Option("--repeats", min=1, help="runs of each case, 3 of a million dofs; the median counts")
    ] = 1,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print nothing but what is wrong")] = False,
) -> int:
    """Solve the paper's joint on ever finer meshes and several ranks: time by part and memory per rank.

    Writes scaling.csv, scaling.md and scaling.png. Exit code 0 only if every run finishes, with the same force on any
    number of ranks.
    """
    from archord.benchmarks.cost import scaling as table
    from archord.benchmarks.cost.scaling_report import markdown, write_report
    from archord.scene.errors import InputError

    if not all(part.strip().isdecimal() for part in ranks.split(",")):
        raise InputError(f"--ranks {ranks}: must be whole numbers with commas between them, like 1,2.")

    def said(cost) -> None:
        if not quiet:
            what = cost.fault or f"{cost.dofs} dofs, {cost.total:.1f} s, {cost.peak / 1e6:.0f} MB"
            print(f"{cost.case.name}: {what}", file=sys.stderr, flush=True)

    costs = table.Costs(table.run(largest, [int(part) for part in ranks.split(",")], output / "runs", repeats, said))
    files = write_report(costs, output)
    if not quiet:
        print(markdown(costs))
        for file in files:
            print(file)
    for fault in costs.faults():
        print(f"archord: {fault}.", file=sys.stderr)
    return 1 if costs.faults() else 0


@benchmark.command()
def variants(
    output: Annotated[Path, typer.Option("-o", "--output", help="folder for runs and table")] = Path("runs/variants"),
    repeats: Annotated[int, typer.Option("--repeats", min=1, help="runs of each variant; the median counts")] = 3,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print nothing but what is wrong")] = False,
) -> int:
    """Solve one scene in variants, and tell what each loads, needs and writes.

    Writes variants.csv and variants.md. Exit code 0 only if none loads what it does not use.
    """
    from archord.benchmarks.cost import variants as table

    def said(use) -> None:
        if not quiet:
            print(f"{use.variant.name}: {use.seconds:.2f} s, {use.modules} modules", file=sys.stderr, flush=True)

    uses = table.run(output / "runs", repeats, said)
    files = table.write_report(uses, output)
    faults = [fault for use in uses for fault in use.faults()]
    if not quiet:
        print(table.markdown(uses))
        for file in files:
            print(file)
    for fault in faults:
        print(f"archord: {fault}.", file=sys.stderr)
    return 1 if faults else 0


@benchmark.command()
def accuracy(
    output: Annotated[Path, typer.Option("-o", "--output", help="folder for runs and table")] = Path("runs/accuracy"),
    only: Annotated[str, typer.Option("--only", metavar="PATTERN", help="joints with such a name")] = "",
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print nothing but what is wrong")] = False,
) -> int:
    """Solve several joints to several accuracies, and compare what was asked, estimated and true.

    Writes accuracy.csv and accuracy.md. Exit code 0 only if all errors are below what was asked.
    """
    from archord.benchmarks.cost import accuracy as table
    from archord.benchmarks.cost.work_precision_cases import matches
    from archord.scene.errors import InputError

    def said(sentence: str) -> None:
        if not quiet:
            print(f"{perf_counter() - begun:7.1f} s  {sentence}", file=sys.stderr, flush=True)

    begun, cases = perf_counter(), tuple(case for case in table.CASES if matches(only, case.name))
    if not cases:
        raise InputError(f"--only {only}: must be part of {', '.join(case.name for case in table.CASES)}.")
    lines = table.run(output / "runs", cases, said)
    files = table.write_report(lines, output)
    if not quiet:
        print(table.markdown(lines))
        for file in files:
            print(file)
    faults = [fault for line in lines if (fault := line.fault())]
    for fault in faults:
        print(f"archord: {fault}.", file=sys.stderr)
    return 1 if faults else 0


@benchmark.command("work-precision")
def work_precision(
    output: Annotated[Path, typer.Option("-o", "--output", help="folder for runs, tables and diagrams")] = Path(
        "runs/work_precision"
    ),
    case: Annotated[str, typer.Option("--case", help="elastic, plastic or both")] = "both",
    only: Annotated[
        list[str] | None,
        typer.Option("--only", metavar="PATTERN", help='codes, series or "code, series, mesh"; may be repeated'),
    ] = None,
    repeats: Annotated[int, typer.Option("--repeats", min=1, help="timed runs of every point")] = 3,
    peers: Annotated[bool, typer.Option("--peers/--no-peers", help="CalculiX and other codes that are here")] = True,
    limit: Annotated[float, typer.Option("--limit", min=1.0, help="seconds that a process may take")] = 600.0,
    quick: Annotated[bool, typer.Option("--quick", help="the coarsest meshes alone, to see that it works")] = False,
    warm: Annotated[bool, typer.Option("--warm", help="time curves within one process, too")] = False,
    reference: Annotated[
        bool, typer.Option("--reference", help="solve the fine meshes and store the reference values, nothing else")
    ] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print nothing but what failed")] = False,
) -> int:
    """Time series of meshes, elastic and elasto-plastic, archord's and other codes', and set error against time.

    Writes work_precision.csv, work_precision.md and a diagram for each case. Every point is a whole process on one core
    with one thread, the median of all repeats. Exit code 0 if all of archord's points were solved.
    """
    from archord.benchmarks.cost.work_precision_cases import chosen_cases

    def say(sentence: str) -> None:
        if not quiet:
            print(f"{perf_counter() - begun:7.1f} s  {sentence}", file=sys.stderr, flush=True)

    begun, cases = perf_counter(), chosen_cases(case)
    try:
        if reference:
            return _store_reference(cases, output / "reference", say)
        return _work_precision(cases, output, only, repeats, peers, limit, quick, warm, quiet, say)
    except RuntimeError as error:
        print(f"archord: {error}.", file=sys.stderr)
        return 3


def _store_reference(cases, folder: Path, say) -> int:
    from archord.benchmarks.cost.work_precision_reference import FILE, compute
    from archord.benchmarks.cost.work_precision_report import reference_table

    for case in cases:
        for kinematics in ("current", "reference"):
            compute(case, kinematics, folder, say)
    print("\n".join(reference_table(cases)))
    print(FILE)
    return 0


def _work_precision(cases, output: Path, only, repeats, peers, limit, quick, warm, quiet, say) -> int:
    from archord.benchmarks.cost import work_precision as table
    from archord.benchmarks.cost.work_precision_figure import draw
    from archord.benchmarks.cost.work_precision_report import markdown, write_csv
    from archord.benchmarks.cost.work_precision_run import INTERRUPTED
    from archord.output.folder import claim_folder

    claim_folder(output, force=True)
    found = [t for case in cases for t in table.tasks(case, output / "runs", quick=quick, peers=peers, limit=limit)]
    found = table.chosen(found, only or [])

    def said(task, repeat: int, sentence: str) -> None:
        counted = f"{repeat} of {repeats}" if repeat else "not counted"
        say(f"{task.case}: {task.code}, {task.series}, {task.label}: {sentence} ({counted})")

    lines = table.run(found, repeats, said)
    whole = all(len(line.point.seconds) == repeats for line in lines if line.point.failure in ("", INTERRUPTED))
    seconds = None
    if warm and whole:
        from archord.benchmarks.cost.work_precision_warm import warm_seconds

        seconds = warm_seconds(repeats)
    text = markdown(lines, seconds)
    files = [output / "work_precision.csv", output / "work_precision.md"]
    write_csv(lines, files[0])
    files[1].write_text(text, encoding="utf-8")
    for case in cases:
        some = [line for line in lines if line.task.case == case.name]
        if some:
            files.append(output / f"work_precision_{case.name}.png")
            draw(case, some, files[-1])
    if not quiet:
        print(text)
        for file in files:
            print(file)
    failed = [line for line in lines if not line.point.done and line.point.failure != INTERRUPTED]
    for line in failed:
        task = line.task
        print(f"archord: {task.case}: {task.code}, {task.series}, {task.label}: {line.point.failure}.", file=sys.stderr)
    if not whole:
        print("archord: interrupted; the tables have what was timed before.", file=sys.stderr)
        return 130
    return 1 if any(line.task.code == "archord" for line in failed) else 0
