"""``python -m archord``, and the ``archord`` command."""

from __future__ import annotations

import atexit
import ctypes
import gc
import os
import sys
import threading
from contextlib import suppress
from time import perf_counter
from typing import NoReturn


def main() -> None:
    """Run the command line. Exit codes: 0 done, 2 bad input, 3 a solve that could not go on, 1 anything else."""
    begun = perf_counter()
    gc.set_threshold(100_000, 1, 1)  # imports make many objects and no garbage: looking for it takes 0.04 s
    from archord.cli import run

    _leave(run(sys.argv[1:], begun))


def _leave(code: int) -> NoReturn:
    """End this process as Python would, but for taking it to pieces object by object, which takes 0.15 s."""
    if threading.active_count() > 1:
        sys.exit(code)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    atexit._run_exitfuncs()
    petsc, mpi = (sys.modules.get(name) for name in ("petsc4py.PETSc", "mpi4py.MPI"))
    if petsc is not None:
        petsc._finalize()
    if mpi is not None and mpi.Is_initialized() and not mpi.Is_finalized():
        mpi.Finalize()
    ctypes.CDLL(None).fflush(None)  # what libraries like PETSc have printed
    os._exit(code)


if __name__ == "__main__":
    main()
