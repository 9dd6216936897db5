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

STATUS = ("done", "stopped", "failed", "interrupted", "busy", "open")


@click.command()
@argument("file", "SWEEP", "sweep file (TOML), or the folder of a sweep")
@overrides("base scene")
@output("folder [runs/<sweep name>]")
@flag("--dry-run", "print the cases and stop")
@click.option("--ranks-per-case", type=click.IntRange(1), default=1, metavar="K", help="ranks that share a case")
@click.option("--array", default="1/1", metavar="I/N", help="solve part I of N of the cases, for a job array")
@click.option("--gather", "gather_only", is_flag=True, help="write the tables of what is there and stop")
@flag("--retry", "try cases again that stopped or failed")
@quiet()
def sweep(
    file: Path,
    overrides: tuple[str, ...],
    output: Path | None,
    dry_run: bool,
    ranks_per_case: int,
    array: str,
    gather_only: bool,
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
    from archord.studies.cases import read_sweep
    from archord.studies.sweep import FILE, Share, check_ranks, claim, default_folder, gather, open_jobs

    comm = MPI.COMM_WORLD
    share = Share.parse(array)
    check_ranks(comm.size, ranks_per_case)
    source = file / FILE if file.is_dir() else file
    if file.is_dir() and not source.is_file():
        raise InputError(f"{file}: is not the folder of a sweep: {FILE} is missing.")
    folder = output or (file if file.is_dir() else default_folder(file))
    show = comm.rank == 0 and not quiet

    def prepared():
        design = read_sweep(source, overrides)
        if show:
            say(_announced(design))
        if dry_run:
            return design, ([], [])
        if gather_only and not (folder / FILE).exists():
            raise InputError(f"{folder}: holds no sweep to gather.")
        claim(design, folder)
        return design, ([], []) if gather_only else open_jobs(design, folder, share, retry=retry)

    found: list = []
    agreed(comm, lambda: found.append(prepared()))  # rank 0 keeps what it found: the others need none of it
    design, (ended, jobs) = found[0] if found else (None, ([], []))
    if dry_run:
        if comm.rank == 0:
            _print_cases(design)
        return 0
    received, results = 0, []
    if comm.bcast(bool(jobs)):
        from archord.studies.farm import Farm  # imports PETSc, on all ranks together

        farm = Farm(comm, ranks_per_case)
        with SweepProgress(jobs, ended, farm.workers, begun, silent=not show) as progress:
            received = farm.run(jobs, progress.ended, progress.running)
        results = progress.results

    def concluded() -> int:
        tables = gather(design, folder, results)
        mine = {case.run for case in share.of(design.distinct)}
        return _report(tables.results, design, folder, mine, quiet=quiet, seconds=perf_counter() - begun)

    failed = agreed(comm, concluded)
    if received:
        return 128 + received
    return 3 if failed else 0


def _announced(design) -> str:
    from archord.studies.sweep import expected_seconds

    n, distinct = len(design.cases), len(design.distinct)
    seconds = sum(expected_seconds(case.scene) for case in design.distinct)
    which = f", {distinct} of them distinct" if distinct < n else ""
    return f"{n} case{'s' if n > 1 else ''}{which}; about {_duration(seconds)} on one rank"


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _print_cases(design) -> None:
    from archord.studies.sweep import expected_dofs, expected_seconds
    from archord.studies.tables import entry, heading

    keys = [heading(key, design.cases[0].scene) for key in design.keys]
    table = Table("case", "run", *keys, "steps", "dofs", "seconds")
    for case in design.cases:
        values = [entry(case.value(key)) for key in design.keys]
        shown = ["-" if v is None else f"{v:.9g}" if isinstance(v, float) else v for v in values]
        scene = case.scene
        cost = (len(scene.targets), f"{expected_dofs(scene):.0f}", f"{expected_seconds(scene):.2g}")
        table.add(case.number, case.run, *shown, *cost)
    print(table)


def _report(results, design, folder: Path, mine: set[str], *, quiet: bool, seconds: float) -> int:
    """Say how the distinct cases ended; returns how many of this share, ``mine``, failed."""
    from archord.progress import say

    number = {case.run: case.number for case in design.distinct}
    failed = [r for r in results if r.run in mine and r.status in ("stopped", "failed")]
    for result in failed:
        case = f"case {number[result.run]}, {result.run}"
        print(f"archord: {case}: {result.status}: {result.message}.", file=sys.stderr)
    if not quiet:
        counts = Counter(result.status for result in results)
        told = ", ".join(f"{n} {status}" for status in STATUS if (n := counts[status]))
        say(f"{told} in {seconds:.1f} s, tables in {folder}")
    return len(failed)
