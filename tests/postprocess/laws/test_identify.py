"""Joints identified from measured curves: what comes back, how sure it is, and what is refused."""

import itertools
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import archord
from archord.cli import run
from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.identification import identification
from archord.postprocess.laws.identification.identification import identify
from archord.postprocess.laws.identification.identify_report import (
    as_json,
    doubts,
    estimates_table,
    units_of,
)
from archord.postprocess.laws.identification.measured import MeasuredCurve, read_curve
from archord.postprocess.laws.identification.unknowns import COMPLIANCE, OFFSET
from archord.report.errors import InputError

SCENES = Path(__file__).parents[3] / "scenes"
STEEL = str(SCENES / "steel_pin.toml")
ELASTIC = str(SCENES / "elastic_pin.toml")
BOTH = "block.yield_stress,pin.yield_stress"
OFF = 0.013
SOFT = 2e-6  # compliance of the machine


def measured(path, changes, seed, turns=(-0.1, 2.0, 0.6), n=400, noise=0.01, soft=SOFT):
    """A curve of the law of a scene through ``turns`` (over dR), with noise over its largest
    force."""
    scene = archord.load_scene(path, changes)
    law = general_law(LawJoint.from_scene(scene))
    ways = itertools.pairwise(turns)
    delta = scene.joint.dR * np.concatenate([np.linspace(*way, n // 2) for way in ways])
    load = law.at(delta, np.maximum.accumulate(delta)).load
    stray = noise * load.max() * np.random.default_rng(seed).normal(size=len(load))
    return MeasuredCurve(delta + OFF + soft * load, load + stray)


def said(found):
    return "\n".join(doubts(found))


def begin_at_the_scene(patch):
    """Let fits begin with the values of the scene, without a search for a beginning, which takes
    most of the time."""
    patch.setattr(identification, "_begun", lambda model: np.zeros(len(model.unknowns)))


@pytest.fixture
def _begun_at_the_scene(monkeypatch):
    begin_at_the_scene(monkeypatch)


@pytest.fixture(scope="module")
def steel():
    """A joint with another clearance and yield stress than the scene's, of which both are sought,
    beside offset and machine."""
    changes = {"joint.clearance": 0.06, "block.yield_stress": 260.0, "pin.yield_stress": 260.0}
    curve = measured(STEEL, changes, seed=4)
    with pytest.MonkeyPatch.context() as patch:
        begin_at_the_scene(patch)
        return identify(archord.load_scene(STEEL), curve, ["joint.clearance", BOTH])


def test_clearance_and_yield_stress_come_back_from_a_noisy_curve(steel):
    """With 1 % noise, an unknown offset and an unknown machine: 2 % and 3 %."""
    clearance, strength, offset, softness = (one.value for one in steel.estimates)
    assert clearance == pytest.approx(0.06, rel=0.02)
    assert strength == pytest.approx(260.0, rel=0.03)
    assert offset == pytest.approx(OFF, abs=0.0006)
    assert softness == pytest.approx(SOFT, rel=0.05)
    assert all(one.low < one.value < one.high for one in steel.estimates)
    assert doubts(steel) == []


@pytest.mark.parametrize(
    ("clearance", "strength", "soft", "too_wide", "too_strong"),
    [(0.05, 230.0, 2e-6, 2.5, 1.2), (0.0375, 70.0, 0.0, 1.8, 2.5)],
)
def test_a_fit_does_not_end_at_the_curve_of_another_joint(
    clearance, strength, soft, too_wide, too_strong
):
    """Clearances were 3 and 4 times too large, with a compliance that the fit did not begin with,
    and with a yield stress that a larger clearance made up for."""
    changes = {
        "joint.clearance": clearance,
        "block.yield_stress": strength,
        "pin.yield_stress": strength,
    }
    curve = measured(STEEL, changes, 0, turns=(-0.3, 1.9, 0.0), n=100, noise=0.0, soft=soft)
    factors = {"joint.clearance": too_wide}
    begun = {key: value * factors.get(key, too_strong) for key, value in changes.items()}
    found = identify(archord.load_scene(STEEL, begun), curve, ["joint.clearance", BOTH])
    values = [one.value for one in found.estimates[:2]]
    assert values == pytest.approx([clearance, strength], rel=0.01)


@pytest.mark.usefixtures("_begun_at_the_scene")
def test_95_percent_intervals_hold_the_truth_in_88_to_99_of_100_curves():
    """Of an elastic joint, whose law is fast, over fixed seeds."""
    scene = archord.load_scene(ELASTIC)
    dR = scene.joint.dR
    inside = []
    for seed in range(40):
        curve = measured(ELASTIC, {}, seed, n=60, soft=0.0)
        found = identify(scene, curve, ["joint.clearance"], stiffness=np.inf)
        truth = [dR, OFF]
        inside += [one.low <= t <= one.high for one, t in zip(found.estimates, truth, strict=True)]
    assert 0.88 <= np.mean(inside) <= 0.99


def test_stray_points_move_nothing():
    """Six of 200 points are wild; the loss of each is bounded in its slope."""
    curve = measured(ELASTIC, {}, 1, n=200, noise=0.005)
    load = curve.load.copy()
    load[20::35] += 0.6 * curve.largest
    scene = archord.load_scene(ELASTIC)
    found = identify(
        scene, MeasuredCurve(curve.displacement, load), ["joint.clearance"], stiffness=1 / SOFT
    )
    assert found.estimates[0].value == pytest.approx(scene.joint.dR, rel=0.03)


def test_what_cannot_be_told_apart_is_said():
    """A yield stress of an elastic curve; an offset without a point before first touch."""
    curve = measured(STEEL, {}, 2, turns=(0.03, 0.15), n=100)
    found = identify(
        archord.load_scene(STEEL), curve, ["joint.clearance", BOTH], stiffness=1 / SOFT
    )
    assert "yield_stress: cannot be told, the curve does not depend on it" in said(found)
    found = identify(archord.load_scene(STEEL), curve, ["joint.clearance", "block.E,pin.E"])
    assert "can hardly be told apart" in said(found)
    assert "no points before first touch" in said(found)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_curve_that_never_touches_tells_nothing():
    """No unknown changes the law then, and none is the most that one can."""
    curve = measured(ELASTIC, {}, 1, n=50)
    scene = archord.load_scene(ELASTIC)
    late = 2 * curve.displacement.max()
    found = identify(scene, curve, ["joint.clearance", "block.E"], offset=late, stiffness=np.inf)
    assert all(one.blind for one in found.estimates)
    assert np.isnan(found.correlation).all()
    assert "block.E: cannot be told, the curve does not depend on it" in said(found)


@pytest.mark.usefixtures("_begun_at_the_scene")
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_force_that_the_machine_reads_without_a_load_is_told(sign):
    """3 % of the largest force made the yield stress 8 % too large, and nothing said why."""
    curve = measured(ELASTIC, {}, 5, n=60, noise=0.002, soft=0.0)
    zero = 0.03 * curve.largest
    moved = MeasuredCurve(curve.displacement, curve.load + sign * zero)
    scene = archord.load_scene(ELASTIC)
    found = identify(scene, moved, ["joint.clearance"], stiffness=np.inf)
    assert "the curve begins at a force of" in said(found)
    assert "what the machine reads without a load" in said(found)
    for few in (curve, measured(ELASTIC, {}, 5, n=12, noise=0.002, soft=0.0)):
        found = identify(scene, few, ["joint.clearance"], stiffness=np.inf)
        assert "the curve begins at a force" not in said(found)


def test_units_that_are_wrong_by_1000_end_at_a_bound():
    curve = measured(STEEL, {}, 3, n=100, soft=0.0)
    kilo = MeasuredCurve(curve.displacement, curve.load / 1000)
    found = identify(archord.load_scene(STEEL), kilo, ["block.E,pin.E", BOTH], stiffness=np.inf)
    assert "is at a bound of what was allowed" in said(found)
    assert "taken as known in the intervals of the others" in said(found)
    assert "check the units" in said(found)


@pytest.mark.usefixtures("_begun_at_the_scene")
def test_the_error_by_the_law_is_unknown_of_points_beyond_the_law():
    """They counted as if the law had no error there: a clearance that is known to 0.005 mm by
    points up to 3 dR was told to 0.0004 mm with as many points beyond."""
    scene = archord.load_scene(ELASTIC)
    keys = ["joint.clearance"]
    inside = identify(scene, measured(ELASTIC, {}, 7, n=60, soft=0.0), keys, stiffness=np.inf)
    assert 0 < inside.estimates[0].by_law < 0.1 * scene.joint.dR
    with pytest.warns(UserWarning, match="it goes on straight"):
        beyond = measured(ELASTIC, {}, 7, turns=(-0.1, 4.0, 0.6), n=60, soft=0.0)
    found = identify(scene, beyond, keys, stiffness=np.inf)
    assert "points are beyond 3 clearances" in said(found)
    assert np.isnan(found.estimates[0].by_law)
    assert "unknown" in str(estimates_table(found))
    assert json.loads(as_json(found))["estimates"][0]["by_law"] is None


@pytest.mark.usefixtures("_begun_at_the_scene")
def test_an_interval_that_ends_at_what_was_allowed_is_told():
    """With 5 % noise the curve knows the yield stress to 15 MPa. Bounds of 226 and 236 MPa were
    its 95 % interval, as if the curve had told it."""
    curve = measured(STEEL, {}, 6, n=80, noise=0.05, soft=0.0)
    scene = archord.load_scene(STEEL)
    keys = ["joint.clearance", f"{BOTH}=226:236"]
    found = identify(scene, curve, keys, stiffness=np.inf)
    assert not found.estimates[1].is_bound
    assert "yield_stress: its interval ends at 226" in said(found)
    wide = identify(scene, curve, ["joint.clearance", BOTH], stiffness=np.inf)
    assert wide.estimates[1].high - wide.estimates[1].low > 20
    assert "its interval ends at" not in said(wide)


@pytest.mark.parametrize(
    ("free", "words"),
    [
        ("analysis.friction", "is no positive number"),
        ("joint.block_size", "the law does not depend on joint.block_size"),
        ("block.strength", "a scene has no key block.strength"),
        ("joint.clearance,joint.clearance", "frees a key twice"),
        ("joint.clearance,joint.relative_clearance", "say one thing; free one of them"),
        ("joint.clearance=3:1", "the lower one first"),
        ("joint.clearance=few", "must read LOW:HIGH"),
    ],
)
def test_a_key_that_cannot_be_free_is_refused(free, words):
    scene = archord.load_scene(STEEL, {"joint.block_size": 900.0})
    with pytest.raises(InputError, match=words):
        identify(scene, MeasuredCurve(np.arange(30.0), np.arange(30.0)), [free])


@pytest.mark.parametrize(
    ("text", "expected", "words"),
    [
        ("u,F\n" + "".join(f"{k},{2 * k}\n" for k in range(9)), (8, 16), None),
        ("time;u [mm];F (N)\n" + "".join(f"0;{k},5;{k}\n" for k in range(9)), (8.5, 8), None),
        ("sep=;\nu;F\n" + "".join(f"{k},5;{k}\n" for k in range(9)), (8.5, 8), None),
        ("".join(f"{k} {-2 * k}\n" for k in range(9)), (8, 16), "forces are negative"),
        ("".join(f"{-k} {-2 * k}\n" for k in range(9)), (8, 16), "are turned round"),
        ('"u, mm","F, N"\n' + "".join(f'"{k}","{2 * k}"\n' for k in range(9)), (8, 16), None),
        ("u,F\n0,nan\n1,\n" + "".join(f"{k},{2 * k}\n" for k in range(9)), (8, 16), "2 of 11 rows"),
    ],
)
def test_files_of_many_kinds_are_read(tmp_path, text, expected, words):
    path = tmp_path / "curve.csv"
    path.write_text(text)
    names = ("u", "F") if "time" in text else (None, None)
    curve = read_curve(path, *names)
    assert (curve.displacement[-1], curve.load[-1]) == expected
    assert (words or "") in "\n".join(curve.said)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has 0 rows with two numbers"),
        ("u,F\n1,2\n", "has 1 rows with two numbers"),
        ("u\n1\n2\n", "has 0 rows with two numbers"),
        ("u,F\n1,many\n", 'not "many"'),
        ("u,F\n" + 9 * "1,2\n", "are all the same"),
        ("u,F\n" + 9 * "1,2\n" + 9 * "2,3\n", "has 2 rows that differ from the row before"),
    ],
)
def test_files_without_a_curve_are_refused(tmp_path, text, words):
    path = tmp_path / "curve.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_curve(path)
    with pytest.raises(InputError, match="has no column 'force'"):
        read_curve(path, load="force")


def test_a_row_that_repeats_the_row_before_is_counted_once(tmp_path):
    """A logger that is faster than its sensor: every point twice told intervals of a curve of
    twice as many points, 0.7 times as wide."""
    path = tmp_path / "curve.csv"
    rows = [f"{k},{2 * k}\n" for k in range(9)]
    path.write_text("u,F\n" + "".join(2 * row for row in rows))
    curve = read_curve(path)
    np.testing.assert_array_equal(curve.load, 2.0 * np.arange(9))
    assert "9 of 18 rows repeat the row before" in "\n".join(curve.said)
    path.write_text("u,F\n" + "".join(rows) + "".join(rows))
    assert len(read_curve(path).load) == 18


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("u,F\n" + "".join(f"{k},05,{2 * k},5\n" for k in range(9)), "has 4 cells in the line"),
        ("u,F\n" + "".join(f"{k},1,{k}00\n" for k in range(9)), "has 3 cells in the line"),
        ("".join(f"{k},{k}\n" for k in range(9)) + '"9","1,000"\n', 'in the number "1,000"'),
        ('"u, mm","F, N"\n' + 9 * '"1,05","2,5"\n', 'in the number "1,05"'),
        ("A, 20 C, run 3, x\nu,F\n" + 9 * "1,05,2,5\n", "has 4 cells in the line"),
        ("".join(f"{k},25,{2 * k},5\n" for k in range(9)), "has no headings and 4 columns"),
        ("".join(f'"{k},25","{2 * k}"\n' for k in range(9)), 'in the number "0,25"'),
        ("u\tF\n" + "".join(f"0.0{k}\t1,{k}00\n" for k in range(9)), "a comma and numbers with a"),
        ("u;F\n" + "".join(f"0,0{k};1.{k}00\n" for k in range(9)), "a comma and numbers with a"),
    ],
)
def test_a_comma_of_two_meanings_is_refused(tmp_path, text, words):
    """Between columns, before decimals and between thousands: half a number is none."""
    path = tmp_path / "curve.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_curve(path)


def test_a_column_without_a_heading_is_no_displacement(tmp_path):
    """As pandas writes tables with their index: columns are found by their names, and the index is
    not taken for the first one."""
    path = tmp_path / "curve.csv"
    path.write_text(",u,F\n" + "".join(f"{k},{0.1 * k},{2 * k}\n" for k in range(9)))
    curve = read_curve(path, "u", "F")
    assert (curve.displacement[-1], curve.load[-1]) == pytest.approx((0.8, 16))
    with pytest.raises(InputError, match="a column without a heading, as of a table's index"):
        read_curve(path)


def test_units_below_the_headings_are_compared(tmp_path):
    """As test machines write them, with or without brackets."""
    path = tmp_path / "curve.csv"
    rows = "".join(f"0;{k},5;{k}\n" for k in range(9))
    for said in ("(s);(mm);(kN)", "s;mm;kN"):
        path.write_text(f"time;u;F\n{said}\n{rows}")
        (warned,) = read_curve(path, "u", "F", units=("mm", "N")).said
        assert "kN" in warned
        assert "has another unit than the scene, N" in warned
        assert not read_curve(path, "u", "F", units=("mm", "kN")).said


@pytest.mark.parametrize(
    "heads", ["u [mm];F [kN]", "u / mm;F / kN", "u/mm;F/kN", "u in mm;F in kN"]
)
def test_units_in_headings_are_compared(heads, tmp_path):
    """In brackets, and as ISO 80000 and test machines write them."""
    path = tmp_path / "curve.csv"
    path.write_text(f"{heads}\n" + "".join(f"{k},5;{k}\n" for k in range(9)))
    names = ("u", "F") if " " in heads else (None, None)
    (warned,) = read_curve(path, *names, units=("mm", "N")).said
    assert "kN' has another unit than the scene, N" in warned.replace("]", "")
    assert not read_curve(path, *names, units=("mm", "kN")).said
    path.write_text("u;F in pin\n" + "".join(f"{k},5;{k}\n" for k in range(9)))
    assert not read_curve(path, units=("mm", "N")).said


def test_columns_that_were_not_named_are_told_where_there_are_others(tmp_path):
    """The time is no displacement, and the displacement no force."""
    path = tmp_path / "curve.csv"
    path.write_text("time,u,F\n" + "".join(f"{k},{k},{2 * k}\n" for k in range(9)))
    (warned,) = read_curve(path).said
    assert "of 3 columns 'time' is taken for the displacement and 'u' for the force" in warned
    assert not read_curve(path, "u", "F").said


@pytest.mark.parametrize("names", [{"delta": "u"}, {"load": "F"}])
def test_one_column_is_not_displacement_and_force(tmp_path, names):
    """Where one of two columns is named, and the other is taken by its place; nor is one name two
    columns."""
    path = tmp_path / "curve.csv"
    path.write_text("F,u\n" + "".join(f"{k},{2 * k}\n" for k in range(9)))
    with pytest.raises(InputError, match="is taken for displacement and force"):
        read_curve(path, **names)
    path.write_text("u,F,u,F\n" + "".join(f"{k},{2 * k},{k},{k}\n" for k in range(9)))
    with pytest.raises(InputError, match=r"has 2 columns headed '[uF]'"):
        read_curve(path, **names)


@pytest.mark.parametrize(
    ("thickness", "unit"), [({}, "mm/(N/mm)"), ({"analysis.thickness": 30.0}, "mm/N")]
)
def test_the_unit_of_a_compliance_has_brackets_for_a_force_per_length_alone(thickness, unit):
    found = SimpleNamespace(scene=archord.load_scene(STEEL, thickness), estimates=[])
    assert units_of(found)[COMPLIANCE] == unit


def test_units_of_headings_are_compared_with_those_of_the_scene(tmp_path, capsys):
    """A force in kN, and a force of the whole beside a scene without thickness."""
    path = tmp_path / "curve.csv"
    rows = "".join(f"{k},{2 * k}\n" for k in range(9))
    path.write_text(f"u [mm],F (kN)\n{rows}")
    (said,) = read_curve(path, units=("mm", "N")).said
    assert "'F (kN)' has another unit than the scene, N" in said
    path.write_text(f"u [mm],F [N/mm]\n{rows}")
    assert not read_curve(path, units=("mm", "N/mm")).said
    curve = measured(ELASTIC, {}, 5, n=40)
    table = np.column_stack([curve.displacement, curve.load])
    np.savetxt(path, table, delimiter=",", header="delta [m],P [N]", comments="")
    words = ["identify", str(path), "--scene", ELASTIC, "--free", "joint.clearance"]
    assert run([*words, "--no-confirm", "-o", str(tmp_path / "out")]) == 0
    error = " ".join(capsys.readouterr().err.split())
    units = archord.load_scene(ELASTIC).units
    assert f"'delta [m]' has another unit than the scene, {units.length}" in error
    assert f"'P [N]' has another unit than the scene, {units.force_of(None)}" in error


def test_an_offset_is_a_reading_of_the_file(tmp_path):
    """Of a file whose displacements have the other sign, too: the joint is the same."""
    curve = measured(ELASTIC, {"joint.clearance": 0.006}, 5, turns=(-0.1, 1.5), n=100, soft=0.0)
    found = []
    for sign in (1, -1):
        path = tmp_path / "curve.csv"
        table = np.column_stack([sign * curve.displacement, curve.load])
        np.savetxt(path, table, delimiter=",", header="delta,P", comments="")
        out = tmp_path / f"out {sign}"
        words = ["identify", str(path), "--scene", ELASTIC, "--free", "joint.clearance"]
        words += ["--machine-stiffness", "rigid", "--offset", str(sign * OFF), "--no-confirm"]
        assert run([*words, "-o", str(out)]) == 0
        data = json.loads((out / "identified.json").read_text())
        found.append(data["estimates"][0]["value"])
        assert data["fixed"][OFFSET] == sign * OFF
        assert data["displacement"] == table[:, 0].tolist()
    assert found[1] == found[0] == pytest.approx(0.006, rel=0.03)


def test_an_offset_that_is_found_is_a_reading_of_the_file():
    """So that it can be given: all else is as of displacements of the other sign."""
    curve = measured(ELASTIC, {"joint.clearance": 0.006}, 5, turns=(-0.1, 1.5), n=100, soft=0.0)
    scene = archord.load_scene(ELASTIC)
    found = identify(scene, curve, ["joint.clearance"], stiffness=np.inf)
    turned = replace(found, model=replace(found.model, curve=replace(curve, turned=True)))
    plain, told = (json.loads(as_json(one)) for one in (found, turned))
    own, other = (data["estimates"][1] for data in (plain, told))
    assert own["name"] == OFFSET
    assert other["value"] == -own["value"] == pytest.approx(-OFF, abs=1e-3)
    assert (other["low"], other["high"]) == (-own["high"], -own["low"])
    assert told["estimates"][0] == plain["estimates"][0]
    assert told["correlation"][0][1] == -plain["correlation"][0][1]
    assert f"{-own['value']:.5g}" in str(estimates_table(turned))
    assert told["delta"] == plain["delta"]


def test_the_command_writes_scene_numbers_and_picture(tmp_path, capsys, monkeypatch):
    curve = measured(ELASTIC, {"joint.clearance": 0.006}, 5, turns=(-0.1, 1.5), n=100, soft=0.0)
    path = tmp_path / "curve.csv"
    table = np.column_stack([curve.displacement, curve.load])
    np.savetxt(path, table, delimiter=",", header="delta,P", comments="")
    words = ["identify", str(path), "--scene", ELASTIC, "--free", "joint.clearance"]
    words += ["--machine-stiffness", "rigid", "--no-confirm", "-o", str(tmp_path / "out")]
    assert run(words) == 0
    out = capsys.readouterr().out
    assert "joint.clearance" in out
    data = json.loads((tmp_path / "out" / "identified.json").read_text())
    scene = archord.load_scene(tmp_path / "out" / "identified.toml")
    assert scene.joint.dR == pytest.approx(data["estimates"][0]["value"], rel=1e-8)
    assert scene.joint.dR == pytest.approx(0.006, rel=0.03)
    assert data["estimates"][1]["name"] == OFFSET
    assert data["fixed"] == {COMPLIANCE: 0.0}
    assert (tmp_path / "out" / "identified.png").read_bytes()[1:4] == b"PNG"
    monkeypatch.setattr(identification, "identify", lambda *given: pytest.fail("it was fitted"))
    assert run(words) == 2
    assert "is there already" in capsys.readouterr().err
    assert run([*words, "--force", "--offset", "deep"]) == 2
    assert "--offset deep: must be a number, or free" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (["--offset", "nan"], "--offset nan: must be a number, or free"),
        (["--machine-stiffness", "inf"], "must be a number, or free"),
        (["--machine-stiffness", "0"], "must be positive, or rigid"),
        (["-o", "/dev/null/x"], "/dev/null/x: cannot hold results"),
    ],
)
def test_odd_options_are_refused(tmp_path, refused, option, words, monkeypatch):
    """Before the fit, which takes seconds."""
    monkeypatch.setattr(identification, "identify", lambda *given: pytest.fail("it was fitted"))
    path = tmp_path / "curve.csv"
    path.write_text("u,F\n" + "".join(f"{k / 200},{50 * k}\n" for k in range(20)))
    given = ["identify", str(path), "--scene", str(STEEL), "--free", "joint.clearance"]
    folder = ["-o", str(tmp_path / "found"), "--no-confirm"]
    assert words in refused([*given, *folder, *option])
