"""Solid elements of Abaqus and CalculiX: the nodes and the faces of each, as their manuals number
them, and a bar in tension."""

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord import Body, Elastic, Load, Problem, Support, System
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.formats.read import read_mesh
from archord.geometry.meshes.quality import measures

# corners, and the corners between which the further nodes lie, both counted from 1
BRICK = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
BRICK_EDGES = ["12", "23", "34", "41", "56", "67", "78", "85", "15", "26", "37", "48"]
BRICK_FACES = ["1234", "5876", "1562", "2673", "3784", "4851"]
TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
TET_EDGES = ["12", "23", "31", "14", "24", "34"]
TET_FACES = ["123", "142", "243", "341"]
# six tetrahedra in a brick, by its corners
KUHN = ["1237", "1267", "1567", "1437", "1487", "1587"]
TYPES = pytest.mark.parametrize(
    "name", ["C3D4", "C3D10", "C3D10M", "C3D8", "C3D8I", "C3D8R", "C3D20", "C3D20R"]
)
E, NU = 210e3, 0.3


def corners_of(name):
    """Corners, edges and faces of an element, and whether it has nodes on its edges."""
    tetrahedron = name in ("C3D4", "C3D10", "C3D10M")
    parts = (TET, TET_EDGES, TET_FACES) if tetrahedron else (BRICK, BRICK_EDGES, BRICK_FACES)
    return (*parts, name in ("C3D10", "C3D10M", "C3D20", "C3D20R"))


def deck(name, cells=((2, 1, 1),), shifts=((0, 0, 0),)):
    """Bricks, or six tetrahedra each, of this type; every part is a box of so many bricks."""
    corners, edges, _, quadratic = corners_of(name)
    number = {}
    rows = []
    for count, shift in zip(cells, shifts, strict=True):
        for place in np.ndindex(*count):
            brick = np.array(BRICK) + place
            for chosen in [range(8)] if len(corners) == 8 else KUHN:
                x = brick[[int(c) - 1 if isinstance(c, str) else c for c in chosen]]
                middles = [x[[int(k) - 1 for k in edge]].mean(axis=0) for edge in edges]
                nodes = [*x, *middles] if quadratic else x
                row = []
                for node in nodes:
                    key = (shift, *node.tolist())
                    row.append(number.setdefault(key, len(number) + 1))
                rows.append(row)
    lines = ["*NODE"]
    lines += [f"{n}, {x + s[0]}, {y + s[1]}, {z + s[2]}" for (s, x, y, z), n in number.items()]
    lines.append(f"*ELEMENT, TYPE={name}, ELSET=bar")
    for n, row in enumerate(rows, 1):
        numbers = [str(value) for value in (n, *row)]
        lines += [", ".join(numbers[:16]) + ("," if numbers[16:] else "")]
        lines += [", ".join(numbers[16:])] if numbers[16:] else []
    for axis, at, side in ((0, 0, "left"), (0, 2, "right"), (1, 0, "bottom"), (2, 0, "back")):
        held = [n for (_, *x), n in number.items() if x[axis] == at]
        lines += [f"*NSET, NSET={side}", ", ".join(map(str, held)) + ","]
    return "\n".join(lines) + "\n", rows, number


@TYPES
def test_faces_are_numbered_as_in_the_manual(tmp_path, name):
    corners, edges, faces, quadratic = corners_of(name)
    x = np.array(corners, dtype=float)
    if quadratic:
        x = np.concatenate([x, [x[[int(k) - 1 for k in edge]].mean(axis=0) for edge in edges]])
    lines = ["*NODE", *(f"{n}, {a}, {b}, {c}" for n, (a, b, c) in enumerate(x, 1))]
    row = ", ".join(map(str, range(1, len(x) + 1)))
    cut = row.find("16")
    row = row if cut < 0 else row[:cut] + "\n" + row[cut:]
    lines += [f"*ELEMENT, TYPE={name}, ELSET=one", f"7, {row}"]
    for k in range(1, len(faces) + 1):
        lines += [f"*SURFACE, NAME=face {k}", f"one, S{k}"]
    path = tmp_path / "one.inp"
    path.write_text("\n".join(lines))
    mesh = gathered(read_mesh(path, MPI.COMM_SELF))
    assert measures(mesh).sum() == pytest.approx(1 if len(corners) == 8 else 1 / 6)
    for k, face in enumerate(faces, 1):
        expected = {corners[int(n) - 1] for n in face}
        [found] = mesh.facets_of(f"face {k}")
        assert {tuple(mesh.x[n]) for n in found[: len(face)]} == expected
    path.write_text("\n".join(lines) + "\n*SURFACE, NAME=wrong\none, S7\n")
    with pytest.raises(ValueError, match=f"face 'S7', which is none of S1 to S{len(faces)}"):
        read_mesh(path, MPI.COMM_SELF)


@TYPES
def test_a_bar_in_tension(tmp_path, name):
    """Its nodes' sets are faces; force and displacements are exact."""
    path = tmp_path / "bar.inp"
    path.write_text(deck(name)[0])
    problem = Problem(
        path,
        bodies=[Body("bar", Elastic(E, NU))],
        supports=[
            Support("left", fixed="x"),
            Support("bottom", fixed="y"),
            Support("back", fixed="z"),
        ],
        loads=[Load("pull", on="right", direction="x", displacement=0.02)],
        steps=1,
    )
    system = System(problem)
    assert system.problem.kinematics.name == "space"
    assert set(system.problem.mesh.facet_sets) == {"left", "right", "bottom", "back"}
    system.solve([1.0])
    assert system.drive_force("pull") == pytest.approx(E * 0.01, rel=1e-11)
    u = system.equilibrium.displacement()
    x = system.V.tabulate_dof_coordinates()
    np.testing.assert_allclose(u, x * [0.01, -NU * 0.01, -NU * 0.01], rtol=0, atol=1e-12)


def test_instances_are_placed_in_space(tmp_path):
    """A part twice, the second time moved and turned about an axis along x; a surface of both."""
    nodes, _, elements = deck("C3D8")[0].partition("*ELEMENT")
    part = f"*Part, name=Bar\n{nodes}*Element{elements}*End Part\n"
    text = f"""{part}*Assembly, name=A
*Instance, name=one, part=Bar
*End Instance
*Instance, name=two, part=Bar
0., 0., 5.
0., 0., 5., 1., 0., 5., 90.
*End Instance
*Surface, type=ELEMENT, name=ends
one.bar, S4
two.bar, S4
*End Assembly
"""
    path = tmp_path / "both.inp"
    path.write_text(text)
    mesh = gathered(read_mesh(path, MPI.COMM_SELF))
    assert list(mesh.cell_sets) == ["one.bar", "two.bar"]
    assert measures(mesh).sum() == pytest.approx(4)
    second = mesh.x[np.unique(mesh.cells[mesh.bodies == mesh.cell_sets["two.bar"][0]])]
    np.testing.assert_allclose(second.min(axis=0), [0, -1, 5], atol=1e-12)
    np.testing.assert_allclose(second.max(axis=0), [2, 0, 6], atol=1e-12)
    left = mesh.x[np.unique(mesh.facets_of("two.left"))]
    np.testing.assert_allclose(left[:, 0], 0, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("TYPE=C3D8", "TYPE=C3D6", "the mesh has prisms, which are not read: cut them into"),
        ("*NSET, NSET=left", "*ELEMENT, TYPE=C3D4\n9, 1, 2, 3, 4\n*NSET, NSET=left", "4 and 8"),
        ("TYPE=C3D8", "TYPE=C3D27", "solid elements of type C3D27 are not read, only CPS"),
        ("TYPE=C3D8", "TYPE=S8", "shell elements of type S8 are not read"),
    ],
)
def test_other_elements_are_refused(tmp_path, old, new, said):
    text = deck("C3D8")[0]
    assert old in text
    path = tmp_path / "bar.inp"
    path.write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=said):
        archord.Mesh(path).on(MPI.COMM_SELF)
