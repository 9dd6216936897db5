"""The page that computes the law of any pin joint: it is up to date, says what Python says, and can
be used with a keyboard and on a phone."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from archord.materials.hardening import TabularHardening
from archord.postprocess.laws.exports.export import export_law
from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.page.page import HERE, law_data, law_page
from archord.scene.file import load_scene
from tests.postprocess.laws import browser

PAGE = Path(__file__).parents[3] / "docs" / "law.html"
PEEQ = (0.0, 0.004, 0.03, 0.2)  # of the points of a hardening curve
CLIENT = """
import { readFileSync } from "node:fs";
import { generalLaw, lawData, missedBySmallStrain } from "HERE/law.mjs";
import { exportLaw } from "HERE/exports.mjs";
import { fitOf } from "HERE/fits.mjs";
const { cases, fits } = JSON.parse(readFileSync("asked.json", "utf8"));
const data = lawData(JSON.parse(readFileSync("words.json", "utf8")), readFileSync("joints.bin"));
function told({ joint, places, suffixes, about }) {
    try {
        const law = generalLaw(data, joint);
        const at = places.map(([delta, deepest]) => {
            const { load, stiffness, error, peak, angle } = law.at(delta, deepest);
            const others = [law.residual(deepest), law.displacement(load)];
            return [load, stiffness, error, peak, angle, ...others];
        });
        const sizes = { radius: joint.radius, length: 7 };
        const text = (suffix) => exportLaw(data, law, about, suffix, "a_law", sizes);
        return { at, texts: suffixes.map(text), missed: missedBySmallStrain(joint) };
    } catch (error) {
        return { refused: error.message };
    }
}
const found = { laws: cases.map(told), fits: fits.map(([fit, diameter]) => fitOf(fit, diameter)) };
console.log(JSON.stringify(found, (_, value) => (Number.isNaN(value) ? null : value)));
"""
LARGE = "&friction=0.2&strain=large"
READY = """new Promise((done) => {
    const look = () => {
        const busy = document.getElementById("law")?.ariaBusy;
        if (busy === "false") done(true);
        else setTimeout(look, 20);
    };
    setTimeout(() => done(false), 20000);
    look();
})"""


def in_javascript(tmp_path: Path, cases: list[dict[str, Any]], fits: Any = ()) -> dict[str, Any]:
    """What the modules of the page say of joints and fits."""
    if not shutil.which("node"):
        pytest.skip("node is not here")
    words, arrays = law_data()
    (tmp_path / "words.json").write_text(words, encoding="utf-8")
    (tmp_path / "joints.bin").write_bytes(arrays)
    asked = json.dumps({"cases": cases, "fits": fits})
    (tmp_path / "asked.json").write_text(asked, encoding="utf-8")
    (tmp_path / "client.mjs").write_text(CLIENT.replace("HERE", str(HERE)), encoding="utf-8")
    command = ["node", "client.mjs"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def case(joint: dict[str, Any], places: Any = (), suffixes: Any = ()) -> dict[str, Any]:
    """What `CLIENT` takes."""
    return {
        "joint": joint,
        "places": places,
        "suffixes": suffixes,
        "about": {"title": "a joint"},
    }


def random_joints(count: int) -> list[dict[str, Any]]:
    """Joints of all kinds, some of them outside the range."""
    rng = np.random.default_rng(3604)
    joints = []
    for kind in rng.choice(["elastic", "pin", "block", "both", "unlike"], count):
        radius = 10 ** rng.uniform(0, 2)
        clearance = radius * 10 ** rng.uniform(-3, -1.7)
        modulus = 10 ** rng.uniform(4, 5.5)
        stresses = modulus * clearance / radius * 10 ** rng.uniform(-0.9, 0.8, 2)
        given = {
            "radius": radius,
            "clearance": clearance,
            "E_star": modulus,
            "plane": str(rng.choice(["strain", "stress"])),
            "nu": rng.uniform(0, 0.49),
            "pin_nu": rng.uniform(0, 0.49),
            "pin_share": float(rng.choice([0.0, 0.5, rng.uniform(0.1, 0.7)])),
            "friction": float(rng.choice([0.0, 0.0, rng.uniform(0, 0.32)])),
            "large_strain": bool(rng.choice([False, False, True])),
        }
        if kind in ("pin", "both", "unlike") and given["pin_share"]:
            given["pin_yield"] = stresses[0]
        if kind in ("block", "both", "unlike"):
            given["block_yield"] = stresses[1 if kind == "unlike" else 0]
        for body in ("pin", "block"):
            if f"{body}_yield" in given and rng.uniform() < 0.4:
                rises = np.array([1.0, 1.0, rng.uniform(1, 1.6), rng.uniform(1.6, 2)])
                stress = given[f"{body}_yield"] * rises
                given[f"{body}_hardening"] = np.column_stack([PEEQ, stress]).tolist()
        joints.append(given)
    return joints


def crossing_joints() -> list[dict[str, Any]]:
    """Joints with a body that hardens until it is the stronger one."""
    joints = []
    for plane in ("strain", "stress"):
        given = {"radius": 10.0, "clearance": 0.05, "E_star": 1e5, "plane": plane, "nu": 0.3}
        given |= {"pin_nu": 0.3, "pin_share": 0.4}
        begin = 85.0
        other = {"strain": 1.17, "stress": 1.45}[plane] * begin
        curve = [[0.0, begin], [0.02, 2.8 * begin], [0.1, 3.0 * begin]]
        for weaker, stronger in (("pin", "block"), ("block", "pin")):
            own = {f"{weaker}_yield": begin, f"{weaker}_hardening": curve}
            joints.append(given | own | {f"{stronger}_yield": other})
    return joints


def joint_of(given: dict[str, Any]) -> LawJoint:
    """A joint whose hardening is ``given`` as points."""
    curves = {
        name: TabularHardening(tuple((peeq, stress) for peeq, stress in points))
        for name, points in given.items()
        if name.endswith("hardening")
    }
    return LawJoint(**given | curves)


def law_or_reason(given: dict[str, Any]) -> JointCurve | str:
    """The law of a joint, or the sentence that refuses it."""
    try:
        return general_law(joint_of(given))
    except ValueError as error:
        return str(error)


def test_the_page_is_the_one_that_its_sources_make():
    """But for the bytes of zlib, which differ between its versions."""
    stored = re.compile(r'(<script type="text/plain" id="\w+">)([^<]*)')

    def parts(text: str) -> tuple[str, list[bytes]]:
        packed = [zlib.decompress(base64.b64decode(own)) for _, own in stored.findall(text)]
        return stored.sub(r"\1", text), packed

    found = PAGE.read_text(encoding="utf-8")
    assert parts(found) == parts(law_page()), "run python3 -m archord.postprocess.laws.page.page"
    assert len(found.encode()) < 400_000


def test_javascript_says_what_python_says(tmp_path):
    """Of elastic joints to round-off; of others as far as round-off goes in Python: a process with
    little noise amplifies it, to some 1e-11 of a force and more of what depends on its slope."""
    rng = np.random.default_rng(11)
    cases = []
    for joint in random_joints(50) + crossing_joints():
        places = joint["clearance"] * np.column_stack(
            [rng.uniform(0, 3, 20), rng.uniform(0, 3, 20)]
        )
        places[:10, 1] = 0.0
        cases.append(case(joint, places.tolist()))
    refused = 0
    thickened = 0
    for asked, said in zip(cases, in_javascript(tmp_path, cases)["laws"], strict=True):
        delta, deepest = np.array(asked["places"]).T
        law = law_or_reason(asked["joint"])
        if isinstance(law, str):
            assert said == {"refused": law}
            refused += 1
            continue
        missed = joint_of(asked["joint"]).missed_by_small_strain
        thickened += missed > 0
        assert said["missed"] == pytest.approx(missed, rel=1e-12)
        state = law.at(delta, deepest)
        told = np.array([*state, law.residual(deepest), law.displacement(state.load)])
        found = np.array(said["at"], float).T
        unit = law.length
        scale = np.nanmax(np.abs(told), axis=1, keepdims=True)
        scale[-2:] = unit
        off = np.nanmax(np.abs(found - told) / scale, axis=1)
        assert (np.isnan(found) == np.isnan(told)).all()
        first = np.abs(found[0] - told[0])[deepest == 0] / scale[0]
        assert first.max() < (5e-11 if law.yields else 1e-12)
        assert off.max() < (1e-9 if law.yields else 1e-12)
    assert 0 < refused < 15
    assert thickened > 0


def test_a_body_that_hardens_too_much_is_refused_in_the_words_of_python(tmp_path):
    """Beyond what was solved, also where one of two bodies does."""
    given = {"radius": 10.0, "clearance": 0.05, "E_star": 115e3, "plane": "stress", "nu": 0.3}
    given |= {"pin_nu": 0.3, "pin_share": 0.5}
    steep = {"block_yield": 120.0, "block_hardening": [[0.0, 120.0], [0.004, 1500.0]]}
    for more in ({}, {"pin_yield": 400.0}):
        joint = given | steep | more
        [said] = in_javascript(tmp_path, [case(joint)])["laws"]
        assert said == {"refused": law_or_reason(joint)}
        assert "at most 3.2 times is covered" in said["refused"]


def test_no_joint_is_refused_in_the_words_of_python(tmp_path):
    good = {"radius": 10.0, "clearance": 0.05, "E_star": 115e3, "plane": "strain", "nu": 0.3}
    bad = [good | {"radius": -1.0}, good | {"nu": 0.7}, good | {"clearance": 1.5}]
    bad += [good | {"block_yield": 1.0}, good | {"pin_yield": 300.0, "pin_share": 0.01}]
    for joint, said in zip(bad, in_javascript(tmp_path, [*map(case, bad)])["laws"], strict=True):
        assert said == {"refused": law_or_reason(joint)}


def test_files_of_the_page_are_those_of_the_exports(tmp_path):
    """But for the description, text by text and number by number."""
    suffixes = [".py", ".h", ".m", ".mo", ".mjs"]
    elastic = {"radius": 10.0, "clearance": 0.05, "E_star": 115e3, "plane": "strain", "nu": 0.3}
    elastic["pin_share"] = 0.5
    joints = [elastic, elastic | {"block_yield": 300.0}]
    number = r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?"
    said = in_javascript(tmp_path, [case(joint, suffixes=suffixes) for joint in joints])["laws"]
    for joint, texts in zip(joints, said, strict=True):
        law = general_law(LawJoint(**joint))
        units = {
            "length_unit": "mm",
            "force_unit": "N",
            "about": {"title": "a joint"},
        }
        law = replace(law, force=7 * law.force, pin_length=7.0, **units)
        for suffix, text in zip(suffixes, texts["texts"], strict=True):
            expected = export_law(law, Path(f"a_law{suffix}"))
            assert _words(text, number) == _words(expected, number)
            found, numbers = ([*map(float, re.findall(number, own))] for own in (text, expected))
            assert found == pytest.approx(numbers, rel=1e-8, abs=1e-10)


def test_python_of_the_page_tells_its_joint_in_python(tmp_path):
    """Truth and nothing included."""
    joint = {"radius": 10.0, "clearance": 0.05, "E_star": 115e3, "plane": "strain", "nu": 0.3}
    joint |= {"pin_share": 0.5, "friction": 0.1, "large_strain": True, "pin_yield": None}
    asked = case(joint, (), [".py"]) | {"about": {"title": "a joint", "of": joint, "unit": "true"}}
    [said] = in_javascript(tmp_path, [asked])["laws"]
    module: dict[str, Any] = {}
    exec(said["texts"][0], module)
    assert module["ABOUT"] == asked["about"]


def _words(text: str, number: str) -> str:
    """A text without its numbers, line ends and Python's quotes."""
    return " ".join(re.sub(number, "#", text).replace("'", '"').split())


def test_fits_have_the_limits_of_the_standard(tmp_path):
    """ISO 286-2: hole, shaft [um]."""
    known = {
        ("H7/f7", 20): ([0, 21], [-41, -20]),
        ("H7/g6", 50): ([0, 25], [-25, -9]),
        ("H8/e8", 100): ([0, 54], [-126, -72]),
        ("H9/d9", 25): ([0, 52], [-117, -65]),
        ("H11/c11", 45): ([0, 160], [-290, -130]),
        ("F8/h6", 30): ([20, 53], [-13, 0]),
        ("JS7/h6", 60): ([-15, 15], [-19, 0]),
        ("H6/h5", 400): ([0, 36], [-25, 0]),
    }
    found = in_javascript(tmp_path, [], [*known])["fits"]
    for said, (hole, shaft) in zip(found, known.values(), strict=True):
        assert (said["hole"], said["shaft"]) == (hole, shaft)
        assert said["least"] == hole[0] - shaft[1]
        assert said["largest"] == hole[1] - shaft[0]


def test_tolerances_follow_the_formulas_of_the_standard(tmp_path):
    """To its rounding: 1 um or 6 %; beyond 3 mm."""
    ends = [6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500]
    units = {5: 7, 6: 10, 7: 16, 8: 25, 9: 40, 10: 64, 11: 100, 12: 160}
    places = [(f"H{grade}/f{grade}", end) for grade in units for end in ends]
    found = in_javascript(tmp_path, [], places)["fits"]
    for (fit, end), said in zip(places, found, strict=True):
        before = dict(zip(ends, [3, *ends], strict=False))[end]
        mean = np.sqrt(before * end)
        width = units[int(fit.split("f")[1])] * (0.45 * np.cbrt(mean) + 0.001 * mean)
        assert said["hole"][1] == pytest.approx(width, rel=0.06, abs=1.0)
        assert -said["shaft"][1] == pytest.approx(5.5 * mean**0.41, rel=0.06, abs=1.0)


@pytest.fixture
def opened(tmp_path):
    """Opens the page in a browser."""
    if browser.found() is None:
        pytest.skip("Chromium is not here")
    with browser.Browser(tmp_path, 360, 800) as page:
        page.call("Page.navigate", url=f"{PAGE.as_uri()}#deepest=0.05")
        assert page.run(READY)
        yield page
        assert page.faults == []


def test_a_phone_and_a_keyboard_are_enough(opened):
    """No sideways scrolling; each field has a label and is reached by Tab, with visible focus."""
    assert opened.run("document.documentElement.scrollWidth") <= 360
    fields = "[...document.querySelectorAll('input, select, button')].filter((f) => f.offsetParent)"
    assert opened.run(f"{fields}.filter((f) => !f.labels?.length && !f.textContent).length") == 0
    reached = set()
    for _ in range(opened.run(f"{fields}.length") + 1):
        opened.press("Tab")
        reached.add(opened.run("document.activeElement.id || document.activeElement.dataset.save"))
        assert opened.run("getComputedStyle(document.activeElement).outlineWidth") == "3px"
    assert set(opened.run(f"{fields}.map((f) => f.id || f.dataset.save)")) <= reached
    opened.run("document.getElementById('cursor').focus()")
    before = float(opened.run("document.getElementById('delta').value"))
    opened.press("ArrowRight")
    assert float(opened.run("document.getElementById('delta').value")) > before


def test_the_page_says_what_python_says_and_its_address_keeps_the_joint(opened):
    joint = "diameter=20&by=given&clearance=0.05&length=3&plane=stress&pin-metal=own"
    opened.run(f"location.hash = '{joint}&pin-E=200000&pin-nu=0.25&block-metal=own&delta=0.06'")
    opened.run("new Promise((done) => setTimeout(done, 100))")
    assert opened.run(READY)
    E_star = 1 / (1 / 200000 + 1 / 210000)
    share = 1 / (1 + 200000 / 210000)
    given = {"plane": "stress", "nu": 0.3, "pin_nu": 0.25, "pin_share": share}
    state = general_law(LawJoint(radius=10.0, clearance=0.05, E_star=E_star, **given)).at(0.06)
    assert float(opened.run("document.getElementById('load').value")) == pytest.approx(
        3 * state.load, rel=1e-5
    )
    assert "clearance=0.05" in opened.run("location.hash")
    opened.run("location.hash = 'by=given&clearance=5'")
    opened.run("new Promise((done) => setTimeout(done, 100))")
    said = opened.run("document.getElementById('refused').textContent")
    assert said == "archord: dR/R = 0.5 is outside 0.001 to 0.02."


def test_metals_by_name_are_the_metals_of_scenes(opened):
    sizes = "diameter=20&by=given&clearance=0.05&length=1&plane=strain&deepest=0"
    metals = {"pin.material": '"4340"', "block.material": '"2024-T3"'}
    told = [f"{key}={value}" for key, value in metals.items()]
    joint = LawJoint.from_scene(load_scene(PAGE.parents[1] / "scenes" / "steel_pin.toml", told))
    assert (joint.radius, joint.plane) == (10.0, "strain")
    for more, changed in (("", joint), (LARGE, replace(joint, friction=0.2, large_strain=True))):
        opened.run(f"location.hash = '{sizes}&pin-metal=4340&block-metal=2024-T3&delta=0.12{more}'")
        opened.run("new Promise((done) => setTimeout(done, 100))")
        assert opened.run(READY)
        load = float(opened.run("document.getElementById('load').value"))
        assert load == pytest.approx(general_law(changed).at(0.12).load, rel=1e-5)


@pytest.mark.parametrize(("slope", "refused"), [("0", False), ("2000", False), ("2 000", True)])
def test_a_slope_that_is_no_number_is_refused(opened, slope, refused):
    """It was perfect plasticity, whose force is another one, without a word."""
    joint = "diameter=20&by=given&clearance=0.05&block-metal=own&block-yield=300"
    opened.run(f"location.hash = '{joint}&block-slope={slope}'")
    opened.run("new Promise((done) => setTimeout(done, 100))")
    assert opened.run(READY)
    said = opened.run("document.getElementById('refused').textContent")
    shown = not opened.run("document.getElementById('refused').hidden")
    assert shown == refused
    assert (said == "The hardening slope of the block must be a positive number.") == refused


def test_all_files_can_be_saved(opened):
    """What links are clicked to download."""
    suffixes = ("csv", "png", "py", "h", "m", "mo", "mjs")
    names = opened.run("""(async () => {
        const names = [];
        HTMLAnchorElement.prototype.click = function () { names.push(this.download); };
        for (const button of document.querySelectorAll("[data-save]")) button.click();
        for (let i = 0; i < 100 && names.length < 7; i++) {
            await new Promise((done) => setTimeout(done, 50));
        }
        return names.sort();
    })()""")
    assert names == sorted(f"pin_joint.{suffix}" for suffix in suffixes)
