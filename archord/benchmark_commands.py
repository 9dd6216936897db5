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

    from archord.benchmarks import stability as table

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
        from archord.benchmarks.stability_report import summary, write_report

        files = write_report(lines, output)
        if not quiet:
            _print_table(lines)
            print(summary(lines))
            for file in files:
                print(file)
        for line in wrong:
            print(f"archord: {line.case.group}: {line.case.name}: {line.verdict}.", file=sys.stderr)
    return 1 if wrong else 0


def _print_table(lines) -> None:
    from rich.console import Console
    from rich.table import Table

    from archord.benchmarks.stability_report import row

    shown = ("case", "status", "steps", "iterations", "cutbacks", "force balance", "energy error", "deviation",
             "tolerance", "seconds", "verdict")  # fmt: skip
    table = Table(*shown, box=None, pad_edge=False)
    for line in lines:
        entries = row(line)
        table.add_row(*(entries[name] for name in shown[:-1]), "as it should be" if not line.faults else "WRONG")
    Console(highlight=False, width=None if sys.stdout.isatty() else 200).print(table, markup=False)
