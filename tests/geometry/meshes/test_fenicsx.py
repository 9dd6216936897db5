"""From gmsh to dolfinx."""

from __future__ import annotations

import numpy as np
import pytest
from basix import make_quadrature

from archord.geometry.basis import QUADRILATERAL, cell_basis
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.refine import Circle


def square(gmsh):
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [1], 1)
    gmsh.model.addPhysicalGroup(1, [1], 1)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)


def broken(gmsh):
    square(gmsh)
    raise ValueError("no such joint")


def disc(gmsh):
    """Of radius 1; its circle has the tag 7."""
    gmsh.model.occ.addDisk(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [1], 1, "disc")
    gmsh.model.addPhysicalGroup(1, [1], 7, "circle")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.2)


@pytest.mark.mpi
@pytest.mark.parametrize("order", [1, 2, 3])
def test_quads_alone_with_their_middle_nodes_in_place(order, comm):
    """The area of a disc whose curved edges are moved onto its circle converges with the order; no
    cell is degenerate at any point."""
    tagged = gmsh_to_mesh(comm, disc, [Circle("circle", (0.0, 0.0), 1.0)], order=order, quads=True)
    mesh = tagged.mesh
    assert mesh.basix_cell() == QUADRILATERAL
    assert mesh.geometry.cmap.degree == order
    n = mesh.topology.index_map(2).size_local
    X, w = make_quadrature(QUADRILATERAL, 6)
    basis = cell_basis(mesh, order, np.arange(n, dtype=np.int32), X)
    area = comm.allreduce(float((basis.measure @ w).sum()))
    assert abs(area - np.pi) < {1: 0.03, 2: 2e-5, 3: 3e-6}[order]
    straight = np.sign(basis.determinant[:, :1])
    assert (
        basis.determinant * straight > 0.3 * np.abs(basis.determinant).max(axis=1, keepdims=True)
    ).all()
    assert (tagged.facets.values == 7).all()


@pytest.mark.mpi
def test_an_error_of_rank_0_is_raised_on_every_rank(comm):
    """No rank waits for a mesh that never comes, and the next mesh is not built on what is left of
    the failed one."""
    fresh = gmsh_to_mesh(comm, square).mesh
    with pytest.raises(RuntimeError, match="no such joint"):
        gmsh_to_mesh(comm, broken)
    np.testing.assert_array_equal(gmsh_to_mesh(comm, square).mesh.geometry.x, fresh.geometry.x)
