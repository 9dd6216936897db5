"""``archord sweep``: many cases of a scene, side by side, into one table."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from time import perf_counter
from typing import Annotated

from archord.plain_typer import typer

STATUS = ("done", "stopped", "failed", "interrupted", "busy", "open")


def sweep(
    file: Annotated[Path, typer.Argument(metavar="SWEEP", help="sweep file (TOML), or the folder of a sweep")],
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="SECTION.KEY=VALUE", help="override a key of the base scene; may be repeated"),
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="folder [runs/<sweep name>]")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="print the cases and stop")] = False,
    ranks_per_case: Annotated[
        int, typer.Option("--ranks-per-case", min=1, metavar="K", help="ranks that share a case")
    ] = 1,
    array: Annotated[
        str, typer.Option("--array", metavar="I/N", help="solve part I of N of the cases, for a job array")
    ] = "1/1",
    gather_only: Annotated[bool, typer.Option("--gather", help="write the tables of what is there and stop")] = False,
    retry: Annotated[bool, typer.Option("--retry", help="try cases again that stopped or failed")] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print nothing but errors")] = False,
) -> int:
    """Solve all cases of a sweep; under mpirun side by side, on one rank each.

    Solved cases are not solved again: a sweep that was killed goes on by the same command, and one whose file was
    changed solves what is new.
    """
    begun = perf_counter()
    from mpi4py import MPI

    from archord.output.ranks import agreed
    from archord.scene.errors import InputError
    from archord.studies.cases import read_sweep
    from archord.studies.sweep import FILE, Share, check_ranks, claim, default_folder, gather, open_jobs
    from archord.sweep_progress import SweepProgress, say

    comm = MPI.COMM_WORLD
    share = Share.parse(array)
    check_ranks(comm.size, ranks_per_case)
    source = file / FILE if file.is_dir() else file
    if file.is_dir() and not source.is_file():
        raise InputError(f"{file}: is not the folder of a sweep: {FILE} is missing.")
    folder = output or (file if file.is_dir() else default_folder(file))
    show = comm.rank == 0 and not quiet

    def prepared():
        design = read_sweep(source, overrides or [])
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
        if show:
            say(progress.meshes)

    def concluded() -> int:
        tables = gather(design, folder, results)
        mine = {case.run for case in share.of(design.distinct)}
        return _report(tables.results, design, folder, mine, quiet=quiet, seconds=perf_counter() - begun)

    failed = agreed(comm, concluded)
    if received:
        return 128 + received
    return 3 if failed else 0


def _announced(design) -> str:
    from archord.studies.cost import expected_seconds

    n, distinct = len(design.cases), len(design.distinct)
    seconds = sum(expected_seconds(case.scene) for case in design.distinct)
    which = f", {distinct} of them distinct" if distinct < n else ""
    return f"{n} case{'s' if n > 1 else ''}{which}; about {_duration(seconds)} on one rank"


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _print_cases(design) -> None:
    from rich.console import Console
    from rich.table import Column, Table

    from archord.ranks import on_terminal
    from archord.studies.cost import expected_dofs, expected_seconds
    from archord.studies.tables import entry, heading

    keys = [heading(key, design.cases[0].scene) for key in design.keys]
    names = ["case", "run", *keys, "steps", "dofs", "seconds"]
    table = Table(*(Column(name, justify="right") for name in names), box=None, pad_edge=False)
    for case in design.cases:
        values = [entry(case.value(key)) for key in design.keys]
        shown = ["-" if v is None else f"{v:.9g}" if isinstance(v, float) else str(v) for v in values]
        scene = case.scene
        cost = [str(len(scene.targets)), f"{expected_dofs(scene):.0f}", f"{expected_seconds(scene):.2g}"]
        table.add_row(f"{case.number}", case.run, *shown, *cost)
    watched = on_terminal()
    width = None if watched else 60 + 40 * len(keys)
    Console(highlight=False, width=width, force_terminal=watched).print(table, markup=False)


def _report(results, design, folder: Path, mine: set[str], *, quiet: bool, seconds: float) -> int:
    """Say how the distinct cases ended; returns how many of this share, ``mine``, failed."""
    from archord.sweep_progress import say

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
