"""Joints in space whose whole thickness is modelled: beside their halves, and under loads that are
not alike on both sides."""

from __future__ import annotations

import pytest
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gathered
from archord.output.run import solve_scene
from archord.presets.account import account_of
from archord.presets.problem import scene_mesh
from archord.scene.file import parse_any
from archord.scene.sections.keys import plain

STEEL = {"E": 210000.0, "nu": 0.3}
LUG = {
    "lug": {
        "radius": 10.0,
        "clearance": 0.1,
        "width": 40.0,
        "length": 40.0,
        "element_size": 5.0,
        "growth": 0.8,
    },
    "space": {"thickness": 12.0, "pin_length": 16.0, "rim_ratio": 1.0},
    "plate": STEEL,
    "pin": STEEL,
    "load": {"displacement": 0.2, "steps": 1},
    "output": {"fields": False},
}
JOINT = {
    "joint": {
        "radius": 10.0,
        "clearance": 0.05,
        "block_size": 25.0,
        "relative_element_size": 0.3,
        "growth": 0.5,
    },
    "space": {"thickness": 8.0, "rim_ratio": 1.0, "chamfer": 0.5},
    "pin": STEEL,
    "block": STEEL,
    "load": {"displacement": 2.0, "steps": 1},
    "output": {"fields": False},
}
RIGID = LUG | {"pin": {"rigid": True}, "space": {"thickness": 12.0, "rim_ratio": 1.0}}
YIELDING = LUG | {"plate": STEEL | {"yield_stress": 400.0}}
SLEEVE = STEEL | {"thickness": 2.0, "bonded": True}
# drawn in touch, where nodes of both bodies are at one place
LOOSE = LUG | {"bushing": STEEL | {"thickness": 2.0}, "load": {"force": 2e4, "steps": 1}}
PLATE = STEEL | {"width": 32.0, "length": 22.0}
CLEVIS = {
    "clevis": {"radius": 10.0, "clearance": 0.02, "element_size": 5.0, "growth": 0.9},
    "space": {"gap": 1.0, "rim_ratio": 1.0},
    "inner": PLATE | {"thickness": 10.0},
    "outer": PLATE | {"thickness": 6.0},
    "pin": STEEL,
    "load": {"displacement": 0.1, "steps": 1},
    "output": {"fields": False},
}


def whole(data):
    """The preset whose whole thickness is modelled."""
    return data | {"space": data["space"] | {"half": False}}


def last_of(data, folder):
    """The values of the last step of a scene."""
    folder.mkdir()
    return solve_scene(parse_any(data), folder, MPI.COMM_SELF).steps[-1].values


TOLD = {
    "joint": (JOINT, ("P", "p0", "rim pressure", "eps", "block y", "contact contact area")),
    "lug": (
        LUG,
        (
            "pull force",
            "pin in lug at z",
            "pin in lug mid pressure",
            "pin in lug rim pressure",
            "clamp y",
        ),
    ),
    "rigid pin": (RIGID, ("pull force", "pin in lug mid pressure", "pin in lug rim pressure")),
    "loose sleeve": (LOOSE, ("pull displacement", "pin in bushing mid pressure", "clamp y")),
    "yielding lug": (YIELDING, ("pull force", "lug peeq_max", "lug at x", "lug at y", "lug at z")),
    "clevis": (
        CLEVIS,
        (
            "pull force",
            *("pin in inner rim pressure", "pin in outer rim pressure", "pin in outer eps"),
            *("pin bending moment", "pin deflection", "pin deflection by hand"),
            *("pin in inner at z", "pin in outer at z"),
        ),
    ),
}


@pytest.mark.parametrize("preset", TOLD)
def test_the_whole_is_as_its_half(preset, tmp_path):
    """All numbers, as their meshes mirror each other; and nothing pulls at what holds it along z.
    Weak springs hold the pin of a clevis and a loose sleeve before they touch."""
    data, names = TOLD[preset]
    half = last_of(data, tmp_path / "half")
    both = last_of(whole(data), tmp_path / "whole")
    tolerance = 1e-5 if preset in ("clevis", "loose sleeve") else 1e-7
    for name in names:
        assert both[name] == pytest.approx(half[name], rel=tolerance)
    held = [name for name in both if name.endswith(" middle z")]
    assert len(held) == {"rigid pin": 1, "loose sleeve": 3}.get(preset, 2)
    largest = max(abs(value) for name, value in half.items() if name.endswith("force x"))
    for name in held:
        assert abs(both[name]) < 1e-9 * largest


@pytest.mark.parametrize("data", [JOINT, LUG, CLEVIS, RIGID, LUG | {"bushing": SLEEVE}])
def test_a_whole_is_the_general_scene_that_it_prints(data):
    """Half as many images make it up, and no mid-plane is held."""
    half = parse_any(data)
    both = parse_any(whole(data))
    half = parse_any(half.general()) if data is JOINT else half
    both = parse_any(both.general()) if data is JOINT else both
    assert parse_any(plain(both)) == both
    assert 2 * both.analysis.symmetry == half.analysis.symmetry
    assert "mid-plane" in {support.on for support in half.support}
    assert "mid-plane" not in {support.on for support in both.support}


@pytest.mark.parametrize("bonded", [True, False])
def test_a_sleeve_that_is_not_bonded_is_held_along_z(bonded):
    scene = parse_any(whole(LUG | {"bushing": STEEL | {"thickness": 2.0, "bonded": bonded}}))
    middles = [support.on for support in scene.support if support.fixed == ["z"]]
    sleeve = [] if bonded else ["bushing inside middle"]
    assert middles == ["flat middle", "clamp middle", *sleeve]


@pytest.mark.mpi
def test_the_mesh_of_a_whole_is_a_half_and_its_image(comm):
    """Its sets have both sides, each of which is a set, too, and so are their nodes between."""
    meshes = []
    for data in (LUG, whole(LUG)):
        meshes.append(gathered(scene_mesh(parse_any(data), comm)))
    if comm.rank:
        return
    half, both = meshes
    assert len(both.cells) == 2 * len(half.cells)
    assert len(both.facets) == 2 * (len(half.facets) - len(half.facets_of("mid-plane")))
    for name in ("hole", "faces", "flat"):
        n = len(half.facets_of(name))
        z = both.x[both.facets_of(f"{name} below")][..., 2]
        assert z.shape == half.facets_of(name).shape
        assert z.max() <= 0.0
        assert len(both.facets_of(name)) == 2 * n
    assert not both.x[both.point_sets["clamp middle"]][:, 2].any()
    assert "faces middle" not in both.point_sets


def turned(angle: float):
    """A whole lug whose pin is pulled, and turned about y by an ``angle``; it keeps its partners,
    as moments of points that slide do not balance at small strain."""
    made = plain(parse_any(whole(LUG)))
    flat = {"name": "grip", "facets": "flat", "point": [0.1, 0.0, 0.0], "kind": "rigid"}
    turn = {"name": "turn", "on": "grip", "direction": "rotation y", "displacement": angle}
    pull = {"name": "pull", "on": "grip", "direction": "x", "displacement": 0.1}
    held = {"name": "guide", "on": "grip", "fixed": ["y", "z", "rotation x", "rotation z"]}
    kept = [support for support in made["support"] if support["name"] != "flat middle"]
    changes = {"coupling": [flat], "load": [pull, turn], "support": [*kept, held]}
    changes["analysis"] = made["analysis"] | {"kinematics": "reference"}
    return account_of(parse_any(made | changes), MPI.COMM_SELF)


def test_a_whole_may_be_tilted():
    """Moments balance about y; and the pin that is turned the other way is the mirror image."""
    found = []
    for angle in (0.004, -0.004):
        account = turned(angle)
        system = account.system
        system.solve(account.scene.targets)
        moments = [
            system.reaction_moments(support.name, [0.0] * 3)[1] for support in account.scene.support
        ]
        found.append((system.drive_force("pull"), system.drive_force("turn"), sum(moments)))
    (pull, turn, reactions), (mirrored_pull, mirrored_turn, _) = found
    assert turn > 1e4
    assert reactions == pytest.approx(-turn, rel=1e-6)
    assert mirrored_pull == pytest.approx(pull, rel=1e-6)
    assert mirrored_turn == pytest.approx(-turn, rel=1e-6)


def test_a_load_on_one_side_has_its_image_on_the_other(tmp_path):
    """The larger pressure of both rims is told."""
    found = {}
    for side in ("above", "below"):
        made = plain(parse_any(whole(LUG)))
        pull = {"name": "pull", "on": f"flat {side}", "direction": "x", "displacement": 0.1}
        found[side] = last_of(made | {"load": [pull]}, tmp_path / side)
    above, below = found.values()
    for name, sign in {
        "pull force": 1,
        "clamp x": 1,
        "clamp moment y": -1,
        "pin in lug moment y": -1,
        "pin in lug rim pressure": 1,
        "pin in lug mid pressure": 1,
    }.items():
        assert below[name] == pytest.approx(sign * above[name], rel=1e-6)
    assert abs(above["clamp moment y"]) > 1e4
