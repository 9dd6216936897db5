"""Presets in space: the general scenes that they stand for, what is refused, and their forces."""

import tomllib

import pytest
from mpi4py import MPI

from archord.presets.problem import general_problem
from archord.report.errors import InputError
from archord.scene.file import parse_any, resolved
from archord.solver.path.system import System
from tests.scene.test_shapes import BUSHED, BUSHING, CLEVIS, LUG, STEEL, changed

SPACE = {"space": {"thickness": 8.0, "pin_length": 12.0, "chamfer": 0.4}}
JOINT = {
    "joint": {"radius": 10.0, "clearance": 0.05, "block_size": 30.0},
    "pin": STEEL,
    "block": STEEL,
    "load": {"displacement": 2.0, "steps": 2},
}


@pytest.mark.parametrize(
    "data", [LUG, BUSHED, BUSHING, JOINT], ids=["lug", "bushed", "bushing", "joint"]
)
def test_a_preset_in_space_is_the_general_scene_that_it_prints(data):
    """Beside the plane's supports the mid-plane is held, and half of its depth is modelled."""
    plane = parse_any(data) if data is not JOINT else parse_any(parse_any(data).general())
    scene = parse_any(data | SPACE)
    assert parse_any(tomllib.loads(resolved(scene))) == scene
    assert scene.analysis.plane == "space"
    assert scene.analysis.symmetry == 2 * plane.analysis.symmetry
    held = [(s.on, s.fixed) for s in plane.support]
    assert [(s.on, s.fixed) for s in scene.support] == [*held, ("mid-plane", ["z"])]
    assert scene.units.force_of(scene.analysis.depth) == "N"


RIGID = {"pin": {"rigid": True}}


@pytest.mark.parametrize("data", [LUG, BUSHING, JOINT], ids=["lug", "bushing", "joint"])
def test_a_rigid_pin_in_space_is_a_cylinder_along_z(data):
    """On the disc of the plane; a length of its own is refused."""
    rigid = data | RIGID
    plane = parse_any(rigid) if data is not JOINT else parse_any(parse_any(rigid).general())
    scene = parse_any(rigid | {"space": {"thickness": 8.0}})
    disc = plane.interaction[0].rigid
    cylinder = scene.interaction[0].rigid
    assert cylinder.centre == [*disc.centre, 0.0]
    assert cylinder.radius == disc.radius
    assert cylinder.axis == [0.0, 0.0, 1.0]
    said = "^scene: space.pin_length = 12.0 is not for a rigid pin, which is infinitely long.$"
    with pytest.raises(InputError, match=said):
        parse_any(rigid | SPACE)


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("space.thickness", 0.1, "space.thickness = 0.1 must be at least 0.02 R."),
        ("space.fillet", 0.1, "space.fillet = 0.1 is instead of a chamfer."),
        ("space.chamfer", 3.0, "space.chamfer = 3.0 must be at most 1.98: 0.2 R, and 0.45 of"),
        ("space.depth", 3.0, "space.depth = 3.0 is not a known key"),
        ("load", {"force": 1e3, "at": "centre"}, 'load.at = "centre" must be "diameter" in space'),
        ("analysis", {"thickness": 3.0}, "analysis.thickness = 3.0 is for planes; give space.th"),
        ("analysis", {"plane": "stress"}, 'analysis.plane = "stress" is not for a joint in space'),
    ],
)
def test_faults_are_said_in_one_sentence(place, value, said):
    with pytest.raises(InputError) as error:
        parse_any(changed(LUG | SPACE, place, value))
    assert said in str(error.value)
    assert len(str(error.value).splitlines()) == 1


CLEVIS_IN_SPACE = changed(CLEVIS, "clevis.element_size", 4.5) | {
    "space": {"gap": 0.5, "overhang": 1.0, "rim_ratio": 1.0},
    "load": {"force": 20000.0, "steps": 1},
}


def test_a_clevis_in_space_is_one_pin_through_all_plates():
    """Its outer plates are pulled away from the inner one; bushings are bonded to their plates."""
    bushing = STEEL | {"thickness": 2.0}
    scene = parse_any(CLEVIS_IN_SPACE | {"bushing": bushing})
    assert parse_any(tomllib.loads(resolved(scene))) == scene
    assert [body.name for body in scene.body] == [
        "pin",
        *("inner", "inner bushing"),
        *("outer", "outer bushing"),
    ]
    assert [part.surfaces for part in scene.interaction] == [
        ["inner bushing outside", "inner hole"],
        ["inner pin", "inner bushing inside"],
        ["outer bushing outside", "outer hole"],
        ["outer pin", "outer bushing inside"],
    ]
    assert [part.law for part in scene.interaction] == ["tied", "frictionless"] * 2
    held = {support.on: "".join(support.fixed) for support in scene.support}
    assert held == {"inner clamp": "xy", "outer clamp": "yz", "axis": "y", "mid-plane": "z"}
    assert scene.analysis.symmetry == 4


@pytest.mark.parametrize(
    ("data", "place", "value", "said"),
    [
        (CLEVIS_IN_SPACE, "space.bore", 9.5, "space.bore = 9.5 must be at most 0.9 R."),
        (CLEVIS_IN_SPACE, "space.gap", -1.0, "space.gap = -1.0 must be at least 0."),
        (CLEVIS_IN_SPACE, "space.chamfer", 2.5, "space.chamfer = 2.5 must be at most 1.98"),
        (CLEVIS_IN_SPACE, "clevis.clearance", -0.1, "clevis.clearance = -0.1 "),
        (CLEVIS, "bushing", STEEL | {"thickness": 2.0}, "is for a clevis in space: give space."),
    ],
)
def test_faults_of_a_clevis_are_said_in_one_sentence(data, place, value, said):
    with pytest.raises(InputError) as error:
        parse_any(changed(data, place, value))
    assert said in str(error.value)
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize("bore", [0.0, 5.0], ids=["solid", "hollow"])
def test_plates_of_a_clevis_carry_one_force(bore):
    """It goes from the outer plates through the pin to the inner one."""
    scene = parse_any(changed(CLEVIS_IN_SPACE, "space.bore", bore))
    system = System(general_problem(scene, MPI.COMM_SELF))
    system.solve(scene.targets)
    assert system.reaction("inner clamp")[0] == pytest.approx(-20000.0, rel=1e-5)
    assert system.contact_force("pin in inner")[0] == pytest.approx(20000.0, rel=1e-5)
    assert system.contact_force("pin in outer")[0] == pytest.approx(-20000.0, rel=1e-5)


def pulled(data, **depths) -> System:
    """The solved coarse problem of a preset, in space where it has ``depths``."""
    shape = next(name for name in ("lug", "bushing") if name in data)
    coarse = data | {shape: data[shape] | {"element_size": 2.5, "growth": 0.5}}
    coarse |= {"load": {"displacement": 0.2, "steps": 1}}
    scene = parse_any(coarse | ({"space": {"rim_ratio": 1.0} | depths} if depths else {}))
    system = System(general_problem(scene, MPI.COMM_SELF))
    system.solve(scene.targets)
    return system


def test_the_whole_lug_carries_what_twice_its_half_does():
    pin = {"pin": STEEL | {"whole": True}}
    half = pulled(LUG | pin, thickness=8.0)
    whole = pulled(changed(LUG, "lug.half", False) | pin, thickness=8.0)
    assert whole.drive_force("pull") == pytest.approx(half.drive_force("pull"), rel=2e-3)
    assert whole.drive_force("pull") == pytest.approx(-whole.reaction("clamp")[0], rel=1e-6)


def test_a_very_stiff_pin_is_a_rigid_pin():
    """A pin as long as the lug, 1e6 times stiffer."""
    rigid = pulled(LUG | RIGID, thickness=8.0)
    stiff = pulled(LUG | {"pin": {"E": 2.1e11, "nu": 0.3}}, thickness=8.0)
    assert rigid.drive_force("pull") == pytest.approx(stiff.drive_force("pull"), rel=1e-3)
    assert rigid.drive_force("pull") == pytest.approx(-rigid.reaction("clamp")[0], rel=1e-6)


def test_a_thin_lug_is_in_plane_stress():
    """As its thickness vanishes."""
    thin = pulled(LUG, thickness=0.4)
    plane = pulled(LUG | {"analysis": {"plane": "stress"}})
    assert thin.drive_force("pull") == pytest.approx(0.4 * plane.drive_force("pull"), rel=5e-3)


def test_a_pin_pulls_at_its_bushing():
    """After the fit, with forces in balance."""
    system = pulled(BUSHING, thickness=8.0, pin_length=12.0)
    assert system.drive_force("pull") > 1e4
    assert system.drive_force("pull") == pytest.approx(-system.reaction("outer edge")[0], rel=1e-6)
