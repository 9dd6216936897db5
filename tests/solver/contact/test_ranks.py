"""The contact's terms on several ranks are those of one."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from tests.geometry.shapes.measures import Cells
from tests.solver.parts import (
    DR,
    ELASTIC,
    PERFECT,
    contact_force,
    coordinates,
    internal_force,
    joint_parts,
    nodes_of,
    partition,
)
from tests.solver.solving import SEVERAL


def body(_, vertices):
    """Number of the connected body that a cell belongs to; all cells are on rank 0 when gmsh's mesh
    is cut."""
    if not len(vertices):
        return np.zeros(0, dtype=int)
    n = vertices.max() + 1
    rows = vertices[:, [0, 1]].ravel()
    columns = vertices[:, [1, 2]].ravel()
    _, label = connected_components(
        coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(n, n)), directed=False
    )
    _, number = np.unique(label[vertices[:, 0]], return_inverse=True)
    return number


CUTS = {
    "sectors": None,
    "dealt round": partition(lambda i, _: i),
    "pin here, block there": partition(body),
    "block here, pin there": partition(lambda i, v: 1 - body(i, v)),
    "all on the last rank": partition(lambda i, _: np.full(len(i), -1)),
}
PAIRS = {"elastic": (ELASTIC, ELASTIC), "plastic": (PERFECT, PERFECT), "rigid pin": (None, PERFECT)}


def state(comm, pin, block, kinematics, partitioner=None):
    """Active points; norms of forces, energies, PEEQ and the tangent's action; the resultant: at a
    given state."""
    parts = joint_parts(comm, pin, block, kinematics=kinematics, partitioner=partitioner)
    x = coordinates(parts.V)
    u = (
        0.3
        * DR
        * np.stack([np.sin(9 * x[:, 0] + x[:, 1]), np.cos(8 * x[:, 0] - 7 * x[:, 1])], axis=1)
    )
    if pin is None:
        parts.contact.rigid[0].motion = np.array([[0.0, -1.5 * DR]])
    else:
        u[nodes_of(parts.V, parts.cells, Cells.PIN), 1] -= 1.5 * DR
    force = internal_force(parts.bulk, u)
    norms = [comm.allreduce((force**2).sum())]
    force = contact_force(parts.contact, u)
    norms += [comm.allreduce((force**2).sum()), *comm.allreduce(np.array(parts.bulk.energies(u)))]
    largest, integral = parts.bulk.peeq()
    norms += [comm.allreduce(largest, op=MPI.MAX), comm.allreduce(integral)]
    tangent = parts.contact.tangent
    rows = tangent.rows
    columns = tangent.columns
    values = tangent.blocks()
    field = np.zeros((parts.V.dofmap.index_map.size_global + 1, 2))  # a rigid pin's is the last
    index_map = parts.V.dofmap.index_map
    start, end = index_map.local_range
    field[start:end] = 1 + np.sin(5 * x[: end - start])
    field = comm.allreduce(field)
    field[-1] = 0.3, -1.0
    action = np.zeros_like(field)
    np.add.at(action, rows, (values @ field[columns, :, None])[..., 0])
    norms.append((comm.allreduce(action) ** 2).sum())
    return parts.contact.n_active(), np.array(norms), parts.contact.resultant()


@pytest.mark.mpi
@pytest.mark.parametrize("kinematics", ["current", "reference", "tied"])
@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("cut", CUTS if SEVERAL else ["dealt round"])
def test_terms_do_not_depend_on_the_ranks(cut, pair, kinematics, comm):
    """However the mesh is cut: residual, resultant, tangent, energies and PEEQ to 1e-12 of those on
    one rank."""
    active, norms, resultant = state(comm, *PAIRS[pair], kinematics, CUTS[cut])
    one_active, one_norms, one_resultant = state(MPI.COMM_SELF, *PAIRS[pair], kinematics)
    assert active == one_active > 0
    np.testing.assert_allclose(norms, one_norms, rtol=1e-12, atol=0)
    np.testing.assert_allclose(
        resultant, one_resultant, rtol=0, atol=1e-12 * np.abs(one_resultant).max()
    )


@pytest.mark.mpi
def test_the_cuts_are_what_they_are_called(comm):
    """Bodies on ranks of their own have no cell elsewhere; cells dealt round are everywhere."""
    for name, expected in (("pin here, block there", 0), ("block here, pin there", 1)):
        parts = joint_parts(comm, partitioner=CUTS[name])
        n_owned = parts.V.mesh.topology.index_map(2).size_local
        pin = parts.cells.find(Cells.PIN)
        holders = np.flatnonzero(comm.allgather(int((pin < n_owned).sum())))
        np.testing.assert_array_equal(holders, [expected % comm.size])
    parts = joint_parts(comm, partitioner=CUTS["dealt round"])
    assert min(comm.allgather(parts.V.mesh.topology.index_map(2).size_local)) > 0
