"""Which integration rule each cell of a mesh has."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import basix
import numpy as np

from archord.geometry.basis import bulk_quadrature_degree
from archord.materials.kinematics import Bools, Ints

if TYPE_CHECKING:
    from dolfinx.mesh import Mesh


class CellRule(NamedTuple):
    """A rule of this ``degree``, and which cells ``(n_owned,)`` of this rank have it."""

    degree: int
    chosen: Bools

    def among(self, cells: Ints) -> Ints:
        """Those of the owned ``cells`` that have the rule."""
        return cells[self.chosen[cells]]


def cell_rules(mesh: Mesh, degree: int, in_contact: Ints) -> list[CellRule]:
    """The rules for displacements of this ``degree``: the usual one, and where that is a reduced
    one also the full one, of the cells ``in_contact`` and of columns of single cells."""
    topology = mesh.topology
    cell = mesh.basix_cell()
    usual = bulk_quadrature_degree(cell, degree)
    full = bulk_quadrature_degree(cell, degree, full=True)
    n = topology.index_map(topology.dim).size_local
    if usual == full:
        return [CellRule(usual, np.ones(n, dtype=bool))]
    needs_full = _in_columns(mesh)
    needs_full[in_contact[in_contact < n]] = True
    return [CellRule(usual, ~needs_full), CellRule(full, needs_full)]


def _in_columns(mesh: Mesh) -> Bools:
    """Whether owned hexahedra ``(n_owned,)`` have two pairs of opposite facets on the boundary:
    neighbours in one direction do not suppress all deformations without energy."""
    topology = mesh.topology
    topology.create_connectivity(3, 2)
    topology.create_connectivity(2, 3)
    n_facets = len(basix.topology(mesh.basix_cell())[2])
    alone = np.diff(topology.connectivity(2, 3).offsets) == 1
    alone[topology.interprocess_facets()] = False
    n = topology.index_map(3).size_local
    of_cells = topology.connectivity(3, 2).array.reshape(-1, n_facets)[:n]
    outside = alone[of_cells]
    opposite = outside[:, ::-1]  # basix numbers them from both ends
    pairs = (outside & opposite).sum(axis=1) // 2
    return pairs >= 2
