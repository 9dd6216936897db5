"""The names that differ between releases: found in the one that is here; and memory that goes back
to the system."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from dolfinx.mesh import create_unit_square
from mpi4py import MPI

from archord.kernels.compat import RESIDUAL_NOT_FINITE, ghosted_vector, versions

_STATM = Path("/proc/self/statm")
_MEMORY = """
import archord.kernels.compat, mmap, numpy
from pathlib import Path
told = lambda: print(int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE)
told()
array = numpy.ones(25_000_000)
told()
del array
told()
"""


@pytest.mark.mpi
def test_a_ghosted_vector_knows_the_values_of_the_other_ranks(comm):
    vertices = create_unit_square(comm, 3, 3).topology.index_map(0)
    n = vertices.size_local
    ghosts = vertices.num_ghosts
    vector = ghosted_vector(vertices, 3)
    vector.array[:] = np.repeat(vertices.local_to_global(np.arange(n, dtype=np.int32)), 3)
    vector.ghostUpdate()
    with vector.localForm() as local:
        assert np.array_equal(
            local.array[::3], vertices.local_to_global(np.arange(n + ghosts, dtype=np.int32))
        )
    vector.destroy()


def test_releases_and_the_residual_that_is_no_number_have_names():
    assert RESIDUAL_NOT_FINITE < 0
    found = versions()
    assert found.keys() == {"dolfinx", "petsc", "mpi"}
    assert all(found.values())
    assert MPI.Get_library_version().split()[0] in found["mpi"]


@pytest.mark.skipif(not _STATM.exists(), reason="not Linux")
def test_freed_arrays_go_back_to_the_system():
    """Of a process of its own: this one may have room among its arrays."""
    found = subprocess.run([sys.executable, "-c", _MEMORY], capture_output=True, text=True)
    before, with_array, after = map(int, found.stdout.split())
    assert with_array > before + 180e6
    assert after < before + 20e6
