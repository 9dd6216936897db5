"""``archord show`` as a user runs it."""

import json
import shutil

import matplotlib.image
import pytest

from archord.benchmarks.case import paper_joint
from archord.cli import run as command
from archord.postprocess.run import Run
from tests.output.run_files import solved


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


def test_show_prints_the_run_and_draws_it(runs, tmp_path, capsys):
    """Every step of history.csv in the table, the peaks below, and a picture that is not empty."""
    target = tmp_path / "new.png"
    assert command(["show", str(runs["plastic"]), "-o", str(target)]) == 0
    printed, run = capsys.readouterr().out, Run(runs["plastic"])
    rows = [line.split() for line in printed.splitlines()]
    for k in range(run.steps):
        row = next(r for r in rows if r and r[0] == str(k + 1))
        for place, name in ((1, "delta"), (3, "P"), (5, "p0"), (9, "iterations")):
            assert float(row[place]) == pytest.approx(run.columns[name][k], rel=1e-5)
    assert f"P = {max(run.columns['P']):.6g} " in printed
    first = next(k for k, peeq in enumerate(run.columns["peeq_max"]) if peeq > 0)
    assert f"plastic strain first at step {first + 1}\n" in printed
    assert printed.endswith(f"\n{target}\n")
    assert matplotlib.image.imread(target).std() > 0.05


@pytest.mark.parametrize(
    ("name", "panels", "said"),
    [("ring", 3, "done; 2 of 2 steps"), ("rigid", 2, "done; 2 of 2 steps"),
     ("stuck", 0, "stopped; 0 of 1 steps: no equilibrium at delta")],
)  # fmt: skip
def test_show_draws_what_there_is_of_other_runs(odd, capsys, name, panels, said):
    """A whole ring; a run without fields; one without a step."""
    assert command(["show", str(odd[name])]) == 0
    assert said in capsys.readouterr().out
    picture = odd[name] / "picture.png"
    assert picture.is_file() == bool(panels)
    if panels:
        height, width, _ = matplotlib.image.imread(picture).shape
        assert width / height == pytest.approx(panels * 5 / 4.4, rel=0.01)


def test_a_long_history_is_thinned(runs, tmp_path, capsys):
    """Forty rows, first and last included, and where the others are."""
    copy = shutil.copytree(runs["coarse"], tmp_path / "run")
    heading, *rows = (copy / "history.csv").read_text().splitlines()
    long = [f"{k},{rows[-1].partition(',')[2]}" for k in range(1, 101)]
    (copy / "history.csv").write_text("\n".join([heading, *long, ""]))
    assert command(["show", str(copy), "--no-pictures"]) == 0
    printed = capsys.readouterr().out
    assert f"40 of 100 rows; {copy}/history.csv has all of them" in printed
    shown = [line.split()[0] for line in printed.splitlines() if line.split() and line.split()[0].isdigit()]
    assert (len(shown), shown[0], shown[39]) == (41, "1", "100")


def test_a_killed_run_is_shown_as_far_as_it_came(runs, tmp_path, capsys):
    """run.json still says running."""
    copy = shutil.copytree(runs["coarse"], tmp_path / "run")
    report = json.loads((copy / "run.json").read_text())
    (copy / "run.json").write_text(json.dumps(report | {"status": "running"}))
    history = (copy / "history.csv").read_bytes().splitlines(keepends=True)
    (copy / "history.csv").write_bytes(b"".join(history[:4]) + history[4][:20])
    assert command(["show", str(copy)]) == 0
    assert capsys.readouterr().out.startswith(f"{copy}: running, or killed (if no archord works there, --restart ")
    assert Run(copy).steps == 3
