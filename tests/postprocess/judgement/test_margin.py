"""Margins of safety: closed forms by hand, the steps of a run by finite elements, and what is said
of both."""

import math
import re
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from archord.cli import run as command
from archord.postprocess.judgement.margin import _by_elements, load_at, margin_text, margins
from archord.postprocess.judgement.parts import Part, parts_of
from archord.postprocess.judgement.sections import (
    ClevisPin,
    lug_forces,
    proof_strength,
    tensile_strength,
)
from archord.postprocess.run import Run
from archord.report.errors import InputError
from archord.scene.file import parse_any
from archord.scene.parts import BodySection
from archord.scene.presets.lug import LugShape
from tests.output.run_files import solved

STEEL = {"E": 210000.0, "nu": 0.3}
SHAPE = {"radius": 10.0, "clearance": 0.1, "width": 40.0, "length": 50.0}
COARSE = {"element_size": 2.5, "growth": 1.0}
CURVE = [[0.0, 450.0], [0.1, 550.0]]


def lug(load: dict, plate: dict, **sections) -> dict:
    return {"lug": SHAPE | COARSE, "pin": STEEL, "plate": STEEL | plate, "load": load} | sections


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A lug in plane stress, 5 mm thick, that is pulled twice and let go; and one that stays
    elastic."""
    cycle = {"displacement": [0.4, 0.0, 0.45, 0.0], "steps": [10, 2, 2, 2]}
    thick = {"analysis": {"plane": "stress", "thickness": 5.0}}
    scenes = {
        "cycled": lug(cycle, {"hardening": CURVE}, **thick),
        "elastic": lug({"displacement": 0.1, "steps": 1}, {}),
        "finer": lug({"displacement": 0.4, "steps": 10}, {"hardening": CURVE}, **thick)
        | {"lug": SHAPE | COARSE | {"element_size": 0.8}},
        "pushed": lug({"displacement": -0.05, "steps": 1}, {"hardening": CURVE}),
    }
    found = solved(
        {name: parse_any(s) for name, s in scenes.items()}, tmp_path_factory.mktemp("runs")
    )
    return {name: Run(folder) for name, folder in found.items()}


def test_hand_formulas_are_those_of_the_sections():
    """A plate of width 40 and edge distance 20 with a hole of 20.2 and a pin of 20, 5 thick, at 100
    MPa."""
    found = lug_forces(LugShape(**SHAPE, edge_distance=20.0), 100.0, 5.0)
    assert found["net section"] == pytest.approx(100 * (40 - 20.2) * 5)
    assert found["bearing"] == pytest.approx(1.5 * 100 * 20 * 5)
    planes = 2 * (20 - 10.1 * math.cos(math.radians(40))) * 5
    assert found["shear-out"] == pytest.approx(planes * 100 / math.sqrt(3))
    short = lug_forces(LugShape(**SHAPE, edge_distance=20.0), 100.0, 5.0, bears=2.0)
    assert short == found | {"bearing": pytest.approx(1.5 * 100 * 20 * 2)}
    bushed = lug_forces(LugShape(**SHAPE, wall=2.0, interference=0.1), 100.0, 5.0)
    assert bushed["net section"] == pytest.approx(100 * (40 - 24) * 5)
    assert bushed["bearing"] == pytest.approx(1.5 * 100 * 24 * 5)


@pytest.mark.parametrize(
    ("space", "bushing", "length"),
    [
        ({"thickness": 12.0, "pin_length": 6.0}, {}, 6.0),
        ({"thickness": 12.0, "pin_length": 16.0}, {}, 12.0),
        ({"thickness": 12.0}, {}, 12.0),
        ({"thickness": 12.0, "pin_length": 16.0, "chamfer": 0.5}, {}, 11.0),
        ({"thickness": 12.0, "pin_length": 6.0, "fillet": 0.5}, {}, 6.0),
        ({"thickness": 12.0, "pin_length": 6.0}, {"bushing": STEEL | {"thickness": 2.0}}, 12.0),
    ],
)
def test_a_pin_bears_over_the_length_of_contact(space, bushing, length):
    """Of a short pin, or between the chamfers or fillets of the hole. A bushing bears over the
    thickness of its lug."""
    scene = parse_any(lug({"force": 1e4}, {"hardening": CURVE}, space=space) | bushing)
    run = SimpleNamespace(
        scene=scene,
        folder="run",
        number=lambda step: 1,
        columns={"pull force": [1e4]},
        units={"pull force": "N"},
    )
    part = parts_of(run)[""]
    diameter = 2 * 12.1 if bushing else 20.0
    assert part.by_hand("yield", 100.0)["bearing"] == pytest.approx(150.0 * diameter * length)
    assert ("over the length" in part.notes[0]) == (length < 12.0)


def test_a_pin_bends_about_the_faces_that_bear():
    """A solid pin by hand: shear on two sections, Bruhn's arm, and the moment of Melcon and Hoblit
    with the lengths that bear; plates of any strength bear at their faces alone."""
    pin = ClevisPin(radius=10.0, bore=0.0, inner=20.0, outer=10.0, gap=1.0)
    found = pin.forces("yield", 300.0)
    assert found["shear"] == pytest.approx(2 * math.pi * 100 * 300 / math.sqrt(3))
    moment = 300 * math.pi * 1000 / 4
    assert found["bending, even bearing"] == pytest.approx(moment / ((5 + 1 + 5) / 2))
    assert "bending, ends bear" not in found
    plates = (2e5, 4e5)
    force = pin.forces("ultimate", 300.0, plates)["bending, ends bear"]
    inner, outer = (force / 2 * 20 / plate for plate in plates)
    assert force / 2 * (inner / 2 + 1.0 + outer / 2) == pytest.approx(300 * 4 / 3 * 1000)
    hard = pin.forces("ultimate", 300.0, (1e12, 1e12))["bending, ends bear"]
    assert hard == pytest.approx(2 * 300 * 4 / 3 * 1000 / 1.0, rel=1e-4)
    soft = pin.forces("ultimate", 300.0, (1e4, 1e4))
    assert soft["bending, ends bear"] == soft["bending, even bearing"]


def test_a_clevis_bears_between_its_rims():
    """Two fillets shorten the length on which each plate bears, and widen the gap by two."""
    thickness = {"inner": 16.0, "outer": 6.0}
    rim = 0.75
    plates = {
        name: STEEL | {"hardening": CURVE, "thickness": t, "width": 40.0}
        for name, t in thickness.items()
    }
    scene = parse_any(
        {
            "clevis": {"radius": 10.0, "clearance": 0.1} | COARSE,
            "space": {"gap": 2.0, "fillet": rim},
        }
        | plates
        | {"pin": STEEL | {"yield_stress": 900.0}, "load": {"force": 2e4}}
    )
    run = SimpleNamespace(
        scene=scene,
        folder="run",
        number=lambda step: 1,
        columns={"pull force": [2e4]},
        units={},
    )
    parts = parts_of(run)
    ultimate = []
    for name, number in {"inner": 1, "outer": 2}.items():
        part = parts[name]
        bears = number * (thickness[name] - 2 * rim)
        assert part.by_hand("yield", 100.0)["bearing"] == pytest.approx(150 * 20 * bears)
        sections = part.by_hand("ultimate", tensile_strength(part.body))
        ultimate.append(min(sections.values()))
    inner, outer = (t - 2 * rim for t in thickness.values())
    pin = ClevisPin(10.0, 0.0, inner, outer, 2.0 + 2 * rim)
    for kind in ("yield", "ultimate"):
        expected = pin.forces(kind, 900.0, tuple(ultimate))
        assert parts["pin"].by_hand(kind, 900.0) == pytest.approx(expected)


def test_strengths_are_those_of_the_tension_test_behind_the_curve():
    """0.2 % proof and largest engineering stress; of metals with a plateau the yield strength; of
    named ones the listed strengths."""
    power = BodySection(
        name="lug", **STEEL, yield_stress=200.0, hardening={"offset": 0.002, "exponent": 0.2}
    )
    assert tensile_strength(power) == pytest.approx(
        200 / 0.002**0.2 * 0.2**0.2 * math.exp(-0.198), rel=0.01
    )
    for name, proof, tensile in (
        ("S355", 355, 470),
        ("CuSn12-C", 150, 300),
        ("Ti-6Al-4V", 827, 896),
    ):
        metal = BodySection(name="lug", material=name)
        assert proof_strength(metal) == pytest.approx(proof, rel=1e-3)
        assert tensile_strength(metal) == pytest.approx(tensile, rel=2e-3)
    line = BodySection(name="lug", **STEEL, yield_stress=300.0, hardening=1000.0)
    highest = 1000 / (1 + 1000 / 210e3)
    expected = pytest.approx(highest * math.exp(-(highest - 300) / 1000 - highest / 210e3))
    assert tensile_strength(line) == expected  # within the line, at no knot
    table = BodySection(name="lug", **STEEL, hardening=[[0.0, 300.0], [0.9, 1200.0]])
    assert tensile_strength(table) == expected
    flat = BodySection(name="lug", **STEEL, yield_stress=200.0)
    assert (proof_strength(flat), tensile_strength(flat)) == (200.0, 200.0)


@pytest.mark.parametrize(
    ("force", "peeq", "limit", "expected"),
    [
        ([10, 20, 30], [0.0, 0.01, 0.03], 0.02, (25.0, True)),
        ([10, 20, 30], [0.0, 0.01, 0.03], 0.0, (10.0, True)),
        ([10, 20, 30], [0.0, 0.01, 0.03], 0.05, (30.0, False)),
        ([10, 30, 0], [0.0, 0.01, 0.01], 0.05, (30.0, False)),  # let go: the largest, not the last
        (
            [30, 0, 30, 0, 30],
            [0.01, 0.01, 0.02, 0.02, 0.03],
            0.025,
            (30.0, True),
        ),  # in a later cycle
        ([20, 0, 30], [0.01, 0.01, 0.03], 0.01, (20.0, True)),
        ([10, 20], [0.02, 0.03], 0.01, (5.0, True)),  # within the first step
        ([0, 10], [0.01, 0.02], 0.0, (0.0, True)),  # in a press fit
    ],
)
def test_the_force_at_a_plastic_strain_is_the_largest_reached(force, peeq, limit, expected):
    found = load_at(np.array(force, dtype=float), np.array(peeq), limit)
    assert found == (pytest.approx(expected[0]), expected[1])


def test_margins_of_a_cycled_lug(runs):
    """By finite elements from the largest force, though the last row has none; in the total force
    of 5 mm."""
    run = runs["cycled"]
    largest = max(run.columns["pull force"])
    assert run.columns["pull force"][-1] == pytest.approx(0.0, abs=1e-6 * largest)
    found = margins(run, 0.5 * largest, factor=1.5)
    assert found.unit == "N"
    checks = {(check.kind, check.by, check.name): check for check in found.checks}
    net = checks["yield", "hand", "net section"]
    assert net.allowable == pytest.approx(found.strengths["yield"][0] * (40 - 20.2) * 5)
    assert net.margin == pytest.approx(net.allowable / (0.5 * largest) - 1)
    assert checks["ultimate", "hand", "bearing"].applied == pytest.approx(0.75 * largest)
    ultimate = checks["ultimate", "FE", "PEEQ of 0.1"]
    assert (ultimate.bound, ultimate.allowable) == (True, largest)
    assert ultimate.margin == pytest.approx(1 / 0.75 - 1)
    first, limit = (
        checks["yield", "FE", name].allowable for name in ("first yield", "PEEQ of 0.01")
    )
    assert 0 < first < limit <= largest
    assert "> +0.333" in margin_text(found)


def test_how_much_the_mesh_counts_is_told(runs):
    """The allowable of a clevis by PEEQ was off by 8 % without a word. Means of cells pass the
    limit later than points, and what is recovered at nodes draws near on finer meshes."""
    apart = []
    for name in ("cycled", "finer"):
        found = margins(runs[name], 9000.0)
        notes = [note for note in found.notes if "the mesh counts" in note]
        assert ["PEEQ of 0.01" in note for note in notes] == [True]
        means, recovered = (float(number) for number in re.findall(r" (\d+) N by", notes[0]))
        limit = next(check.allowable for check in found.checks if check.name == "PEEQ of 0.01")
        assert means >= limit * (1 - 1e-4)
        apart.append(means / recovered - 1)
    assert 0 < apart[1] < apart[0] / 2


def test_without_fields_nothing_is_told_of_the_mesh(runs, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(runs["cycled"].folder, folder)
    (folder / "fields.h5").unlink()
    found = margins(Run(folder), 9000.0)
    assert not [note for note in found.notes if "mesh" in note]
    assert found.checks == margins(runs["cycled"], 9000.0).checks


@pytest.mark.parametrize(("pushed", "step"), [([0.0, -5.0], 2), ([3.0, 6.0], 0)])
def test_what_a_push_did_before_is_told(pushed, step):
    """A lug that yields while its pin pushes had the margin -1 under any pull, without a word."""
    body = BodySection(name="lug", **STEEL, yield_stress=300.0)
    part = Part("", body, np.array([*pushed, 0.0, 8.0]), "N", "lug")
    peeq = np.array([0.0, 0.02, 0.02, 0.03])
    _, notes = _by_elements(part, peeq, {"yield": 4.0, "ultimate": 4.0}, 0.01, 0.05)
    told = [note for note in notes if "in which no force pulls" in note]
    assert [f"passes PEEQ of 0.01 in step {step}" in note for note in told] == (
        [False, True] if step else []
    )


def test_nothing_is_extrapolated(runs):
    """Beyond the largest force that was solved there is no margin of a limit that was not
    reached."""
    largest = max(runs["cycled"].columns["pull force"])
    found = margins(runs["cycled"], 2 * largest)
    assert [check.margin for check in found.checks if check.bound] == [None]
    assert "not known" in margin_text(found)
    assert f"is beyond the largest force that was solved, {largest:.5g}" in margin_text(found)


def test_an_elastic_lug_has_hand_formulas_alone(runs, capsys):
    folder = str(runs["elastic"].folder)
    assert command(["margin", folder, "--load", "1000"]) == 2
    said = "the lug is elastic: it has no yield; give --proof and --tensile for the hand formulas"
    assert said in capsys.readouterr().err
    assert command(["margin", folder, "--load", "1000", "--proof", "300"]) == 0
    printed = capsys.readouterr().out
    assert "it has no yield, and no margins by finite elements" in printed
    assert " FE " not in printed
    assert "[N/mm]" in printed


def test_the_command_prints_what_the_function_finds(runs, capsys):
    """From the folder; ``--help`` explains."""
    folder = str(runs["cycled"].folder)
    assert command(["margin", folder, "--load", "9000", "--factor", "1.5"]) == 0
    assert (
        capsys.readouterr().out == margin_text(margins(runs["cycled"], 9000.0, factor=1.5)) + "\n"
    )
    assert command(["margin", folder, "--load", "9000", "--plate", "outer"]) == 2
    assert "'outer': is for a clevis or for bodies" in capsys.readouterr().err
    assert command(["margin", "--help"]) == 0
    assert "by hand formulas (net" in capsys.readouterr().out


def test_the_text_compares_formulas_with_finite_elements(runs):
    """The last criterion of finite elements with the weakest section by hand."""
    found = margins(runs["cycled"], 9000.0)
    told = r"yield: by hand (.*) is the weakest; finite elements \((.*)\) are ([-+.\d]+)% off it"
    name, criterion, off = re.search(told, margin_text(found)).groups()
    allowable = {check.name: check.allowable for check in found.checks if check.kind == "yield"}
    by_hand = [check for check in found.checks if (check.kind, check.by) == ("yield", "hand")]
    assert name == min(by_hand, key=lambda check: check.allowable).name
    lacking = allowable[criterion] / allowable[name] - 1
    assert float(off) == pytest.approx(100 * lacking, abs=0.05)


@pytest.mark.parametrize(
    ("name", "asked", "said"),
    [
        ("cycled", ["--load", "0"], "--load 0: must be a positive number."),
        ("cycled", ["--load", "nan"], "--load nan: must be a positive number."),
        ("cycled", ["--load", "1", "--factor", "-1"], "--factor -1: must be a positive number."),
        ("pushed", ["--load", "1"], "the pin never pulls at the lug's end"),
    ],
)
def test_what_has_no_margin_is_refused(runs, capsys, name, asked, said):
    assert command(["margin", str(runs[name].folder), *asked]) == 2
    assert said in capsys.readouterr().err


def test_plates_of_a_clevis_have_the_margins_of_lugs_under_their_share(tmp_path, capsys):
    """The inner plate under P, and an outer plate under P/2: forces of both are told as those of
    the whole."""
    plates = {
        "inner": {"thickness": 5.0, "width": 40.0},
        "outer": {"thickness": 4.0, "width": 44.0, "edge_distance": 21.0},
    }
    metals = {"inner": {"hardening": CURVE}, "outer": {"hardening": [[0.0, 300.0]]}}
    plane = {"analysis": {"plane": "stress"}, "pin": STEEL}
    around = {"radius": 10.0, "clearance": 0.1} | COARSE
    sections = {name: STEEL | metals[name] | plates[name] for name in plates}
    load = {"load": {"force": 20000.0, "steps": 2}}
    scenes = {"clevis": parse_any({"clevis": around} | sections | plane | load)}
    for name, number in (("inner", 1), ("outer", 2)):
        outline = dict(plates[name])
        thickness = number * outline.pop("thickness")
        alone = {"lug": around | outline, "plate": STEEL | metals[name]} | load | plane
        alone["analysis"] = plane["analysis"] | {"thickness": thickness}
        scenes[name] = parse_any(alone)
    folders = solved(scenes, tmp_path)
    for name in plates:
        found = margins(Run(folders["clevis"]), 15000.0, part=name)
        lug = margins(Run(folders[name]), 15000.0)
        assert (found.part, found.unit, found.strengths) == (f"{name} plate", "N", lug.strengths)
        for check, expected in zip(found.checks, lug.checks, strict=True):
            assert (check.kind, check.name, check.bound) == (
                expected.kind,
                expected.name,
                expected.bound,
            )
            tolerance = 1e-12 if check.by == "hand" else 0.02  # the meshes differ
            assert check.allowable == pytest.approx(expected.allowable, rel=tolerance)
    clevis = str(folders["clevis"])
    assert command(["margin", clevis, "--load", "15000"]) == 0
    printed = capsys.readouterr().out
    assert printed.index("inner plate: load 15000 N") < printed.index("outer plate: load 15000 N")
    assert command(["margin", clevis, "--load", "15000", "--proof", "400"]) == 2
    assert "--proof: is the strength of one part" in capsys.readouterr().err
    assert command(["margin", clevis, "--load", "15000", "--proof", "400", "--plate", "outer"]) == 0
    assert command(["margin", str(folders["inner"]), "--load", "1", "--plate", "outer"]) == 2


def test_runs_of_other_problems_are_refused(tmp_path):
    shape = {"radius": 10.0, "relative_clearance": 0.01, "relative_element_size": 0.2}
    joint = {
        "joint": shape,
        "pin": STEEL,
        "block": STEEL,
        "load": {"displacement": 0.2, "steps": 1},
    }
    run = Run(solved({"joint": parse_any(joint)}, tmp_path)["joint"])
    with pytest.raises(InputError, match=r"this run has the loads of a \[joint\]"):
        margins(run, 1.0)
