"""Parts, instances and assemblies of Abaqus: an instance is its part, moved and turned."""

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.formats.read import read_mesh

PART = """*Part, name=Bar
*Node
1, 0., 0.
2, 2., 0.
3, 2., 1.
4, 0., 1.
*Element, type=CPS4
1, 1, 2, 3, 4
*Nset, nset=left
1, 4
*Elset, elset=all, generate
1, 1, 1
*Surface, type=ELEMENT, name=top
all, S3
*Solid Section, elset=all, material=steel
1.,
*End Part
"""
ASSEMBLY = """*Assembly, name=Assembly
*Instance, name=Bar-1, part=Bar
*End Instance
*Instance, name=Bar-2, part=BAR
10., 0., 0.
10., 0., 0., 10., 0., 1., 90.
*End Instance
*Node
1, 5., 5., 0.
*Nset, nset=ends, instance=Bar-1
2, 3
*Nset, nset=ends, instance=bar-2
left,
*Elset, elset=_right_S2, internal, instance=Bar-1
1,
*Surface, type=ELEMENT, name=right
_right_S2, S2
*Surface, type=ELEMENT, name=upper
Bar-2.all, S3
Bar-1.all, S3
*End Assembly
*Material, name=steel
*Step
*End Step
"""


def read(tmp_path, text, comm=MPI.COMM_SELF):
    path = comm.bcast(tmp_path) / "deck.inp"
    if comm.rank == 0:
        path.write_text(text)
    comm.barrier()
    return gathered(read_mesh(path, comm))


def ends(mesh, name):
    """The corners of a facet set."""
    nodes = np.unique(mesh.facets[np.isin(mesh.tags, mesh.facet_sets[name])][:, :2])
    return sorted(map(tuple, (mesh.x[nodes].round(9) + 0.0).tolist()))


@pytest.mark.mpi
def test_instances_are_moved_then_turned_and_their_sets_qualified(tmp_path, comm):
    text = PART + ASSEMBLY
    mesh = read(tmp_path, text, comm)
    if mesh is None:
        return
    assert list(mesh.cell_sets) == ["Bar-1.all", "Bar-2.all"]
    assert set(mesh.facet_sets) == {
        "Bar-1.top",
        "Bar-2.top",
        "Bar-1.left",
        "Bar-2.left",
        "ends",
        "right",
        "upper",
    }
    assert ends(mesh, "Bar-1.left") == [(0, 0), (0, 1)]
    assert ends(mesh, "Bar-2.left") == [(9, 0), (10, 0)]
    assert ends(mesh, "Bar-2.top") == [(9, 0), (9, 2)]
    assert ends(mesh, "ends") == [(2, 0), (2, 1), (9, 0), (10, 0)]
    assert ends(mesh, "right") == [(2, 0), (2, 1)]
    assert ends(mesh, "upper") == [(0, 1), (2, 1), (9, 0), (9, 2)]


def test_a_part_without_an_instance_is_in_its_place(tmp_path):
    mesh = read(tmp_path, PART)
    assert (list(mesh.cell_sets), list(mesh.facet_sets)) == (["all"], ["top", "left"])
    both = read(
        tmp_path, PART + PART.replace("name=Bar", "name=Rod").replace("1, 0., 0.", "1, 0.5, 0.")
    )
    assert list(both.cell_sets) == ["Bar.all", "Rod.all"]


def test_a_blank_number_of_an_instance_is_zero(tmp_path):
    text = PART + ASSEMBLY.replace("10., 0., 0.\n", ", 10., 0.\n")
    mesh = read(
        tmp_path, text.replace("10., 0., 0., 10., 0., 1., 90.", ", 10., , 0., 10., 1., 90.")
    )
    assert ends(mesh, "Bar-2.left") == [(-1, 10), (0, 10)]


def test_a_generated_set_has_the_nodes_below_it_too(tmp_path):
    rest = "3, 2., 1.\n4, 0., 1.\n"
    between = "*Nset, nset=whole, generate\n1, 4\n*Node\n"
    mesh = read(tmp_path, PART.replace(rest, between + rest))
    assert ends(mesh, "whole") == [(0, 0), (0, 1), (2, 0), (2, 1)]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("part=BAR", "part=Rod", "there is no .PART 'Rod' above its instance 'Bar-2'"),
        ("name=Bar-2", "name=bar-1", "the .INSTANCE 'bar-1' is there twice"),
        ("instance=bar-2", "instance=bar-3", "there is no .INSTANCE 'bar-3' above a set of it"),
        ("left,\n", "right,\n", "there is no .NSET 'right'"),
        (
            "10., 0., 0., 10., 0., 1., 90.",
            "10., 0., 0., 10., 0., 0., 90.",
            "between two points that are one",
        ),
        ("10., 0., 0., 10., 0., 1., 90.", "10., 0., 0., 11., 0., 0., 90.", "not plane: z differs"),
        ("10., 0., 0., 10., 0., 1., 90.", "90.", "one of 7 to turn it"),
        (
            "nset=ends, instance=bar-2",
            "nset=Bar-1.left, instance=bar-2",
            "'Bar-1.left' is there twice",
        ),
        ("_right_S2, S2", ", S2", "the surface 'right' has a row that names no elements"),
        ("1, 5., 5., 0.", "-1, 5., 5., 0.", "'-1' is no number of a node"),
    ],
)
def test_what_contradicts_itself_is_refused(tmp_path, old, new, said):
    text = PART + ASSEMBLY
    assert old in text
    with pytest.raises(ValueError, match=said):
        read(tmp_path, text.replace(old, new))


def test_a_generated_set_has_all_of_its_rows(tmp_path):
    rows = "*Nset, nset=ends, generate\n1, 1\n4, 4\n2, 3, 1\n"
    mesh = read(tmp_path, PART.replace("*Solid", rows + "*Solid"))
    assert ends(mesh, "ends") == [(0, 0), (0, 1), (2, 0), (2, 1)]
    backward = rows.replace("2, 3, 1", "3, 2, 1")
    with pytest.raises(ValueError, match="NSET is to generate 3 to 2, backward"):
        read(tmp_path, PART.replace("*Solid", backward + "*Solid"))


def test_a_node_set_of_an_element_set_has_its_nodes(tmp_path):
    text = PART.replace("*Solid", "*Nset, nset=whole, elset=all\n*Solid")
    assert ends(read(tmp_path, text), "whole") == [(0, 0), (0, 1), (2, 0), (2, 1)]


@pytest.mark.parametrize(("rows", "warned"), [("3, 4", False), ("4", True), ("2, 3, 4", True)])
def test_a_node_set_beside_a_surface_of_its_name_is_told(tmp_path, rows, warned):
    mesh = read(tmp_path, PART.replace("*Solid", f"*Nset, nset=top\n{rows}\n*Solid"))
    assert ends(mesh, "top") == [(0, 1), (2, 1)]
    assert any("'top' is a surface and a node set" in note for note in mesh.notes) == warned
