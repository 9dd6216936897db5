"""The commands ``archord laws`` and ``archord law``: tables, pictures, sentences."""

from pathlib import Path

import numpy as np
import pytest

from archord.cli import run
from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.laws import LAWS
from archord.scene.file import load_scene

SCENE = str(Path(__file__).parents[1] / "scenes" / "steel_pin.toml")
JOINT = ["--radius", "10", "--clearance", "0.05", "--E-star", "115385"]


def table(text: str) -> dict[str, np.ndarray]:
    """Columns of the table below the title."""
    rows = [line.split() for line in text.splitlines()[2:] if line.strip()]
    heads = text.splitlines()[1].replace("P/(E* R)", "P/E*R").replace("P/(E* dR)", "P/E*dR").split()
    return dict(zip(heads, np.array(rows, float).T, strict=True))


def test_laws_lists_every_law(capsys):
    assert run(["laws"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if line[0] != " "] == [
        f"{law.name}: {law.title}" for law in LAWS.values()
    ]


def test_law_prints_its_numbers(capsys):
    numbers = ["--yield-stress", "230", "--c", "1.5", "--points", "4", "--to", "1"]
    assert run(["law", "paper-plastic", *JOINT, *numbers]) == 0
    columns = table(capsys.readouterr().out)
    state = LAWS["paper-plastic"].at_displacement(
        LawJoint(10, 0.05, 115385, block_yield=230, c=1.5), columns["delta"]
    )
    assert columns["delta/dR"] == pytest.approx([0.25, 0.5, 0.75, 1])
    assert columns["P"] == pytest.approx(state.load, rel=1e-5)
    assert columns["P/E*R"] == pytest.approx(columns["P"] / 1153850, rel=1e-5)
    assert columns["dP/ddelta"] == pytest.approx(state.stiffness, rel=1e-5)
    assert columns["p0"].max() == 345


def test_law_of_a_scene_has_its_units_and_options_come_first(capsys):
    assert run(["law", "paper", "--scene", SCENE, "--points", "1"]) == 0
    first = capsys.readouterr().out
    assert first.split("\n")[1].startswith("delta [mm]  delta/dR  P [N/mm]")
    assert run(["law", "paper", "--scene", SCENE, "--points", "1", "--clearance", "0.1"]) == 0
    assert capsys.readouterr().out != first


def test_forces_of_a_thick_joint_are_those_of_its_runs(capsys):
    """In N and N/mm, times the thickness; what has no units is as it was."""
    law = ["law", "paper", "--scene", SCENE, "--points", "2"]
    assert run(law) == run([*law, "--set", "analysis.thickness=10"]) == 0
    thin, thick = (text.split("\n") for text in capsys.readouterr().out.split("paper: ")[1:])
    assert "P [N] " in thick[1]
    assert "dP/ddelta [N/mm]" in thick[1]
    ratios = np.array(thick[3].split(), float) / np.array(thin[3].split(), float)
    assert ratios == pytest.approx([1, 1, 10, 1, 1, 10, 1, 1])


def test_laws_without_displacement_are_tabulated_over_the_load(capsys):
    assert run(["law", "persson", "winkler", *JOINT, "--points", "2", "--to", "1"]) == 0
    persson, winkler = capsys.readouterr().out.split("\n\n")
    assert table(persson)["P/E*dR"] == pytest.approx([0.5, 1])
    assert table(winkler)["P/E*dR"] == pytest.approx([0.5, 1])
    assert table(persson)["eps/deg"] == pytest.approx([39.6376, 50.4236], rel=1e-5)


def test_outside_the_range_rows_are_nan_and_one_warning(capsys):
    assert run(["law", "johnson", *JOINT, "--points", "4", "--to", "2"]) == 0
    result = capsys.readouterr()
    assert np.isnan(table(result.out)["P"][1:]).all()
    assert "johnson: delta = 1 to 2 dR is outside 0 to 0.5413 dR" in result.err


@pytest.mark.parametrize("more", [[], ["--deepest", "2"], ["--by-load"]])
def test_no_error_is_told_of_a_joint_outside_the_range(more, capsys):
    """Its law is an extrapolation, whose error nobody knows."""
    words = ["law", *JOINT, "--plane", "strain", "--nu", "0.3", "--points", "2", "--to", "1", *more]
    assert run([*words, "--yield-stress", "230"]) == 0
    assert "+-P" in capsys.readouterr().out
    assert run([*words, "--yield-stress", "60", "--extrapolate"]) == 0
    said = capsys.readouterr()
    assert "+-P" not in said.out
    assert "sigY R/(E* dR) = 0.104 is outside" in said.err


def test_a_ring_has_no_law_with_displacements(tmp_path, capsys, refused):
    """One sentence that says how wrong it would be; p0 and eps of a load are a ring's as well."""
    ring = str(Path(SCENE).with_name("persson.toml"))
    for words in (
        [],
        ["paper", "persson"],
        ["johnson", "--by-load"],
        ["paper", "--plot", str(tmp_path / "x.png")],
    ):
        said = refused(["law", *words, "--scene", ring])
        assert 'of joint.model = "ring" its P would be about twice too high' in said
    assert run(["law", "persson", "hertz", "--scene", ring, "--to", "0.1"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("width", "share"), [("25", "22.4%"), ("100", "1.4%"), ("300", "0.2%"), ("1000", None)]
)
def test_a_small_block_is_told_with_the_size_of_its_effect(capsys, width, share):
    """Once, and the numbers stay those of the law."""
    words = ["law", "paper", "--scene", SCENE, "--points", "3"]
    assert run(words) == 0
    wide, before = capsys.readouterr()
    words += ["--set", f"joint.block_size={width}"]
    assert run(words) == 0
    out, err = capsys.readouterr()
    assert out == wide
    assert len(err.splitlines()) == len(before.splitlines()) + (share is not None)
    assert share is None or f"its P about {share} smaller than the law's" in err


@pytest.mark.parametrize(
    "sets",
    [
        "hardening=1000.0",
        "hardening=[[0, 230.76923076923077], [1, 400.0]]",
        "back_stresses=[[20000.0, 100.0]]",
    ],
)
def test_hardening_is_told_by_the_laws_that_yield(capsys, sets):
    """Once each; the numbers stay those of perfect plasticity."""
    words = ["law", "paper", "paper-plastic", "--scene", SCENE, "--points", "3"]
    outs = []
    for more in ([], ["--set", f"block.{sets}"]):
        assert run([*words, *more]) == 0
        outs.append(capsys.readouterr())
    assert outs[0].out == outs[1].out
    before, after = (captured.err.splitlines() for captured in outs)
    assert all("knows no yielding" in line for line in before)
    told = [line.split(":")[2:] for line in after if line not in before]
    assert len(after) == len(before) + 1
    assert [name for name, _ in told] == [" paper-plastic"]
    assert all(
        "is a law of perfect plasticity" in said and "too low beyond yield" in said
        for _, said in told
    )


def test_elastic_laws_beyond_yield_are_told(capsys):
    """With how far beyond; those that know yielding are silent."""
    assert (
        run(
            [
                "law",
                "paper",
                "paper-plastic",
                "archord",
                "--scene",
                SCENE,
                "--points",
                "3",
                "--to",
                "2",
            ]
        )
        == 0
    )
    (line,) = capsys.readouterr().err.splitlines()
    assert ": paper: knows no yielding, and its p0 reaches 4.25 times the yield stress" in line


def test_a_whole_pin_is_told_by_the_laws_that_give_a_displacement(capsys):
    """Their numbers are those of half a pin. The thickness is the length of the laws that need
    one."""
    laws = ["paper", "persson", "esdu-78035", "lankarani-nikravesh"]
    words = ["law", *laws, "--scene", SCENE, "--points", "3", "--to", "0.1"]
    assert run([*words, "--set", "pin.whole=true", "--set", "analysis.thickness=40"]) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "half a pin" in line]
    assert [line.split(":")[2] for line in told] == [
        " paper",
        " esdu-78035",
        " lankarani-nikravesh",
    ]
    assert all("of a whole one P is higher" in line for line in told)


def test_a_law_is_not_drawn_over_its_scene(tmp_path, capsys):
    """Whatever its name; over another picture it is."""
    scene, picture = (tmp_path / name for name in ("scene.svg", "old.png"))
    text = Path(SCENE).read_text()
    scene.write_text(text)
    picture.touch()
    assert run(["law", "paper", "--scene", str(scene), "--plot", str(scene)]) == 2
    assert f"{scene}: cannot be written: it is an input of the command." in capsys.readouterr().err
    assert scene.read_text() == text
    assert run(["law", "paper", "--scene", str(scene), "--plot", str(picture)]) == 0
    assert picture.read_bytes()[1:4] == b"PNG"
    assert (
        run(["law", "paper", "johnson", "persson", *JOINT, "--plot", str(tmp_path / "laws.svg")])
        == 0
    )
    assert capsys.readouterr().out == f"{picture}\n{tmp_path / 'laws.svg'}\n"
    assert (tmp_path / "laws.svg").read_text().count("<svg") == 1


def test_where_no_law_is_named_it_is_the_paper_s(capsys):
    """Elastic, or with the plateau where the joint yields."""
    for numbers, law in ([], "paper"), (["--yield-stress", "230.77"], "paper-plastic"):
        assert run(["law", *JOINT, *numbers, "--points", "2"]) == 0
        said = capsys.readouterr().out
        assert run(["law", law, *JOINT, *numbers, "--points", "2"]) == 0
        assert capsys.readouterr().out == said


def test_a_yield_stress_is_that_of_the_bodies_that_yield(capsys):
    """Of both, of the block alone, of a rigid pin's block; as in the scene."""
    words = ["law", "paper-plastic", "--points", "2", "--scene"]
    rigid = str(Path(SCENE).with_name("rigid_pin.toml"))
    for scene, keys in (SCENE, ("pin", "block")), (rigid, ("block",)):
        assert run([*words, scene, "--yield-stress", "400"]) == 0
        said = capsys.readouterr().out
        assert (
            run(
                [
                    *words,
                    scene,
                    *(word for key in keys for word in ("--set", f"{key}.yield_stress=400")),
                ]
            )
            == 0
        )
        assert capsys.readouterr().out == said


def test_a_law_with_nothing_to_say_is_one_sentence(tmp_path, capsys, refused):
    """No row of nan; beside other laws a warning in its place, also in a picture."""
    far = [*JOINT, "--points", "1"]
    said = "johnson: delta = 2 dR is outside 0 to 0.5413 dR (range: up to its load limit"
    assert refused(["law", "johnson", *far]).startswith(said)
    assert run(["law", "johnson", "paper", *far]) == 0
    out, err = capsys.readouterr()
    assert "nan" not in out
    assert "johnson" not in out
    assert err.startswith(f"archord: warning: {said}")
    wide = [
        "law",
        "paper",
        "winkler",
        *JOINT,
        "--clearance",
        "2",
        "--plot",
        str(tmp_path / "laws.png"),
    ]
    assert "paper: dR/R = 0.2 is no small clearance" in refused(wide)
    assert not (tmp_path / "laws.png").exists()


@pytest.mark.parametrize(("columns", "width"), [("60", 60), ("200", 110), ("5", 40)])
def test_laws_fit_the_terminal(monkeypatch, capsys, columns, width):
    """Lines as wide as it is, between what can be read."""
    monkeypatch.setenv("COLUMNS", columns)
    assert run(["laws"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert width - 10 < max(map(len, lines)) <= width


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            [
                "--set",
                "joint.model=ring",
                "--set",
                "load.displacement=none",
                "--set",
                "load.relative_force=0.001",
                "--export",
                "joint.py",
            ],
            "ring",
        ),
        (
            ["--set", "joint.relative_clearance=0.1", "--export", "joint.py"],
            "dR/R = 0.1 is outside",
        ),
        (["--deepest", "5"], "must be from 0 to 3 clearances"),
        (["--deepest", "1", "--by-load"], "does not go with --by-load"),
        (["--deepest", "1", "--export", "joint.py"], "does not go with --deepest"),
        (["paper", "--deepest", "1"], "is for the law archord alone"),
    ],
)
def test_what_the_law_of_solved_joints_cannot_say_is_refused(
    options, said, tmp_path, monkeypatch, capsys
):
    """Exit code 2, one sentence, and no file."""
    monkeypatch.chdir(tmp_path)
    assert run(["law", *options, "--scene", SCENE]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("options", [[], ["--export", "joint.py"]])
@pytest.mark.parametrize(
    ("change", "key", "said"),
    [
        ("joint.relative_clearance=0.1", "joint.clearance", "dR/R = 0.1 is outside 0.001 to 0.02"),
        ("pin.nu=-0.3", "pin.nu", "nu of the pin = -0.3 is outside 0 to 0.49"),
        ("pin.E=1e3", "pin.E, block.E", "E(pin)/E(block) = "),
        ("analysis.friction=1.5", "analysis.friction", "friction = 1.5 is outside"),
        ("block.yield_stress=30", "pin.yield_stress, block.yield_stress", "sigY R/(E* dR) = "),
        (
            "pin.yield_stress=100 pin.hardening=2e5",
            "pin.hardening, block.hardening",
            "a body hardens by 3 dR",
        ),
    ],
)
def test_what_a_law_refuses_of_a_scene_names_file_and_key(
    options, change, key, said, tmp_path, monkeypatch, refused
):
    monkeypatch.chdir(tmp_path)
    changes = [part for setting in change.split() for part in ("--set", setting)]
    told = refused(["law", "archord", "--scene", SCENE, *changes, *options])
    assert told.startswith(f"{SCENE}: {key}: archord: {said}")


def test_an_export_of_a_small_block_warns(tmp_path, capsys):
    """The law is of a wide block: the export is written, and the size of the error said."""
    target = tmp_path / "joint.py"
    assert (
        run(["law", "--scene", SCENE, "--set", "joint.block_size=100", "--export", str(target)])
        == 0
    )
    assert "the joint is softer" in capsys.readouterr().err
    assert target.exists()


ELASTIC = str(Path(SCENE).with_name("elastic_pin.toml"))


@pytest.mark.parametrize(
    ("options", "sets"),
    [
        (["--plane", "stress"], ["analysis.plane=stress"]),
        (["--nu", "0.1"], ["pin.nu=0.1", "block.nu=0.1"]),
        (["--radius", "2", "--nu", "0"], ["joint.radius=2", "pin.nu=0", "block.nu=0"]),
        (["--clearance", "0.01"], ["joint.clearance=0.01"]),
        (["--yield-stress", "0.004"], ["pin.yield_stress=0.004", "block.yield_stress=0.004"]),
        (["--length", "25"], ["analysis.thickness=25"]),
    ],
)
def test_options_beside_a_scene_change_the_scene(options, sets, tmp_path, capsys):
    """As --set does: E* follows from them, in tables and in exports."""
    outs = []
    for k, words in enumerate((options, [word for key in sets for word in ("--set", key)])):
        export = tmp_path / f"joint{k}.json"
        assert run(["law", "--scene", ELASTIC, "--points", "3", *words]) == 0
        table = capsys.readouterr().out
        assert run(["law", "--scene", ELASTIC, "--export", str(export), *words]) == 0
        capsys.readouterr()
        outs.append((table, export.read_text()))
    assert outs[0] == outs[1]
    assert run(["law", "--scene", ELASTIC, "--points", "3"]) == 0
    assert capsys.readouterr().out != outs[0][0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([], "at 2 dR by about 5.7%: large strain has that"),
        (["block.hardening=2000"], "at 2 dR by about 1.0%: large strain has that"),
        (['analysis.strain="large"'], ""),
        (["pin.yield_stress=300"], ""),
        (['analysis.plane="strain"'], ""),
        (["block.yield_stress=1e4"], ""),
    ],
)
def test_a_block_that_thickens_is_told(changes, said, capsys):
    """Where it yields in plane stress, its pin does not, and the law is of small strain."""
    thin = ['analysis.plane="stress"', "pin.yield_stress=900", "block.yield_stress=300", *changes]
    sets = [word for change in thin for word in ("--set", change)]
    steel_pin = str(Path(SCENE).with_name("steel_pin.toml"))
    assert run(["law", "archord", "--scene", steel_pin, "--points", "1", *sets]) == 0
    warned = capsys.readouterr().err
    assert said in warned
    assert ("thickens" in warned) == bool(said)


def test_fixed_pairs_of_points_are_told(capsys):
    """By the law of solved joints alone: their pairs follow the deformed curves."""
    words = ["law", "archord", "paper", "--scene", ELASTIC, "--points", "1"]
    assert run(words) == 0
    assert "kinematics" not in capsys.readouterr().err
    assert run([*words, "--set", "analysis.kinematics=reference"]) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "kinematics" in line]
    assert len(told) == 1
    assert told[0].startswith(
        "archord: warning: archord: is a law of closest points on the deformed curves; with"
    )


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_p0_with_friction_is_told_to_be_rough(friction, capsys):
    """The expected error is of P. p0 was printed to six digits beside it, and is off by up to
    19 %."""
    change = f"analysis.friction={friction}"
    assert run(["law", "archord", "--scene", SCENE, "--points", "1", "--set", change]) == 0
    said = "p0 of a joint with friction is off by some 3 %, and by 19 % at worst"
    assert (said in capsys.readouterr().err) == bool(friction)
    joint = LawJoint.from_scene(load_scene(SCENE, [change]))
    assert (said in general_law(joint).about["expected error"]) == bool(friction)


def test_a_rigid_pin_keeps_its_nu(capsys):
    rigid = str(Path(SCENE).with_name("rigid_pin.toml"))
    assert run(["law", "paper", "--scene", rigid, "--points", "1", "--nu", "0.1"]) == 0
    said = capsys.readouterr().out
    assert run(["law", "paper", "--scene", rigid, "--points", "1", "--set", "block.nu=0.1"]) == 0
    assert capsys.readouterr().out == said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--scene", ELASTIC, "--E-star", "2"], "--E-star 2: does not go with --scene"),
        (
            ["--scene", ELASTIC, "--nu", "0.2", "--set", "pin.nu=0.3"],
            "--nu 0.2: does not go with --set pin.nu=0.3",
        ),
        (
            ["--scene", ELASTIC, "--clearance", "1", "--set", "joint.relative_clearance=0.1"],
            "does not go with",
        ),
        (
            ["--scene", ELASTIC, "--radius", "-1"],
            "--radius -1.0: joint.radius must be greater than 0",
        ),
        (["--scene", ELASTIC, "--k", "0.9"], "--k 0.9: is for paper, paper-plastic, winkler alone"),
        (
            ["paper", *JOINT, "--c", "2"],
            "--c 2: is for paper-plastic alone; paper has no such coefficient",
        ),
        (["--scene", ELASTIC, "--export", "x.h", "--to", "3"], "--export: does not go with --to"),
        (
            ["--scene", ELASTIC, "--export", "x.h", "--extrapolate"],
            "--export: does not go with --extrapolate",
        ),
        (
            ["--scene", ELASTIC, "--plot", "x.png", "--points", "3"],
            "--plot: does not go with --points",
        ),
        (["--scene", ELASTIC, "--force"], "--force: overwrites exports, and there is no --export"),
        (
            ["--scene", ELASTIC, "--export", "x.json", "--mu-static", "0.1"],
            "--mu-static: is of an export's element, and a .json file has none",
        ),
        (
            ["lankarani-nikravesh", "--scene", ELASTIC],
            "lankarani-nikravesh: this law needs length. Give --length",
        ),
        ([*JOINT, "--nu", "0.3"], "--nu: says nothing without --plane"),
        (
            [*JOINT, "--nu", "0.3", "--plane", "strain", "--length", "25", "--export", "x.h"],
            "--length 25: is for dubowsky-freudenstein, lankarani-nikravesh alone, or beside "
            "--scene; forces of archord are per unit length.",
        ),
        (["paper", *JOINT, "--length", "25"], "forces of paper are per unit length"),
    ],
)
def test_options_that_contradict_each_other_are_refused(
    words, said, tmp_path, monkeypatch, refused
):
    """None comes silently before another."""
    monkeypatch.chdir(tmp_path)
    assert said in refused(["law", *words])
    assert not list(tmp_path.iterdir())


def test_all_that_is_missing_is_asked_for_at_once(refused):
    """In one sentence, for all laws that are named, or for the one that an export needs."""
    every = "--radius, --clearance, --E-star"
    scene = "or the --scene of a joint.\n"
    for words, said in (
        ([], f"{every}: missing; give all, {scene}"),
        (
            ["paper-plastic", "dubowsky-freudenstein"],
            f"{every}, --yield-stress, --length: missing; paper-plastic needs --yield-stress; "
            f"dubowsky-freudenstein needs --length; give all, {scene}",
        ),
        (
            ["--export", "x.h"],
            f"{every}, --plane, --nu: missing; archord needs --plane and --nu; give all, {scene}",
        ),
        (["archord", *JOINT], f"archord: this law needs plane and nu. Give --plane, --nu, {scene}"),
    ):
        assert refused(["law", *words]) == said
