"""Solids of CAD: volumes, areas, names of solids and faces, element sizes, a bar in tension."""

import json
import re
from itertools import count

import gmsh
import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord import Body, Elastic, Load, Mesh, Problem, Support, System
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.quality import measures
from archord.presets.problem import scene_mesh
from tests.geometry.meshes.test_read import content, module  # noqa: F401

RADIUS = 0.8
HOLE = 2 * np.pi * RADIUS
E, NU = 210e3, 0.3


@pytest.fixture
def plate(module, tmp_path):  # noqa: F811
    """A STEP file of a plate 4 by 3 by 1 with a hole, and of a pin beside it."""
    occ = gmsh.model.occ
    box = occ.addBox(0, 0, 0, 4, 3, 1)
    occ.cut([(3, box)], [(3, occ.addCylinder(2, 1.5, 0, 0, 0, 1, RADIUS))])
    occ.addCylinder(2, 6, 0, 0, 0, 1, RADIUS)
    occ.synchronize()
    gmsh.write(str(tmp_path / "plate.step"))
    gmsh.write(str(tmp_path / "plate.brep"))
    return tmp_path / "plate.step"


def named(path, **names):
    """The file with names of its faces, by the kinds of their surfaces, and labels of solids."""
    text = path.read_text()
    number = count(1)
    text = re.sub(r"ADVANCED_FACE\(''", lambda _: f"ADVANCED_FACE('{next(number)}'", text)
    for face, name in names.items():
        text = text.replace(f"ADVANCED_FACE('{face.removeprefix('f')}'", f"ADVANCED_FACE('{name}'")
    text = re.sub(r"ADVANCED_FACE\('\d+'", "ADVANCED_FACE(''", text)
    path.write_text(text)
    return path


def test_solids_and_faces_have_their_volumes_areas_and_names(plate):
    """Also the faces that the file names: both of one name are one set."""
    named(plate, f7="hole", f8="pin", f1="ends", f6="ends")
    label = re.compile(r"Open CASCADE STEP translator [\d.]+ \d+\.2")
    plate.write_text(label.sub("the pin", plate.read_text()))
    mesh = Mesh(plate, size=1.0).on(MPI.COMM_SELF)
    _, order, found = content(mesh)
    assert order == 2
    first, second = "solid 1", "the pin"
    assert list(mesh.cell_sets) == ["solid 1", "solid 2", "the pin"]
    assert found["cells", first][1] == pytest.approx(12 - np.pi * RADIUS**2, rel=1e-4)
    assert found["cells", second][1] == pytest.approx(np.pi * RADIUS**2, rel=1e-4)
    assert found["facets", "hole"][1] == pytest.approx(HOLE, rel=1e-4)
    assert found["facets", "pin"][1] == pytest.approx(HOLE, rel=1e-4)
    assert found["facets", "face 7"] == found["facets", "hole"]
    assert found["facets", "ends"][1] == pytest.approx(2 * 3)
    assert {f"face {k}" for k in range(1, 11)} < set(mesh.facet_sets)
    whole = gathered(mesh)
    r = np.linalg.norm(whole.x[whole.facets_of("hole")][..., :2] - [2, 1.5], axis=2)
    np.testing.assert_allclose(r, RADIUS, rtol=1e-9)


def test_faces_of_rational_splines_have_names(module, tmp_path):  # noqa: F811
    """A file tells a rational spline by several words in brackets, with no word before them."""
    occ = gmsh.model.occ
    pin = occ.addCylinder(0, 0, 0, 0, 0, 1, RADIUS)
    occ.dilate([(3, pin)], 0, 0, 0, 1, 1, 2)  # which makes splines
    occ.synchronize()
    path = tmp_path / "spline.step"
    gmsh.write(str(path))
    assert "BOUNDED_SURFACE()" in path.read_text()
    named(path, f1="round", f2="top")
    found = content(Mesh(path, size=1.0).on(MPI.COMM_SELF))[2]
    assert found["facets", "round"][1] == pytest.approx(2 * HOLE, rel=1e-3)
    assert found["facets", "top"][1] == pytest.approx(np.pi * RADIUS**2, rel=1e-3)


@pytest.mark.parametrize(("length", "scale"), [("m", 0.001), ("in", 1 / 25.4)])
def test_a_step_file_is_scaled_to_the_unit_of_the_scene(length, scale):
    """It is read in mm, so that another unit without a scale is wrong for certain."""
    body = {"name": "bar", "E": 210e9, "nu": 0.3}
    keys = {
        "units": {"length": length, "stress": "Pa"},
        "body": [body],
        "load": [{"name": "pull", "on": "face 1", "direction": "x", "force": 1.0}],
    }
    said = f'mesh.scale.* is far from {scale:.10g}, .* the unit of length "{length}"'
    for wrong in (1.0, 1000.0):
        with pytest.raises(archord.InputError, match=said):
            archord.ProblemScene(mesh={"file": "bar.step", "scale": wrong}, **keys)
    stated = [Body("bar", Elastic(210e9, NU))]
    with pytest.raises(archord.InputError, match=f'scale = 1.0 is far .*"{length}"'):
        Problem("bar.STP", stated, units=(length, "Pa"))
    for file, factor in (
        ("bar.step", scale),
        ("bar.step", 2 * scale),
        ("bar.brep", 1.0),
        ("bar.msh", 1.0),
    ):
        archord.ProblemScene(mesh={"file": file, "scale": factor}, **keys)
        Problem(Mesh(file, scale=factor), stated, units=(length, "Pa"))


def test_brep_files_and_capital_suffixes(plate):
    brep = Mesh(plate.with_suffix(".brep"), size=1.0).on(MPI.COMM_SELF)
    assert list(brep.cell_sets) == ["solid 1", "solid 2"]
    assert content(brep)[2]["facets", "face 7"][1] == pytest.approx(HOLE, rel=1e-4)
    other = plate.rename(plate.with_suffix(".STP"))
    assert measures(gathered(Mesh(other).on(MPI.COMM_SELF))).sum() == pytest.approx(12, rel=1e-3)


def test_sizes_of_elements(plate):
    """On a face smaller than elsewhere; first order and refined on demand."""
    coarse = gathered(Mesh(plate, size=2.0, order=1).on(MPI.COMM_SELF))
    fine = gathered(Mesh(plate, size=2.0, order=1, sizes={"face 7": 0.1}).on(MPI.COMM_SELF))
    assert coarse.order == 1

    def lengths(mesh, name):
        ends = mesh.x[mesh.facets_of(name)]
        return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    assert np.median(lengths(fine, "face 7")) == pytest.approx(0.1, rel=0.2)
    assert np.median(lengths(coarse, "face 7")) > 0.15
    assert np.median(lengths(fine, "face 8")) > 0.15
    with pytest.raises(ValueError, match=r"mesh\.sizes: there is no face 'bore' for a size"):
        Mesh(plate, sizes={"bore": 0.1}).on(MPI.COMM_SELF)


def test_sets_are_made_of_others(plate):
    mesh = Mesh(plate, size=1.0, sets={"sides": ["face 1", "face 2"]}).on(MPI.COMM_SELF)
    found = content(mesh)[2]
    areas = [found["facets", name][1] for name in ("face 1", "face 2", "sides")]
    assert areas[2] == pytest.approx(areas[0] + areas[1])
    for others, said in ((["face 99"], "there is no facet set 'face 99'"), ([], "the facet set")):
        found = rf"plate\.step: mesh\.sets\.sides = {re.escape(json.dumps(others))}: {said}"
        with pytest.raises(ValueError, match=found):
            Mesh(plate, sets={"sides": others}).on(MPI.COMM_SELF)


def test_damaged_files_and_files_without_solids_are_refused(plate, tmp_path):
    damaged = tmp_path / "damaged.step"
    damaged.write_text(plate.read_text()[:500])
    with pytest.raises(ValueError, match=r"damaged.step: "):
        Mesh(damaged).on(MPI.COMM_SELF)
    gmsh.clear()
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.write(str(tmp_path / "face.step"))
    with pytest.raises(ValueError, match="has no solid, only faces or curves"):
        Mesh(tmp_path / "face.step").on(MPI.COMM_SELF)


def bar(tmp_path, suffix):
    """A bar of 3 by 1 by 2 in a file of this kind, or as what Python has."""
    box = {"bar": (0, 0, 0, 3, 1, 2)}
    if suffix == "boxes":
        return archord.boxes(box, 1.0, comm=MPI.COMM_SELF)
    gmsh.model.occ.addBox(0, 0, 0, 3, 1, 2)
    gmsh.model.occ.synchronize()
    path = tmp_path / f"bar{suffix}"
    if suffix in (".step", ".brep"):
        gmsh.write(str(path))
        return Mesh(path, size=1.0)
    gmsh.model.addPhysicalGroup(3, [1], name="solid 1")
    for face in range(1, 7):
        gmsh.model.addPhysicalGroup(2, [face], name=f"face {face}")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 1.0)
    if suffix == "live":
        return Mesh(gmsh)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    gmsh.write(str(path))
    return Mesh(path)


@pytest.mark.parametrize("suffix", [".step", ".brep", ".msh", "live", "boxes"])
def test_a_bar_in_tension(module, tmp_path, suffix):  # noqa: F811
    mesh = bar(tmp_path, suffix)
    made = mesh if suffix == "boxes" else mesh.on(MPI.COMM_SELF)
    solid = next(iter(made.cell_sets))
    left, right, bottom, _, back, _ = made.facet_sets
    system = System(
        Problem(
            mesh,
            bodies=[Body("bar", Elastic(E, NU), cells=solid)],
            supports=[
                Support(left, fixed="x"),
                Support(bottom, fixed="y"),
                Support(back, fixed="z"),
            ],
            loads=[Load("pull", on=right, direction="x", displacement=0.03)],
            steps=1,
        )
    )
    system.solve([1.0])
    assert system.drive_force("pull") == pytest.approx(E * 0.01 * 2, rel=1e-11)
    u = system.equilibrium.displacement()
    x = system.V.tabulate_dof_coordinates()
    np.testing.assert_allclose(u, x * [0.01, -NU * 0.01, -NU * 0.01], rtol=0, atol=1e-12)


def test_a_scene_of_a_file_of_cad(module, tmp_path):  # noqa: F811
    """Its sizes and sets are keys of [mesh]."""
    bar(tmp_path, ".step")
    (tmp_path / "bar.toml").write_text("""
[mesh]
file = "bar.step"
size = 1.0
sizes = {"face 1" = 0.5}
sets = {left = ["face 1"], right = ["face 2"]}

[[body]]
name = "bar"
cells = "solid 1"
E = 210e3
nu = 0.3

[[support]]
name = "left"
on = "left"
fixed = ["x", "y", "z"]

[[load]]
name = "pull"
on = "right"
direction = "x"
displacement = 0.03
""")
    scene = archord.load_scene(tmp_path / "bar.toml")
    mesh = scene_mesh(scene, MPI.COMM_SELF)
    assert content(mesh)[2]["cells", "solid 1"][1] == pytest.approx(6)
    assert content(mesh)[2]["facets", "left"][1] == pytest.approx(2)
    with pytest.raises(archord.InputError, match=r"mesh.size must be greater than 0"):
        archord.load_scene(tmp_path / "bar.toml", {"mesh.size": -1.0})
