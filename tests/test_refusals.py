"""What commands refuse: one sentence, exit code 2, nothing written, and runs that stay as they
are."""

import shutil
from pathlib import Path

import pytest

from archord.postprocess.run import _NEEDED, Run
from archord.report.errors import InputError
from tests.output.run_files import rewrite_report
from tests.test_cli import SCENE, archord, run_on_two_ranks

JOINT = ["--radius", "10", "--clearance", "0.05", "--E-star", "115385"]
SCENES = Path(SCENE).parent
RUN = "{coarse}"
OTHER = "{elastic}"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["picture", "empty"], "empty: is not a run folder: scene.toml is missing."),
        (
            ["picture", RUN, "-o", "nowhere/x.png"],
            "nowhere/x.png: cannot be written: nowhere is not a folder.",
        ),
        (["picture", RUN, "-o", "picture.xyz"], "picture.xyz: must end in one of "),
        (
            ["picture", RUN, "-o", f"{RUN}/history.csv"],
            f"{RUN}/history.csv: cannot be written: it belongs to ",
        ),
        (
            ["report", RUN, "-o", "x.docx"],
            "x.docx: must end in .pdf, as a report is a PDF file.",
        ),
        (["compare", RUN], "compare: needs two runs or more."),
        (["export", RUN], "export: give --vtk DIR, --csv DIR or both."),
        (
            ["export", RUN, "--vtk", "new", "--step", "7"],
            f"{RUN}: has no step 7; its accepted steps are 1 to 6.",
        ),
        (
            ["export", RUN, "--csv", RUN, "--force"],
            f"{RUN}/history.csv: cannot be written: it belongs to the run",
        ),
        (
            ["export", RUN, "--csv", f"{RUN}/run.json"],
            f"{RUN}/run.json: cannot be used for results: File exists.",
        ),
        (
            ["fit", RUN, "--json", f"{RUN}/history.csv"],
            f"{RUN}/history.csv: cannot be written: it belongs to ",
        ),
        (
            ["fit", RUN, "--json", "x.json", "--export", "./x.json"],
            "x.json: is named for two files; choose different ones.",
        ),
        (
            ["fit", RUN, "--json", "/dev/full"],
            "/dev/full: cannot be written: No space left on device.",
        ),
        (
            ["reproduce", "fig2", "-o", f"{RUN}/history.csv"],
            f"{RUN}/history.csv: cannot be used for results: File",
        ),
        (["export-deck", SCENE, "-o", RUN], f"{RUN}: cannot be written: it is a folder."),
        (["mesh", "nowhere.msh"], "nowhere.msh: No such file or directory."),
        (
            ["solve", f"{SCENES}/ball.toml", "--set", "mesh.file=nowhere.msh"],
            "--set mesh.file=nowhere.msh: mesh.file = ",
        ),
        (
            ["mesh", "empty"],
            "empty: is none of the files of meshes that are read: .msh, .inp, .xdmf, .npz, .step, "
            ".stp, .brep.",
        ),
        (
            ["mesh", "x.msh", "--set", "mesh.scal=2"],
            "--set mesh.scal=2: mesh.scal is not a known key; did you mean ",
        ),
        (
            ["solve", SCENE, "--set", "analysis.accuracy=0.02", "--set", "joint.growth=0.5"],
            "--set joint.growth=0.5: joint.growth must not be given together with "
            "analysis.accuracy, which chooses it.",
        ),
        (
            ["solve", RUN],
            f"{RUN}: is a run; --restart or --extend continues it, and its scene is "
            f"{RUN}/scene.toml.",
        ),
        (["solve", "empty"], "empty: is no scene but a folder, and no run is in it."),
        (
            ["solve", SCENE, "--set", "load.force=1", "--set", "load.displacement=1"],
            "--set load.displacement=1: does not go with load.force=1; give one of them.",
        ),
        (
            ["solve", SCENE, "--set", "pin.E="],
            "--set 'pin.E=': must have a value; none drops the key.",
        ),
        (["law", "jonson", *JOINT], "jonson: is not a known law; did you mean johnson?"),
        (["law", "johnson", "--radius", "1"], "--clearance, --E-star: missing"),
        (
            ["law", "johnson", *JOINT, "--clearance", "-1"],
            "clearance = -1 must be a positive number.",
        ),
        (["law", "paper-plastic", *JOINT], "paper-plastic: this law needs yield_stress."),
        (["law", "paper", *JOINT, "--to", "-2"], "--to -2: must be a positive number."),
        (["law", "paper", *JOINT, "--points", "0"], "--points 0: must be between 1 and 100000."),
        (["law", "paper", *JOINT, "--set", "joint.radius=1"], "--set: changes a scene"),
        (["law", "paper", "--scene", "nowhere.toml"], "nowhere.toml: cannot be read"),
        (["law", "paper", *JOINT, "--plot", "laws.xyz"], "laws.xyz: must end in one of "),
        (
            ["law", "--scene", SCENE, "--export", "law.cpp"],
            "law.cpp: must end in .py, .h, .mo, .mjs, .m, .fmu or .json.",
        ),
    ],
)
def test_bad_input_is_one_sentence(runs, tmp_path, monkeypatch, refused, arguments, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    before = {path: path.stat().st_mtime_ns for path in runs["coarse"].rglob("*")}
    assert refused([argument.format(**runs) for argument in arguments]).startswith(
        said.format(**runs)
    )
    assert {path: path.stat().st_mtime_ns for path in runs["coarse"].rglob("*")} == before
    assert [path.name for path in tmp_path.rglob("*")] == ["empty"]


RADIUS = "bad.toml: joint.radius = -10.0 must be greater than 0."
REFUSED_BY_ALL_RANKS = [
    (["solve", "bad.toml"], RADIUS),
    (["solve", "--bogus", "nowhere.toml"], "No such option: --bogus"),
    (["reproduce", "fig6"], "fig6: is not a figure of the paper"),
    (["sweep", "bad.sweep.toml"], "pin.E = -1.0 must be greater than 0."),
]
REFUSED_BY_ONE_RANK = [
    (["scene", "--bogus"], "No such option: --bogus"),
    (["fit", "nowhere"], "nowhere: is not a run folder"),
]


@pytest.fixture
def bad_files(tmp_path):
    """A folder with a scene and a sweep that are refused, in which nothing else may be written."""
    scene = Path(SCENE).read_text()
    (tmp_path / "bad.toml").write_text(scene.replace("radius = 10.0", "radius = -10.0"))
    (tmp_path / "bad.sweep.toml").write_text(f'base = "{SCENE}"\n[grid]\npin.E = [-1.0]\n')
    yield tmp_path
    assert {path.name for path in tmp_path.iterdir()} == {"bad.toml", "bad.sweep.toml"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["solve", "bad.toml"], RADIUS),
        (["slove", "--help"], "No such command 'slove'. Did you mean solve?"),
        (["benchmark", "stabilty"], "No such command 'stabilty'. Did you mean stability?"),
    ],
)
def test_a_process_tells_bad_input_once(bad_files, arguments, said):
    result = archord(*arguments, cwd=bad_files, code=2)
    assert result.stderr.count(said) == 1


def test_a_launcher_tells_bad_input_once(bad_files):
    """Its exit code is 2."""
    result = archord("solve", "bad.toml", cwd=bad_files, ranks=2, code=2)
    assert result.stderr.count(RADIUS) == 1


@pytest.mark.parametrize("refused_commands", [REFUSED_BY_ALL_RANKS, REFUSED_BY_ONE_RANK])
def test_ranks_tell_bad_input_once(bad_files, refused_commands):
    """Several commands under one launcher."""
    result = run_on_two_ranks([arguments for arguments, _ in refused_commands], bad_files)
    assert result.returncode == 2
    assert all(result.stderr.count(said) == 1 for _, said in refused_commands)
    assert "Traceback" not in result.stderr


FIELDS = "run/fields.h5: cannot be read as the fields of a run at step 6."
CONTACT = "run/contact.h5: cannot be read as the contact of a run at step"
HISTORY = "run/history.csv: cannot be read as the history of a run."
REPORT = "run/run.json: cannot be read as the report of a run."


@pytest.mark.parametrize("command", ["show", "picture"])
@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("fields.h5", 1000, FIELDS),
        ("fields/0006.h5", None, FIELDS),
        ("fields.h5", 0, FIELDS),
        ("fields.h5", None, "run: is not a complete run folder: fields.h5 is missing."),
        ("contact.h5", 3000, CONTACT),
        ("contact.h5", None, "run: is not a complete run folder: contact.h5 is missing."),
        ("run.json", 100, REPORT),
        ("run.json", None, "run: is not a run folder: run.json is missing."),
        ("history.csv", 0, HISTORY),
        ("history.csv", 30, HISTORY),
        ("history.csv", "step,delta\n1", HISTORY),
        ("history.csv", f"{','.join(_NEEDED)}\n{','.join(['nan'] * len(_NEEDED))}\n", HISTORY),
        ("scene.toml", 25, "run/scene.toml: is not valid TOML: "),
    ],
)
def test_a_broken_run_is_one_sentence(
    runs, tmp_path, monkeypatch, refused, command, name, content, said
):
    """A file cut short (to so many bytes), missing or with another text: no table, no picture."""
    monkeypatch.chdir(tmp_path)
    file = shutil.copytree(runs["coarse"], tmp_path / "run") / name
    rewrite_report(
        tmp_path / "run", files={}
    )  # of what was sealed less is read before it is refused
    whole = file.read_bytes()
    file.unlink()
    if content is not None:
        file.write_bytes(content.encode() if isinstance(content, str) else whole[:content])
    assert refused([command, "run"]).startswith(said)
    assert not list((tmp_path / "run").glob("*.png"))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("status", 1),
        ("warnings", "none"),
        ("warnings", [1]),
        ("totals", {"cutbacks": "none"}),
        ("seconds", [1.0]),
        ("versions", {"archord": None}),
        ("steps", {}),
        ("mesh", []),
        ("peak_memory", ["much"]),
        ("error_estimates", {"force_balance": []}),
    ],
)
def test_a_report_of_other_types_is_one_sentence(runs, tmp_path, key, value):
    """It names the key, wherever in it the fault is."""
    path = shutil.copytree(runs["coarse"], tmp_path / "run") / "run.json"
    rewrite_report(path.parent, **{key: value})
    with pytest.raises(
        InputError, match=rf"run\.json: cannot be read as the report of a run: {key}.*\.$"
    ):
        Run(path.parent)
