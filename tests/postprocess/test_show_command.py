"""``archord show`` as a user runs it."""

import json
import shutil

import matplotlib.image
import pytest

from archord.benchmarks.case import paper_joint
from archord.cli import run as command
from archord.postprocess.run import Run
from tests.output.run_files import solved

PICTURES = ["force.png", "pressure.png", "field.png", "iterations.png"]


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    """A rigid pin without fields, a ring, and a run that does not get through its first step."""
    scenes = {
        "rigid": paper_joint(0.2, 2, pin={"rigid": True}, output={"fields": False}),
        "ring": paper_joint(
            0.2, joint={"model": "ring"}, load={"displacement": None, "relative_force": 0.005, "steps": 2}
        ),
        "stuck": paper_joint(0.2, 1, analysis={"max_iterations": 2}, stepping={"minimum": 1.0}),
    }
    return solved(scenes, tmp_path_factory.mktemp("odd"))


@pytest.fixture
def copy(runs, tmp_path):
    """A copy of a run to be broken."""
    return shutil.copytree(runs["coarse"], tmp_path / "run")


def test_show_prints_the_run_and_draws_it(runs, tmp_path, capsys):
    """Every step of history.csv in the table, the peaks below, and pictures that are not empty."""
    assert command(["show", str(runs["plastic"]), "-o", str(tmp_path / "new")]) == 0
    printed, run = capsys.readouterr().out, Run(runs["plastic"])
    rows = [line.split() for line in printed.splitlines()]
    for k in range(run.steps):
        row = next(r for r in rows if r and r[0] == str(k + 1))
        for place, name in ((1, "delta"), (3, "P"), (5, "p0"), (9, "iterations")):
            assert float(row[place]) == pytest.approx(run.columns[name][k], rel=1e-5)
    assert f"P = {max(run.columns['P']):.6g} " in printed
    first = next(k for k, peeq in enumerate(run.columns["peeq_max"]) if peeq > 0)
    assert f"first seen at step {first + 1} " in printed
    assert printed.splitlines()[-4:] == [str(tmp_path / "new" / name) for name in PICTURES]
    for name in PICTURES:
        pixels = matplotlib.image.imread(tmp_path / "new" / name)
        assert pixels.std() > 0.05


@pytest.mark.parametrize(
    ("name", "missing", "said"),
    [
        ("ring", set(), "done"),
        ("rigid", {"field.png"}, "no picture of the field: the run was solved with output.fields = false."),
        ("stuck", set(PICTURES), "stopped; 0 of 1 steps: no equilibrium at delta"),
        ("stuck", set(PICTURES), "no picture: no step was accepted."),
    ],
)
def test_show_draws_what_there_is_of_other_runs(odd, capsys, name, missing, said):
    """A whole ring; a run without fields; one without a step. A sentence for what is not there."""
    assert command(["show", str(odd[name])]) == 0
    printed = capsys.readouterr().out
    assert {file.name for file in odd[name].glob("*.png")} == set(PICTURES) - missing
    assert said in printed
    assert ("no picture" in printed) == bool(missing)


def test_a_killed_run_is_shown_as_far_as_it_came(copy, capsys):
    """run.json still says running."""
    report = json.loads((copy / "run.json").read_text())
    (copy / "run.json").write_text(json.dumps(report | {"status": "running"}))
    history = (copy / "history.csv").read_bytes().splitlines(keepends=True)
    (copy / "history.csv").write_bytes(b"".join(history[:4]) + history[4][:20])
    assert command(["show", str(copy)]) == 0
    assert capsys.readouterr().out.startswith(f"{copy}: running, or killed (if no archord works there, --restart ")
    assert Run(copy).steps == 3
