"""``archord sweep``: many cases of a scene, side by side, into one table."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from time import perf_counter

import click

from archord.options import argument, flag, output, overrides, quiet
from archord.report.table import Table
from archord.scene.errors import InputError


@click.command()
@argument("file", "SWEEP", "sweep file (TOML), or the folder of a sweep")
@overrides("base scene")
@output("folder [runs/<sweep name>]")
@flag("--dry-run", "print the cases and stop")
@click.option("--array", default="1/1", metavar="I/N", help="solve part I of N of the cases, for a job array")
@flag("--gather", "write the tables of what is there and stop")
@flag("--retry", "try cases again that stopped or failed")
@quiet()
def sweep(
    file: Path,
    overrides: tuple[str, ...],
    output: Path | None,
    dry_run: bool,
    array: str,
    gather: bool,
    retry: bool,
    quiet: bool,
) -> int:
    """Solve all cases of a sweep; under mpirun side by side, on one rank each.

    Solved cases are not solved again: a sweep that was killed goes on by the same command, and one whose file was
    changed solves what is new.
    """
    begun = perf_counter()
    from mpi4py import MPI

    from archord.output.ranks import agreed
    from archord.progress import SweepProgress, say
    from archord.studies import tables
    from archord.studies.cases import read_sweep
    from archord.studies.sweep import FILE, claim, open_cases, part_of

    comm = MPI.COMM_WORLD
    source = file / FILE if file.is_dir() else file
    folder = output or (file if file.is_dir() else Path("runs") / file.stem.removesuffix(".sweep"))
    show = comm.rank == 0 and not quiet

    def prepared():
        if file.is_dir() and not source.is_file():
            raise InputError(f"{file}: is not the folder of a sweep: {FILE} is missing.")
        design = read_sweep(source, overrides)
        mine = part_of(design.distinct, array)
        if show:
            say(_announced(design))
        if dry_run:
            print(_table(design))
            return design, mine, [], []
        if gather and not (folder / FILE).exists():
            raise InputError(f"{folder}: holds no sweep to gather.")
        claim(design, folder)
        return design, mine, *(([], []) if gather else open_cases(mine, folder, retry=retry))

    found: list = []
    agreed(comm, lambda: found.append(prepared()))  # rank 0 keeps what it found: the others need none of it
    if dry_run:
        return 0
    design, mine, ended, cases = found[0] if found else (None, [], [], [])
    received, results = 0, []
    if comm.bcast(bool(cases)):
        from archord.studies.farm import solve_cases  # imports PETSc, on all ranks together

        with SweepProgress(len(mine), ended, begun, silent=not show) as progress:
            received = solve_cases(comm, cases, folder, progress.ended)
        results = progress.results

    def concluded() -> bool:
        known = tables.write(design, folder, results)
        if show:
            counts = Counter(result.status for result in known.values())
            told = ", ".join(f"{n} {status}" for status, n in sorted(counts.items()))
            say(f"{told} in {perf_counter() - begun:.1f} s, tables in {folder}")
        failed = [case for case in mine if known[case.run].status in ("stopped", "failed")]
        for case in failed:
            result = known[case.run]
            print(f"archord: case {case.number}, {case.run}: {result.status}: {result.message}.", file=sys.stderr)
        return bool(failed)

    failed = agreed(comm, concluded)
    return 128 + received if received else 3 * failed


def _announced(design) -> str:
    from archord.studies.sweep import expected_seconds

    minutes = sum(expected_seconds(case.scene) for case in design.distinct) / 60
    n = len(design.cases)
    return f"{n} case{'s' if n > 1 else ''}, {len(design.distinct)} distinct; about {minutes:.1f} min on one rank"


def _table(design) -> Table:
    """A line for each case: what is varied, and what it may cost."""
    from archord.studies.sweep import expected_seconds
    from archord.studies.tables import heading, shown

    table = Table("case", "run", *(heading(key, design.cases[0].scene) for key in design.keys), "steps", "seconds")
    for case in design.cases:
        values = [shown(case.value(key)) or "-" for key in design.keys]
        table.add(case.number, case.run, *values, len(case.scene.targets), f"{expected_seconds(case.scene):.2g}")
    return table
