"""Meshes as arrays, between gmsh and dolfinx."""

import gmsh
import numpy as np
import pytest

from archord.geometry.meshes.mesh_arrays import MeshArrays


@pytest.fixture
def model():
    """A face between an arc and its chord, whose centre belongs to no triangle."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    geo = gmsh.model.geo
    centre, a, b = (geo.addPoint(*x, 0) for x in ((0, 0), (1, 0), (0, 1)))
    arc = geo.addCircleArc(a, centre, b)
    chord = geo.addLine(b, a)
    face = geo.addPlaneSurface([geo.addCurveLoop([arc, chord])])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(2, [face], 7)
    gmsh.model.addPhysicalGroup(1, [chord], 3)
    gmsh.model.addPhysicalGroup(1, [arc], 4)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.1)
    gmsh.model.mesh.generate(2)
    yield gmsh
    gmsh.finalize()


def test_every_node_belongs_to_a_cell(model):
    mesh = MeshArrays.from_gmsh(model)
    assert (np.unique(mesh.cells) == np.arange(len(mesh.x))).all()
    assert set(mesh.bodies) == {7}
    assert np.abs(mesh.x[mesh.facets[mesh.tags == 3]].sum(axis=2) - 1).max() < 1e-12
    assert np.abs(np.linalg.norm(mesh.x[mesh.facets[mesh.tags == 4]], axis=2) - 1).max() < 1e-12


def test_middle_nodes_are_those_that_gmsh_would_make(model):
    """Of every cell and every edge, in basix' order, on the arc too."""
    ours = MeshArrays.from_gmsh(model).second_order()
    arc = np.unique(ours.facets[ours.tags == 4])
    ours.x[arc] /= np.linalg.norm(ours.x[arc], axis=1)[:, None]
    model.model.mesh.setOrder(2)
    gmshs = MeshArrays.from_gmsh(model)
    assert ours.x.shape == gmshs.x.shape
    assert np.abs(ours.x[ours.cells] - gmshs.x[gmshs.cells]).max() < 1e-9
    assert np.abs(ours.x[ours.facets] - gmshs.x[gmshs.facets]).max() < 1e-9
