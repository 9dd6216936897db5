"""Meshes from files: one disc in a plate in every format, with the same areas, lengths and sets."""

import basix.cell
import basix.ufl
import gmsh
import numpy as np
import pytest
import ufl
from dolfinx import fem, io
from dolfinx.mesh import (
    CellType,
    create_mesh,
    create_submesh,
    create_unit_cube,
    create_unit_square,
    entities_to_geometry,
    exterior_facet_indices,
    locate_entities,
    meshtags,
)
from mpi4py import MPI

from archord.geometry.basis import tabulate
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.formats.read import read_mesh, tagged
from archord.geometry.meshes.refine import Circle
from archord.kernels.compat import cell_degree, cell_nodes

CIRCLES = [Circle("arc", (0.0, 0.0), 1.0), Circle("hole", (0.0, 0.0), 1.01)]


def draw(order, quads=False, size=0.5):
    """A disc "pin" with its edge "arc" in a "plate" with a "hole", and the disc's point "east"."""
    model = gmsh.model
    disc = model.occ.addDisk(0, 0, 0, 1, 1)
    plate = model.occ.addRectangle(-2, -2, 0, 4, 4)
    hole = 9
    model.occ.addDisk(0, 0, 0, 1.01, 1.01, hole)
    model.occ.cut([(2, plate)], [(2, hole)])
    model.occ.synchronize()
    arc = model.getBoundary([(2, disc)])[0][1]
    edges = [abs(line) for _, line in model.getBoundary([(2, plate)])]
    hole = [line for line in edges if np.ptp(model.getBoundingBox(1, line)) < 3]
    for name, faces in {"pin": [disc], "plate": [plate], "all": [disc, plate]}.items():
        model.addPhysicalGroup(2, faces, name=name)
    for name, lines in {
        "arc": [arc],
        "hole": hole,
        "rim": sorted(set(edges) - set(hole)),
        "plate": edges,
    }.items():
        model.addPhysicalGroup(1, lines, name=name)
    model.addPhysicalGroup(0, [model.getBoundary([(1, arc)], combined=False)[0][1]], name="east")
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    if quads:
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(order)


@pytest.fixture
def module():
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    yield gmsh
    gmsh.finalize()


def content(mesh):
    """Kind and order, and of every set the number of its entities and their measure; over all
    ranks."""
    d = mesh.dimension
    cells = {
        ("cells", name): measured(mesh.mesh, d, mesh.cells_in(name)) for name in mesh.cell_sets
    }
    facets = {
        ("facets", name): measured(mesh.mesh, d - 1, mesh.facets_in(name))
        for name in mesh.facet_sets
    }
    return mesh.mesh.topology.cell_name(), cell_degree(mesh.mesh), cells | facets


def measured(mesh, dim, entities):
    """How many ``entities`` of the dimension ``dim`` there are, and their volume, area or length;
    over all ranks."""
    owned = np.unique(entities[entities < mesh.topology.index_map(dim).size_local])
    size = size_of(mesh, dim, owned) if len(owned) else 0.0
    return mesh.comm.allreduce(len(owned)), mesh.comm.allreduce(size)


def size_of(mesh, dim, owned):
    """The volume, area or length of entities that this rank has."""
    if dim == mesh.topology.dim:
        nodes = cell_nodes(mesh)[owned]
    else:
        mesh.topology.create_connectivity(dim, mesh.topology.dim)
        nodes = entities_to_geometry(mesh, dim, owned)
    kind = basix.cell.subentity_types(mesh.basix_cell())[dim][0]
    X, w = basix.make_quadrature(kind, 8)
    slopes = tabulate(kind, cell_degree(mesh), X)[1:]
    J = np.einsum("jqa,nai->nqji", slopes, mesh.geometry.x[nodes])
    stretch = np.sqrt(np.linalg.det(J @ J.swapaxes(2, 3)))
    return float((stretch @ w).sum())


def like(measures):
    return {key: (n, pytest.approx(value, rel=1e-9)) for key, (n, value) in measures.items()}


@pytest.mark.parametrize("quads", [False, True])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_every_format_gives_the_same_mesh(module, tmp_path, order, quads):
    """All versions of gmsh's files, its live model, dolfinx's meshes and files, and Abaqus'
    input."""
    draw(order, quads)
    expected = read_mesh(gmsh, MPI.COMM_WORLD)
    kind, degree, measures = content(expected)
    assert (kind, degree) == ("quadrilateral" if quads else "triangle", order)
    assert (
        measures["cells", "all"][0] == measures["cells", "pin"][0] + measures["cells", "plate"][0]
    )
    np.testing.assert_allclose(expected.point_sets["east"], [[1, 0]], atol=1e-12)
    for version, binary in ((4.1, 0), (4.1, 1), (2.2, 0)):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(tmp_path / "disc.msh"))
        assert content(read_mesh(tmp_path / "disc.msh", MPI.COMM_WORLD)) == (
            kind,
            degree,
            like(measures),
        )
    assert content(read_mesh(expected, MPI.COMM_WORLD)) == (kind, degree, like(measures))
    if order == 3:
        return  # dolfinx writes no tags of cubic lines
    flat = meshtags(expected.mesh, 2, expected.cells.indices, expected.cells.values)
    flat.name = "cell_tags"
    expected.facets.name = "facet_tags"
    for encoding in (io.XDMFFile.Encoding.HDF5, io.XDMFFile.Encoding.ASCII):
        with io.XDMFFile(MPI.COMM_WORLD, tmp_path / "disc.xdmf", "w", encoding=encoding) as file:
            file.write_mesh(expected.mesh)
            file.write_meshtags(flat, expected.mesh.geometry)
            file.write_meshtags(expected.facets, expected.mesh.geometry)
        _, _, found = content(read_mesh(tmp_path / "disc.xdmf", MPI.COMM_WORLD, scale=2.0))
        for dim, name, factor in (("cells", "pin", 4), ("facets", "arc", 2)):
            sets = {"cells": expected.cell_sets, "facets": expected.facet_sets}[dim]
            n, measure = measures[dim, name]
            assert found[dim, str(sets[name][0])] == (n, pytest.approx(factor * measure, rel=1e-6))


@pytest.mark.parametrize(("order", "quads"), [(1, False), (2, False), (1, True)])
def test_abaqus_input_has_the_sets_of_gmsh(module, tmp_path, order, quads):
    draw(order, quads)
    expected = content(read_mesh(gmsh, MPI.COMM_WORLD))[2]
    gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", 1)
    gmsh.write(str(tmp_path / "disc.inp"))
    mesh = read_mesh(tmp_path / "disc.inp", MPI.COMM_WORLD)
    found = content(mesh)[2]
    assert {key: found[key] for key in expected} == like(expected)
    np.testing.assert_allclose(mesh.point_sets["east"], [[1, 0]], atol=1e-9)


INPUT = """*HEADING
two squares
*NODE, NSET=Nall
 1, 0., 0.
 2, 1., 0.
 3, 2., 0.
 11, 0., 1.
 12, 1., 1.
*INCLUDE, INPUT=more.inp
** five nodes come from there
*ELEMENT, TYPE=CPE8R, ELSET=Left
 7, 1, 2, 12, 11, 21,
 23, 24, 25
*Element, type=cpe8r
 8, 2, 3, 13, 12, 22, 26, 27, 23
*ELSET, ELSET=right
 8,
*ELSET, ELSET=BOTH, GENERATE
 7, 8, 1
*ELSET, ELSET=again
 left, 8
*NSET, NSET=floor
 1, 2, 3, 21, 22
*NSET, NSET=mixed
 1, 24, 25, 11, 13
*SURFACE, NAME=Top, TYPE=ELEMENT
 Both, S3
*SURFACE, NAME=seam
 7, S2
*STEP
*STATIC
*END STEP
"""
MORE = """ 13, 2., 1.
 21, .5, 0.
 22, 1.5, 0.
 23, 1., .5
 24, .5, 1.
*NODE
 25, 0., .5
 26, 2.1, .5
 27, 1.5, 1., 0.
"""


@pytest.fixture
def deck(tmp_path):
    (tmp_path / "more.inp").write_text(MORE)

    def write(*changes):
        text = INPUT
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "deck.inp").write_text(text)
        return tmp_path / "deck.inp"

    return write


@pytest.mark.mpi
def test_an_input_deck_of_sets_and_surfaces(comm, deck):
    """Eight nodes become nine; names in any case, by number, by set, generated; sides as curved as
    their nodes say."""
    mesh = read_mesh(deck(), comm)
    kind, order, found = content(mesh)
    assert (kind, order) == ("quadrilateral", 2)
    area = 1 + 2 / 3 * 0.1
    assert found["cells", "Left"] == (1, pytest.approx(1.0))
    assert found["cells", "right"] == (1, pytest.approx(area))
    assert found["cells", "BOTH"] == found["cells", "again"]
    assert found["cells", "BOTH"] == (2, pytest.approx(1 + area))
    assert found["facets", "floor"] == (2, pytest.approx(found["facets", "Top"][1]))
    assert found["facets", "floor"] == (2, pytest.approx(2.0))
    assert found["facets", "seam"][0] == 1
    assert found["facets", "mixed"][0] == 1
    assert sorted(map(tuple, mesh.point_sets["mixed"].tolist())) == [(0.5, 1.0), (2.0, 1.0)]
    assert set(mesh.point_sets) == {"Nall", "mixed"}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (" 3, 2., 0.", "  ** half of them\n 3, 2., 0."),
        ("*ELEMENT, TYPE=CPE8R, ELSET=Left", "*ELEMENT, TYPE=CPE8R,\n ELSET=Left"),
        (
            "*NSET, NSET=floor\n 1, 2, 3,",
            '*NSET, NSET="some of it"\n 1, 2\n*NSET, NSET=floor\n "some of it", 3,',
        ),
        ("*INCLUDE, INPUT=more.inp\n", "*NODE, NSET=Nall, INPUT=more.inp\n"),
        ("TYPE=CPE8R", "TYPE=CAX8R"),
        ("type=cpe8r", "type=cax8"),
    ],
)
def test_what_an_input_deck_may_look_like(comm, deck, old, new):
    """Comments, keywords on two lines, names between quotes, data in other files and axisymmetric
    elements lose nothing."""
    expected = content(read_mesh(deck(), comm))[2]
    found = content(read_mesh(deck((old, new)), comm))[2]
    assert {key: found[key] for key in expected} == like(expected)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("cpe8r", "C3D27", "solid elements of type C3D27 are not read, only CPS, CPE and CAX"),
        ("cpe8r", "C3D15", "the mesh has prisms, which are not read: cut them into tetrahedra"),
        ("cpe8r", "CGAX8", "axisymmetric elements with twist of type CGAX8 are not read"),
        ("cpe8r", "CPE4", "type CPE4 have 9 numbers, no multiple of 5"),
        (" Both, S3", " Bath, S3", "there is no .ELSET 'Bath'"),
        (" Both, S3", " Both, S5", "surface 'Top' has the face 'S5', which is none of S1 to S4"),
        (" 8, 2, 3,", " 8, 2, 99,", "no node with the number 99"),
        (" 8, 2, 3,", " 8, , 2, 3,", "'' is no number of a node or an element"),
        (
            "*ELSET, ELSET=right\n 8,",
            "*ELSET, ELSET=right\n 9,",
            "no element of the set 'right' with the number 9",
        ),
        (
            "*ELSET, ELSET=right",
            "*ELGEN, ELSET=right\n 7, 2, 1, 1\n*ELSET, ELSET=right",
            "ELGEN is not read",
        ),
        ("*NODE, NSET=Nall", "*NODE, NSET=Nall, SYSTEM=C", "in rectangular coordinates"),
        (" 12, 1., 1.", " 12, 1., 1.\n 12, 1., 2.", "the node 12 is there twice"),
        (" 8, 2, 3,", " 7, 2, 3,", "the element 7 is there twice"),
        ("more.inp", "deck.inp", "deck.inp includes itself"),
        ("more.inp", "mroe.inp", "No such file"),
        (" 12, 1., 1.", " 12, 1., 1., 0.5", "not plane: z differs"),
        (" 3, 2., 0.", " 3, 2., nan", "not finite"),
        (
            " 12, 1., 1.",
            " 12, .1, .1",
            "cells are folded .* in 'Left' and 'BOTH' and 'again': its Jacobian",
        ),
        (
            " 7, 1, 2, 12, 11,",
            " 7, 1, 2, 12, 12,",
            "1 cells have a node twice, .* must not be collapsed",
        ),
    ],
)
def test_a_deck_gone_wrong_is_refused_in_a_sentence(comm, deck, old, new, said):
    path = deck((old, new))
    with pytest.raises(ValueError, match=said) as refusal:
        read_mesh(path, comm)
    assert str(refusal.value).startswith(str(path))


def test_lines_say_what_they_are(module, tmp_path, comm):
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(1)
    gmsh.model.addPhysicalGroup(1, [1], name="edge")
    gmsh.write(str(tmp_path / "line.msh"))
    with pytest.raises(ValueError, match=r"no plane cells in named sets \(only points, lines"):
        read_mesh(tmp_path / "line.msh", comm)


def test_two_groups_of_one_name_are_refused(module, comm):
    draw(1)
    groups = gmsh.model.getPhysicalGroups(2)
    gmsh.model.addPhysicalGroup(2, gmsh.model.getEntitiesForPhysicalGroup(*groups[0]), 77)
    gmsh.model.addPhysicalGroup(2, gmsh.model.getEntitiesForPhysicalGroup(*groups[-1]), name="77")
    with pytest.raises(ValueError, match="two physical groups of dimension 2 are called '77'"):
        read_mesh(gmsh, comm)


def test_a_name_that_gmsh_gave_to_one_of_two_groups_is_told(module, tmp_path, comm):
    """The second one has no name then, and not a half of what the user meant."""
    draw(1)
    assert not gathered(read_mesh(gmsh, comm)).notes
    first, *_ = gmsh.model.getPhysicalGroups(1)
    name = gmsh.model.getPhysicalName(*first)
    curves = gmsh.model.getEntitiesForPhysicalGroup(*first)
    again = gmsh.model.addPhysicalGroup(1, curves, name=name)
    gmsh.write(str(tmp_path / "disc.msh"))
    for source in (gmsh, tmp_path / "disc.msh"):
        (note,) = gathered(read_mesh(source, comm)).notes
        assert f"the physical group {again} of dimension 1 has no name" in note


def test_cells_in_no_group_are_told(module, comm):
    """A body of two faces, one of which its group lacks, is half a body."""
    draw(1)
    for group in gmsh.model.getPhysicalGroups(2):
        if gmsh.model.getPhysicalName(*group) != "pin":
            gmsh.model.removePhysicalGroups([group])
    _, plate = gmsh.model.getEntities(2)
    _, (numbers,), _ = gmsh.model.mesh.getElements(*plate)
    gmsh.model.removePhysicalGroups(gmsh.model.getPhysicalGroups(1))
    (note,) = gathered(read_mesh(gmsh, comm)).notes
    assert f"{len(numbers)} cells are in no physical group and are left out" in note


def test_lines_and_points_of_one_name_are_refused(module, comm):
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    for dim in (3, 1, 0):
        gmsh.model.addPhysicalGroup(dim, [1], name="corner")
    with pytest.raises(ValueError, match="lines and of points are called 'corner'"):
        read_mesh(gmsh, comm)


def test_cells_of_two_kinds_and_other_files_are_refused(module, tmp_path, comm):
    (tmp_path / "mesh.stl").touch()
    for path, said in (
        (tmp_path / "mesh.stl", "none of the files"),
        (tmp_path / "no.msh", "No such file"),
    ):
        with pytest.raises(ValueError, match=said):
            read_mesh(path, comm)
    draw(1)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
    gmsh.model.mesh.setOrder(3)
    with pytest.raises(ValueError, match="triangles of 9 nodes are not read"):
        read_mesh(gmsh, comm)
    gmsh.model.mesh.clear()
    gmsh.model.mesh.setRecombine(2, 1)
    gmsh.model.mesh.generate(2)
    with pytest.raises(ValueError, match="cells of 3 and 4 nodes; it must have one kind"):
        read_mesh(gmsh, comm)


@pytest.mark.mpi
@pytest.mark.parametrize("quads", [False, True])
def test_refined_and_raised_meshes_become_round(comm, quads, tmp_path):
    """The area of the disc: second-order arcs are off by h^4, and straight ones by h^2; other sets
    keep theirs."""
    path = tmp_path / "disc.msh"
    if comm.rank == 0:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        draw(1, quads)
        gmsh.write(str(path))
        gmsh.finalize()
    path = comm.bcast(path)
    off = {}
    for order in (1, 2, 3):
        for times in (0, 1):
            mesh = read_mesh(path, comm, refine=times, order=order, circles=CIRCLES)
            _, degree, found = content(mesh)
            assert degree == order
            assert found["facets", "rim"] == (found["facets", "rim"][0], pytest.approx(16.0))
            off[order, times] = abs(found["cells", "pin"][1] / np.pi - 1), found["cells", "pin"][0]
        assert off[order, 1][1] == 4 * off[order, 0][1]
        assert off[order, 0][0] / off[order, 1][0] == pytest.approx(
            4 if order == 1 else 16, rel=0.1
        )
    np.testing.assert_allclose(mesh.point_sets["east"], [[1, 0]], atol=1e-9)


@pytest.mark.parametrize("quads", [False, True])
def test_nodes_within_cubic_cells_follow_the_circles(module, quads):
    """Smooth functions are interpolated to the fourth power of the size beside the circles, too."""
    off = []
    for size in (0.25, 0.125):
        gmsh.clear()
        draw(1, quads, size)
        mesh = read_mesh(gmsh, MPI.COMM_SELF, order=3, circles=CIRCLES).mesh
        f = fem.Function(fem.functionspace(mesh, ("Lagrange", 3)))
        x = ufl.SpatialCoordinate(mesh)
        f.interpolate(lambda x: np.sin(3 * x[0] + x[1]))
        dx = ufl.dx(metadata={"quadrature_degree": 8})
        off.append(
            fem.assemble_scalar(fem.form(abs(f - ufl.sin(3 * x[0] + x[1])) ** 4 * dx)) ** 0.25
        )
    assert off[0] / off[1] == pytest.approx(16, rel=0.2)


@pytest.mark.mpi
def test_a_mesh_is_gathered_as_it_was_read(comm, deck):
    mesh = read_mesh(deck(), comm, refine=2)
    whole = gathered(mesh)
    again = gathered(read_mesh(mesh, comm))
    assert (whole is None) == (comm.rank > 0)
    if whole is not None:
        assert len(whole.cells) == 32
        np.testing.assert_array_equal(whole.x[whole.cells], again.x[again.cells])
        np.testing.assert_array_equal(whole.bodies, again.bodies)
        assert whole.cell_sets == again.cell_sets


def test_wrong_circles_and_orders_are_refused(comm, deck):
    path = deck()
    with pytest.raises(
        ValueError,
        match=r"node \(2, 0\) of the facet set 'floor' is 1.8 off its circle, .* must be wrong$",
    ):
        read_mesh(path, comm, circles=[Circle("floor", (0.5, 1.0), 1e-3)])
    with pytest.raises(
        ValueError,
        match=r"radius 1000 must be wrong; or is the mesh in metres. Then give mesh.scale = ",
    ):
        read_mesh(path, comm, circles=[Circle("floor", (0.0, 0.0), 1e3)])
    with pytest.raises(
        ValueError,
        match=r"mesh\.circle\.facets: there is no facet set 'flor' .did you mean 'floor'",
    ):
        read_mesh(path, comm, circles=[Circle("flor", (0.5, 1.0), 1.0)])
    with pytest.raises(ValueError, match="of order 2, which cannot be lowered to 1"):
        read_mesh(path, comm, order=1)


def test_a_dolfinx_mesh_keeps_its_tags_under_names(comm):
    square = create_unit_square(comm, 3, 3)
    whole = tagged(square)
    assert content(read_mesh(whole, comm, order=2))[2]["cells", "all"] == (18, pytest.approx(1.0))
    square.topology.create_connectivity(1, 2)
    facets = exterior_facet_indices(square.topology)
    tags = meshtags(square, 1, facets, np.full(len(facets), 7, dtype=np.int32))
    assert list(tagged(square, facets=tags).facet_sets) == ["7"]
    named = tagged(square, facets=tags, facet_sets={"rim": 7})
    assert content(read_mesh(named, comm, scale=2.0))[2]["facets", "rim"] == (
        12,
        pytest.approx(8.0),
    )
    with pytest.raises(ValueError, match="'none' is empty"):
        tagged(square, facets=tags, facet_sets={"none": 8}).facets_in("none")


def test_cells_without_a_tag_are_of_no_set(comm):
    """Whatever the tags are that others have."""
    square = create_unit_square(comm, 4, 4)
    left = locate_entities(square, 2, lambda x: x[0] < 0.5 + 1e-9)
    zero = tagged(square, meshtags(square, 2, left, np.zeros(len(left), dtype=np.int32)))
    assert content(read_mesh(zero, comm))[2]["cells", "0"] == (16, pytest.approx(0.5))
    part = create_submesh(square, 2, left)[0]
    assert content(read_mesh(tagged(part), comm))[2]["cells", "all"] == (16, pytest.approx(0.5))


@pytest.mark.mpi
def test_dolfinx_meshes_that_are_not_plane_and_tags_in_the_wrong_place_are_refused(comm):
    square = create_unit_square(comm, 2, 2)
    square.topology.create_connectivity(1, 2)
    facets = exterior_facet_indices(square.topology)
    tags = meshtags(square, 1, facets, np.ones(len(facets), dtype=np.int32))
    cube = create_unit_cube(comm, 2, 2, 2)
    for wrong in (lambda: tagged(square, tags), lambda: tagged(cube, facets=tags)):
        with pytest.raises(ValueError, match="must be of dimension 2"):
            wrong()
    prisms = create_unit_cube(comm, 1, 1, 1, CellType.prism)
    with pytest.raises(ValueError, match="the mesh has prisms, which are not read: cut them"):
        tagged(prisms)
    element = basix.ufl.element("P", "triangle", 1, shape=(3,))
    with pytest.raises(ValueError, match="not plane: z differs by 1"):
        tagged(create_mesh(MPI.COMM_SELF, cells=np.array([[0, 1, 2]]), e=element, x=np.eye(3)))


def write_tags(path, *values):
    """A square of 32 triangles of which each array of ``values`` is a tag, and its first vertex
    with the tag 5."""
    square = create_unit_square(MPI.COMM_SELF, 4, 4)
    square.topology.create_connectivity(0, 2)
    corner = meshtags(square, 0, np.zeros(1, dtype=np.int32), np.full(1, 5, dtype=np.int32))
    with io.XDMFFile(MPI.COMM_SELF, path, "w") as file:
        file.write_mesh(square)
        for k, found in enumerate(values):
            tags = meshtags(
                square, 2, np.arange(len(found), dtype=np.int32), found.astype(np.int32)
            )
            tags.name = f"tags {k}"
            file.write_meshtags(tags, square.geometry)
        file.write_meshtags(corner, square.geometry)


TWICE = """<Xdmf><Domain><Grid>
<Geometry><DataItem Dimensions="3 2">0 0 1 0 0 1</DataItem></Geometry>
<Topology TopologyType="Triangle"><DataItem Dimensions="1 3">0 1 2</DataItem></Topology>
<Attribute Name="entity" Center="Cell"><DataItem Dimensions="1">1</DataItem></Attribute>
<Attribute Name="group" Center="Cell"><DataItem Dimensions="1">2</DataItem></Attribute>
</Grid></Domain></Xdmf>
"""


def test_cells_with_two_values_are_refused(comm, tmp_path):
    """Which of them names the sets cannot be told; meshio writes entities and groups of gmsh."""
    (tmp_path / "two.xdmf").write_text(TWICE)
    with pytest.raises(ValueError, match="several values of each cell, entity, group"):
        read_mesh(tmp_path / "two.xdmf", comm)
    entity = "\n".join(line for line in TWICE.splitlines() if "entity" not in line)
    (tmp_path / "one.xdmf").write_text(entity)
    assert list(read_mesh(tmp_path / "one.xdmf", comm).cell_sets) == ["2"]


def test_no_tag_of_an_xdmf_file_is_lost(comm, tmp_path):
    """Large values are told apart, a value that two tags have is refused, and vertices are
    points."""
    write_tags(tmp_path / "large.xdmf", np.repeat([1000001, 1000002], 16))
    mesh = read_mesh(tmp_path / "large.xdmf", comm)
    assert {key: n for key, (n, _) in content(mesh)[2].items()} == {
        ("cells", f"100000{k}"): 16 for k in (1, 2)
    }
    assert mesh.point_sets["5"].shape == (1, 2)
    write_tags(tmp_path / "twice.xdmf", np.repeat([1, 2], 16), np.ones(3))
    with pytest.raises(ValueError, match="two tags have the value 1"):
        read_mesh(tmp_path / "twice.xdmf", comm)
