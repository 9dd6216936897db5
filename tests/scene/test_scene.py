"""Scene files: what is accepted, what is refused, and in which words."""

import os
import tomllib
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from archord.materials.hardening import (
    LinearHardening,
    SwiftHardening,
    TabularHardening,
    VoceHardening,
)
from archord.materials.named import metal
from archord.report.errors import InputError
from archord.scene.file import load_scene, parse_scene, resolved
from archord.scene.presets.joint import Scene
from archord.scene.reference import example, materials, reference


def basic() -> dict:
    return {
        "joint": {"radius": 10.0, "relative_clearance": 0.005},
        "pin": {"E": 210000.0, "nu": 0.3},
        "block": {"E": 210000.0, "nu": 0.3},
        "load": {"displacement": 2.0},
    }


@pytest.mark.parametrize(
    ("section", "key", "value", "said"),
    [
        ("joint", "radius", -1.0, "scene: joint.radius = -1.0 must be greater than 0."),
        ("joint", "radius", "ten", 'scene: joint.radius = "ten" must be a number.'),
        ("joint", "radius", True, "scene: joint.radius = true must be a number."),
        ("joint", "radius", float("nan"), "scene: joint.radius = NaN must be a finite number."),
        (
            "joint",
            "radius",
            float("inf"),
            "scene: joint.radius = Infinity must be a finite number.",
        ),
        (
            "joint",
            "relative_clearance",
            0.0,
            '= 0.0 must be positive; an interference is for joint.model = "ring".',
        ),
        (
            "joint",
            "relative_clearance",
            0.9,
            "must be between 1e-6 and 0.5 times the radius, in a ring or minus that.",
        ),
        ("joint", "clearance", 0.05, "= 0.05 must not be given together with relative_clearance."),
        ("joint", "edge_angle", 0.0, "must be greater than 0."),
        ("joint", "element_size", 20.0, "must be between 1e-4 and 0.5 times the radius."),
        ("joint", "block_size", 15.0, "must be at least twice the radius of the hole, 20.1."),
        ("joint", "block_size", 10.1, "must be at least twice the radius of the hole, 20.1."),
        ("joint", "raduis", 1.0, "did you mean radius?"),
        ("block", "nu", 0.5, "scene: block.nu = 0.5 must be at most 0.499999."),
        ("block", "rigid", True, "is not a known key"),
        ("block", "hardening", 1.0, "needs a yield_stress."),
        ("block", "hardening", "x", "must be a number."),
        ("block", "hardening", [], "= [] must not be empty."),
        ("block", "hardening", [[0, 1, 2]], "entry 1 must have at most 2 entries."),
        (
            "block",
            "hardening",
            [[0, 2], [0.1, 1]],
            "is no hardening law: yield stresses must be positive and must not",
        ),
        ("block", "hardening", [[0.1, 2]], "is no hardening law: PEEQ must begin at 0"),
        (
            "block",
            "hardening",
            {"rate": 20.0},
            "block.hardening must have rate and saturation (Voce); or exponent and",
        ),
        (
            "block",
            "hardening",
            {"rate": -1.0, "saturation": 9.0},
            "block.hardening.rate = -1.0 must be greater than 0.",
        ),
        (
            "block",
            "hardening",
            {"rat": 1.0},
            "block.hardening.rat = 1.0 is not a known key; did you mean rate?",
        ),
        ("block", "back_stresses", [[1.0, 1.0]], "need a yield_stress."),
        ("block", "yield_stress", 0.0, "must be greater than 0."),
        ("block", "yield_stress", 1e-30, "must be at least 1e-07 times E, in the same unit."),
        ("joint", "block_size", 1e30, "must not exceed 1e+06 times the radius."),
        ("pin", "rigid", True, "is not for a rigid pin."),
        (
            "pin",
            None,
            {"rigid": True, "material": "S355"},
            'pin.material = "S355" is not for a rigid pin.',
        ),
        (
            "block",
            "material",
            "S335",
            'block.material = "S335" is not a known material; did you mean S355? Materials',
        ),
        ("block", "material", 355, "block.material = 355 must be text."),
        (
            "pin",
            None,
            {"rigid": True, "hardening": [[0, 2], [0.1, 3]]},
            "pin.hardening = [[0, 2], [0.1, 3]] is not for a",
        ),
        ("load", "steps", 2.5, "must be a whole number."),
        ("load", "steps", 0, "must be at least 1."),
        ("load", "steps", [4, "x"], '= [4, "x"]: entry 2 must be a whole number.'),
        ("load", "steps", [4, 5], "= [4, 5] must have one number for each of the 1 stages."),
        ("load", "displacement", 200.0, "must not exceed 100 clearances, half the radius."),
    ],
)
def test_a_bad_value_is_refused_in_one_sentence(section, key, value, said):
    """File, key, value and what is allowed."""
    data = basic()
    data = (
        data | {section: value} if key is None else data | {section: data[section] | {key: value}}
    )
    with pytest.raises(InputError) as caught:
        parse_scene(data)
    sentence = str(caught.value)
    assert said in sentence
    assert f"scene: {section}." in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize("section", ["joint", "pin", "block", "load"])
def test_a_missing_section_is_named(section):
    """Sections without defaults are required."""
    with pytest.raises(InputError, match=f"{section} is missing"):
        parse_scene({name: table for name, table in basic().items() if name != section})


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "is a folder, not a scene"),
        (b"\xff\xfe\x00", "UTF-8"),
        (b"[joint\n", "is not valid TOML"),
        (b"x = " + b"9" * 5000, "is not valid TOML"),
        (b"x = " + b"[" * 20000, "is not valid TOML"),
        (b"date = 0000-00-00", "is not valid TOML"),
        (b"a." * 20 + b"b = 1", "a key has more than 20 dotted parts"),
        (b"['a'" + b" . 'a'" * 60000 + b"]", "a key has more than 20 dotted parts"),
        (b"x" * 999999, "is not valid TOML"),
        (b"# " + b"x" * 1999999, "it is larger than 2 MB"),
        (b"".join(b"k%d = 1\n" % i for i in range(3000)), "k0 = 1 is not a known key"),
        (b"x" * 5000 + b" = 1", "is not a known key"),
        (b'"a\\nb" = 1', r'"a\\nb" = 1 is not a known key'),
    ],
    ids=[
        "folder",
        "binary",
        "section",
        "digits",
        "brackets",
        "date",
        "dots",
        "quoted",
        "word",
        "large",
        "keys",
        "long key",
        "two-line key",
    ],
)
def test_files_that_are_no_scenes_are_refused_briefly(tmp_path, content, said):
    """In sentences that name the file."""
    path = tmp_path if content is None else tmp_path / "scene.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=said) as caught:
        load_scene(path)
    lines = str(caught.value).splitlines()
    assert len(lines) <= 20
    assert all(line.startswith(str(path)) and len(line) < 400 for line in lines)


def test_what_never_ends_or_takes_forever_is_refused(tmp_path):
    """A device without an end; a long key in the value of --set, which stays text then."""
    with pytest.raises(InputError, match="/dev/zero: cannot be read: it is a device, not a file"):
        load_scene("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe: cannot be read: it is a pipe, not a file"):
        load_scene(tmp_path / "pipe")
    data = basic()
    data["load"] = {"path": "pipe"}
    (tmp_path / "scene.toml").write_text(tomli_w.dumps(data))
    with pytest.raises(InputError, match="pipe: cannot be read: it is a pipe, not a file"):
        load_scene(tmp_path / "scene.toml")
    (tmp_path / "scene.toml").write_text(resolved(parse_scene(basic())))
    with pytest.raises(InputError, match=r"joint\.radius must be a number"):
        load_scene(tmp_path / "scene.toml", ["joint.radius={" + "a." * 60000 + "b = 1}"])


def test_a_ring_may_have_a_thin_wall():
    """Of 0.02 R and more, where a block needs as much again as its hole."""
    data = basic() | {"load": {"relative_force": 0.001}}
    ring = {"model": "ring", "radius": 10.0, "clearance": 0.05}
    assert parse_scene(data | {"joint": ring | {"block_size": 10.25}}).joint.W == 10.25
    said = (
        r"joint\.block_size = 10\.2 must leave a wall of at least 0\.02 times R, 10\.25 or more\.$"
    )
    with pytest.raises(InputError, match=said):
        parse_scene(data | {"joint": ring | {"block_size": 10.2}})


def test_a_block_that_yields_in_plane_stress_needs_large_strain_early():
    """Unless its pin yields as early."""
    data = basic() | {"analysis": {"plane": "stress"}, "load": {"displacement": 1.0}}
    steel = {"E": 210000.0, "nu": 0.3, "yield_stress": 300.0}

    def doubts(pin, **block):
        return parse_scene(data | {"pin": steel | pin, "block": steel | block}).doubts_of_strain

    stronger = {"yield_stress": 450.0}
    (said,) = doubts(stronger)
    assert "small-strain theory makes P about 2.8 % too low there" in said
    assert doubts({}) == doubts(stronger, hardening=2000.0) == []
    far = {"load": {"displacement": 2.6}}
    (said,) = parse_scene(
        data | far | {"pin": steel | stronger, "block": steel | {"hardening": 2000.0}}
    ).doubts_of_strain
    assert "about 1.3 % too low" in said


@pytest.mark.parametrize("clearance", [0.05, -0.02])
def test_a_ring_in_plane_stress_is_told_nothing_of_thickening(clearance):
    """Of rings it is not known; their clearance may be negative."""
    steel = {"E": 210000.0, "nu": 0.3}
    ring = parse_scene(
        {
            "joint": {"model": "ring", "radius": 10.0, "clearance": clearance, "block_size": 20.0},
            "pin": steel,
            "block": steel | {"yield_stress": 300.0},
            "analysis": {"plane": "stress"},
            "load": {"force": 100.0},
        }
    )
    assert ring.too_low == 0.4
    assert ring.doubts_of_strain == []


def test_a_yield_stress_in_another_unit_than_the_modulus_is_doubted():
    """Which no body reaches: GPa beside MPa."""
    data = basic()
    steel = {"E": 210.0, "nu": 0.3, "yield_stress": 355.0}
    (said,) = parse_scene(data | {"pin": steel, "block": steel | {"yield_stress": 104.0}}).doubts
    assert said == (
        "the yield stress of 'pin', 355, is 1.7 times its E, 210: it does not yield; look whether "
        "both have the same unit"
    )


def test_a_displacement_beyond_small_strains_is_doubted():
    """Where P is off by more than 1 %; by a force, if no joint is so stiff that it moves less."""
    data = basic()
    assert parse_scene(data | {"load": {"displacement": 12.0}}).doubts == []
    assert parse_scene(data | {"load": {"relative_force": 0.09}}).doubts == []
    (said,) = parse_scene(data | {"load": {"displacement": [100.0, 0.0], "steps": 2}}).doubts
    assert said.startswith(
        "load.displacement moves the pin by 0.5 R: small-strain theory makes P about 8 % too low"
    )
    steel = {"E": 210000.0, "nu": 0.3, "yield_stress": 300.0}
    (said,) = parse_scene(data | {"pin": steel, "load": {"displacement": 10.0}}).doubts
    assert said.endswith('makes P about 2 % too low there; analysis.strain = "large" is for that')
    large = {"analysis": {"strain": "large"}, "load": {"displacement": 100.0}}
    assert parse_scene(data | large).doubts == []
    (said,) = parse_scene(data | {"load": {"relative_force": 0.17}}).doubts
    assert said.startswith(
        "load.relative_force moves the pin by at least 0.11 R: small-strain theory"
    )
    assert (
        parse_scene(data | {"analysis": {"friction": 0.3}, "load": {"relative_force": 0.14}}).doubts
        == []
    )


def test_a_pin_lifted_to_the_half_of_the_hole_that_is_not_modelled_is_told():
    """A load that reverses has P = 0 there, where the joint would press the other side of its
    hole."""
    data = basic()
    assert parse_scene(data | {"load": {"displacement": [2.0, -2.0]}}).doubts == []
    (said,) = parse_scene(data | {"load": {"displacement": [2.0, -2.5]}}).doubts
    assert said.startswith(
        "load.displacement lifts the pin by 2.5 dR: beyond 2 dR it would meet the upper half"
    )
    assert parse_scene(data | {"load": {"force": [100.0, -100.0]}}).doubts == []


@pytest.mark.parametrize(
    ("typo", "meant"),
    [
        ("block.yield_stres", "block.yield_stress"),
        ("joint.block_sise", "joint.block_size"),
        ("units.lenght", "units.length"),
    ],
)
def test_a_key_that_no_scene_has_cannot_be_dropped(tmp_path, typo, meant):
    """The misspelled key was dropped, and the one that was meant kept its value."""
    path = tmp_path / "scene.toml"
    path.write_text(resolved(parse_scene(basic())))
    said = f"--set {typo}=none: there is no key {typo}; did you mean {meant}?"
    with pytest.raises(InputError) as refusal:
        load_scene(path, [f"{typo}=none"])
    assert str(refusal.value) == said
    load_scene(path, [f"{meant}=none"])


def test_overrides_replace_values_and_alternatives(tmp_path):
    """--set wins over the file, drops the alternative key, and is named when it is at fault."""
    path = tmp_path / "scene.toml"
    path.write_text(resolved(parse_scene(basic())))
    scene = load_scene(
        path,
        ["joint.clearance=.01", "load.steps=3", "analysis.plane=stress", "block.yield_stress=300"],
    )
    assert scene.joint.dR == 0.01
    assert (scene.load.steps, scene.analysis.plane, scene.plastic) == (3, "stress", True)
    assert not load_scene(path, ["block.yield_stress=300", "block.yield_stress=none"]).plastic
    assert load_scene(path, ["pin.rigid=true"]).pin.rigid
    with pytest.raises(
        InputError, match=r"^--set joint\.radius=-1: joint\.radius must be greater than 0\.$"
    ):
        load_scene(path, ["joint.radius=-1"])
    for malformed in ("radius=3", "joint.radius", "joint=3", "a.b.c=1"):
        with pytest.raises(InputError, match=r"must read section\.key=value"):
            load_scene(path, [malformed])


@pytest.mark.parametrize(
    ("hardening", "law"),
    [
        (2.0, LinearHardening(3.0, 2.0)),
        (
            [[0, 3.0], [0.1, 3.0], [0.2, 4.0]],
            TabularHardening(((0.0, 3.0), (0.1, 3.0), (0.2, 4.0))),
        ),
        ({"saturation": 5.0, "rate": 20.0}, VoceHardening(3.0, 5.0, 20.0)),
        ({"offset": 0.01, "exponent": 0.5}, SwiftHardening(30.0, 0.01, 0.5)),
        ({"engineering": [[0.5, 2.0]]}, TabularHardening(((0.0, 3.0),))),
    ],
)
def test_hardening_is_a_number_a_table_or_a_law(hardening, law):
    """The material has it, and the resolved scene says it; tables say the yield stress themselves,
    and nothing else."""
    solid = basic()["block"] | {"E": 1000.0, "hardening": hardening}
    table = isinstance(law, TabularHardening)
    data = basic() | {"block": solid if table else solid | {"yield_stress": 3.0}}
    block = parse_scene(data).block
    assert block.constitutive("strain").hardening == law
    assert parse_scene(tomllib.loads(resolved(parse_scene(data)))).block == block
    kinematic = parse_scene(
        data | {"block": data["block"] | {"back_stresses": [[50.0, 2.0]]}}
    ).block.constitutive("stress")
    assert (kinematic.hardening, kinematic.back_stresses) == (law, ((50.0, 2.0),))
    if table or isinstance(law, VoceHardening):
        with pytest.raises(
            InputError, match=r"block\.hardening.* must (begin at yield_stress|not soften)"
        ):
            parse_scene(data | {"block": solid | {"yield_stress": 6.0}})


def test_a_material_brings_what_is_not_given(tmp_path):
    """In the scene's unit of stress; the resolved scene holds its values alone, and --set replaces
    them all."""
    data = basic() | {"pin": {"material": "S460", "E": 205000.0}, "block": {"material": "S355"}}
    scene = parse_scene(data)
    steel = metal("S355", "MPa")
    assert (scene.block.E, scene.block.yield_stress, scene.block.hardening) == (
        210000.0,
        355.0,
        steel["hardening"],
    )
    assert (scene.pin.E, scene.pin.nu, scene.pin.yield_stress) == (205000.0, 0.3, 460.0)
    text = resolved(scene)
    assert "material" not in text
    assert parse_scene(tomllib.loads(text)).block.law == scene.block.law
    assert (
        parse_scene(data | {"units": {"length": "m", "stress": "Pa"}}).block.yield_stress == 355e6
    )
    own = (
        {"hardening": 0.0},
        {"yield_stress": 300.0},
        {"hardening": {"saturation": 500.0, "rate": 10.0}},
    )
    blocks = [parse_scene(data | {"block": {"material": "S355"} | keys}).block for keys in own]
    assert [block.yield_stress for block in blocks] == [355.0, 300.0, 355.0]
    assert [block.perfectly_plastic for block in blocks] == [True, True, False]
    path = tmp_path / "scene.toml"
    path.write_text(text)
    found = load_scene(path, ["block.E=70000.0", "block.material=6082-T6"]).block
    assert (found.E, found.nu, found.yield_stress) == (70000.0, 0.3, 230.42)
    with pytest.raises(
        InputError,
        match=r"^--set block\.material=S335: block\.material is not .* did you mean S355\?",
    ):
        load_scene(path, ["block.material=S335"])


def test_the_resolved_scene_is_the_same_scene():
    """What a run folder keeps solves to the same numbers."""
    plastic = {"E": 1.0, "nu": 0.2, "yield_stress": 0.01, "hardening": 0.1}
    for change in ({}, {"pin": {"rigid": True}}, {"block": plastic}):
        a = parse_scene(basic() | change)
        b = parse_scene(tomllib.loads(resolved(a)))
        assert tomllib.loads(resolved(a))["format"] == 1
        assert (a.joint.dR, a.joint.h, a.joint.W) == (b.joint.dR, b.joint.h, b.joint.W)
        assert (a.targets, a.E_star) == (b.targets, b.E_star)
        assert (a.solids, a.analysis, a.load) == (b.solids, b.analysis, b.load)


def test_the_example_shows_every_key_and_loads():
    """Each key of the model stands in the example, with its description."""
    text = example()
    parse_scene(tomllib.loads(text))
    for section, info in Scene.model_fields.items():
        headings = (f"\n[{section}]", f"\n# [{section}]", f"\n{section} = 1")
        assert any(heading in text for heading in headings)
        for key, field in getattr(info.annotation, "model_fields", {}).items():
            assert f"{key} = " in text
            assert field.description in text


def test_the_page_of_materials_holds_their_table():
    """docs/materials.md has what `archord scene --materials` prints."""
    assert materials() in (Path(__file__).parents[2] / "docs" / "materials.md").read_text()


def test_the_reference_page_is_that_of_the_model():
    """docs/scene.md is what `archord scene --reference` prints."""
    assert (Path(__file__).parents[2] / "docs" / "scene.md").read_text() == reference()


def test_contact_modulus_of_plane_strain_and_stress():
    """1/E* = sum (1 - nu^2)/E in plane strain, sum 1/E in plane stress; a rigid pin adds
    nothing."""
    data = basic()
    assert parse_scene(data).E_star == pytest.approx(105000 / 0.91, rel=1e-14)
    assert parse_scene(data | {"analysis": {"plane": "stress"}}).E_star == pytest.approx(
        105000, rel=1e-14
    )
    assert parse_scene(data | {"pin": {"rigid": True}}).E_star == pytest.approx(
        210000 / 0.91, rel=1e-14
    )


def test_a_mesh_of_too_many_triangles_is_refused():
    """With the key to change; the sizes that are used are far below."""
    data = basic()
    data["joint"] |= {"relative_element_size": 1e-4, "growth": 0.01}
    with pytest.raises(
        InputError, match=r"relative_element_size = 0.0001 with growth = 0.01 makes .e\+06"
    ):
        parse_scene(data)
    data["joint"] |= {"growth": 0.25}
    assert parse_scene(data).joint.expected_cells < 1e6


@pytest.mark.parametrize("value", [2, 10**30, "1", 0, -1, [1]])
def test_a_scene_of_another_format_is_refused(value):
    """A newer one for that alone, whatever else it holds, which may mean something there."""
    newer = isinstance(value, int) and value > 1
    said = (
        f"scene: format = {value} is for a newer archord; this one reads format 1."
        if newer
        else "must be 1."
    )
    with pytest.raises(InputError) as caught:
        parse_scene(basic() | {"format": value} | ({"friction": {"mu": 0.1}} if newer else {}))
    assert str(caught.value).endswith(said)
    assert str(caught.value).startswith("scene: format = ")


def test_a_byte_order_mark_and_carriage_returns_change_nothing(tmp_path):
    """What editors on Windows leave."""
    path = tmp_path / "scene.toml"
    text = resolved(parse_scene(basic()))
    path.write_bytes(text.replace("\n", "\r\n").encode("utf-8-sig"))
    assert load_scene(path) == parse_scene(tomllib.loads(text))


@settings(max_examples=60, deadline=None)
@given(
    length=st.integers(-60, 60),
    stress=st.integers(-60, 60),
    clearance=st.floats(-7, 0),
    size=st.floats(-5, 0),
    growth=st.floats(0.01, 2),
    soft=st.floats(-10, 10),
    delta=st.floats(-3, 4),
)
def test_whether_a_scene_is_accepted_does_not_depend_on_its_units(
    length, stress, clearance, size, growth, soft, delta
):
    """Units scaled by powers of two, which round nothing: the same verdict, the same expected
    mesh."""

    def accepted(L: float, S: float) -> tuple[bool, float]:
        data = {
            "joint": {
                "radius": 10.0 * L,
                "clearance": 10.0**clearance * L,
                "element_size": 10.0**size * L,
            },
            "pin": {"E": S, "nu": 0.3, "yield_stress": 1e-3 * S},
            "block": {"E": 10.0**soft * S, "nu": 0.2},
            "load": {"displacement": 10.0**delta},
        }
        data["joint"]["growth"] = growth
        try:
            return True, parse_scene(data).joint.expected_cells
        except InputError:
            return False, 0.0

    assert accepted(2.0**length, 2.0**stress) == accepted(1.0, 1.0)
