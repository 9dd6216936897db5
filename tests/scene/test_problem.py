"""General scenes: what they may hold, what is refused and how it is said."""

import copy
import tomllib

import pytest

from archord.report.errors import InputError
from archord.scene.file import files_read, load_scene, parse_any, resolved
from archord.scene.problem import ProblemScene
from archord.scene.reference import example

LUG = """
[mesh]
file = "lug.msh"
[[mesh.circle]]
facets = "hole"
centre = [0.0, 0.0]
radius = 10.0
[[body]]
name = "pin"
E = 210000.0
nu = 0.3
[[body]]
name = "lug"
E = 210000.0
nu = 0.3
yield_stress = 300.0
[[interaction]]
name = "contact"
surfaces = ["pin", "hole"]
[[coupling]]
name = "point"
facets = "bore"
point = [0.0, 0.0]
[[support]]
name = "clamp"
on = "clamp"
fixed = ["x", "y"]
[[load]]
name = "press"
on = "flat"
direction = "x"
displacement = [0.1, 0.3]
[[load]]
name = "side"
on = "point"
direction = "y"
force = 5.0
[path]
steps = [2, 4]
"""


def lug() -> dict:
    return tomllib.loads(LUG)


def test_bodies_may_name_their_material(tmp_path):
    """As in the scene of a joint, also by --set, which drops the body's own numbers."""
    path = tmp_path / "scene.toml"
    path.write_text(LUG.replace("E = 210000.0\nnu = 0.3\n", 'material = "S355"\n'))
    pin, plate = load_scene(path, ["body.pin.material=6082-T6"]).body
    assert (pin.E, pin.yield_stress) == (70000.0, 230.42)
    assert (plate.E, plate.nu, plate.yield_stress, plate.perfectly_plastic) == (
        210000.0,
        0.3,
        300.0,
        True,
    )
    assert parse_any(tomllib.loads(resolved(load_scene(path)))).body[0].yield_stress == 355.0
    with pytest.raises(
        InputError, match=r'body "lug"\.material.* is not a known material; did you mean S275'
    ):
        load_scene(path, ["body.lug.material=S253"])


def changed(place: str, value) -> dict:
    """The data with the key at ``place``, like "load.0.force", replaced."""
    data = copy.deepcopy(lug())
    *way, last = [int(part) if part.isdigit() else part for part in place.split(".")]
    table = data
    for part in way:
        table = table[part]
    if value is None:
        del table[last]
    else:
        table[last] = value
    return data


def test_stages_follow_the_longest_list():
    scene = parse_any(lug())
    assert isinstance(scene, ProblemScene)
    assert scene.targets == [0.5, 1.0, 1.25, 1.5, 1.75, 2.0]
    assert [scene.values(load) for load in scene.load] == [(0.0, 0.1, 0.3), (0.0, 5.0, 5.0)]
    assert scene.travelled[-1] == [2.0, 0.3, 5.0]


def test_an_interference_has_a_stage_of_its_own():
    scene = parse_any(changed("interaction.0.interference", 0.02))
    assert scene.fits
    assert scene.targets == [1.0, 1.5, 2.0, 2.25, 2.5, 2.75, 3.0]
    assert scene.values(scene.load[0]) == (0.0, 0.0, 0.1, 0.3)


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("body.0.E", -1, 'body "pin".E = -1 must be greater than 0'),
        ("body.1.foo", 1, 'body "lug".foo = 1 is not a known key'),
        (
            "body.0.name",
            "lug",
            'body "lug".name = "lug" must not be the name of another body, too.',
        ),
        (
            "interaction.0.name",
            "pin",
            'interaction "pin".name = "pin" must not be the name of a body, too.',
        ),
        (
            "interaction.0.name",
            "point",
            'interaction "point".name = "point" must not be the name of a coupling, too.',
        ),
        (
            "support.0.name",
            "point",
            'support "point".name = "point" must not be the name of a coupling, too.',
        ),
        (
            "body.1.hardening",
            [[0.0, 300.0], [0.1, 200.0]],
            'body "lug".hardening = .* is no hardening law',
        ),
        ("body", 5, r"body = 5 must be a list of tables, \[\[body\]\]\."),
        ("body", None, "body is missing"),
        ("support.0.fixed", ["up"], 'support "clamp".fixed = ."up".: entry 1 must be'),
        ("analysis", {"plane": "flat"}, "analysis.plane = .* must be 'strain', 'stress', 'axi"),
        (
            "support.0.fixed",
            ["rotation"],
            'support "clamp".fixed = .* must be "x" or "y": .clamp. is no coupling',
        ),
        (
            "support.0.name",
            "press",
            'support "press".name = "press" must not be the name of a load, too.',
        ),
        (
            "load.0.force",
            1.0,
            'load "press".displacement = .* must not be given together with force',
        ),
        ("load.0.displacement", None, 'load "press".displacement is missing'),
        (
            "load.0.displacement",
            [0.1, "x"],
            'load "press".displacement = .0.1, "x".: entry 2 must be a number',
        ),
        ("load.0.displacement", {"a": 1}, 'load "press".displacement must be a number'),
        ("path.steps", [0, 1], "path.steps = .0, 1.: entry 1 must be at least 1"),
        ("load.0.direction", None, 'load "press".direction is missing'),
        ("load.1.force", "4 kN", 'load "side".force = "4 kN" must be a number.$'),
        ("load.1.force", float("nan"), 'load "side".force = NaN must be a finite number.$'),
        ("load.1.steps", 4, 'load "side".steps = 4 is not a known key; did you mean path.steps. '),
        (
            "load.1",
            {"name": "p", "on": "clamp", "pressure": 1.0},
            'load "p".on = .clamp. must not be held in x and y',
        ),
        (
            "interaction",
            [
                {"name": "a", "surfaces": ["pin", "hole"]},
                {"name": "b", "surfaces": ["bore", "pin"]},
            ],
            'interaction "b".surfaces = .* must not name .pin., which .a. has already; '
            "give its facets a second name",
        ),
        ("load.1.direction", "up", 'load "side".direction = "up" must be'),
        (
            "interaction.0.surfaces",
            ["pin"],
            'interaction "contact".surfaces = ."pin". must name two facet sets',
        ),
        (
            "interaction.0.integrated",
            "end",
            'interaction "contact".integrated = "end" must be one of the surfaces',
        ),
        (
            "interaction.0.rigid",
            {"centre": [0.0], "radius": 1.0},
            'interaction "contact".rigid.centre',
        ),
        (
            "interaction.0",
            {"name": "contact", "surfaces": ["pin"]}
            | {"rigid": {"centre": [0.0, 0.0], "radius": 1.0, "axis": [0.0, 0.0, 1.0]}},
            'interaction "contact".rigid.axis = .* is for cylinders in space',
        ),
        ("mesh.file", None, "mesh.file is missing"),
        ("mesh.circle.0.radius", -1.0, "mesh.circle.radius must be greater than 0"),
        ("path.steps", [1, 2, 3], "path.steps = .* must have one number for each of the 2 stages"),
        ("interaction.0.law", "coulomb", "interaction .*friction must be positive where law"),
        ("analysis", {"plane": "space"}, 'coupling "point".point = .* must have 3 numbers in'),
        (
            "analysis",
            {"plane": "axisymmetric", "thickness": 2.0},
            "analysis.thickness = 2.0 is for planes: axisymmetric forces are of the whole ring",
        ),
        (
            "analysis",
            {"plane": "axisymmetric", "symmetry": 4},
            "analysis.symmetry = 4 must be 1, or 2 for a half that is cut across the axis",
        ),
        (
            "mesh",
            {
                "shape": {
                    "kind": "lug",
                    "radius": 9.0,
                    "clearance": 0.1,
                    "width": 40.0,
                    "pin": "half",
                }
            },
            'analysis.plane = "axisymmetric" must be .strain. or .stress. for the shape of a '
            "preset",
        ),
        ("analysis", {"coarse_start": False}, "analysis.coarse_start = false is not a known key"),
        ("format", 3, "format = 3 is for a newer archord"),
    ],
)
def test_a_fault_is_said_in_a_sentence(place, value, said):
    data = changed(place, value)
    if place == "mesh":
        data["analysis"] = {"plane": "axisymmetric"}
    with pytest.raises(InputError, match=f"^lug.toml: {said}") as fault:
        parse_any(data, "lug.toml")
    assert len(str(fault.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("section", "key", "typed"),
    [("body", "E", "Ee"), ("load", "on", "onn"), ("mesh", "file", "fil")],
)
def test_a_misspelled_key_is_one_fault(section, key, typed):
    data = lug()
    table = data[section][0] if isinstance(data[section], list) else data[section]
    table[typed] = table.pop(key)
    with pytest.raises(
        InputError, match=rf"^scene: {section}[^\n]*{typed}[^\n]* did you mean {key}\?[^\n]*$"
    ):
        parse_any(data)


def test_what_is_loaded_twice_is_refused():
    twice = lug()
    twice["load"].append(twice["load"][1] | {"name": "again"})
    with pytest.raises(
        InputError,
        match=r'load "again".direction = "y" repeats .y. of .point., which the load .side.',
    ):
        parse_any(twice)


def test_a_scene_loads_as_it_is_resolved(tmp_path):
    path = tmp_path / "lug.toml"
    path.write_text(LUG)
    scene = load_scene(path, ["body.lug.yield_stress=250", "load.press.displacement=[0.1, 0.2]"])
    assert scene.body[1].yield_stress == 250
    assert scene.mesh.file == str(tmp_path / "lug.msh")
    assert parse_any(tomllib.loads(resolved(scene))) == scene
    with pytest.raises(
        InputError,
        match=r"must read body.NAME.key=value, like .body.pin.E=1., with a name among pin, lug",
    ):
        load_scene(path, ["body.plate.E=1"])


def test_set_replaces_alternatives_in_tables(tmp_path):
    """As in the sections of a joint."""
    path = tmp_path / "lug.toml"
    path.write_text(LUG)
    load = load_scene(path, ["load.press.force=[1, 2]"]).load[0]
    assert (load.kind, load.stages) == ("force", [1, 2])


def test_files_that_a_solve_reads_are_known(tmp_path):
    """No result may be written over them."""
    path = tmp_path / "lug.toml"
    path.write_text(LUG)
    assert files_read(path) == [path, tmp_path / "lug.msh"]


def test_the_example_is_a_scene():
    assert parse_any(tomllib.loads(example(general=True))).body[0].name == "pin"
    hidden = "\n".join(line.removeprefix("# ") for line in example(general=True).splitlines()[2:])
    assert tomllib.loads(hidden)["interaction"][0]["rigid"]["radius"] == 10.0


NAMED = {
    (
        "load",
        0,
        "x [mm]",
    ): 'load "x [mm]".name = "x [mm]" must not hold " [", which begins the unit',
    ("load", 0, " press"): "must not begin or end with a space",
    ("support", 0, "a\u2028b"): "must be text on one line",
    ("support", 0, "contact force"): (
        'interaction "contact".name = "contact" makes the column \'contact force x\' of '
        "history.csv, "
        "as the support 'contact force' does: rename one of them"
    ),
    ("load", 0, "lug at"): None,
    (
        "support",
        0,
        "point x",
    ): "is what results call a motion of the coupling 'point': rename one of them",
    (
        "load",
        0,
        "point rotation",
    ): "is what results call a motion of the coupling 'point': rename one of them",
    ("load", 0, 'a, "b"/δ'): None,
    ("load", 0, "step"): None,
}


@pytest.mark.parametrize("case", NAMED)
def test_names_that_would_lose_a_column_are_refused(case):
    section, number, name = case
    data = lug()
    data[section][number]["name"] = name
    if NAMED[case] is None:
        assert parse_any(data)
        return
    with pytest.raises(InputError) as fault:
        parse_any(data)
    assert NAMED[case] in str(fault.value)


@pytest.mark.parametrize("name", ["load", "accepted", ".", "..", "a/b", "/a"])
def test_a_surface_has_a_name_that_contact_h5_can_hold(name):
    data = lug()
    data["interaction"][0]["surfaces"] = ["pin", name]
    with pytest.raises(InputError, match="rename the set in the mesh"):
        parse_any(data)


def test_a_coupling_turns_by_a_right_angle_at_most():
    data = lug()
    data["load"].append(
        {"name": "turn", "on": "point", "direction": "rotation", "displacement": 90.0}
    )
    with pytest.raises(InputError, match=r"must be at most 6.2832, a full turn in radians"):
        parse_any(data)
    data["load"][-1]["displacement"] = 2.0
    with pytest.raises(InputError, match=r"must be at most 1.5708, a right angle in radians"):
        parse_any(data)


def test_an_override_changes_the_shape_of_a_preset(tmp_path):
    path = tmp_path / "lug.toml"
    data = tomllib.loads(LUG) | {
        "mesh": {"shape": {"kind": "lug", "radius": 9.9, "clearance": 0.1, "width": 40.0}},
    }
    path.write_text(resolved(parse_any(data)))
    assert load_scene(path, ["mesh.shape.radius=9.0"]).mesh.shape.radius == 9.0
    for override, said in {
        "mesh.shape.radius=-9.0": "--set mesh.shape.radius=-9.0: mesh.shape.radius must be",
        "mesh.shape.radus=9.0": "did you mean radius?",
        "mesh.shape.a.b=1": "must read section.key=value",
        "mesh.form.radius=1": "must read section.key=value",
    }.items():
        with pytest.raises(InputError) as fault:
            load_scene(path, [override])
        assert said in str(fault.value)


STEEL = {"E": 210000.0, "nu": 0.3}
LUG_SHAPE = {"lug": {"radius": 10.0, "clearance": 0.1, "width": 40.0}, "plate": STEEL}
SLEEVED = {
    "bushing": {"radius": 10.0},
    "sleeve": [{"bore": 10.05, "outer": 14.0} | STEEL],
    "housing": {"bore": 13.98, "outer": 30.0} | STEEL,
}
IN_SPACE = {
    "joint": {"radius": 10.0, "clearance": 0.05, "block_size": 40.0},
    "block": STEEL,
    "space": {"thickness": 10.0},
}


@pytest.mark.parametrize(
    ("sections", "load", "said"),
    [
        (LUG_SHAPE, {"force": [5e3, -5e3]}, "force = -5000 moves the pin back, where nothing"),
        (LUG_SHAPE, {"displacement": [0.1, -0.19]}, ""),
        (LUG_SHAPE, {"displacement": [0.1, -0.21]}, "= -0.21 moves the pin back by more than 0.2"),
        (SLEEVED, {"displacement": -0.04}, ""),
        (SLEEVED, {"displacement": -0.2}, "= -0.2 moves the pin back by more than 0.05"),
        (IN_SPACE, {"displacement": [2.0, -1.9]}, ""),
        (IN_SPACE, {"displacement": [2.0, -2.1]}, "moves the pin back by more than 0.1"),
    ],
)
def test_half_a_pin_that_is_moved_back_is_told(sections, load, said):
    """A force moved it by 3.6 mm for 0.26, and a displacement left P at 0, without a word."""
    scene = parse_any(sections | {"pin": STEEL, "load": load})
    if not isinstance(scene, ProblemScene):
        scene = parse_any(scene.general())
    assert [said in doubt for doubt in scene.doubts] == [True] * bool(said)
    if sections is IN_SPACE:
        return
    whole = parse_any(sections | {"pin": STEEL | {"whole": True}, "load": load})
    assert whole.doubts == []
