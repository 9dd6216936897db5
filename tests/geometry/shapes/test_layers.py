"""Layers of hexahedra: volumes, areas, sets and nodes on cylinders."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import meshtags
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.shapes.layers import layered
from tests.geometry.shapes.layered_joint import (
    DEPTH,
    HOLE_RADIUS,
    MIDDLE,
    PIN_RADIUS,
    THICKNESS,
    WIDTH,
    graded,
    joint,
)

LENGTH = 1.5 * THICKNESS
_PARABOLAS = 1e-4


def measured(mesh, integral, dimension, entities):
    """The sum over ranks of an integral of 1 over entities: the same form for each set of them."""
    one = fem.Constant(mesh.mesh, 1.0)
    places = np.sort(entities)
    tags = meshtags(mesh.mesh, dimension, places, np.ones(len(places), dtype=np.int32))
    measure = integral(domain=mesh.mesh, subdomain_data=tags, subdomain_id=1)
    return mesh.mesh.comm.allreduce(fem.assemble_scalar(fem.form(one * measure)))


@pytest.mark.mpi
def test_a_joint_has_its_volumes_and_its_areas(comm):
    """The plane's areas times the lengths, and its lines' lengths times the same, but for what
    parabolas differ from arcs."""
    mesh = joint(3.0, 2, length=LENGTH, comm=comm)
    quarter = np.pi / 4
    areas = {
        "block": (WIDTH * DEPTH - quarter * HOLE_RADIUS**2) * THICKNESS,
        "pin": quarter * PIN_RADIUS**2 * LENGTH,
    }
    for name, expected in areas.items():
        found = measured(mesh, ufl.dx, 3, mesh.cells_in(name))
        assert found == pytest.approx(expected, rel=_PARABOLAS)
    faces = {
        "pin": np.pi / 2 * PIN_RADIUS * LENGTH,
        "hole": np.pi / 2 * HOLE_RADIUS * THICKNESS,
        "pin top": PIN_RADIUS * LENGTH,
        "block top": (WIDTH - HOLE_RADIUS) * THICKNESS,
        "pin below": quarter * PIN_RADIUS**2,
        "pin above": quarter * PIN_RADIUS**2,
        "block below": WIDTH * DEPTH - quarter * HOLE_RADIUS**2,
    }
    for name, expected in faces.items():
        found = measured(mesh, ufl.ds, 2, mesh.facets_in(name))
        assert found == pytest.approx(expected, rel=_PARABOLAS)


@pytest.mark.mpi
def test_nodes_lie_on_cylinders_and_between_heights(comm):
    """Those of second order, too, which halve the layers."""
    mesh = joint(3.0, 2, comm=comm)
    V = fem.functionspace(mesh.mesh, ("P", 2))
    x = V.tabulate_dof_coordinates()
    for name, middle, radius in (("pin", MIDDLE, PIN_RADIUS), ("hole", 0.0, HOLE_RADIUS)):
        on = x[mesh.dofs_in(V, name)]
        np.testing.assert_allclose(np.hypot(on[:, 0], on[:, 1] - middle), radius, rtol=1e-13)
    heights = np.unique(np.concatenate(comm.allgather(np.round(x[:, 2], 9))))
    first, second, third = graded(2, 0.4)
    halves = [first, (first + second) / 2, second, (second + third) / 2, third]
    np.testing.assert_allclose(heights, halves, atol=1e-8)


def draw_two(gmsh):
    """Two squares that share an edge, and a point set."""
    occ = gmsh.model.occ
    squares = [(2, occ.addRectangle(x, 0, 0, 1, 1)) for x in (0, 1)]
    occ.fragment(squares[:1], squares[1:])
    occ.synchronize()
    for name, (_, tag) in zip(("left", "right"), squares, strict=True):
        gmsh.model.addPhysicalGroup(2, [tag], name=name)
    gmsh.model.addPhysicalGroup(0, [1], name="corner")


def test_bodies_share_nodes_and_points_become_lines():
    plane = gmsh_to_mesh(MPI.COMM_SELF, draw_two, quads=True)
    heights = [0.0, 0.5, 2.0]
    mesh = layered(plane, {"left": heights, "right": heights})
    n_plane = len(plane.mesh.geometry.x)
    assert len(mesh.mesh.geometry.x) == 5 * n_plane
    corner = mesh.point_sets["corner"]
    assert np.ptp(corner[:, :2], axis=0) == pytest.approx([0.0, 0.0])
    assert sorted(corner[:, 2]) == pytest.approx([0.0, 0.25, 0.5, 1.25, 2.0])


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("quads", "heights", "said"),
    [
        (False, {"left": [0, 1], "right": [0, 1]}, "prisms, which are not supported"),
        (True, {"left": [0, 1]}, "cells have no heights: give heights of every body"),
        (True, {"left": [0, 1], "right": [0, 2]}, "share nodes must have the same heights"),
        (True, {"left": [0, 1], "right": [0, 0]}, "heights of 'right' must be .* increase"),
        (True, {"left": [0, 1], "rigth": [0, 1]}, "did you mean 'right'"),
    ],
)
def test_what_has_no_layers_is_refused(quads, heights, said, comm):
    """On all ranks."""
    plane = gmsh_to_mesh(comm, draw_two, quads=quads)
    with pytest.raises(ValueError, match=said):
        layered(plane, heights)
