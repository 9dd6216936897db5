"""The names that differ between releases: found in the one that is here."""

import numpy as np
import pytest
from mpi4py import MPI

from archord.kernels.compat import RESIDUAL_NOT_FINITE, ghosted_vector, versions


@pytest.mark.mpi
def test_a_ghosted_vector_knows_the_values_of_the_other_ranks(comm):
    """Of points in a row, of which every rank owns two and sees the next one behind its own."""
    from dolfinx.common import IndexMap

    last = comm.rank + 1 == comm.size
    ghosts, owner = ([], []) if last else ([2 * comm.rank + 2], [comm.rank + 1])
    row = IndexMap(comm, 2, np.array(ghosts, dtype=np.int64), np.array(owner, dtype=np.int32), 0)
    vector = ghosted_vector(row, 3)
    first, _ = vector.getOwnershipRange()
    vector.array[:] = first + np.arange(6)
    vector.ghostUpdate()
    with vector.localForm() as local:
        assert np.array_equal(local.array, first + np.arange(6 if last else 9))
    vector.destroy()


def test_releases_and_the_residual_that_is_no_number_have_names():
    assert RESIDUAL_NOT_FINITE < 0
    found = versions()
    assert found.keys() == {"dolfinx", "petsc", "mpi"}
    assert all(found.values())
    assert MPI.Get_library_version().split()[0] in found["mpi"]
