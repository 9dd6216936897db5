"""Cells whose nodes are numbered as in a mirror: what readers of a run see."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord import Body, Elastic, Load, Problem, Support
from archord.geometry.basis import HEXAHEDRON, QUADRILATERAL, TETRAHEDRON
from archord.geometry.meshes.cells import in_mirror, turned
from archord.geometry.meshes.fenicsx import distribute, gathered
from archord.postprocess.export import export_vtk
from tests.postprocess.vtk_reader import VtkFile

SIZE = (2.0, 1.0, 1.0)
# corners of VTK's cells beside the first one
BESIDE = {"triangles": [1, 2], "tetrahedra": [1, 2, 3], "hexahedra": [1, 3, 4]}


def bar(kind):
    """A bar of this ``kind`` of cells under tension; every other cell is mirrored."""
    if kind == "triangles":
        made = archord.rectangles({"bar": (0, 0, 2, 1)}, 0.5, comm=MPI.COMM_SELF)
    else:
        made = archord.boxes({"bar": (0, 0, 0, *SIZE)}, 0.5, kind=kind, comm=MPI.COMM_SELF)
    mesh = gathered(made)
    every_other = np.arange(len(mesh.cells)) % 2 == 0
    mesh.cells[:] = turned(mesh.kind, mesh.order, mesh.cells, every_other)
    return Problem(
        distribute(MPI.COMM_SELF, mesh),
        [Body("bar", Elastic(1000.0, 0.3))],
        supports=[Support("bar left")],
        loads=[Load("pull", on="bar right", direction="x", displacement=0.1)],
        steps=1,
    )


@pytest.mark.parametrize("kind", BESIDE)
def test_no_cell_is_inside_out(kind, tmp_path):
    """Determinants are positive in VTK, and integration points move with the cells around them."""
    run = archord.solve(bar(kind), tmp_path / "bar", fields="points", comm=MPI.COMM_SELF)
    bodies, points = export_vtk(run, tmp_path / "vtk")
    grid = VtkFile(bodies).at(1)
    d = run.kinematics.dimension
    nodes = np.reshape(grid.cell_connectivity, (grid.n_cells, -1))
    x = grid.points[nodes][..., :d]
    assert np.linalg.det(x[:, BESIDE[kind]] - x[:, :1]).min() > 0
    at_points = VtkFile(points).at(1)
    some = np.linspace(0, len(at_points.points) - 1, 12).astype(int)
    places = at_points.points[some, :d]
    probed = [run.probe(quantity="ux", line=(*at, *at)).values[0] for at in places]
    # in a plane a probe is linear between nodes
    tolerance = 2e-3 if d == 2 else 1e-9
    np.testing.assert_allclose(at_points["displacement"][some, 0], probed, atol=tolerance)


def test_a_mirror_of_a_mirror_is_no_mirror():
    X = np.array([[0.1, 0.2, 0.3]])
    np.testing.assert_array_equal(in_mirror(in_mirror(X)), X)
    for kind, nodes in ((QUADRILATERAL, 9), (TETRAHEDRON, 10), (HEXAHEDRON, 27)):
        cell = np.arange(nodes)[None]
        once = turned(kind, 2, cell, np.array([True]))
        assert (once != cell).any()
        np.testing.assert_array_equal(turned(kind, 2, once, np.array([True])), cell)
