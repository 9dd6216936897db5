"""Meshes in space cut finer, given a higher order, put on cylinders and spheres; straight sides of
arcs against their clearance."""

import gmsh
import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.geometry.basis import HEXAHEDRON, TETRAHEDRON
from archord.geometry.meshes.check import check_mesh
from archord.geometry.meshes.fenicsx import distribute
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.quality import faults, measures
from archord.geometry.meshes.refine import Circle, cylinder_through, refined
from tests.geometry.meshes.test_read import content, module  # noqa: F401
from tests.geometry.meshes.test_read_space import AREAS, INNER, OUTER, VOLUME, draw

BOTH = pytest.mark.parametrize("kind", [TETRAHEDRON, HEXAHEDRON])
AXIS = (0.0, 0.0, 1.0)
CYLINDERS = [
    Circle("bore", (0.0, 0.0, 0.3), INNER, AXIS),
    Circle("rim", (0.0, 0.0, 0.0), OUTER, (0.0, 0.0, -2.0)),
]


def tube(kind, order=1, split=4):
    draw(kind, order, split=split)
    return MeshArrays.from_gmsh(gmsh)


@BOTH
@pytest.mark.parametrize("order", [1, 2])
def test_a_cut_mesh_is_the_same_body(module, kind, order):  # noqa: F811
    """Eight cells for one and four facets for one, which fit together, with the same volume and
    areas."""
    made = tube(kind, order)
    fine = refined(made, 1)
    assert fine.order == order
    assert (len(fine.cells), len(fine.facets)) == (8 * len(made.cells), 4 * len(made.facets))
    assert faults(fine) == []
    assert measures(fine).sum() == pytest.approx(measures(made).sum(), rel=1e-12)
    coarse, found = (content(distribute(MPI.COMM_SELF, mesh))[2] for mesh in (made, fine))
    for key, (n, measure) in coarse.items():
        parts = 8 if key[0] == "cells" else 4
        assert found[key] == (parts * n, pytest.approx(measure, rel=1e-9))
    for name, nodes in made.point_sets.items():
        np.testing.assert_allclose(fine.x[fine.point_sets[name]], made.x[nodes], atol=1e-12)


@BOTH
@pytest.mark.parametrize("times", [0, 1])
def test_nodes_come_to_lie_on_cylinders(module, kind, times):  # noqa: F811
    """A mesh of the first order gets a higher one: the volume is the tube's, and cells stay
    sound."""
    made = refined(tube(kind), times, 2, CYLINDERS)
    assert faults(made) == []
    off = 2e-4 / 8**times
    assert measures(made).sum() == pytest.approx(VOLUME, rel=off)
    found = content(distribute(MPI.COMM_SELF, made))[2]
    for name, area in AREAS.items():
        assert found["facets", name][1] == pytest.approx(area, rel=off)
    for circle in CYLINDERS:
        on = made.x[np.unique(made.facets_of(circle.facets))]
        assert circle.distance(on).max() < 1e-13
    corners = np.unique(made.cells[:, : 4 if kind == TETRAHEDRON else 8])
    inner = np.setdiff1d(np.unique(made.cells), [*np.unique(made.facets), *corners])
    assert len(inner)


def test_nodes_come_to_lie_on_a_sphere(module):  # noqa: F811
    ball = gmsh.model.occ.addSphere(1, 2, 3, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [ball], name="ball")
    gmsh.model.addPhysicalGroup(2, [1], name="surface")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
    gmsh.model.mesh.generate(3)
    made = MeshArrays.from_gmsh(gmsh)
    on_sphere = refined(made, 0, 2, [Circle("surface", (1.0, 2.0, 3.0), 1.0)])
    assert measures(on_sphere).sum() == pytest.approx(4 / 3 * np.pi, rel=1e-3)
    assert faults(on_sphere) == []
    with pytest.raises(ValueError, match=r"is 0.1 off its sphere, whose centre or radius 1.1 must"):
        refined(made, 0, 2, [Circle("surface", (1.0, 2.0, 3.0), 1.1)])


def test_circles_that_do_not_fit_are_told_of(module):  # noqa: F811
    made = tube(TETRAHEDRON)
    with pytest.raises(ValueError, match=r"off its cylinder, whose axis or radius 3 must be wrong"):
        refined(made, 0, 2, [Circle("bore", (0.0, 0.0, 0.0), 3.0, AXIS)])
    with pytest.raises(ValueError, match="circle of 'bore' must have a centre of 3 numbers"):
        refined(made, 0, 2, [Circle("bore", (0.0, 0.0), INNER)])
    [note] = refined(made, 0, 2, [Circle("bore", (0.0, 0.0, 0.0), 1.01, AXIS)]).notes
    assert "'bore' is drawn up to 0.01 off its [[mesh.circle]]" in note


@BOTH
def test_cylinders_are_found_by_their_facets(module, kind):  # noqa: F811
    made = tube(kind)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    x = made.x @ turn + [1.0, -2.0, 0.5]
    for circle in CYLINDERS:
        found = cylinder_through(x, made.facets_of(circle.facets))
        assert found.radius == pytest.approx(circle.radius, rel=1e-9)
        along = np.array(found.axis) / np.linalg.norm(found.axis)
        assert abs(along @ turn[2]) == pytest.approx(1, rel=1e-12)
    assert cylinder_through(x, made.facets_of("top")) is None


def pin_and_hole(gap, order=1):
    """A pin in a ring with this clearance, apart in no place."""
    occ = gmsh.model.occ
    pin = occ.addCylinder(0, 0, 0, 0, 0, 1, 1)
    ring = occ.addCylinder(0, 0, 0, 0, 0, 1, 2)
    [(_, ring)], _ = occ.cut([(3, ring)], [(3, occ.addCylinder(0, 0, 0, 0, 0, 1, 1 + gap))])
    occ.synchronize()
    for name, tag in (("pin", pin), ("ring", ring)):
        gmsh.model.addPhysicalGroup(3, [tag], name=name)
        for _, face in gmsh.model.getBoundary([(3, tag)], oriented=False):
            x = np.abs(gmsh.model.getBoundingBox(2, face))[:2].max()
            if gmsh.model.getType(2, face) == "Cylinder" and x < 1.9:
                gmsh.model.addPhysicalGroup(2, [face], name=f"{name} arc")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)
    return distribute(MPI.COMM_SELF, MeshArrays.from_gmsh(gmsh))


@pytest.mark.parametrize(
    ("gap", "order", "said"),
    [(0.05, 1, "refused"), (0.5, 1, "warned"), (0.05, 2, "")],
)
def test_straight_sides_of_arcs_are_judged_by_the_clearance(module, gap, order, said):  # noqa: F811
    bodies = {"pin": "pin", "ring": "ring"}
    mesh = pin_and_hole(gap, order)
    if said == "refused":
        with pytest.raises(ValueError, match="the arcs 'pin arc' and 'ring arc' have straight si"):
            check_mesh(mesh, bodies, [["pin arc", "ring arc"]])
        return
    warnings = check_mesh(mesh, bodies, [["pin arc", "ring arc"]])
    assert any("their corners make" in warning for warning in warnings) == (said == "warned")


def test_a_scene_puts_nodes_on_cylinders(module, tmp_path):  # noqa: F811
    draw(TETRAHEDRON, 1)
    gmsh.write(str(tmp_path / "tube.msh"))
    circles = {"bore": ((0.0, 0.0, 0.0), INNER, AXIS), "rim": ((0.0, 0.0, 0.0), OUTER, AXIS)}
    mesh = archord.Mesh(tmp_path / "tube.msh", order=2, circles=circles).on(MPI.COMM_SELF)
    assert content(mesh)[2]["cells", "tube"][1] == pytest.approx(VOLUME, rel=2e-4)
