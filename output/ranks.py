"""What one rank does for all."""

from __future__ import annotations

from collections.abc import Callable
from time import sleep
from typing import Any, TypeVar

from mpi4py import MPI

from archord.output.files.disk import WriteError
from archord.report.errors import InputError

Result = TypeVar("Result")
_PAUSE = 0.01  # seconds between two looks


def agreed(comm: MPI.Comm, function: Callable[[], Result]) -> Result:
    """Call ``function`` on rank 0 alone; its result is the result of all ranks. Collective.

    Raises on every rank the `InputError` that it raises, and `WriteError` for an `OSError`.
    ``function`` must not call or import anything collective; importing petsc4py is.
    """
    result: Any = None
    fault: Exception | None = None
    if comm.rank == 0:
        try:
            result = function()
        except InputError as error:
            fault = error
        except OSError as error:
            fault = WriteError(f"{error.filename} cannot be written: {error.strerror or error}")
    result, fault = comm.bcast((result, fault))
    if fault is not None:
        raise fault
    return result


def arrived_before(comm: MPI.Comm, seconds: float = float("inf")) -> bool:
    """Wait, asleep, for all ranks to come here; False if they have not after so many ``seconds``.
    Collective."""
    request = comm.Ibarrier()
    while not request.Test():
        if seconds <= 0:
            return False
        sleep(_PAUSE)
        seconds -= _PAUSE
    return True
