"""``archord show`` as a user runs it."""

import shutil

import matplotlib.image
import pytest

from archord.benchmarks.case import paper_joint
from archord.cli import run as command
from archord.postprocess.pictures.joint import field_panel
from archord.postprocess.run import Run
from archord.report.figure import new_figure
from tests.output.run_files import rewrite_report, solved


def test_show_prints_the_run_and_draws_it(runs, tmp_path, capsys):
    """Every step of history.csv in the table, the peaks below, and a picture that is not empty."""
    target = tmp_path / "new.png"
    assert command(["show", str(runs["plastic"]), "-o", str(target)]) == 0
    printed = capsys.readouterr().out
    run = Run(runs["plastic"])
    rows = {row[0]: row for line in printed.splitlines() if len(row := line.split()) == 13}
    for k in range(run.steps):
        for place, name in (
            (1, "delta"),
            (3, "P"),
            (5, "p0"),
            (9, "contact peeq_max"),
            (10, "iterations"),
        ):
            assert float(rows[str(k + 1)][place]) == pytest.approx(run.columns[name][k], rel=1e-5)
    assert f"P = {max(run.columns['P']):.6g} " in printed
    first = next(k for k, peeq in enumerate(run.columns["peeq_max"]) if peeq > 0)
    assert (
        f"contact peeq_max = {run.columns['contact peeq_max'][-1]:.6g} at step {run.steps}, x = "
        in printed
    )
    assert f"plastic strain first at step {first + 1}\n" in printed
    assert printed.endswith(f"\n{target}\n")
    assert matplotlib.image.imread(target).std() > 0.05


def test_the_field_of_a_joint_is_its_stress_until_it_yields(tmp_path):
    """A picture of PEEQ that is zero everywhere tells nothing."""
    run = Run(
        solved(
            {"run": paper_joint(0.2, 2, 0.005, load={"displacement": [0.2, 2.0], "steps": 1})},
            tmp_path,
        )["run"]
    )
    labels = []
    for step in (1, 2):
        figure = new_figure(4, 4)
        field_panel(figure.subplots(), run, step)
        labels.append(figure.axes[-1].get_ylabel())
    assert [peeq > 0 for peeq in run.columns["peeq_max"]] == [False, True]
    assert labels == ["von Mises stress [MPa]", "equivalent plastic strain [%]"]


def test_show_draws_what_there_is_of_other_runs(tmp_path, capsys):
    """A whole ring; a rigid pin without fields; a run that does not get through its first step."""
    force = {"displacement": None, "relative_force": 0.005, "steps": 2}
    scenes = {
        "ring": paper_joint(0.2, joint={"model": "ring"}, load=force),
        "rigid": paper_joint(0.2, 2, pin={"rigid": True}, output={"fields": False}),
        "stuck": paper_joint(0.2, 1, analysis={"max_iterations": 2}, stepping={"minimum": 1.0}),
    }
    for folder, panels in zip(solved(scenes, tmp_path).values(), (3, 2, 0), strict=True):
        assert command(["show", str(folder)]) == 0
        said = "done; 2 of 2 steps" if panels else "stopped; 0 of 1 steps: no equilibrium at delta"
        assert said in capsys.readouterr().out
        assert (folder / "picture.png").is_file() == bool(panels)
        if panels:
            height, width, _ = matplotlib.image.imread(folder / "picture.png").shape
            assert width / height == pytest.approx(panels * 5 / 4.4, rel=0.01)


def test_a_long_history_is_thinned_and_a_killed_run_shown_as_far_as_it_came(runs, tmp_path, capsys):
    """Forty rows, first and last included, and where the others are; half a row at the end does not
    count."""
    copy = shutil.copytree(runs["coarse"], tmp_path / "run")
    rewrite_report(copy, files={}, status="running", steps=[])
    heading, *rows = (copy / "history.csv").read_text().splitlines()
    long = [f"{k},{rows[-1].partition(',')[2]}" for k in range(1, 101)]
    (copy / "history.csv").write_text("\n".join([heading, *long, "101,0.0"]))
    assert command(["show", str(copy), "--no-pictures"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith(f"{copy}: running, or killed (if no archord works there, --restart ")
    assert f"40 of 100 rows; {copy}/history.csv has all of them" in printed
    shown = [
        line.split()[0]
        for line in printed.splitlines()
        if line.split() and line.split()[0].isdigit()
    ]
    assert (len(shown), shown[0], shown[39]) == (41, "1", "100")


def test_a_run_that_was_killed_has_no_memory_to_tell(runs, tmp_path, capsys):
    """run.json has it from the end of a run on; "0 MB" would be wrong."""
    killed = shutil.copytree(runs["coarse"], tmp_path / "killed")
    for known, said in (([2e8], True), ([], False)):
        rewrite_report(killed, peak_memory=known)
        assert command(["show", str(killed), "--no-pictures"]) == 0
        assert ("MB at most on a rank" in capsys.readouterr().out) == said
