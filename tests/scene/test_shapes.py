"""Presets: what general scenes they stand for, and what is refused and how it is said."""

import copy
import tomllib
from pkgutil import resolve_name

import pytest
import tomli_w
from mpi4py import MPI

from archord.presets.problem import general_problem
from archord.report.errors import InputError
from archord.scene.file import load_scene, parse_any, resolved
from archord.scene.presets.known import SHAPES
from archord.scene.problem import ProblemScene
from archord.solver.path.system import System

STEEL = {"E": 210000.0, "nu": 0.3}
LUG = {
    "lug": {"radius": 9.9, "clearance": 0.1, "width": 40.0, "length": 60.0},
    "pin": STEEL,
    "plate": STEEL,
    "load": {"displacement": 0.3, "steps": 15},
}
BUSHING = {
    "bushing": {"radius": 10.0},
    "pin": STEEL,
    "sleeve": [{"bore": 10.05, "outer": 14.0, "E": 110000.0, "nu": 0.34}],
    "housing": {"bore": 13.98, "outer": 30.0, "E": 70000.0, "nu": 0.33},
    "load": {"displacement": [0.05, 0.2], "steps": [1, 3]},
}


def test_every_shape_is_drawn():
    assert all(callable(resolve_name(shape.drawing)) for shape in SHAPES.values())


def changed(data: dict, place: str, value) -> dict:
    data = copy.deepcopy(data)
    *path, last = place.split(".")
    table = data
    for part in path:
        table = table[int(part)] if isinstance(table, list) else table[part]
    if value is None:
        table.pop(last)
    else:
        table[last] = value
    return data


OTHERS = {
    "units": {"length": "m", "stress": "Pa"},
    "analysis": {"thickness": 5.0, "accuracy": 1e-3},
}


BUSHED = LUG | {"bushing": {"thickness": 2.0, "interference": 0.01, "E": 110000.0, "nu": 0.34}}


CLEVIS = {
    "clevis": {"radius": 9.9, "clearance": 0.1, "element_size": 1.5, "growth": 0.5},
    "inner": STEEL | {"thickness": 20.0, "width": 40.0, "length": 60.0},
    "outer": {"E": 70000.0, "nu": 0.33, "thickness": 8.0, "width": 48.0, "end": "square"},
    "pin": STEEL,
    "load": {"force": [30000.0, 60000.0], "steps": 1},
}


@pytest.mark.parametrize(
    "data", [LUG, BUSHED, CLEVIS, BUSHING, LUG | OTHERS, BUSHED | OTHERS, BUSHING | OTHERS]
)
def test_a_preset_is_the_general_scene_that_it_prints(data):
    scene = parse_any(data)
    assert isinstance(scene, ProblemScene)
    assert parse_any(tomllib.loads(resolved(scene))) == scene
    assert scene.analysis.symmetry == 2
    if "units" in data:
        assert (scene.units.force_of(5.0), scene.thickness, scene.analysis.accuracy) == (
            "N",
            5.0,
            1e-3,
        )


def test_ten_lines_of_a_lug_say_all_of_it():
    scene = parse_any(LUG)
    assert scene.mesh.shape is not None
    assert scene.mesh.shape.arguments() == {
        "kind": "lug",
        **LUG["lug"],
        "edge_distance": 20.0,
        "element_size": pytest.approx(0.396),
        "growth": 0.25,
        "end": "round",
        "half": True,
        "pin": "half",
        "wall": None,
        "interference": 0.0,
        "touching": True,
    }
    assert [body.name for body in scene.body] == ["pin", "lug"]
    assert [(s.on, s.fixed) for s in scene.support] == [("clamp", ["x", "y"]), ("axis", ["y"])]
    assert (scene.load[0].on, scene.load[0].displacement, scene.path.steps) == ("flat", 0.3, 15)
    assert not scene.fits


def test_radii_of_a_bushing_make_its_fits():
    scene = parse_any(BUSHING)
    assert scene.mesh.shape is not None
    assert scene.mesh.shape.rings == [[10.05, 14.0], [13.98, 30.0]]
    assert [i.surfaces for i in scene.interaction] == [
        ["pin", "sleeve 1 inside"],
        ["sleeve 1 outside", "bore"],
    ]
    assert [i.overlap for i in scene.interaction] == pytest.approx([0.0, 0.02])
    assert scene.fits
    assert scene.targets == pytest.approx([1, 2, 7 / 3, 8 / 3, 3])


@pytest.mark.parametrize(
    ("data", "place", "value", "said"),
    [
        (LUG, "lug.radius", -1.0, "lug.radius = -1.0 must be at least 1e-30."),
        (LUG, "lug.widht", 40.0, "did you mean width?"),
        (LUG, "lug.width", None, "lug.width is missing."),
        (
            LUG,
            "lug.width",
            20.1,
            "lug.width = 20.1 must leave a ligament of at least 0.02 R beside the hole.",
        ),
        (
            LUG,
            "lug.edge_distance",
            10.1,
            "must leave a ligament of at least 0.02 R before the hole.",
        ),
        (
            LUG,
            "lug.length",
            10.0,
            "must leave a ligament of at least 0.02 R behind the hole and the end's arc.",
        ),
        (LUG, "lug.length", 1e5, "lug.length = 100000.0 must not exceed 1000 R."),
        (
            LUG,
            "lug.clearance",
            5.0,
            "lug.clearance = 5.0 must be between -0.03 and 0.5 times the radius.",
        ),
        (
            LUG,
            "lug.clearance",
            -0.1,
            "lug.clearance = -0.1 needs pin.whole = true, as half a pin cannot be pressed in.",
        ),
        (
            LUG,
            "lug.element_size",
            8.0,
            "lug.element_size = 8.0 must be between 1e-3 and 0.5 times the radius.",
        ),
        (LUG, "lug.end", "pointed", "lug.end = \"pointed\" must be 'round' or 'square'."),
        (LUG, "load.displacement", None, "load.displacement is missing (or force)."),
        (LUG, "load.force", 1.0, "load.displacement = 0.3 must not be given together with force."),
        (LUG, "load.at", "centre", 'load.at = "centre" must be "diameter" for a displacement.'),
        (
            LUG,
            "load.steps",
            [1, 2],
            "path.steps = [1, 2] must have one number for each of the 1 stages.",
        ),
        (LUG, "plate", None, "plate is missing."),
        (BUSHED, "bushing.thickness", None, "bushing.thickness is missing."),
        (BUSHED, "bushing.thickness", 0.1, "bushing.thickness = 0.1 must be at least 0.02 R."),
        (
            BUSHED,
            "bushing.thickness",
            9.9,
            "lug.width = 40.0 must leave a ligament of at least 0.02 R beside the hole.",
        ),
        (BUSHED, "bushing.interference", 0.5, "must not exceed 0.03 of its outer radius."),
        (BUSHED, "bushing.interference", -0.1, "bushing.interference = -0.1 must be at least 0."),
        (
            BUSHED,
            "bushing.bonded",
            True,
            "bushing.interference = 0.01 is not for a bonded bushing.",
        ),
        (BUSHED, "bushing.radius", 9.9, "bushing.radius = 9.9 is not a known key"),
        (
            BUSHED,
            "lug.clearance",
            -0.1,
            "needs pin.whole = true, as half a pin cannot be pressed in.",
        ),
        (LUG, "block", STEEL, "block is not a known key"),
        (LUG, "path", {"steps": 5}, "is not a known key; did you mean load.steps? Sections are"),
        (LUG, "pin", {"rigid": True, "whole": True}, "pin.whole = true is not for a rigid pin."),
        (
            LUG,
            "lug.pin",
            "whole",
            "is not a known key; did you mean pin.whole? Keys are radius, element_size, growth, cl",
        ),
        (LUG, "lug.kind", "lug", 'lug.kind = "lug" is not a known key; keys are '),
        (CLEVIS, "outer.thickness", None, "outer.thickness is missing."),
        (
            CLEVIS,
            "outer.width",
            20.1,
            "outer.width = 20.1 must leave a ligament of at least 0.02 R beside the hole.",
        ),
        (
            CLEVIS,
            "clevis.clearance",
            6.0,
            "clevis.clearance = 6.0 must be between -0.03 and 0.5 times the radius.",
        ),
        (
            CLEVIS,
            "clevis.clearance",
            -0.1,
            "needs pin.whole = true, as half a pin cannot be pressed in.",
        ),
        (
            CLEVIS,
            "load",
            {"displacement": 0.1},
            "load.displacement = 0.1 is not for a clevis: its plates share a force",
        ),
        (
            CLEVIS,
            "analysis",
            {"thickness": 5.0},
            "analysis.thickness = 5.0 is not for a clevis, whose plates have a",
        ),
        (CLEVIS, "pin", {"rigid": True}, "pin.rigid = true must be false in a clevis."),
        (CLEVIS, "plate", STEEL, "plate is not a known key"),
        (BUSHING, "bushing.pin", "whole", "did you mean pin.whole?"),
        (
            BUSHING,
            "bushing.rings",
            [[1.0, 2.0]],
            "did you mean [[sleeve]] and [housing]? Keys are radius, element_size, ",
        ),
        (BUSHING, "sleeve.0.bore", None, "sleeve 1.bore is missing."),
        (BUSHING, "sleeve.0.outer", 10.1, "must have a wall of at least 0.02 R."),
        (
            BUSHING,
            "sleeve.0.bore",
            9.9,
            "needs pin.whole = true, as half a pin cannot be pressed in.",
        ),
        (
            BUSHING,
            "housing.bore",
            13.0,
            "housing must not overlap what is inside by more than 0.03 of its radius",
        ),
        (BUSHING, "housing.bore", 22.0, "nor be wider by more than 0.5."),
        (BUSHING, "housing.outer", 1e5, "housing must not exceed 1000 R."),
        (BUSHING, "housing.E", None, "housing.E is missing."),
    ],
)
def test_faults_are_said_in_one_sentence(data, place, value, said):
    with pytest.raises(InputError) as error:
        parse_any(changed(data, place, value))
    assert said in str(error.value)
    assert str(error.value).startswith("scene: ")
    assert len(str(error.value).splitlines()) == 1


def test_sleeves_are_set_by_number(tmp_path):
    path = tmp_path / "bushing.toml"
    path.write_text(tomli_w.dumps(BUSHING))
    assert load_scene(path, ["sleeve.1.E=2.0", "sleeve.1.outer=14.01"]).body[1].E == 2.0
    for override, said in (
        ("sleeve.2.E=1", "'sleeve.2.E=1': must read .* like 'sleeve.1.E=1', with a name among 1.$"),
        ("sleeve.1.E=-1", "sleeve.1.E=-1: sleeve 1.E must be greater than 0.$"),
    ):
        with pytest.raises(InputError, match=f"^--set {said}"):
            load_scene(path, [override])


@pytest.mark.parametrize(
    "overrides",
    [["load.force=2e3", "load.displacement=none"], ["load.displacement=none", "load.force=2e3"]],
)
def test_a_load_is_replaced_in_any_order(tmp_path, overrides):
    path = tmp_path / "lug.toml"
    path.write_text(tomli_w.dumps(LUG))
    assert load_scene(path, overrides).load[0].force == 2000.0


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("scale", 1000.0),
        ("order", 2),
        ("refine", 1),
        ("circle", [{"facets": "hole", "centre": [0.0, 0.0], "radius": 10.0}]),
    ],
)
def test_what_is_said_of_files_is_refused_of_shapes(key, value):
    data = tomllib.loads(resolved(parse_any(LUG)))
    with pytest.raises(
        InputError, match=rf"^scene: mesh\.{key} = [^\n]* is for a mesh file: mesh\.shape[^\n]*$"
    ):
        parse_any(changed(data, f"mesh.{key}", value))


@pytest.mark.parametrize(
    ("width", "edge"), [(24.2, 20.0), (120.0, 60.0), (40.0, 12.0), (40.0, 60.0)]
)
def test_lugs_from_slender_to_stout_are_allowed(width, edge):
    """W/D from 1.2 to 6, e/D from 0.6 to 3."""
    parse_any(changed(changed(LUG, "lug.width", width), "lug.edge_distance", edge))


def test_walls_may_be_thin():
    """Two walls of 0.02 R to round-off, the second with its bore in the first one's outside."""
    sleeves = [STEEL | {"bore": 10.24, "outer": 10.44}, STEEL | {"bore": 10.43, "outer": 10.63}]
    scene = parse_any(
        changed(BUSHING, "sleeve", sleeves) | {"housing": STEEL | {"bore": 10.63, "outer": 30.0}}
    )
    assert [i.overlap for i in scene.interaction] == pytest.approx([0.0, 0.01, 0.0])


def test_bodies_touch_at_first_under_a_force():
    """Or where the scene says so; else they are concentric."""
    shapes = [
        parse_any(data).mesh.shape
        for data in (
            BUSHING,
            changed(BUSHING, "bushing.touching", True),
            BUSHING | {"load": {"force": 1.0}},
        )
    ]
    assert [shape.touching for shape in shapes] == [False, True, True]


def pulled(data: dict, **sections) -> System:
    """The solved coarse problem of a preset with other sections."""
    shape = "lug" if "lug" in data else "bushing"
    coarse = data | {shape: data[shape] | {"element_size": 1.5, "growth": 0.5}} | sections
    scene = parse_any(coarse | {"load": {"displacement": 0.2, "steps": 2}})
    system = System(general_problem(scene, MPI.COMM_SELF))
    system.solve(scene.targets)
    return system


@pytest.mark.parametrize(
    "pin", [STEEL, STEEL | {"whole": True}, {"rigid": True}], ids=["half", "whole", "rigid"]
)
def test_the_whole_lug_carries_what_twice_its_half_does(pin):
    """Whatever pin pulls at it."""
    half = pulled(LUG, pin=pin)
    whole = pulled(changed(LUG, "lug.half", False), pin=pin)
    assert half.drive_force("pull") > 0
    assert whole.drive_force("pull") == pytest.approx(half.drive_force("pull"), rel=1e-3)
    assert whole.drive_force("pull") == pytest.approx(-whole.reaction("clamp")[0], rel=1e-6)


def test_a_loaded_pin_without_clearance():
    """NAFEMS R0094, benchmark 4, in two dimensions: a force of 20 kN/mm at the centre of a steel
    pin in a softer sheet. Displacement at the hole's edge on the load axis 0.760, pressure there
    189 MPa (1 %); it takes 9983 of 10000 N."""
    lug = {"radius": 50.0, "clearance": 0.0, "width": 200.0, "length": 200.0, "element_size": 4.0}
    load = {"force": 20000.0, "at": "centre", "steps": 1}
    scene = parse_any(
        {
            "lug": lug,
            "pin": STEEL | {"whole": True},
            "plate": {"E": 70000.0, "nu": 0.3},
            "load": load,
        }
    )
    system = System(general_problem(scene, MPI.COMM_SELF))
    system.solve(scene.targets)
    assert system.reaction("clamp")[0] == pytest.approx(-20000.0, rel=1e-6)
    nodes = system.problem.mesh.dofs_in(system.V, "hole")
    x = system.V.tabulate_dof_coordinates()[nodes, 0]
    assert system.equilibrium.displacement()[nodes[x.argmax()], 0] == pytest.approx(0.760, rel=5e-3)
    side = system.sides["hole"]
    pressure = system.contact.pair_of(side).pressure
    first = side.point[..., 0].mean(axis=1).argmax()
    assert (side.weight * pressure)[first].sum() / side.weight[first].sum() == pytest.approx(
        189.0, rel=0.02
    )


@pytest.mark.parametrize(
    "pin", [STEEL, STEEL | {"whole": True}, {"rigid": True}], ids=["half", "whole", "rigid"]
)
def test_a_pin_pulls_at_its_bushing(pin):
    """After the fit, with forces in balance at pin and housing but for the weak springs that hold
    loose bodies."""
    system = pulled(BUSHING, pin=pin)
    assert system.drive_force("pull") > 1e4
    assert system.drive_force("pull") == pytest.approx(-system.reaction("outer edge")[0], rel=1e-6)


def test_a_bushing_of_a_lug_makes_a_fit_in_the_plate():
    """The pin lies in it with the clearance; it is drawn into the plate by its interference."""
    scene = parse_any(BUSHED)
    assert scene.mesh.shape.hole == pytest.approx(10.0 + 2.0 - 0.01)
    assert [body.name for body in scene.body] == ["pin", "bushing", "lug"]
    assert [i.surfaces for i in scene.interaction] == [
        ["pin", "bushing inside"],
        ["bushing outside", "hole"],
    ]
    assert [i.overlap for i in scene.interaction] == pytest.approx([0.0, 0.01])
    rubbed = parse_any(BUSHED | {"analysis": {"friction": 0.1}}).interaction
    assert [i.friction for i in rubbed] == [0.1, 0.1]
    glued = changed(changed(BUSHED, "bushing.interference", None), "bushing.bonded", True)
    found = parse_any(glued | {"analysis": {"friction": 0.1}}).interaction
    assert [(i.law, i.friction) for i in found] == [("frictionless", 0.1), ("tied", 0.0)]
    shapes = [parse_any(data).mesh.shape for data in (BUSHED, BUSHED | {"load": {"force": 1.0}})]
    assert [shape.touching for shape in shapes] == [False, True]


@pytest.mark.parametrize(
    "pin", [STEEL, STEEL | {"whole": True}, {"rigid": True}], ids=["half", "whole", "rigid"]
)
def test_a_pin_pulls_at_a_lug_through_its_bushing(pin):
    """With the force at the clamp, and the whole lug carries what twice its half does."""
    half = pulled(BUSHED, pin=pin)
    whole = pulled(changed(BUSHED, "lug.half", False), pin=pin)
    assert half.drive_force("pull") > 100
    assert half.drive_force("pull") == pytest.approx(-half.reaction("clamp")[0], rel=1e-6)
    assert whole.drive_force("pull") == pytest.approx(half.drive_force("pull"), rel=2e-3)
    assert whole.drive_force("pull") == pytest.approx(-whole.reaction("clamp")[0], rel=1e-6)


def test_a_bonded_bushing_of_the_same_metal_is_a_plain_lug():
    """Whose hole is the bushing's bore."""
    bushing = STEEL | {"thickness": 2.0, "bonded": True, "touching": True}
    bonded = pulled(LUG | {"bushing": bushing}, analysis={"plane": "stress"})
    plain = pulled(LUG, analysis={"plane": "stress"})
    assert bonded.drive_force("pull") == pytest.approx(plain.drive_force("pull"), rel=5e-3)


def test_the_fit_of_a_bushing_in_a_wide_lug_is_that_of_lame():
    """Before the pin touches, in a plate of 60 radii in plane stress: the pressure of a ring in an
    infinite plate."""
    E = 110000.0
    nu = 0.34
    plate = 70000.0
    a = 10.0
    wall = 2.0
    fit = 0.01
    lug = {
        "radius": 9.9,
        "clearance": 0.1,
        "width": 600.0,
        "length": 600.0,
        "element_size": 0.8,
        "growth": 0.3,
    }
    bushing = {"thickness": wall, "interference": fit, "E": E, "nu": nu}
    data = {"lug": lug, "bushing": bushing, "pin": STEEL, "plate": {"E": plate, "nu": 0.33}}
    scene = parse_any(
        data | {"load": {"displacement": 0.01, "steps": 1}, "analysis": {"plane": "stress"}}
    )
    system = System(general_problem(scene, MPI.COMM_SELF))
    system.solve(scene.targets)
    b = a + wall
    lame = fit / (b / plate * 1.33 + b / E * ((b**2 + a**2) / (b**2 - a**2) - nu))
    side = system.sides["hole"]
    pressure = system.contact.pair_of(side).pressure
    assert (side.weight * pressure).sum() / side.weight.sum() == pytest.approx(lame, rel=5e-3)
    assert system.drive_force("pull") == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("pin", [STEEL, STEEL | {"whole": True}], ids=["half", "whole"])
def test_each_plate_of_a_clevis_is_a_lug_of_its_own(pin):
    """The inner one under P, an outer one under P/2, each with its thickness; forces balance at
    their clamps."""
    analysis = {"plane": "stress"}
    scene = parse_any(CLEVIS | {"pin": pin, "analysis": analysis})
    assert [load.force for load in scene.load] == [[1500.0, 3000.0], [1875.0, 3750.0]]
    both = System(general_problem(scene, MPI.COMM_SELF))
    both.solve(scene.targets)
    moved = dict(zip(both.drive_names, both.driven()[0], strict=True))
    for name, share in (("inner", 1.0), ("outer", 0.5)):
        plate = dict(CLEVIS[name])
        thickness = plate.pop("thickness")
        metal = {key: plate.pop(key) for key in ("E", "nu")}
        load = {"force": [share * force for force in CLEVIS["load"]["force"]], "steps": 1}
        data = {"lug": CLEVIS["clevis"] | plate, "plate": metal, "pin": pin, "load": load}
        alone = parse_any(data | {"analysis": analysis | {"thickness": thickness}})
        system = System(general_problem(alone, MPI.COMM_SELF))
        system.solve(alone.targets)
        assert moved[f"{name} pull"] == pytest.approx(system.driven()[0][0], rel=2e-3)
        pull = share * 60000.0 / thickness
        assert both.reaction(f"{name} clamp")[0] == pytest.approx(-pull, rel=1e-6)
