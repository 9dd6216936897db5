"""The worst cell of a mesh on any number of ranks."""

import numpy as np
import pytest
from dolfinx.mesh import CellType, create_rectangle

from archord.geometry.meshes.quality import worst_cells


@pytest.mark.mpi
def test_the_worst_cell_is_of_all_ranks(comm):
    """Squares are perfect; a rectangle of two to one is as wide as the root of its area, and a
    trapezoid's determinant falls from side to side."""
    mesh = create_rectangle(comm, [[0.0, 0.0], [4.0, 2.0]], [4, 2], CellType.quadrilateral)
    assert worst_cells(mesh) == pytest.approx({"jacobian": 1.0, "roundness": 1.0})
    x = mesh.geometry.x
    x[x[:, 0] > 3.5, 0] += 1.0
    assert worst_cells(mesh) == pytest.approx({"jacobian": 1.0, "roundness": 0.5})
    x[np.isclose(x[:, 0], 5.0) & (x[:, 1] > 1.5), 0] -= 1.0
    assert worst_cells(mesh)["jacobian"] == pytest.approx(0.5)
