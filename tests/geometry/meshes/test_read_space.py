"""Meshes in space from files: a quarter of a thick tube in every format, with its known volume,
areas and sets."""

import gmsh
import numpy as np
import pytest
from dolfinx import io
from mpi4py import MPI

from archord.geometry.basis import HEXAHEDRON, TETRAHEDRON, lagrange_element, tabulate
from archord.geometry.meshes.cells import n_corners
from archord.geometry.meshes.fenicsx import distribute, gathered
from archord.geometry.meshes.formats.read import dimension_of_source, read_mesh, tagged
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.quality import faults, measures
from archord.geometry.meshes.stored import store_mesh, stored_mesh
from tests.geometry.meshes.test_read import content, like, module  # noqa: F401

INNER, OUTER, HEIGHT = 1.0, 2.0, 1.5
VOLUME = np.pi / 4 * (OUTER**2 - INNER**2) * HEIGHT
AREAS = {
    "bore": np.pi / 2 * INNER * HEIGHT,
    "rim": np.pi / 2 * OUTER * HEIGHT,
    "bottom": VOLUME / HEIGHT,
    "top": VOLUME / HEIGHT,
    "cut": (OUTER - INNER) * HEIGHT,
}
KINDS = pytest.mark.parametrize(
    ("kind", "order", "nodes"),
    [
        (TETRAHEDRON, 1, 4),
        (TETRAHEDRON, 2, 10),
        (TETRAHEDRON, 3, 20),
        (HEXAHEDRON, 1, 8),
        (HEXAHEDRON, 2, 27),
        (HEXAHEDRON, 2, 20),
    ],
)
OFF = {1: 0.03, 2: 1e-4, 3: 1e-5}  # of volumes and areas, by the order of the cells


def draw(kind, order, nodes=0, split=4):
    """The "tube" with its sets of faces, its edge "rim edge" and its corner "corner"."""
    geo = gmsh.model.geo
    centre = geo.addPoint(0, 0, 0)
    a, b = (geo.addPoint(r, 0, 0) for r in (INNER, OUTER))
    c, d = (geo.addPoint(0, r, 0) for r in (OUTER, INNER))
    lines = [geo.addLine(a, b), geo.addCircleArc(b, centre, c), geo.addLine(c, d)]
    lines.append(geo.addCircleArc(d, centre, a))
    face = geo.addPlaneSurface([geo.addCurveLoop(lines)])
    hexes = kind == HEXAHEDRON
    made = geo.extrude([(2, face)], 0, 0, HEIGHT, [split // 2] if hexes else [], recombine=hexes)
    geo.synchronize()
    top, volume, cut, rim, other, bore = (tag for _, tag in made)
    if hexes:
        for line in lines:
            gmsh.model.mesh.setTransfiniteCurve(line, split + 1)
        gmsh.model.mesh.setTransfiniteSurface(face)
        gmsh.model.mesh.setRecombine(2, face)
    gmsh.model.addPhysicalGroup(3, [volume], name="tube")
    faces = {"bore": [bore], "rim": [rim], "bottom": [face], "top": [top], "cut": [cut]}
    for name, tags in (faces | {"cuts": [cut, other]}).items():
        gmsh.model.addPhysicalGroup(2, tags, name=name)
    gmsh.model.addPhysicalGroup(1, [lines[1]], name="rim edge")
    gmsh.model.addPhysicalGroup(0, [b], name="corner")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 2 / split)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", nodes == 20 and hexes)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)


def nodes_off(mesh, order):
    """How far the cells' nodes are off where their kind's reference nodes go by their corners, in a
    mesh of straight cells."""
    corners = n_corners(mesh.kind)
    weights = tabulate(mesh.kind, 1, lagrange_element(mesh.kind, order).points)[0]
    there = np.einsum("qa,nai->nqi", weights, mesh.x[mesh.cells[:, :corners]])
    return np.abs(mesh.x[mesh.cells] - there).max()


@KINDS
def test_every_format_gives_the_same_tube(module, tmp_path, kind, order, nodes):  # noqa: F811
    draw(kind, order, nodes)
    comm = MPI.COMM_WORLD
    expected = read_mesh(gmsh, comm)
    name, degree, found = content(expected)
    assert (name, degree) == (kind.name, order)
    assert found["cells", "tube"][1] == pytest.approx(VOLUME, rel=OFF[order])
    for face, area in AREAS.items():
        assert found["facets", face][1] == pytest.approx(area, rel=OFF[order])
    assert found["facets", "cuts"][1] == pytest.approx(2 * AREAS["cut"], rel=1e-9)
    np.testing.assert_allclose(expected.point_sets["corner"], [[OUTER, 0, 0]], atol=1e-12)
    radii = np.linalg.norm(expected.point_sets["rim edge"][:, :2], axis=1)
    assert len(radii) > 2
    np.testing.assert_allclose(radii, OUTER, rtol=1e-9)
    for version, binary in ((4.1, 0), (4.1, 1), (2.2, 0)):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(tmp_path / "tube.msh"))
        assert content(read_mesh(tmp_path / "tube.msh", comm)) == (name, degree, like(found))
        assert dimension_of_source(tmp_path / "tube.msh") == 3
    whole = MeshArrays.from_gmsh(gmsh)
    assert whole.cells.shape[1] == (27 if nodes == 20 and kind == HEXAHEDRON else nodes)
    assert measures(whole).sum() == pytest.approx(VOLUME, rel=OFF[order])
    assert faults(whole) == []
    with (tmp_path / "tube.npz").open("wb") as file:
        store_mesh(whole, file)
    assert content(read_mesh(tmp_path / "tube.npz", comm)) == (name, degree, like(found))
    assert (stored_mesh(tmp_path / "tube.npz").facets == whole.facets).all()
    again = tagged(expected.mesh, expected.cells, expected.facets)
    volume = sum(value for (what, _), (_, value) in content(again)[2].items() if what == "cells")
    assert volume == pytest.approx(VOLUME, rel=OFF[order])


@KINDS
def test_files_of_dolfinx_keep_the_tags(module, tmp_path, kind, order, nodes):  # noqa: F811
    """Sets are the values of tags; in HDF5 and as text."""
    if order == 3:
        pytest.skip("dolfinx writes no tags of cubic facets")
    draw(kind, order, nodes)
    comm = MPI.COMM_WORLD
    made = read_mesh(gmsh, comm)
    name, degree, expected = content(made)
    path = tmp_path / "tube.xdmf"
    for encoding in (io.XDMFFile.Encoding.HDF5, io.XDMFFile.Encoding.ASCII):
        with io.XDMFFile(comm, path, "w", encoding=encoding) as file:
            file.write_mesh(made.mesh)
            made.facets.name = "facet_tags"
            file.write_meshtags(made.facets, made.mesh.geometry)
        mesh = read_mesh(path, comm)
        assert content(mesh)[:2] == (name, degree)
        found = content(mesh)[2]
        [volume] = [value for (what, _), (_, value) in found.items() if what == "cells"]
        assert volume == pytest.approx(expected["cells", "tube"][1], rel=1e-6)
        for face in ("bore", "rim", "top"):
            n, area = expected["facets", face]
            tag = str(made.facet_sets[face][0])
            assert found["facets", tag] == (n, pytest.approx(area, rel=1e-6))
        assert dimension_of_source(path) == 3


@KINDS
def test_abaqus_input_has_the_sets_of_gmsh(module, tmp_path, kind, order, nodes):  # noqa: F811
    """Plane elements name faces, trusses name nodes."""
    if nodes == 27 or order == 3:
        pytest.skip("gmsh writes none of these")
    draw(kind, order, nodes)
    expected = content(read_mesh(gmsh, MPI.COMM_WORLD))[2]
    gmsh.write(str(tmp_path / "tube.inp"))
    mesh = read_mesh(tmp_path / "tube.inp", MPI.COMM_WORLD)
    found = content(mesh)[2]
    assert {key: found[key] for key in expected} == like(expected)
    radii = np.linalg.norm(mesh.point_sets["rim_edge"][:, :2], axis=1)
    np.testing.assert_allclose(radii, OUTER, rtol=1e-9)
    assert dimension_of_source(tmp_path / "tube.inp") == 3


@KINDS
def test_nodes_are_in_basix_order(module, kind, order, nodes):  # noqa: F811
    """Nodes of straight cells lie where the corners put them; nodes of the curved faces on the
    cylinders, in the middle of faces, too."""
    gmsh.model.occ.addBox(0, 0, 0, 1, 2, 3)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [1], name="box")
    if kind == HEXAHEDRON:
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", nodes == 20)
        gmsh.model.mesh.setTransfiniteAutomatic()
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 1.0)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)
    box = MeshArrays.from_gmsh(gmsh)
    assert nodes_off(box, order) < 1e-12
    gmsh.clear()
    draw(kind, order, nodes)
    tube = MeshArrays.from_gmsh(gmsh)
    for name, radius, off in (("bore", INNER, 5e-3), ("rim", OUTER, 5e-3)):
        r = np.linalg.norm(tube.x[tube.facets_of(name)][..., :2], axis=2)
        filled = nodes == 20 and kind == HEXAHEDRON
        on = r[:, :8] if filled else r
        np.testing.assert_allclose(on, radius, rtol=1e-9)
        np.testing.assert_allclose(r, radius, rtol=off)


@pytest.mark.mpi
@pytest.mark.parametrize("kind", [TETRAHEDRON, HEXAHEDRON])
def test_ranks_have_the_same_mesh(comm, kind):
    """Rank 0 gets back what it has distributed."""
    made = None
    if comm.rank == 0:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        draw(kind, 2)
        made = MeshArrays.from_gmsh(gmsh)
        gmsh.finalize()
    mesh = distribute(comm, made)
    assert content(mesh)[2]["cells", "tube"][1] == pytest.approx(VOLUME, rel=OFF[2])
    assert content(mesh)[2]["facets", "rim"][1] == pytest.approx(AREAS["rim"], rel=OFF[2])
    whole = gathered(mesh)
    if whole is not None:
        np.testing.assert_array_equal(whole.x[whole.cells], made.x[made.cells])
        assert whole.facet_sets == made.facet_sets
        assert measures(whole).sum() == pytest.approx(VOLUME, rel=OFF[2])


def test_a_cell_that_is_turned_inside_out_is_refused(module):  # noqa: F811
    draw(TETRAHEDRON, 2)
    made = MeshArrays.from_gmsh(gmsh)
    cell = made.cells[len(made.cells) // 2]
    made.x[cell[4]] += 1.5 * (made.x[cell[0]] - made.x[cell[4]])
    [said] = faults(made)
    assert "cells are folded or have no volume, the worst at (" in said
    assert "in 'tube': its Jacobian determinant falls to -" in said


def test_prisms_mixed_and_unnamed_meshes_are_refused(module, comm):  # noqa: F811
    box = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    made = gmsh.model.occ.extrude([(2, box)], 0, 0, 1, [2], recombine=True)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(3)
    with pytest.raises(ValueError, match="the mesh has solid cells in no physical group"):
        read_mesh(gmsh, comm)
    gmsh.model.addPhysicalGroup(3, [made[1][1]], name="box")
    gmsh.model.addPhysicalGroup(2, [box], name="bottom")
    with pytest.raises(ValueError, match="the mesh has prisms, which are not read: cut them into"):
        read_mesh(gmsh, comm)
