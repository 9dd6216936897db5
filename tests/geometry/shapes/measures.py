"""What meshes of shapes measure."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from dolfinx.mesh import entities_to_geometry
from mpi4py import MPI

from archord.geometry.basis import TRIANGLE, bulk_quadrature, cell_basis


class Cells(IntEnum):
    """Numbers of the bodies of a quarter joint and a half ring."""

    PIN = 1
    BLOCK = 2


class Facets(IntEnum):
    """Numbers of their facet sets, "pin", "hole", "pin top", "block held" and "symmetry"."""

    PIN_ARC = 1
    HOLE_ARC = 2
    PIN_TOP = 3
    BLOCK_HELD = 4
    SYMMETRY = 5


def area(joint, body, comm=MPI.COMM_SELF):
    """Area of a body, over all ranks."""
    cells = joint.cells_in(body)
    degree = joint.mesh.geometry.cmap.degree
    n_owned = joint.mesh.topology.index_map(2).size_local
    X, w = bulk_quadrature(TRIANGLE, degree)
    basis = cell_basis(joint.mesh, degree, cells[cells < n_owned], X)
    return comm.allreduce(float((basis.measure @ w).sum()))


def facet_nodes(joint, name):
    """Coordinates ``(n, degree + 1, 2)`` of the nodes of a facet set."""
    joint.mesh.topology.create_connectivity(1, 2)
    return joint.mesh.geometry.x[entities_to_geometry(joint.mesh, 1, joint.facets_in(name))][
        ..., :2
    ]


def length(joint, name):
    """Length of a facet set, along its chords."""
    x = facet_nodes(joint, name)
    return np.linalg.norm(x[:, 0] - x[:, 1], axis=1).sum()
