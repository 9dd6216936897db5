"""A deck that archord wrote, read as a mesh: the scene on it gives the same forces."""

import re
import tomllib

import pytest
from mpi4py import MPI

from archord.output.run import solve_scene
from archord.postprocess.decks.deck import deck, system_of
from archord.postprocess.decks.mesh import deck_mesh, label
from archord.scene.file import parse_any, resolved

STEEL = {"E": 210000.0, "nu": 0.3}
SIZES = {"element_size": 1.5, "growth": 0.6}
LUG = {
    "lug": {"radius": 10.0, "clearance": 0.1, "width": 40.0, "edge_distance": 20.0, "length": 60.0}
    | SIZES,
    "pin": {"rigid": False} | STEEL,
    "plate": STEEL,
}


def joint():
    data = {
        "joint": {
            "radius": 10.0,
            "clearance": 0.05,
            "relative_element_size": 0.15,
            "block_size": 60.0,
        },
        "pin": STEEL,
        "block": STEEL,
        "load": {"displacement": 0.04, "steps": 2},
    }
    return parse_any(parse_any(data).general())


def lug():
    shape = {
        "kind": "lug",
        "radius": 9.9,
        "clearance": 0.1,
        "width": 40.0,
        "edge_distance": 20.0,
        "length": 60.0,
    }
    data = {
        "mesh": {"shape": shape | SIZES},
        "body": [{"name": "pin"} | STEEL, {"name": "lug"} | STEEL],
        "interaction": [{"name": "contact", "surfaces": ["pin", "hole"]}],
        "support": [
            {"name": "clamp", "on": "clamp", "fixed": ["x", "y"]},
            {"name": "symmetry", "on": "axis", "fixed": ["y"]},
        ],
        "load": [{"name": "press", "on": "flat", "direction": "x", "displacement": 0.15}],
        "path": {"steps": 2},
        "analysis": {"symmetry": 2},
    }
    return parse_any(data)


def bushing():
    """Its sleeve hangs on springs in the deck."""
    shape = {
        "kind": "bushing",
        "radius": 10.0,
        "rings": [[10.05, 14.0], [14.02, 30.0]],
        "pin": "half",
        "touching": False,
    }
    pairs = [["pin", "sleeve 1 inside"], ["sleeve 1 outside", "bore"]]
    data = {
        "mesh": {"shape": shape | SIZES},
        "body": [{"name": name} | STEEL for name in ("pin", "sleeve 1", "housing")],
        "interaction": [{"name": " in ".join(pair), "surfaces": pair} for pair in pairs],
        "support": [
            {"name": "edge", "on": "outer edge", "fixed": ["x", "y"]},
            {"name": "symmetry", "on": "axis", "fixed": ["y"]},
        ],
        "load": [{"name": "press", "on": "flat", "direction": "x", "displacement": 0.2}],
        "path": {"steps": 2},
        "analysis": {"symmetry": 2},
    }
    return parse_any(data)


def renamed(scene, path):
    """The scene on the deck's mesh, whose sets have the names of decks."""
    data = tomllib.loads(resolved(scene))
    data["mesh"] = {"file": str(path)}
    for body in data["body"]:
        body["cells"] = label(body.get("cells", body["name"]))
    for interaction in data["interaction"]:
        interaction["surfaces"] = [f"{label(name)}_SURFACE" for name in interaction["surfaces"]]
    for part in data["support"] + data["load"]:
        part["on"] = label(part["on"])
    return parse_any(data)


@pytest.mark.parametrize("made", [lug, joint, bushing])
def test_the_forces_are_the_same(made, tmp_path):
    """To 1e-9 of the largest: decks have coordinates of at most 20 characters."""
    scene = made()
    system = system_of(scene)
    text = deck(system, deck_mesh(system), scene.targets)
    (tmp_path / "deck.inp").write_text(text)
    assert bool(re.search("SPRING1", text)) == (made is bushing)
    found = []
    for k, one in enumerate((scene, renamed(scene, tmp_path / "deck.inp"))):
        (tmp_path / str(k)).mkdir()
        outcome = solve_scene(one, tmp_path / str(k), MPI.COMM_SELF)
        assert outcome.status == "done"
        found.append([m.values["press force"] for m in outcome.steps])
    assert abs(found[0][-1]) > 100
    assert found[1] == pytest.approx(found[0], rel=1e-9)
