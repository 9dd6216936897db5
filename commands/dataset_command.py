"""``archord dataset``: solved joints as tables, always the same."""

from __future__ import annotations

import sys

import click

from archord.commands.options import output, quiet
from archord.report.errors import InputError


@click.command()
@output("folder for tables and runs", "runs/dataset")
@click.option(
    "--joints",
    type=click.IntRange(1, 5000),
    default=5000,
    metavar="N",
    help="the first N of the 5 000 joints",
)
@quiet()
@click.pass_context
def dataset(context: click.Context, output, joints: int, quiet: bool) -> int:
    """Solve the joints of the dataset, and write joints.csv, curves.csv and their checksums.

    Under mpirun the ranks solve different joints. Solved joints are not solved again.
    """
    from mpi4py import MPI

    from archord.commands.sweep_commands import sweep
    from archord.output.ranks import agreed
    from archord.studies import dataset as tables

    comm = MPI.COMM_WORLD
    file = output / "dataset.sweep.toml"

    def designed() -> None:
        try:
            output.mkdir(parents=True, exist_ok=True)
            tables.write_sweep(joints, file)
        except OSError as error:
            said = f"{output}: cannot hold a dataset: {error.strerror}."
            raise InputError(said) from None

    agreed(comm, designed)
    runs = output / "runs"
    code = context.invoke(sweep, file=file, output=runs, array="1/1", quiet=quiet)
    if comm.rank == 0 and code < 128:
        try:
            files = tables.write_tables(runs, output)
        except (OSError, ValueError) as error:
            print(f"archord: {error}", file=sys.stderr)
            return 3
        if not quiet:
            print(*files, sep="\n")
    return code
