"""Bodies in space that lie in each other."""

import gmsh
import numpy as np
import pytest
from mpi4py import MPI

from archord import boxes
from archord.geometry.meshes.check import check_mesh
from archord.geometry.meshes.fenicsx import distribute
from archord.geometry.meshes.mesh_arrays import MeshArrays
from tests.geometry.meshes.test_read import module  # noqa: F401

CUBE = (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)


@pytest.mark.parametrize("kind", ["tetrahedra", "hexahedra"])
@pytest.mark.parametrize(
    ("place", "depth"),
    [
        ((0.2, 0.3, 0.95, 0.5, 0.5, 1.0), 0.05),  # pressed into the top
        ((0.2, 0.3, 1.0, 0.5, 0.5, 1.0), 0.0),  # standing on it
        ((0.2, 0.3, 1.05, 0.5, 0.5, 1.0), 0.0),
        ((0.97, 0.2, 0.3, 1.0, 0.5, 0.5), 0.03),
        ((1.0, 1.0, 1.0, 1.0, 1.0, 1.0), 0.0),  # corner at corner
        ((1.2, 0.9, 0.9, 1.0, 1.0, 1.0), 0.0),  # beside an edge
        ((0.4, 0.4, 0.4, 0.2, 0.2, 0.2), 0.4),  # within
    ],
)
def test_boxes_in_each_other(place, depth, kind):
    mesh = boxes({"cube": CUBE, "other": place}, 0.25, kind, MPI.COMM_SELF)
    bodies = {"cube": "cube", "other": "other"}
    if not depth:
        assert check_mesh(mesh, bodies) == []
        return
    with pytest.raises(ValueError, match=r"the body .* lies .* deep in the body") as no:
        check_mesh(mesh, bodies)
    said = float(str(no.value).split(" deep")[0].split()[-1])
    assert said == pytest.approx(depth, rel=0.6)
    assert said >= depth * 0.99
    assert check_mesh(mesh, bodies, overlap=1.01 * said) == []


def pin_and_ring(gap):
    """A pin of radius 1 in a ring, about one axis that is askew."""
    occ = gmsh.model.occ
    pin = occ.addCylinder(0, 0, 0, 0, 0, 1, 1)
    ring = occ.addCylinder(0, 0, 0, 0, 0, 1, 2)
    [(_, ring)], _ = occ.cut([(3, ring)], [(3, occ.addCylinder(0, 0, 0, 0, 0, 1, 1 + gap))])
    occ.rotate([(3, pin), (3, ring)], 0, 0, 0, 1, 2, 3, 0.7)
    occ.synchronize()
    for name, tag in (("pin", pin), ("ring", ring)):
        gmsh.model.addPhysicalGroup(3, [tag], name=name)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.35)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    return distribute(MPI.COMM_SELF, MeshArrays.from_gmsh(gmsh))


@pytest.mark.parametrize(("gap", "deep"), [(0.01, False), (0.0, False), (-0.02, True)])
def test_a_pin_in_a_ring(module, gap, deep):  # noqa: F811
    """With a clearance, or none, curved sides do not lie in each other; an interference does."""
    mesh = pin_and_ring(gap)
    bodies = {"pin": "pin", "ring": "ring"}
    if not deep:
        assert check_mesh(mesh, bodies) == []
        return
    with pytest.raises(ValueError, match=r"lies 0\.02\d* deep in the body .*overlap = 0\.02"):
        check_mesh(mesh, bodies)
    assert check_mesh(mesh, bodies, overlap=0.0205) == []
    assert np.isfinite(mesh.mesh.geometry.x).all()
