"""``archord reproduce``: the paper's figures and claims."""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter
from typing import Annotated

from archord.plain_typer import typer


def reproduce(
    figures: Annotated[list[str] | None, typer.Argument(metavar="[FIGURE]...", help="fig2 ... fig9, or all")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="folder for runs, tables, pictures, report")] = Path(
        "runs/paper"
    ),
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print nothing but errors")] = False,
) -> int:
    """Solve what the paper's figures need, and write each as CSV and picture; all of them with a report.

    Runs that are there already are not solved again. Under mpirun the ranks solve different runs side by side.
    """
    from mpi4py import MPI

    from archord.benchmarks.paper.reproduce import chosen
    from archord.benchmarks.paper.reproduce import reproduce as make

    begun, comm = perf_counter(), MPI.COMM_WORLD
    wanted = chosen(figures or ["all"])

    def said(case, P: float) -> None:
        if not quiet:
            # stderr, as ranks other than 0 report their runs too
            print(
                f"{perf_counter() - begun:7.1f} s  {case.name:34s} P(2 dR)/(E* R) = {P:.6f}",
                file=sys.stderr,
                flush=True,
            )

    try:
        files = make(wanted, output, comm, said)
    except RuntimeError as error:
        if comm.rank == 0:
            print(f"archord: {error}.", file=sys.stderr)
        return 3
    if not quiet:
        for file in files:
            print(file)
    return 0
