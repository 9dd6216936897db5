"""The input deck, read back by a small parser of keyword blocks: what another solver is told of the
joint."""

from __future__ import annotations

import math
import shutil
import subprocess
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.benchmarks.case import paper_joint
from archord.benchmarks.peers.calculix import areas, drive_forces, read_printed
from archord.cli import run
from archord.geometry.curve import RigidCircle
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.shapes.bushing import bushing
from archord.geometry.shapes.rectangles import rectangles
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.kinematic import KinematicMaterial
from archord.materials.kinematics import AXISYMMETRIC
from archord.postprocess.decks.deck import (
    deck,
    system_of,
)
from archord.postprocess.decks.mesh import deck_mesh
from archord.postprocess.decks.model import DeckModel, thickness
from archord.postprocess.decks.model_lines import contact_stiffness
from archord.scene.file import resolved
from archord.solver.path.system import System
from archord.solver.problem import (
    Body,
    DeadLoad,
    Dirichlet,
    Drive,
    Interaction,
    Load,
    Mean,
    Problem,
    Rigid,
    Support,
)

ccx = shutil.which("ccx")
W = 4.0
DR = 0.005
STEPS = 3
COARSE = {"element_size": 0.2, "block_size": W, "growth": 0.5}


def scene(yield_stress=0.002, **sections):
    return paper_joint(0.2, STEPS, yield_stress, **({"joint": COARSE} | sections))


def written_deck(data):
    """The deck of a scene, read back, and the mesh that it was written from."""
    system = system_of(data)
    mesh = deck_mesh(system)
    found = read(deck(system, mesh, data.targets))
    found.system = system
    found.mesh = mesh
    return found


def read(text):
    """The deck's ``blocks`` (keyword, parameters, rows), ``nodes`` ``{label: (x, y)}``,
    ``elements`` ``{label: nodes}`` and their ``bodies``, node ``sets`` and ``surfaces``."""
    found = SimpleNamespace(
        text=text, blocks=[], nodes={}, elements={}, bodies={}, sets={}, surfaces={}
    )
    for line in text.splitlines():
        first, *words = (word.strip() for word in line.split(","))
        if line.startswith("*"):
            found.blocks.append((first, dict(word.split("=") for word in words if "=" in word), []))
        else:
            found.blocks[-1][2].append([first, *words])
    for keyword, parameters, rows in found.blocks:
        if keyword == "*NODE":
            found.nodes |= {int(label): (float(x), float(y)) for label, x, y in rows}
        elif keyword == "*ELEMENT":
            found.elements |= {int(row[0]): [int(n) for n in row[1:]] for row in rows}
            found.bodies |= {int(row[0]): parameters["ELSET"] for row in rows}
        elif keyword == "*NSET":
            found.sets[parameters["NSET"]] = {int(n) for row in rows for n in row}
        elif keyword == "*SURFACE":
            found.surfaces[parameters["NAME"]] = [(int(e), int(side[1:])) for e, side in rows]
    return found


@pytest.fixture(scope="module")
def written():
    return written_deck(scene())


def test_counts(written):
    """Two separate discs by Euler's formula: vertices - edges + faces = 1 each, and every node in
    some element. Every condition of docs/theory.md has its edges, and no line more than CalculiX
    reads."""
    elements = written.elements.values()
    assert {n for e in elements for n in e} == set(written.nodes)
    assert {len(e) for e in elements} == {6}
    corners = {n for e in elements for n in e[:3]}
    edges = {frozenset((e[i], e[(i + 1) % 3])) for e in elements for i in range(3)}
    assert len(corners) - len(edges) + len(elements) == 2
    assert len(written.nodes) == len(corners) + len(edges)
    assert set(written.bodies.values()) == {"PIN", "BLOCK"}
    assert set(written.sets) - {"ALL_NODES"} == {"PIN", "HOLE", "SYMMETRY", "BLOCK_HELD", "PIN_TOP"}
    for line in written.text.splitlines()[2:]:
        assert len(line.split(",")) <= 16
        assert line.startswith("*") or all(len(word.strip()) <= 20 for word in line.split(","))


def test_elements_turn_counterclockwise_and_fill_the_bodies(written):
    """Positive corners' area each; with parabolic edges the bodies' exact areas to O(h^4). Node 4
    is between 1 and 2, 5 between 2 and 3, 6 between 3 and 1: nearer to the middle than the arc's
    height."""
    x = np.array([[written.nodes[n] for n in element] for element in written.elements.values()])
    sides = np.roll(x[:, :3], -1, axis=1) - x[:, :3]
    assert (np.linalg.det(sides[:, :2]) > 0).all()
    apart = np.linalg.norm(x[:, :3] + sides / 2 - x[:, 3:], axis=2)
    assert (apart < 0.05 * np.linalg.norm(sides, axis=2)).all()
    exact = {"pin": math.pi / 4, "block": W**2 - math.pi / 4 * (1 + DR) ** 2}
    for body, area in exact.items():
        own = areas(written.mesh.x[written.mesh.elements[body]]).sum()
        assert own == pytest.approx(area, rel=1e-4)


def test_surfaces_cover_the_arcs(written):
    """Sides chain from the axis to the top without gap, over exactly the arc's nodes, on elements
    of their body. Arcs lie on their circles to the digits that the format holds: the clearance is a
    small difference of large numbers."""
    nodes = written.nodes
    for name, body, radius, centre in (("PIN", "PIN", 1.0, -DR), ("HOLE", "BLOCK", 1 + DR, 0.0)):
        elements = [
            (written.elements[label], side) for label, side in written.surfaces[f"{name}_SURFACE"]
        ]
        assert {written.bodies[label] for label, _ in written.surfaces[f"{name}_SURFACE"]} == {body}
        ends = [element[k % 3] for element, side in elements for k in (side - 1, side)]
        middle = [element[side + 2] for element, side in elements]
        assert {*ends, *middle} == written.sets[name]
        n = len(elements)
        chords = sum(
            math.dist(nodes[a], nodes[b]) for a, b in zip(ends[::2], ends[1::2], strict=True)
        )
        assert chords == pytest.approx(2 * n * radius * math.sin(math.pi / 4 / n), rel=1e-7)
        assert sorted(nodes[n][0] for n in set(ends) if ends.count(n) == 1) == pytest.approx(
            [0, radius], abs=1e-14
        )
        for place in written.sets[name]:
            assert math.dist(nodes[place], (0, centre)) == pytest.approx(radius, rel=0, abs=2e-14)


def test_sets_lie_where_their_names_say(written):
    """Supports and loaded edge, on both bodies where both are cut."""
    nodes = written.nodes
    sets = written.sets
    for name, height in (("PIN_TOP", -DR), ("BLOCK_HELD", 0.0)):
        assert [nodes[n][1] for n in sets[name]] == pytest.approx(
            [height] * len(sets[name]), abs=1e-14
        )
    pin = {
        n
        for element, body in written.bodies.items()
        if body == "PIN"
        for n in written.elements[element]
    }
    assert sets["SYMMETRY"] & pin
    assert sets["SYMMETRY"] - pin
    assert sets["SYMMETRY"] == {n for n in nodes if abs(nodes[n][0]) < 1e-12}
    assert max(place[0] for place in nodes.values()) == pytest.approx(W)


def test_steps_push_the_pin_down_in_equal_parts(written):
    """One step each, the last at delta; reactions of pin and block in all of them."""
    first = next(i for i, block in enumerate(written.blocks) if block[0] == "*STEP")
    assert written.blocks[first - 1][2] == [
        [*held, "0.0"]
        for held in (["SYMMETRY", "1", "1"], ["BLOCK_HELD", "1", "1"], ["BLOCK_HELD", "2", "2"])
    ]
    loads = [rows for keyword, _, rows in written.blocks[first:] if keyword == "*BOUNDARY"]
    assert [row[0][:3] for row in loads] == [["PIN_TOP", "2", "2"]] * STEPS
    assert [float(row[0][3]) for row in loads] == pytest.approx(
        [-2 * DR * k / STEPS for k in (1, 2, 3)]
    )
    printed = [
        parameters["NSET"] for keyword, parameters, _ in written.blocks if keyword == "*NODE PRINT"
    ]
    assert printed == ["SYMMETRY", "BLOCK_HELD", "PIN_TOP"] * STEPS


@pytest.mark.parametrize(("plane", "family"), [("strain", "CPE"), ("stress", "CPS")])
def test_materials_and_elements_of_the_plane(plane, family):
    """Each body its own constants; a hardening curve with the slope H; an elastic body has no
    *PLASTIC."""
    data = scene(None, block={"yield_stress": 0.003, "hardening": 0.1}, analysis={"plane": plane})
    found = written_deck(data).blocks
    assert {p["TYPE"] for keyword, p, _ in found if keyword == "*ELEMENT"} == {family + "6"}
    materials = ("*SOLID SECTION", "*PLASTIC", "*ELASTIC")
    sections, ((first, second),), elastic = (
        [np.array(rows, float).tolist() for keyword, _, rows in found if keyword == name]
        for name in materials
    )
    assert (
        sections
        == [[[1.0 if plane == "strain" else pytest.approx(0.1 * data.joint.h, rel=0.2)]]] * 2
    )
    assert first == [0.003, 0]
    assert (second[0] - first[0]) / second[1] == pytest.approx(0.1)
    assert elastic == [[[data.pin.E, 0.3]], [[data.block.E, 0.3]]]


def test_a_table_of_hardening_is_that_of_the_deck():
    """Stress before PEEQ; a law is a table that straight lines follow to 0.1 % up to PEEQ 1."""
    data = scene(
        None,
        pin={"hardening": [[0, 0.002], [0.1, 0.003]]},
        block={"yield_stress": 0.002, "hardening": {"offset": 0.01, "exponent": 0.2}},
    )
    found = written_deck(data).blocks
    pin, block = (np.array(rows, float) for keyword, _, rows in found if keyword == "*PLASTIC")
    assert pin.tolist() == [[0.002, 0], [0.003, 0.1]]
    peeq = np.linspace(0, 1, 10000)
    assert np.interp(peeq, block[:, 1], block[:, 0]) == pytest.approx(
        data.block.law.stress(peeq), rel=1e-3
    )


def test_friction_and_large_strain_are_told():
    """With the stiffness of sticking, that of the pressure; in every step."""
    found = written_deck(scene(analysis={"friction": 0.1, "strain": "large"}))
    (rows,) = (rows for keyword, _, rows in found.blocks if keyword == "*FRICTION")
    (pressure,) = (rows for keyword, _, rows in found.blocks if keyword == "*SURFACE BEHAVIOR")
    assert rows == [["0.1", *pressure[0]]]
    assert found.text.count(", NLGEOM") == found.text.count("*STEP") == STEPS
    assert "Kirchhoff" in found.text
    plain = written_deck(scene()).text
    assert "FRICTION" not in plain
    assert "NLGEOM" not in plain


def test_a_rigid_pin_moves_as_a_whole():
    """All its nodes held sideways and pushed down."""
    data = scene(None, pin={"rigid": True})
    found = written_deck(data)
    boundary = [row for keyword, _, rows in found.blocks if keyword == "*BOUNDARY" for row in rows]
    assert ["CONTACT_DISC", "1", "1", "0.0"] in boundary
    assert boundary[-1][:3] == ["CONTACT_DISC", "2", "2"]
    ring = {
        n for e in found.elements if found.bodies[e] == "CONTACT_DISC" for n in found.elements[e]
    }
    assert found.sets["CONTACT_DISC"] == ring
    radii = [math.dist(found.nodes[n], (0, -DR)) for n in ring]
    assert sorted({round(r, 12) for r in radii}) == [0.8, 0.9, 1.0]


def press_fit(drawn):
    """The deck of a pin in a sleeve, which interferes with its housing by 0.02: drawn so, or to be
    drawn so."""
    joint = bushing(
        MPI.COMM_SELF, 10.0, [(10.05, 14.0), (13.98 if drawn else 14.0, 30.0)], 2.0, 0.5
    )
    bodies = [Body(name, Elastic(2e5, 0.3, "strain")) for name in ("pin", "sleeve 1", "housing")]
    fit = Interaction(
        "fit", ("sleeve 1 outside", "bore"), **{"overlap" if drawn else "interference": 0.02}
    )
    supports = [
        Dirichlet("held", "outer edge", 0),
        Dirichlet("held", "outer edge", 1),
        Dirichlet("axis", "axis", 1),
    ]
    drives = [Drive("press", (0.0, 0.0, 100.0), "force")]
    problem = Problem(
        joint,
        bodies,
        [Interaction("inside", ("pin", "sleeve 1 inside")), fit],
        [*supports, Dirichlet("press", "flat", 0, 1.0, "press")],
        drives=drives,
        fit=True,
        stabilise=True,
        symmetry=2.0,
    )
    system = System(problem)
    mesh = deck_mesh(system)
    return read(deck(system, mesh, [1.0, 1.5, 2.0])), mesh


def test_an_interference_is_drawn_and_what_floats_hangs_on_springs():
    """Radii of the sleeve's outer nodes; springs in two directions for bodies that no support holds
    sideways. Half the force on a node of its own, of which the nodes of the flat side are
    equals."""
    for drawn in (False, True):
        found, _ = press_fit(drawn)
        radii = {
            name: [math.hypot(*found.nodes[n]) for n in found.sets[name]]
            for name in ("SLEEVE_1_OUTSIDE", "BORE")
        }
        apart = np.mean(radii["SLEEVE_1_OUTSIDE"]) - np.mean(radii["BORE"])
        assert apart == pytest.approx(0.02, rel=1e-3)
    springs = [p["ELSET"] for keyword, p, _ in found.blocks if keyword == "*SPRING"]
    assert springs == ["PIN_SPRINGS_1", "PIN_SPRINGS_2", "SLEEVE_1_SPRINGS_1", "SLEEVE_1_SPRINGS_2"]
    (own,) = found.sets["DRIVES"] if "DRIVES" in found.sets else [max(found.nodes)]
    assert [rows for keyword, _, rows in found.blocks if keyword == "*CLOAD"] == [
        [[str(own), "1", force]] for force in ("0.0", "25.0", "50.0")
    ]
    equations = [rows for keyword, _, rows in found.blocks if keyword == "*EQUATION"]
    assert {int(rows[1][0]) for rows in equations} == found.sets["FLAT"]
    assert all(rows[1][3:] == [str(own), "1", "-1.0"] for rows in equations)


def test_nodal_forces_on_quadrilaterals():
    """Those of bodies and reference points sum to half the forces on the whole although the middles
    of nine nodes are gone, and are written where they vanish again, or they would stay."""

    def build(gmsh):
        face = gmsh.model.occ.addRectangle(0, 0, 0, 4, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name="bar")
        for line, name in ((4, "left"), (2, "right")):
            gmsh.model.addPhysicalGroup(1, [line], name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)

    wall = [Dirichlet("wall", "left", axis) for axis in (0, 1)]
    problem = Problem(
        gmsh_to_mesh(MPI.COMM_SELF, build, quads=True),
        [Body("bar", Elastic(2e5, 0.3))],
        supports=wall,
        loads=[DeadLoad("bar", (1.0, 0.0), drive="weight")],
        means=[Mean("end", "right", 1, (4.0, 0.5), "end")],
        drives=[Drive("weight", (0.0, 8.0, 0.0)), Drive("end", (0.0, 3.0, 0.0), "force")],
        symmetry=2.0,
    )
    system = System(problem)
    mesh = deck_mesh(system)
    found = read(deck(system, mesh, [1.0, 2.0]))
    assert {len(nodes) for nodes in found.elements.values()} == {8}
    assert sum(areas(mesh.x[mesh.elements["bar"]])) == pytest.approx(4)
    first, last = (
        np.array(rows, float) for keyword, _, rows in found.blocks if keyword == "*CLOAD"
    )
    assert [first[first[:, 1] == axis, 2].sum() for axis in (1, 2)] == pytest.approx([4.0, 1.5])
    assert last[:, :2].tolist() == first[:, :2].tolist()
    assert not last[:, 2].any()
    prescribed = replace(problem, drives=[problem.drives[0], Drive("end", (0.0, 3.0))])
    with pytest.raises(ValueError, match="the mean displacement of 'end' cannot be exported"):
        deck(System(prescribed), mesh, [1.0])


def tube(quads):
    """A tube of radii 5 and 10 that is 8 long; held at its lower end, pulled along the axis at its
    upper end by a force, and by a pressure-like load on it."""

    def build(gmsh):
        face = gmsh.model.occ.addRectangle(5, 0, 0, 5, 8)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name="tube")
        for line, name in ((1, "bottom"), (3, "top")):
            gmsh.model.addPhysicalGroup(1, [line], name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 2.0)

    return Problem(
        gmsh_to_mesh(MPI.COMM_SELF, build, quads=quads),
        [Body("tube", Elastic(2e5, 0.3))],
        supports=[Dirichlet("bottom", "bottom", 1), Dirichlet("top", "top", 1, 1.0, "pull")],
        drives=[Drive("pull", (0.0, 4000.0, 8000.0), "force")],
        kinematics="axisymmetric",
    )


@pytest.mark.parametrize("quads", [False, True])
def test_a_ring_has_axisymmetric_elements_and_the_force_on_all_of_it(quads, tmp_path):
    """CAX6 or CAX8 without a thickness; forces of the whole ring, as CalculiX takes them, and the
    factor that takes what it prints, of a wedge of two degrees, to the whole."""
    system = System(tube(quads))
    mesh = deck_mesh(system)
    found = read(deck(system, mesh, [1.0, 2.0], "tube"))
    kinds = {parameters["TYPE"] for keyword, parameters, _ in found.blocks if keyword == "*ELEMENT"}
    assert kinds == {"CAX8" if quads else "CAX6"}
    assert [rows for keyword, _, rows in found.blocks if keyword == "*SOLID SECTION"] == [[]]
    loads = [rows for keyword, _, rows in found.blocks if keyword == "*CLOAD"]
    assert [float(force) for ((_, axis, force),) in loads if axis == "1"] == [4000.0, 8000.0]
    assert "forces times 180.0 are of the whole" in found.text
    assert thickness(system.problem, mesh) == 1 / 180
    if ccx is None:
        pytest.skip("CalculiX is not installed (image target peers)")
    (tmp_path / "tube.inp").write_text(found.text)
    subprocess.run([ccx, "-i", "tube"], cwd=tmp_path, check=True, capture_output=True)
    printed = (tmp_path / "tube.dat").read_text().splitlines()
    area = math.pi * (10**2 - 5**2)
    moved = [
        float(line.split()[1]) for line in printed if line.split()[:1] == [str(len(mesh.x) + 1)]
    ]
    assert moved == pytest.approx([force * 8 / (2e5 * area) for force in (4000, 8000)], rel=1e-6)


@pytest.mark.parametrize("kinematics", ["plane strain", "plane stress", "axisymmetric"])
def test_tied_blocks_are_one_column(kinematics, tmp_path):
    """A column of two tied blocks without lateral contraction, on meshes that do not match, is a
    bar of two materials. `*TIE` of CalculiX leaves most nodes of plane elements loose."""
    heights = {"low": 1.0, "high": 0.5}
    moduli = {"low": 1e3, "high": 2e3}
    mesh = rectangles({"low": (1, 0, 2, 1), "high": (1, 1, 2, 0.5)}, 0.3, MPI.COMM_SELF)
    problem = Problem(
        mesh,
        [Body(name, Elastic(E, 0.0)) for name, E in moduli.items()],
        [Interaction("tie", ("high bottom", "low top"), law="tied")],
        supports=[Support("low bottom")],
        loads=[Load("pull", on="high top", direction="y", displacement=0.01)],
        steps=1,
        kinematics=kinematics,
    )
    system = System(problem)
    decks_mesh = deck_mesh(system)
    text = deck(system, decks_mesh, [1.0])
    assert "*TIE" not in text
    tied = np.unique(decks_mesh.surfaces["high bottom"].nodes)
    assert text.count("*EQUATION") == 2 * len(tied)
    if ccx is None:
        pytest.skip("CalculiX is not installed (image target peers)")
    (tmp_path / "tied.inp").write_text(text)
    subprocess.run([ccx, "-i", "tied"], cwd=tmp_path, check=True, capture_output=True)
    printed = read_printed((tmp_path / "tied.dat").read_text())
    compliance = sum(heights[name] / moduli[name] for name in heights)
    area = math.pi * (3**2 - 1**2) if kinematics == "axisymmetric" else 2.0
    forces = drive_forces(system, decks_mesh, printed)
    assert forces["pull"] == pytest.approx(area * 0.01 / compliance, rel=1e-6)


def test_a_rigid_disc_around_an_axis_is_refused():
    disc = SimpleNamespace(surfaces=(Rigid(RigidCircle((0.0, 9.0), 1.0)), "top"))
    problem = SimpleNamespace(kinematics=AXISYMMETRIC, interactions=[disc])
    with pytest.raises(ValueError, match="a rigid disc cannot be exported around an axis"):
        DeckModel(SimpleNamespace(problem=problem), None)


def test_a_rigid_ball_is_refused():
    mesh = archord.boxes({"block": (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)}, size=1.0, kind="hexahedra")
    ball = archord.RigidBall((0.5, 2.0, 0.5), 1.0)
    problem = Problem(
        mesh,
        [Body("block", Elastic(1.0, 0.3))],
        [Interaction("press", (ball, "block top"))],
        [archord.Support("block bottom")],
        [archord.Load("down", on="press", direction="y", displacement=-0.01)],
    )
    with pytest.raises(ValueError, match="a rigid ball or cylinder cannot be exported; a body"):
        deck_mesh(System(problem))


@pytest.mark.parametrize("unit", [1000.0, 1e-3])
def test_the_deck_does_not_depend_on_the_unit_of_length(unit):
    """Nodes scale to the digits of the format, and the penetration with them."""
    lengths = {"radius": 1.0, "clearance": DR, "element_size": 0.2, "block_size": W}
    scaled = scene(joint={key: unit * value for key, value in lengths.items()} | {"growth": 0.5})
    a, b = (written_deck(s) for s in (scene(), scaled))
    np.testing.assert_allclose(
        np.array(list(b.nodes.values())) / unit, list(a.nodes.values()), rtol=0, atol=1e-12
    )
    stiff, stiffer = (
        contact_stiffness(d.system.problem, d.mesh, d.system.problem.interactions[0])
        for d in (a, b)
    )
    assert stiffer * unit == pytest.approx(stiff)
    assert stiff == pytest.approx(2500)


def test_the_command_writes_a_deck_and_nothing_over_what_is_there(
    tmp_path, monkeypatch, capsys, refused
):
    """Named after the scene, refused where one is, and never over an input of the command."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "joint.toml").write_text(resolved(paper_joint(0.3, pin={"rigid": True})))
    assert run(["export-deck", "joint.toml", "--set", "load.steps=2"]) == 0
    assert capsys.readouterr() == ("joint.inp\n", "")
    text = (tmp_path / "joint.inp").read_text()
    assert (text.count("*STEP"), text.count("TYPE=CPE6"), text.count("TYPE=CPE8")) == (2, 1, 1)
    assert refused(["export-deck", "joint.toml"]).startswith(
        "joint.inp: is there already; choose another file"
    )
    cyclic = ["--set=block.yield_stress=300", "--set=block.back_stresses=[[1000, 10]]", "--force"]
    assert "the material of 'block' cannot be exported" in refused(
        ["export-deck", "joint.toml", *cyclic]
    )
    (tmp_path / "path.csv").write_text("displacement\n0.01\n")
    with_path = [f"--set=load.{key}=none" for key in ("displacement", "displacement_absolute")] + [
        "--set=load.path=path.csv"
    ]
    for name in ("joint.toml", "path.csv"):
        said = f"{name}: cannot be written: it is an input of the command.\n"
        assert refused(["export-deck", "joint.toml", *with_path, "--force", "-o", name]) == said
    assert (tmp_path / "joint.inp").read_text() == text


def test_a_problem_from_python_has_a_deck(tmp_path):
    """With elements of second order whatever the problem's degree, and a step to each output."""
    block = {"block": (0.0, 0.0, 2.0, 1.0)}
    problem = Problem(
        rectangles(block, size=0.5),
        [Body("block", Elastic(210e3, 0.3))],
        supports=[Support("block bottom")],
        loads=[Load("pull", on="block top", direction="y", displacement=0.01)],
        steps=3,
        degree=3,
    )
    path = archord.export_deck(problem, tmp_path / "block.inp")
    text = path.read_text()
    assert (text.count("*STEP"), text.count("TYPE=CPE6")) == (3, 1)
    assert "archord: block in mm" in text
    with pytest.raises(archord.InputError, match="is there already"):
        archord.export_deck(problem, path)
    hardening = LinearHardening(200.0)
    cyclic = Body(
        "block", KinematicMaterial(210e3, 0.3, hardening=hardening, back_stresses=((1e3, 5.0),))
    )
    with pytest.raises(archord.InputError, match="the material of 'block' cannot be exported"):
        archord.export_deck(replace(problem, bodies=[cyclic]), path, force=True)
    assert path.read_text() == text
    with pytest.raises(archord.InputError, match=r"^archord.export_deck: problem must be"):
        archord.export_deck(3, path, force=True)


@pytest.mark.mpi
def test_ranks_write_one_deck_of_a_whole_mesh(comm, tmp_path):
    """Rank 0 writes; a mesh on several ranks, of which a rank has a part, is refused on all."""
    box = {"block": (0.0, 0.0, 2.0, 1.0)}
    parts = {
        "bodies": [Body("block", Elastic(210e3, 0.3))],
        "supports": [Support("block bottom")],
        "loads": [Load("pull", on="block top", direction="y", displacement=0.01)],
    }
    path = comm.bcast(tmp_path) / "block.inp"
    archord.export_deck(Problem(rectangles(box, 0.25, MPI.COMM_SELF), **parts), path)
    text = path.read_text()
    assert "*STATIC" in text
    shared = Problem(rectangles(box, 0.25, comm), **parts)
    if comm.size == 1:
        archord.export_deck(shared, path, force=True)
    else:
        with pytest.raises(archord.InputError, match=f"the mesh is on {comm.size} ranks"):
            archord.export_deck(shared, path, force=True)
    assert path.read_text() == text


@pytest.mark.parametrize("held", ["low bottom", "all nodes", "drives"])
@pytest.mark.parametrize("contacts", [("lower", "upper"), ("c 1", "c-1")])
def test_names_that_a_deck_takes_for_one_are_refused(held, contacts, tmp_path):
    """A support on "all nodes" would hold every node; of two laws of one name one would count."""
    bodies = ("low", "middle", "top")
    blocks = {name: (0.0, float(k), 2.0, 1.0) for k, name in enumerate(bodies)}
    tagged = rectangles(blocks, 1.0, MPI.COMM_SELF)
    tagged.facet_sets[held] = tagged.facet_sets["low bottom"]
    steel = Elastic(210e3, 0.3)
    lower, upper = contacts
    problem = archord.Problem(
        tagged,
        bodies=[archord.Body(name, steel) for name in bodies],
        interactions=[
            archord.Interaction(lower, ("middle bottom", "low top"), friction=0.1),
            archord.Interaction(upper, ("top bottom", "middle top"), friction=0.5),
        ],
        supports=[
            archord.Support("base", on=held),
            archord.Support("middle left", fixed="x"),
            archord.Support("top left", fixed="x"),
        ],
        loads=[archord.Load("press", on="top top", direction="y", force=-1.0)],
    )
    if held == "low bottom" and lower == "lower":
        assert archord.export_deck(problem, tmp_path / "deck.inp").exists()
        return
    with pytest.raises(archord.InputError, match="must differ in more than case and signs"):
        archord.export_deck(problem, tmp_path / "deck.inp")
