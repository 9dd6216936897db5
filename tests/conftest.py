"""What every test needs, on one rank or several."""

from __future__ import annotations

import gc

import pytest
from mpi4py import MPI


def pytest_addoption(parser):
    parser.addoption("--kills", type=int, default=12, help="how often test_kill.py kills runs (12)")


def pytest_collection_finish():
    """Leave what the imports made out of the collections below: they take a tenth of a second otherwise."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _destroy_together():
    """Destructors of PETSc and dolfinx objects are collective: run them on all ranks at the same place."""
    yield
    if MPI.COMM_WORLD.size > 1:
        gc.collect()
        MPI.COMM_WORLD.barrier()


@pytest.fixture
def comm() -> MPI.Comm:
    return MPI.COMM_WORLD
