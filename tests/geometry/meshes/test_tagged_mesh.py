"""Named sets that overlap, on any number of ranks, and what is said of names that are none."""

from dataclasses import replace

import numpy as np
import pytest
from dolfinx import fem
from dolfinx.mesh import compute_midpoints

from archord import rectangles
from archord.geometry.meshes.fenicsx import distribute, gathered, gmsh_to_mesh


def squares(gmsh):
    """Two unit squares side by side that share an edge; sets "left", "right", "all", "bottom",
    "lower left"."""
    for x in (0, 1):
        gmsh.model.occ.addRectangle(x, 0, 0, 1, 1)
    gmsh.model.occ.fragment([(2, 1)], [(2, 2)])
    gmsh.model.occ.synchronize()
    for name, faces in {"left": [1], "right": [2], "all": [1, 2]}.items():
        gmsh.model.addPhysicalGroup(2, faces, name=name)
    low = [
        [
            line
            for _, line in gmsh.model.getEntitiesInBoundingBox(
                x - 0.1, -0.1, -1, x + 1.1, 0.1, 1, 1
            )
        ]
        for x in (0, 1)
    ]
    gmsh.model.addPhysicalGroup(1, low[0] + low[1], name="bottom")
    gmsh.model.addPhysicalGroup(1, low[0], name="lower left")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)


@pytest.fixture
def mesh(comm):
    tagged = gmsh_to_mesh(comm, squares)
    return replace(
        tagged, point_sets={"corner": np.array([[2.0, 1.0]]), "nowhere": np.array([[3.0, 1.0]])}
    )


def middles(mesh, dim, entities):
    return compute_midpoints(mesh, dim, entities).reshape(-1, 3)[:, :2]


@pytest.mark.mpi
def test_sets_that_overlap_have_all_their_cells_and_facets(mesh):
    x = {name: middles(mesh.mesh, 2, mesh.cells_in(name)) for name in mesh.cell_sets}
    index_map = mesh.mesh.topology.index_map(2)
    n = index_map.size_local + index_map.num_ghosts
    assert len(x["left"]) + len(x["right"]) == len(x["all"]) == n
    assert (x["left"][:, 0] < 1).all()
    assert (x["right"][:, 0] > 1).all()
    low, left = (middles(mesh.mesh, 1, mesh.facets_in(name)) for name in ("bottom", "lower left"))
    assert np.abs(low[:, 1]).max(initial=0) < 1e-12
    assert (low[:, 0] < 1).sum() == len(left)
    assert mesh.tags_behind("bottom") == set(mesh.cell_sets["all"])
    assert mesh.tags_behind("lower left") == set(mesh.cell_sets["left"])


@pytest.mark.mpi
def test_dofs_are_those_of_facets_points_or_cells(mesh, comm):
    V = fem.functionspace(mesh.mesh, ("Lagrange", 2, (2,)))
    both = mesh.facet_sets | {"both": mesh.facet_sets["bottom"]}
    points = mesh.point_sets | {"both": mesh.point_sets["corner"], "void": np.zeros((0, 2))}
    mesh = replace(mesh, facet_sets=both, point_sets=points)
    x = V.tabulate_dof_coordinates()[:, :2]
    for name, inside in {
        "bottom": np.abs(x[:, 1]) < 1e-9,
        "corner": np.abs(x - [2, 1]).max(axis=1) < 1e-9,
        "left": x[:, 0] < 1 + 1e-9,
        "both": (np.abs(x[:, 1]) < 1e-9) | (np.abs(x - [2, 1]).max(axis=1) < 1e-9),
    }.items():
        np.testing.assert_array_equal(np.sort(mesh.dofs_in(V, name)), np.flatnonzero(inside))
    with pytest.raises(ValueError, match=r"'nowhere' does not tell which node at \(3, 1\)"):
        mesh.dofs_in(V, "nowhere")
    with pytest.raises(ValueError, match="'void' is empty: no cell has a node of it"):
        mesh.dofs_in(V, "void")


@pytest.mark.mpi
def test_points_of_bodies_in_touch_are_told_apart(comm):
    """By the bodies that they belong to, after a mesh is gathered, too."""
    boxes = {"left": (0.0, 0.0, 1.0, 1.0), "right": (1.0, 0.0, 1.0, 1.0)}
    drawn = rectangles(boxes, size=0.5, comm=comm)
    whole = gathered(drawn)
    if whole is not None:
        for body in boxes:
            own = np.unique(whole.cells[np.isin(whole.bodies, whole.cell_sets[body])])
            is_touching = np.abs(whole.x[own, 0] - 1) < 1e-9
            whole.point_sets[f"end of {body}"] = own[is_touching]
    mesh = distribute(comm, whole)
    again = distribute(comm, gathered(mesh))
    for made in (mesh, again):
        V = fem.functionspace(made.mesh, ("Lagrange", 2, (2,)))
        for body in boxes:
            found = made.dofs_in(V, f"end of {body}")
            assert comm.allreduce((found < V.dofmap.index_map.size_local).sum()) == 5
            assert np.isin(found, made.dofs_in(V, body)).all()


def test_a_name_that_is_none_gets_the_list(mesh):
    with pytest.raises(
        ValueError, match=r"no cell set 'lift' .did you mean 'left'..; there are 'left', 'right'"
    ):
        mesh.cells_in("lift")
    with pytest.raises(ValueError, match="no facet set 'x'; there are 'bottom', 'lower left'"):
        mesh.facets_in("x")
    with pytest.raises(ValueError, match="the facet set 'void' is empty"):
        replace(mesh, facet_sets={"void": ()}).facets_in("void")
