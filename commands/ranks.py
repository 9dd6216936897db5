"""Commands under an MPI launcher: on which ranks they work, and how all ranks end with one exit
code.

MPI is loaded only by commands that all ranks work on, and only where a launcher started several.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from io import TextIOWrapper

# commands that all ranks work on; all others are rank 0's alone
COLLECTIVE = ("solve", "reproduce", "sweep", "benchmark stability")
_RANK = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID")
_SIZE = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS")
_LAUNCHER = ("OMPI_COMM_WORLD_", "PMIX_", "PMI_", "SLURM_")  # how their variables begin
_PATIENCE = 10.0  # seconds that a rank with bad input waits for the others


def launcher_rank() -> int:
    """Rank of this process as its MPI launcher says, without loading MPI."""
    return next((int(os.environ[name]) for name in _RANK if name in os.environ), 0)


def launched_with_others() -> bool:
    """Whether a launcher may have started other ranks too, without loading MPI. PMIx tells no
    number of ranks."""
    if any(os.environ.get(name, "1") != "1" for name in _SIZE):
        return True
    return "PMIX_RANK" in os.environ and "OMPI_COMM_WORLD_SIZE" not in os.environ


def on_terminal() -> bool:
    """Whether somebody watches stdout. Under a launcher nobody can tell: Open MPI gives its ranks a
    terminal of their own even where it writes to a file itself."""
    return sys.stdout.isatty() and not any(name in os.environ for name in _RANK)


def terminal_width() -> int:
    """Characters of a line of the terminal that shows stdout; 0 where none does."""
    return shutil.get_terminal_size().columns if on_terminal() else 0


def run_on_ranks(command: str, work: Callable[[], int]) -> int:
    """Exit code of ``work``, done by all ranks for a command of `COLLECTIVE`, else by rank 0 alone.

    Alone means without the launcher: dolfinx and PETSc start collectively, and would wait for ranks
    that never come. So rank 0 forgets who started it, and the others, which have nothing to say,
    are done. With a collective command no rank leaves with bad input before rank 0 has spoken, as a
    launcher then ends all others at once.
    """
    if not launched_with_others():
        return work()
    if command not in COLLECTIVE:
        if launcher_rank() != 0:
            return 0
        for name in [name for name in os.environ if name.startswith(_LAUNCHER)]:
            del os.environ[name]
        if isinstance(sys.stdout, TextIOWrapper):
            # all in one write: mpirun may lose a last line whose end comes apart from it
            sys.stdout.reconfigure(line_buffering=False)
        return work()
    if launcher_rank() != 0:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    code = work()
    if code == 1 and launcher_rank() == 0:
        said = (
            "ends with exit code 1, for what is told above; the launcher may add a page about that "
            "code"
        )
        print(f"archord {command}: {said}.", file=sys.stderr, flush=True)
    if code == 2:
        from mpi4py import MPI

        from archord.output.ranks import arrived_before

        if not arrived_before(MPI.COMM_WORLD, _PATIENCE):  # the fault is here alone
            MPI.COMM_WORLD.Abort(code)
    return code
