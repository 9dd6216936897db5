"""``archord fit`` as a user runs it."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from archord.cli import run
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.run import Run
from tests.output.run_files import rewrite_report
from tests.postprocess.synthetic import curve


def test_fit_prints_a_table_and_writes_what_is_asked_for(runs, tmp_path, capsys):
    """The numbers of table and JSON agree; the module gives the run's forces; the picture is a
    picture."""
    files = {name: tmp_path / f"law.{name}" for name in ("json", "py", "png")}
    arguments = ["--json", files["json"], "--python", files["py"], "--picture", files["png"]]
    assert run(["fit", *map(str, [runs["plastic"], *arguments])]) == 0
    printed = capsys.readouterr().out
    data = json.loads(files["json"].read_text())
    law = FittedLaw.from_json(files["json"].read_text())
    assert [(row["of"], row["value"], row["steps"]) for row in data["fits"]] == [
        ("k", law.k, 8),
        ("c", law.c, 8),
    ]
    assert f"law: k = {law.k:.5f}, c = {law.c:.5f}, from P(delta)" in printed
    assert "discretisation error is unknown" in printed
    assert files["png"].read_bytes()[1:4] == b"PNG"
    history = Run(runs["plastic"]).curve
    values: dict = {}
    exec(files["py"].read_text(), values)
    forces = [values["force"](d)[0] for d in history.delta]
    assert forces[-1] == pytest.approx(history.P[-1], rel=0.05)
    np.testing.assert_allclose(forces, law.force(history.delta), rtol=1e-14)


@pytest.mark.parametrize("name", ["elastic", "plastic"])
def test_a_law_that_misses_its_runs_is_told(runs, tmp_path, name, capsys):
    """From 5 % rms on, and in the exported law; the table has the same numbers."""
    assert run(["fit", str(runs[name]), "--json", str(tmp_path / "law.json")]) == 0
    data = json.loads((tmp_path / "law.json").read_text())
    law = FittedLaw.model_validate(data["law"])
    row = data["fits"][0]
    assert (law.rms, law.largest) == (row["rms"], row["largest"])
    said = (
        f"archord: warning: the law misses P of its own runs by {law.rms:.1%} rms, "
        f"{law.largest:+.1%} at worst"
    )
    assert capsys.readouterr().err.startswith(said if law.rms > 0.05 else "")


def test_files_of_others_and_of_runs_stay(runs, tmp_path, capsys):
    """A file that is there needs --force, and no force touches what a run is made of."""
    law, module = files = [tmp_path / name for name in ("law.json", "law.py")]
    words = ["fit", str(runs["elastic"]), "--json", str(law), "--python", str(module)]
    for file in files:
        file.write_text("mine\n", encoding="utf-8")
        assert run(words) == 2
        said = f"{file}: is there already; choose another file, or overwrite it with --force.\n"
        assert capsys.readouterr().err == said
        assert [other.read_text() for other in files if other.exists()] == ["mine\n"]
        file.unlink()
    assert run(words) == 0
    assert run([*words, "--force"]) == 0
    link = tmp_path / "link.json"
    link.symlink_to(runs["elastic"] / "run.json")
    capsys.readouterr()
    assert run(["fit", str(runs["elastic"]), "--json", str(link), "--force"]) == 2
    assert capsys.readouterr().err == f"{link}: cannot be written: it is an input of the command.\n"
    for option, name in (
        ("--json", "history.csv"),
        ("--python", "checkpoint.h5"),
        ("--picture", "run.json"),
    ):
        before = (runs["elastic"] / name).read_bytes()
        assert (
            run(["fit", str(runs["plastic"]), option, str(runs["elastic"] / name), "--force"]) == 2
        )
        assert "it belongs to the run" in capsys.readouterr().err
        assert (runs["elastic"] / name).read_bytes() == before


def test_two_meshes_give_a_mesh_error(runs, capsys):
    """Order does not matter; the finer run is the law's."""
    assert run(["fit", str(runs["coarse"]), str(runs["elastic"]), "--range", "0.3", "2"]) == 0
    printed = capsys.readouterr().out
    assert (
        f"{runs['coarse']} serves to estimate the discretisation error of {runs['elastic']}."
        in printed
    )
    assert "unknown" in printed.split(str(runs["elastic"]))[0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["{empty}"], "{empty}: is not a run folder: scene.toml is missing."),
        (
            ["{elastic}", "--range", "3", "4"],
            "{elastic}: has no step with contact from 3 to 4 clearances;",
        ),
        (["{elastic}", "{plastic}"], "{plastic}: analysis.plane = 'stress' does not fit"),
        (
            ["{elastic}", "{elastic}"],
            "{elastic}: is the same scene on the same mesh as {elastic}; give one of them.",
        ),
        (
            ["{elastic}", "--json", "{empty}/no/x"],
            "{empty}/no/x: cannot be written: {empty}/no is not a folder.",
        ),
        (["{elastic}", "--python", "{empty}"], "{empty}: cannot be written: it is a folder"),
        (
            ["{elastic}", "--json", "{empty}/x.json", "--picture", "{empty}/x.xyz"],
            "{empty}/x.xyz: must end in one of ",
        ),
        (
            ["{apart}"],
            "{apart}: the bodies never touch in this run, so there is no law to fit to it.",
        ),
        (
            ["{coarse}", "{apart}"],
            "{apart}: the bodies never touch in this run, so there is no law to fit to it.",
        ),
        (["{begun}"], "{begun}: holds no accepted step."),
        (["{broken}"], "{broken}/history.csv: cannot be read as the history of a run."),
    ],
)
def test_bad_input_is_one_sentence(runs, tmp_path, refused, arguments, said):
    folders = runs | {name: tmp_path / name for name in ("empty", "begun", "broken", "apart")}
    (tmp_path / "empty").mkdir()
    history = (runs["elastic"] / "history.csv").read_text()
    heading, first = history.splitlines()[:2]
    apart = ",".join(["1", "0.001", "0.001", *("0" for _ in first.split(",")[3:])])
    texts = {"begun": f"{heading}\n", "broken": f"{history}1,2\n", "apart": f"{heading}\n{apart}\n"}
    for name, text in texts.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "scene.toml").write_text((runs["elastic"] / "scene.toml").read_text())
        shutil.copy(runs["elastic"] / "run.json", tmp_path / name)
        rewrite_report(tmp_path / name, files={}, status="running", steps=[])
        (tmp_path / name / "history.csv").write_text(text)
    assert refused(["fit", *(a.format(**folders) for a in arguments)]).startswith(
        said.format(**folders)
    )
    assert not list((tmp_path / "empty").iterdir())


@pytest.mark.parametrize(
    ("delta", "P", "kept"),
    [
        ([1, 2, 3, 2, 1, 1, 2, 3, 4], [1, 2, 3, 2, 1, 1, 2, 3, 4], [1, 2, 3, 4]),
        # the same force again, a little deeper by what yielded on the way, or a smaller one
        ([1, 2, 1.5, 2.002, 1.5, 2.003, 2.5, 3], [1, 2, 0, 2, 0, 2 + 1e-9, 2.5, 3], [1, 2, 2.5, 3]),
        ([1, 2, 1, 2.001, 2.1, 3], [1, 2, 0, 1.999, 2.1, 3], [1, 2, 2.1, 3]),
        # without an unloading every deeper step counts, also where P falls
        ([1, 2, 3, 4], [1, 2, 1.9, 2], [1, 2, 3, 4]),
    ],
)
def test_unloading_is_left_out(delta, P, kept):
    """Of a way there, back and further, the steps on new ground remain."""
    values = dict.fromkeys(("P", "p0", "eps", "peeq_max"), np.array(P))
    assert list(replace(curve(0.85), delta=np.array(delta), **values).loading().delta) == kept
