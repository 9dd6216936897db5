"""Where a body yields: what a named metal brings, what the scene gives beside it, and what is said
of both."""

from dataclasses import dataclass

import numpy as np
import pytest

from archord.materials.hardening import Hardening, SwiftHardening, VoceHardening
from archord.materials.named import metal, metals
from archord.report.errors import InputError
from archord.scene.file import load_scene, parse_any, parse_scene, resolved
from archord.scene.sections import plasticity
from archord.scene.sections.bodies import Solid
from archord.scene.sections.units import Units

STEEL = {"E": 206000.0, "nu": 0.29}
TEST = {
    "engineering": [[0.0061972, 440.0], [0.0092, 503.0], [0.02, 530.0]]
}  # 440 MPa: 442.727 MPa of true stress
ALUMINIUM = {"E": 71000.0, "nu": 0.33, "hardening": TEST}


def joint(block: dict, **sections) -> dict:
    shape = {"radius": 12.0, "clearance": 0.08}
    return {"joint": shape, "pin": STEEL, "block": block, "load": {"displacement": 2.0}} | sections


def block(keys: dict, **sections) -> Solid:
    return parse_scene(joint(keys, **sections)).block


@pytest.mark.parametrize("name", metals())
@pytest.mark.parametrize("unit", ["MPa", "Pa", "ksi"])
def test_a_number_for_the_hardening_begins_at_the_listed_yield_strength(name, unit):
    """Not at the first point of the metal's curve, whose place a number takes; 0 is perfect
    plasticity there."""
    units = {"length": "in", "stress": unit}
    listed = metal(name, unit)["yield"]
    flat = block({"material": name, "hardening": 0.0}, units=units)
    assert (flat.yield_stress, flat.perfectly_plastic) == (listed, True)
    assert block({"material": name, "hardening": listed}, units=units).law.linear == (
        listed,
        listed,
    )
    voce = {"saturation": 2 * listed, "rate": 10.0}
    assert block({"material": name, "hardening": voce}, units=units).yield_stress == listed


def test_what_stands_beside_a_metal_wins():
    """A table says where it begins; a yield stress drops the curve; a modulus leaves it."""
    table = [[0.0, 100.0], [0.1, 200.0]]
    assert block({"material": "CuSn12-C", "hardening": table}).yield_stress == 100.0
    assert block({"material": "CuSn12-C", "hardening": TEST}).yield_stress == pytest.approx(
        442.727, abs=1e-3
    )
    given = block({"material": "CuSn12-C", "yield_stress": 170.0})
    assert (given.yield_stress, given.perfectly_plastic) == (170.0, True)
    softer = block({"material": "CuSn12-C", "E": 90000.0})
    assert (softer.E, softer.hardening) == (90000.0, metals()["CuSn12-C"]["hardening"])


def test_back_stresses_do_not_add_to_the_curve_of_a_metal(tmp_path):
    """Which is all of its hardening: what of it is left must be said, by --set, too."""
    back = {"back_stresses": [[20000.0, 200.0]]}
    with pytest.raises(
        InputError, match=r"^scene: block\.back_stresses = .* would add to the curve"
    ):
        block({"material": "S355"} | back)
    assert block({"material": "S355", "hardening": 0.0} | back).yield_stress == 355.0
    assert block({"material": "S355", "yield_stress": 200.0} | back).yield_stress == 200.0
    path = tmp_path / "scene.toml"
    path.write_text(resolved(parse_scene(joint(STEEL | {"yield_stress": 250.0} | back))))
    with pytest.raises(InputError, match="would add to the curve"):
        load_scene(path, ["block.material=S355"])
    assert (
        load_scene(path, ["block.material=S355", "block.hardening=0.0"]).block.yield_stress == 355.0
    )


@pytest.mark.parametrize("said", [440.0, 442.727, 442.72676799999994, 443.0])
def test_a_tension_test_goes_with_either_stress_of_its_first_point(said):
    """The engineering or the true one, rounded or not; the true one is solved with."""
    assert block(ALUMINIUM | {"yield_stress": said}) == block(ALUMINIUM)
    assert block(ALUMINIUM).yield_stress == pytest.approx(440 * 1.0061972)


def test_another_yield_stress_is_refused_with_both():
    said = (
        "block.hardening must begin at yield_stress (450), not at 442.727, the true stress of 440."
    )
    with pytest.raises(InputError) as error:
        block(ALUMINIUM | {"yield_stress": 450.0})
    assert str(error.value) == f"scene: {said}"
    with pytest.raises(InputError, match=r"must begin at yield_stress \(300\), not at 100\.$"):
        block(STEEL | {"yield_stress": 300.0, "hardening": [[0.0, 100.0]]})


def test_a_table_of_no_numbers_is_refused_in_a_sentence():
    for wrong in (
        [[0.0, "a"]],
        [["b"]],
        [[]],
        {"engineering": [[10**400, 1.0]]},
        {"engineering": "x"},
    ):
        with pytest.raises(InputError, match=r"^scene: block\.hardening"):
            block(STEEL | {"yield_stress": 300.0, "hardening": wrong})


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({}, "elastic"),
        ({"yield_stress": 300.0}, "yields at 300 MPa, perfectly plastic"),
        (
            {"yield_stress": 300.0, "hardening": 900.0},
            "yields at 300 MPa, hardens by 900 MPa times PEEQ",
        ),
        (
            {"hardening": [[0.0, 300.0], [0.1, 400.0]]},
            "yields at 300 MPa, hardens to 400 MPa at PEEQ 0.1",
        ),
        (
            {"yield_stress": 300.0, "back_stresses": [[1e4, 0.0]]},
            "yields at 300 MPa, back stresses: 1",
        ),
    ],
)
def test_the_strength_that_is_used_is_said(keys, said):
    scene = parse_scene(joint(STEEL | keys))
    assert scene.materials["block"]["strength"] == said
    assert scene.materials["block"]["yield_stress"] == (300.0 if keys else None)


@pytest.mark.parametrize(
    ("stress", "length", "force"),
    [
        ("psi", "in", "lbf"),
        ("ksi", "in", "kip"),
        ("ksi", "inch", "kip"),
        ("N/mm2", "mm", "N"),
        ("Pa", "m", "N"),
        ("kPa", "m", "kN"),
        ("GPa", "mm", "kN"),
        ("psi", "mm", "psi mm2"),
    ],
)
def test_headings_know_the_unit_of_force(stress, length, force):
    units = Units(length=length, stress=stress)
    assert units.force_of(2.0) == force
    assert units.force_of(None) == (
        f"{force}/{length}" if " " not in force else f"{stress} {length}"
    )
    assert units.energy_of(2.0) == f"{force} {length}"


def test_inches_beside_metric_stresses_are_doubted():
    """Of any scene, as a default may be the other half; own names of units are nobody's
    business."""
    lug = {"lug": {"radius": 0.4, "clearance": 0.01, "width": 2.0}, "pin": STEEL, "plate": STEEL}
    cases = ("psi", "in", 0), ("ksi", "mm", 1), ("MPa", "in", 1), ("MPa", "mm", 0), ("-", "R", 0)
    for stress, length, doubted in cases:
        units = {"length": length, "stress": stress}
        for scene in (
            joint(STEEL, units=units),
            lug | {"units": units, "load": {"displacement": 0.01}},
        ):
            found = [doubt for doubt in parse_any(scene).doubts if "the unit of force" in doubt]
            assert len(found) == doubted


def test_a_metal_whose_name_is_a_number_needs_no_quotes(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(resolved(parse_scene(joint(STEEL))))
    assert load_scene(path, ["block.material=4340"]) == load_scene(path, ['block.material="4340"'])


def test_a_law_may_be_named_and_its_name_must_fit_its_keys():
    voce = {"saturation": 500.0, "rate": 10.0}
    steel = STEEL | {"yield_stress": 300.0}
    named = block(steel | {"hardening": voce | {"law": "Voce"}})
    assert named.law == block(steel | {"hardening": voce}).law
    with pytest.raises(InputError, match=r"block\.hardening\.law = \"Ludwik\" must be 'Voce'"):
        block(steel | {"hardening": voce | {"law": "Ludwik"}})
    with pytest.raises(InputError, match=r"block\.hardening must have rate and saturation"):
        block(steel | {"hardening": voce | {"law": "Swift"}})
    with pytest.raises(InputError, match=r"block\.hardening\.speed .*is not a known key"):
        block(steel | {"hardening": voce | {"speed": 1.0}})


def test_a_law_is_one_row(monkeypatch):
    """Of a class: by its parameters, from its words and back; two laws with the same keys by
    name."""

    @dataclass(frozen=True)
    class Ludwik(Hardening):
        yield_stress: float
        strength: float
        power: float

        def stress(self, peeq):
            return self.yield_stress + self.strength * peeq**self.power

    keys = {"strength": (float, "rise"), "power": (float, "power")}
    row = plasticity.NamedLaw("Ludwik", Ludwik, keys)
    law = Ludwik(300.0, 500.0, 0.4)
    assert plasticity.parameters_of(law) is None
    monkeypatch.setattr(plasticity, "LAWS", (*plasticity.LAWS, row))
    words = {"strength": 500.0, "power": 0.4}
    assert plasticity.parameters_of(law) == words
    assert row.of(300.0, 2e5, words) == law
    other = plasticity.NamedLaw("another", SwiftHardening, keys)
    monkeypatch.setattr(plasticity, "LAWS", (*plasticity.LAWS, other))
    assert plasticity.parameters_of(law) == {"law": "Ludwik"} | words


@pytest.mark.parametrize(
    "law", [VoceHardening(300.0, 500.0, 10.0), SwiftHardening(700.0, 0.01, 0.2)]
)
def test_the_words_of_a_law_make_it_again(law):
    words = plasticity.parameters_of(law)
    first = float(law.stress(np.zeros(1))[0])
    again = block(STEEL | {"yield_stress": first, "hardening": words}).law
    peeq = np.linspace(0, 0.1, 5)
    np.testing.assert_allclose(again.stress(peeq), law.stress(peeq), rtol=1e-14)


def test_a_law_that_softens_is_refused():
    voce = {"saturation": 200.0, "rate": 10.0}
    with pytest.raises(InputError, match=r"block\.hardening must not soften"):
        block(STEEL | {"yield_stress": 300.0, "hardening": voce})
    flat = voce | {"saturation": 300.0}
    assert block(STEEL | {"yield_stress": 300.0, "hardening": flat}).plastic
