"""``archord sweep``: many cases of a scene, side by side, into one table."""

from __future__ import annotations

import os
import sys
from collections import Counter
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import click

from archord.commands.options import argument, complain, flag, output, overrides, quiet, warn
from archord.report.by_name import Names
from archord.report.errors import InputError
from archord.report.table import Table

if TYPE_CHECKING:
    from archord.studies.sweep import Result


@click.command()
@argument("file", "SWEEP", "sweep file (TOML), or the folder of a sweep")
@overrides("base scene")
@output("folder [runs/<sweep name>]")
@flag("--dry-run", "print the cases and stop")
@click.option(
    "--array", default="1/1", metavar="I/N", help="solve part I of N of the cases, for a job array"
)
@flag("--gather", "write the tables of what is there and stop")
@flag("--retry", "try cases again that stopped or failed")
@flag("--force", "solve all cases again, and overwrite their results")
@quiet()
def sweep(
    file: Path,
    overrides: Names,
    output: Path | None,
    dry_run: bool,
    array: str,
    gather: bool,
    retry: bool,
    force: bool,
    quiet: bool,
) -> int:
    """Solve all cases of a sweep; under mpirun side by side, on one rank each.

    Solved cases are not solved again: a sweep that was killed goes on by the same command, and one
    whose file was changed solves what is new.
    """
    begun = perf_counter()
    if force + gather + retry > 1:
        raise click.UsageError("choose one of --force, --gather and --retry")
    from mpi4py import MPI

    from archord.output.ranks import agreed
    from archord.studies.cases import read_sweep
    from archord.studies.sweep import (
        FILE,
        claim,
        open_cases,
        part_of,
        warnings_of,
        write_tables,
    )

    comm = MPI.COMM_WORLD
    source = file / FILE if file.is_dir() else file
    folder = output or (file if file.is_dir() else Path("runs") / file.stem.removesuffix(".sweep"))

    def say(text: str) -> None:
        """Print on rank 0; if nobody reads any more, that is no reason to stop, nor to leave other
        ranks waiting."""
        try:
            if comm.rank == 0 and not quiet:
                print(text, flush=True)
        except OSError:
            sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115

    def prepared():
        design = read_sweep(source, overrides)
        mine = part_of(design.distinct, array)
        minutes = sum(case.scene.expected_seconds for case in design.distinct) / 60
        distinct = f"{len(design.distinct)} of them distinct"
        say(f"{len(design.cases)} cases, {distinct}; about {minutes:.1f} min on one rank")
        if dry_run:
            print(_table(design))
            return design, mine, [], []
        if gather and not (folder / FILE).exists():
            raise InputError(folder, "holds no sweep to gather.")
        claim(design, folder)
        if gather:
            return design, mine, [], []
        ended, left, damaged = open_cases(mine, folder, retry=retry, force=force)
        warn(*(f"{result.message}: the case is solved again" for result in damaged))
        if ended:
            say(f"{len(ended)} of {len(mine)} cases are there already")
        return design, mine, ended, left

    found = []
    agreed(
        comm, lambda: found.append(prepared())
    )  # rank 0 keeps what it found: the others need none of it
    if dry_run:
        return 0
    design, mine, results, cases = found[0] if found else (None, [], [], [])

    def ended(result: Result) -> None:
        results.append(result)
        if result.status != "open":
            done = f"{sum(result.status == 'done' for result in results)} of {len(mine)} done"
            word = f"{result.status}, {result.steps} steps in {result.seconds:.1f} s"
            say(f"{perf_counter() - begun:7.1f} s  {result.run} {word}; {done}")

    received = 0
    if comm.bcast(bool(cases)):
        from archord.studies.farm import solve_cases  # imports PETSc, on all ranks together

        received = solve_cases(comm, cases, folder, ended, force=force)

    def concluded() -> bool:
        known = write_tables(design, folder, results)
        counts = Counter(result.status for result in known.values())
        told = ", ".join(f"{n} {status}" for status, n in sorted(counts.items()))
        say(f"{told} in {perf_counter() - begun:.1f} s, tables in {folder}")
        damaged = [result.message for result in known.values() if result.damaged]
        warn(*damaged, *warnings_of(design, folder))
        failed = [
            f"case {case.number}, {case.run}: {result.status}: {result.message}"
            for case in mine
            if (result := known[case.run]).status in ("stopped", "failed")
        ]
        complain(*failed)
        return bool(failed)

    failed = agreed(comm, concluded)
    return 128 + received if received else 3 * failed


def _table(design) -> Table:
    """A line for each case: what is varied, and what it may cost."""
    from archord.studies.sweep import shown

    table = Table(
        "case",
        "run",
        *design.headings,
        "steps",
        "seconds",
    )
    for case in design.cases:
        own = case.values(design.keys)
        values = [shown(own.get(heading)) or "-" for heading in design.headings]
        table.add(
            case.number,
            case.run,
            *values,
            len(case.scene.targets),
            f"{case.scene.expected_seconds:.2g}",
        )
    return table
