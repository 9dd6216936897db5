"""From gmsh to dolfinx."""

from __future__ import annotations

import numpy as np
import pytest

from archord.geometry.meshes.fenicsx import gmsh_to_mesh


def square(gmsh):
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [1], 1)
    gmsh.model.addPhysicalGroup(1, [1], 1)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)


def broken(gmsh):
    square(gmsh)
    raise ValueError("no such joint")


@pytest.mark.mpi
def test_an_error_of_rank_0_is_raised_on_every_rank(comm):
    """No rank waits for a mesh that never comes, and the next mesh is not built on what is left of the failed one."""
    fresh = gmsh_to_mesh(comm, square).mesh
    with pytest.raises(RuntimeError, match="no such joint"):
        gmsh_to_mesh(comm, broken)
    np.testing.assert_array_equal(gmsh_to_mesh(comm, square).mesh.geometry.x, fresh.geometry.x)
