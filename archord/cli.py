"""The command line: ``archord solve``, ``archord picture`` and ``archord scene``; the other commands are in files of
their own.

Heavy packages are imported by the commands that need them. Bad input ends with exit code 2 and one sentence from rank
0.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from time import perf_counter
from typing import Annotated

import click

from archord import law_commands, result_commands
from archord.benchmark_commands import benchmark
from archord.deck_commands import export_deck
from archord.fit_commands import fit
from archord.plain_typer import typer
from archord.ranks import COLLECTIVE, launcher_rank, run_on_ranks
from archord.reproduce_commands import reproduce
from archord.sweep_commands import sweep

app = typer.Typer(
    name="archord",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
_begun = perf_counter()


def run(arguments: list[str], begun: float | None = None) -> int:
    """Run the command line ``arguments``; returns the exit code. Only rank 0 prints."""
    global _begun
    _begun = perf_counter() if begun is None else begun
    return run_on_ranks(arguments[0] if arguments else "", lambda: _run(arguments))


def _run(arguments: list[str]) -> int:
    """Run the command line on this rank; all errors are told here and become exit codes."""
    try:
        code = app(arguments, prog_name="archord", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except click.ClickException as error:
        if launcher_rank() == 0:
            error.show()
        return error.exit_code
    except click.exceptions.Abort:
        return 130
    except BrokenPipeError:
        return _unread(arguments)
    except SystemExit as error:
        if isinstance(error.__context__, BrokenPipeError):  # click makes exit code 1 of it
            return _unread(arguments)
        raise
    except KeyboardInterrupt:
        say("archord: interrupted.")
        return 130
    except Exception as error:
        from archord.scene.errors import InputError

        if isinstance(error, InputError):
            for sentence in str(error).splitlines():
                say(sentence)
            return 2
        return _fail(error)


def _unread(arguments: list[str]) -> int:
    """The exit code where the reader of the output, like head, has seen enough: only what solves is not done then."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 128 + signal.SIGPIPE if arguments and arguments[0] in COLLECTIVE else 0


def say(text: str) -> None:
    """Print to stderr on rank 0."""
    if launcher_rank() == 0:
        print(text, file=sys.stderr, flush=True)


def _fail(error: Exception) -> int:
    """Report an unexpected error with its traceback from the rank that has it, and end all ranks."""
    import traceback

    traceback.print_exception(error)
    mpi = sys.modules.get("mpi4py.MPI")
    if mpi is not None and mpi.Is_initialized() and mpi.COMM_WORLD.size > 1:
        print(f"archord: rank {mpi.COMM_WORLD.rank} failed: {error}", file=sys.stderr, flush=True)
        mpi.COMM_WORLD.Abort(1)
    return 1


def _print_version(wanted: bool) -> None:
    if wanted:
        from archord import __version__

        print(f"archord {__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="print the version")
    ] = False,
) -> None:
    """Conformal contact of pins in holes: P(delta), pressure and plastic zone, by finite elements."""


@app.command()
def solve(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="scene file (TOML)")],
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="SECTION.KEY=VALUE", help="override a key of the scene; may be repeated"),
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="run folder [runs/<scene name>]")] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite the results in the run folder")] = False,
    restart: Annotated[bool, typer.Option("--restart", help="continue the interrupted run in the run folder")] = False,
    extend: Annotated[bool, typer.Option("--extend", help="continue the finished run to the scene's load")] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="write the fields of a step that cannot be solved to debug.xdmf")
    ] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print nothing but errors")] = False,
) -> int:
    """Solve a scene into a run folder. Under mpirun, all ranks work on it.

    With --restart and --extend, the run folder may stand in the place of the scene.
    """
    if restart + extend + force > 1:
        raise click.UsageError("choose one of --force, --restart and --extend")
    if restart or extend:
        from archord.continuing import continue_with_progress

        return continue_with_progress(
            scene, overrides or [], output, extend=extend, debug=debug, quiet=quiet, begun=_begun
        )
    from archord.progress import solve_with_progress
    from archord.scene.file import load_scene

    folder = output or Path("runs") / scene.stem
    return solve_with_progress(
        lambda: load_scene(scene, overrides or []), folder, force=force, debug=debug, quiet=quiet, begun=_begun
    )


result_commands.register(app)


@app.command()
def picture(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="run folder")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="file to draw [RUN/picture.png]")] = None,
) -> int:
    """Draw a run: plastic zone, contact pressure, P(delta)."""
    from archord.postprocess.pictures import draw

    print(draw(folder, output))
    return 0


app.command()(fit)
app.command()(reproduce)
app.command()(sweep)
app.command("export-deck")(export_deck)
app.add_typer(benchmark, name="benchmark")


@app.command("scene")
def scene_format(
    schema: Annotated[bool, typer.Option("--schema", help="print the JSON schema of scene files")] = False,
    example: Annotated[bool, typer.Option("--example", help="print a commented example")] = False,
    reference: Annotated[bool, typer.Option("--reference", help="print all keys as Markdown tables")] = False,
) -> int:
    """Print what a scene file may hold."""
    if schema + example + reference != 1:
        raise click.UsageError("choose one of --schema, --example and --reference")
    from archord.scene import reference as scene

    if schema:
        import json

        print(json.dumps(scene.schema(), indent=2))
    else:
        print(scene.example() if example else scene.reference(), end="")
    return 0


law_commands.register(app)
