"""The command line: the file of each command, and the exit code of each error, told by rank 0.

A command imports the rooms that it needs when it is called.
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
import traceback
from time import perf_counter, sleep

import click

import archord
from archord.commands.options import Group
from archord.commands.ranks import COLLECTIVE, launcher_rank, run_on_ranks
from archord.report.errors import InputError

# seconds in which a launcher (MPICH's) hands on what a rank said, which it drops with a job that
# aborts
_HEARD = 0.3

FILES = {
    "solve_commands": ("solve", "scene", "mesh"),
    "result_commands": ("show", "compare", "export", "export-deck", "picture", "report", "probe"),
    "margin_command": ("margin",),
    "sweep_commands": ("sweep",),
    "dataset_command": ("dataset",),
    "law_commands": ("laws", "law"),
    "fit_command": ("fit",),
    "identify_command": ("identify",),
    "benchmark_commands": ("reproduce", "benchmark"),
}
SOLVERS = (
    "mpi4py",
    "dolfinx",
    "petsc4py",
    "basix",
    "ufl",
    "gmsh",
)  # what only solving and meshing need
COMMANDS = {command: file for file, commands in FILES.items() for command in commands}


class _Commands(Group):
    """The commands of `COMMANDS`, whose files are imported when they are asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        file = importlib.import_module(f"archord.commands.{COMMANDS[name]}")
        return getattr(file, name.replace("-", "_"))


@click.group(cls=_Commands, context_settings={"show_default": True})
@click.version_option(archord.__version__, message="archord %(version)s", help="print the version")
def app() -> None:
    """Conformal contact of pins in holes: P(delta), pressure and plastic zone, by finite
    elements."""


def run(arguments: list[str], begun: float | None = None) -> int:
    """The exit code of the command line ``arguments``, ``begun`` at that time of `perf_counter`;
    only rank 0 prints."""
    since = perf_counter() if begun is None else begun
    return run_on_ranks(_command(arguments), lambda: _run(arguments, since))


def _command(arguments: list[str]) -> str:
    """The command of a command line, with the command of a group behind it."""
    return " ".join(arguments[: 2 if arguments[:1] == ["benchmark"] else 1])


def _run(arguments: list[str], begun: float) -> int:
    """Run the command line on this rank; all errors are told here and become exit codes."""
    try:
        code = app(arguments, prog_name="archord", standalone_mode=False, obj=begun)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except click.ClickException as error:
        if launcher_rank() == 0:
            error.show()
        return error.exit_code
    except (
        BrokenPipeError,
        SystemExit,
    ):  # the reader, like head, has seen enough; click makes one of the other
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return (
            128 + signal.SIGPIPE if _command(arguments) in COLLECTIVE else 0
        )  # what solves is not done
    except (KeyboardInterrupt, click.exceptions.Abort, InputError) as error:
        bad = isinstance(error, InputError)
        if launcher_rank() == 0:
            print(error if bad else "archord: interrupted.", file=sys.stderr, flush=True)
        return 2 if bad else 130
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in SOLVERS:
            return _fail(error)
        if launcher_rank() == 0:
            said = f"{error}; pip install 'archord[solve]' brings what solves (docs/containers.md)"
            print(f"archord {_command(arguments)}: {said}.", file=sys.stderr, flush=True)
        return 2
    except Exception as error:
        return _fail(error)


def _fail(error: Exception) -> int:
    """Report an unexpected error with its traceback from the rank that has it, and end all
    ranks."""
    traceback.print_exception(error)
    mpi = sys.modules.get("mpi4py.MPI")
    if mpi is not None and mpi.Is_initialized() and mpi.COMM_WORLD.size > 1:
        print(f"archord: rank {mpi.COMM_WORLD.rank} failed: {error}", file=sys.stderr, flush=True)
        sleep(_HEARD)
        mpi.COMM_WORLD.Abort(1)
    return 1
