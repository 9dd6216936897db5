"""The input deck, read back by a small parser of keyword blocks: what another solver is told of the joint."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from archord.benchmarks.case import paper_joint
from archord.benchmarks.peers.calculix import areas
from archord.cli import run
from archord.geometry.joint_mesh import Cells, Facets
from archord.postprocess.deck import contact_stiffness, deck, deck_mesh
from archord.scene.file import resolved

W, DR, STEPS = 4.0, 0.005, 3
COARSE = {"element_size": 0.2, "block_size": W, "growth": 0.5}
KINDS = ["quadratic", "linear"]


def scene(yield_stress=0.002, **sections):
    return paper_joint(0.2, STEPS, yield_stress, **({"joint": COARSE} | sections))


def read(text):
    """The deck's ``blocks`` (keyword, parameters, rows), ``nodes`` ``{label: (x, y)}``, ``elements`` ``{label: nodes}``
    and their ``bodies``, node ``sets`` and ``surfaces``."""
    found = SimpleNamespace(text=text, blocks=[], nodes={}, elements={}, bodies={}, sets={}, surfaces={})
    for line in text.splitlines():
        words = [word.strip() for word in line.split(",")]
        if line.startswith("*"):
            parameters = dict(word.split("=") for word in words[1:] if "=" in word)
            found.blocks.append((words[0], parameters, []))
        else:
            found.blocks[-1][2].append(words)
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


@pytest.fixture(scope="module", params=KINDS)
def written(request):
    """The deck with one kind of elements, read back, the kind, and the mesh that it was written from."""
    found = read(deck(scene(), deck_mesh(scene(), request.param)))
    found.quadratic, found.mesh = request.param == "quadratic", deck_mesh(scene(), request.param)
    return found


def test_counts(written):
    """Two separate discs by Euler's formula: vertices - edges + faces = 1 each, and every node in some element. Every
    condition of docs/theory.md has its edges, and no line more than CalculiX reads."""
    elements = written.elements.values()
    assert {n for e in elements for n in e} == set(written.nodes)
    assert {len(e) for e in elements} == {6 if written.quadratic else 3}
    corners = {n for e in elements for n in e[:3]}
    edges = {frozenset((e[i], e[(i + 1) % 3])) for e in elements for i in range(3)}
    assert len(corners) - len(edges) + len(elements) == 2
    assert len(written.nodes) == len(corners) + (len(edges) if written.quadratic else 0)
    assert set(written.bodies.values()) == {"PIN", "BLOCK"}
    assert set(written.mesh.edges) == set(Facets)
    assert all(len(edges) for edges in written.mesh.edges.values())
    for line in written.text.splitlines()[2:]:
        assert len(line.split(",")) <= 16
        assert line.startswith("*") or all(len(word.strip()) <= 20 for word in line.split(","))


def test_elements_turn_counterclockwise_and_fill_the_bodies(written):
    """Positive corners' area each; with parabolic edges the bodies' exact areas to O(h^4). Node 4 is between 1 and 2, 5
    between 2 and 3, 6 between 3 and 1: nearer to the middle than the arc's height."""
    for element in written.elements.values():
        (x0, y0), (x1, y1), (x2, y2) = (written.nodes[n] for n in element[:3])
        assert (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0) > 0
        x = np.array([written.nodes[n] for n in element])
        following = np.roll(x[:3], -1, axis=0)
        apart = np.linalg.norm((x[:3] + following) / 2 - x[3:], axis=1) if written.quadratic else 0
        assert np.all(apart < 0.05 * np.linalg.norm(following - x[:3], axis=1))
    exact = {Cells.PIN: math.pi / 4, Cells.BLOCK: W**2 - math.pi / 4 * (1 + DR) ** 2}
    for body, area in exact.items():
        own = areas(written.mesh)[written.mesh.bodies == body].sum()
        assert own == pytest.approx(area, rel=1e-4 if written.quadratic else 5e-3)


def test_linear_elements_are_quarters_of_the_quadratic_ones():
    quadratic, linear = (deck_mesh(scene(), kind) for kind in KINDS)
    np.testing.assert_array_equal(quadratic.x, linear.x)
    assert len(linear.elements) == 4 * len(quadratic.elements)


def test_surfaces_cover_the_arcs(written):
    """Sides chain from the axis to the top without gap, over exactly the arc's nodes, on elements of their body."""
    nodes = written.nodes
    for name, body, radius in (("PIN_ARC", "PIN", 1.0), ("HOLE_ARC", "BLOCK", 1 + DR)):
        sides, listed = [], set()
        for label, side in written.surfaces[f"{name}_SURFACE"]:
            assert written.bodies[label] == body
            element = written.elements[label]
            ends = element[side - 1], element[side % 3]
            sides.append(ends)
            listed |= {*ends, *([element[side + 2]] if written.quadratic else [])}
        assert listed == written.sets[name]
        chords = sum(math.dist(nodes[a], nodes[b]) for a, b in sides)
        assert chords == pytest.approx(2 * len(sides) * radius * math.sin(math.pi / 4 / len(sides)), rel=1e-7)
        ends = [n for side in sides for n in side]
        assert sorted(nodes[n][0] for n in set(ends) if ends.count(n) == 1) == pytest.approx([0, radius], abs=1e-14)


def test_sets_lie_where_their_names_say(written):
    """Supports and loaded edge, on both bodies where both are cut; arcs on their circles, to the digits that the format
    holds: the clearance is a small difference of large numbers."""
    nodes, sets = written.nodes, written.sets
    x = {name: np.array([nodes[n] for n in labels]) for name, labels in sets.items()}
    for name, height in (("PIN_TOP", -DR), ("BLOCK_HELD", 0.0)):
        np.testing.assert_allclose(x[name][:, 1], height, rtol=0, atol=1e-14)
    for name, radius, centre in (("PIN_ARC", 1.0, -DR), ("HOLE_ARC", 1 + DR, 0.0)):
        np.testing.assert_allclose(np.linalg.norm(x[name] - [0, centre], axis=1), radius, rtol=0, atol=2e-14)
    assert sets["SYMMETRY"] & sets["PIN_NODES"]
    assert sets["SYMMETRY"] - sets["PIN_NODES"]
    assert sets["SYMMETRY"] == {n for n in nodes if abs(nodes[n][0]) < 1e-12}
    assert max(place[0] for place in nodes.values()) == pytest.approx(W)


def test_steps_push_the_pin_down_in_equal_parts(written):
    """One step each, the last at delta; reactions of pin and block in all of them."""
    first = next(i for i, block in enumerate(written.blocks) if block[0] == "*STEP")
    assert written.blocks[first - 1][2] == [["SYMMETRY", "1", "1"], ["BLOCK_HELD", "1", "2"]]
    loads = [rows for keyword, _, rows in written.blocks[first:] if keyword == "*BOUNDARY"]
    assert [row[0][:3] for row in loads] == [["PIN_TOP", "2", "2"]] * STEPS
    assert [float(row[0][3]) for row in loads] == pytest.approx([-2 * DR * k / STEPS for k in (1, 2, 3)])
    printed = [parameters["NSET"] for keyword, parameters, _ in written.blocks if keyword == "*NODE PRINT"]
    assert printed == ["PIN_TOP", "BLOCK_HELD"] * STEPS


@pytest.mark.parametrize(("plane", "family"), [("strain", "CPE"), ("stress", "CPS")])
def test_materials_and_elements_of_the_plane(plane, family):
    """Each body its own constants; a hardening curve with the slope H; an elastic body has no *PLASTIC."""
    data = scene(None, block={"yield_stress": 0.003, "hardening": 0.1}, analysis={"plane": plane})
    found = read(deck(data, deck_mesh(data, "linear"))).blocks
    assert {p["TYPE"] for keyword, p, _ in found if keyword == "*ELEMENT"} == {family + "3"}
    rows_of = {name: [rows for keyword, _, rows in found if keyword == name] for name, _, _ in found}
    sections = [float(rows[0][0]) for rows in rows_of["*SOLID SECTION"]]
    assert sections == [1.0 if plane == "strain" else pytest.approx(0.1 * data.joint.h)] * 2
    (plastic,) = rows_of["*PLASTIC"]
    (s0, a0), (s1, a1) = ((float(v) for v in row) for row in plastic)
    assert (s0, a0) == (0.003, 0)
    assert (s1 - s0) / (a1 - a0) == pytest.approx(0.1)
    elastic = [[float(v) for v in rows[0]] for rows in rows_of["*ELASTIC"]]
    assert elastic == [[data.pin.E, 0.3], [data.block.E, 0.3]]


def test_a_rigid_pin_moves_as_a_whole():
    """All its nodes held sideways and pushed down."""
    data = scene(None, pin={"rigid": True})
    found = read(deck(data, deck_mesh(data, "linear")))
    boundary = [row for keyword, _, rows in found.blocks if keyword == "*BOUNDARY" for row in rows]
    assert ["PIN_NODES", "1", "1"] in boundary
    assert boundary[-1][:3] == ["PIN_NODES", "2", "2"]
    assert found.sets["PIN_NODES"] == {
        n for e, nodes in found.elements.items() if found.bodies[e] == "PIN" for n in nodes
    }


@pytest.mark.parametrize("unit", [1000.0, 1e-3])
def test_the_deck_does_not_depend_on_the_unit_of_length(unit):
    """Nodes scale to the digits of the format, and the penetration with them."""
    lengths = {"radius": 1.0, "clearance": DR, "element_size": 0.2, "block_size": W}
    scaled = scene(joint={key: unit * value for key, value in lengths.items()} | {"growth": 0.5})
    a, b = (read(deck(s, deck_mesh(s, "quadratic"))).nodes for s in (scene(), scaled))
    np.testing.assert_allclose(np.array(list(b.values())) / unit, list(a.values()), rtol=0, atol=1e-12)
    assert contact_stiffness(scaled) * unit == pytest.approx(contact_stiffness(scene()))


def test_the_command_writes_a_deck_and_nothing_over_what_is_there(tmp_path, monkeypatch, capsys, refused):
    """Named after the scene, refused where one is, and never over an input of the command."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "joint.toml").write_text(resolved(paper_joint(0.3, pin={"rigid": True})))
    assert run(["export-deck", "joint.toml", "--elements", "linear", "--set", "load.steps=2"]) == 0
    assert capsys.readouterr() == ("joint.inp\n", "")
    assert [(tmp_path / "joint.inp").read_text().count(word) for word in ("*STEP", "TYPE=CPE3")] == [2, 2]
    before = {path: path.read_text() for path in tmp_path.iterdir()}
    for options, said in (
        ([], "joint.inp: is there already; choose another file, or overwrite it with --force.\n"),
        (["--force", "-o", "joint.toml"], "joint.toml: cannot be written: it is an input of the command.\n"),
    ):
        assert refused(["export-deck", "joint.toml", *options]) == said
    assert {path: path.read_text() for path in tmp_path.iterdir()} == before
