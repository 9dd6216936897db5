"""A sweep's folder from Python and on the terminal."""

import csv
import io
import shutil

import matplotlib.image
import numpy as np
import pytest

import archord
from archord.cli import run as command

NAMES = {"elastic": "48976689e411", "coarse": "000123456789"}  # as hashes may be: they look like numbers


@pytest.fixture(scope="module")
def sweep(runs, tmp_path_factory):
    """Four cases as ``archord sweep`` leaves them: two that share a run, one on another mesh, one that failed."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "sweep.toml").write_text("[base]\n")
    tables = {}
    for name, run in NAMES.items():
        shutil.copytree(runs[name], folder / "cases" / run)
        tables[run] = list(csv.reader(io.StringIO((runs[name] / "history.csv").read_text())))
    (folder / "cases" / "ffffffffffff").mkdir()
    history = tables[NAMES["elastic"]][0]
    final = [h for h in history if h not in ("step", "iterations", "cutbacks", "seconds [s]")]
    keys = ["case", "run", "status", "joint.element_size [mm]", "analysis.plane"]
    cost = ["message", "steps", "seconds [s]", "iterations", "cutbacks", "cells", "dofs"]
    steps, cases = [[*keys, *history]], [[*keys, *cost, *final]]
    for case, (name, size) in enumerate((("elastic", 0.1), ("coarse", 0.15), ("elastic", 0.1)), 1):
        rows = tables[NAMES[name]][1:]
        head = [str(case), NAMES[name], "done", str(size), "strain"]
        steps += [[*head, *row] for row in rows]
        last = dict(zip(history, rows[-1], strict=True))
        cases.append([*head, "", str(len(rows)), "1.5", "40", "0", "300", "1200", *(last[h] for h in final)])
    cases.append(["4", "ffffffffffff", "failed", "0.2", "strain", "no mesh", "0", *[""] * (len(cost) - 2 + len(final))])
    for name, table in (("sweep.csv", steps), ("cases.csv", cases)):
        with (folder / name).open("w", newline="") as file:
            csv.writer(file).writerows(table)
    return folder


def test_the_tables_are_those_of_the_folder(sweep):
    """Rows, columns without units, and names of runs that stay text."""
    loaded = archord.load(sweep)
    assert isinstance(loaded, archord.Sweep)
    assert (len(loaded), loaded.keys) == (4, ["joint.element_size", "analysis.plane"])
    assert loaded.moving == ["joint.element_size"]
    assert loaded.cases["run"].tolist() == [*NAMES.values(), NAMES["elastic"], "ffffffffffff"]
    assert loaded.cases["message"].tolist() == ["", "", "", "no mesh"]
    assert np.isnan(loaded.cases["P"].iloc[3])
    assert loaded.history.attrs["units"]["joint.element_size"] == "mm"
    for case in (1, 2, 3):
        rows, run = loaded.history[loaded.history["case"] == case], loaded.run(case)
        for name in ("delta", "P", "eps", "iterations"):
            np.testing.assert_array_equal(rows[name], run.history[name])
        assert loaded.cases["P"][case - 1] == run.history["P"].iloc[-1]


def test_cases_share_runs(sweep):
    """A run by the number of a case or its own name; each once."""
    loaded = archord.load(sweep)
    assert loaded.run(1).folder == loaded.run(3).folder == loaded.run("48976689e411").folder
    assert list(loaded.runs) == [1, 2]
    with pytest.raises(archord.InputError, match=r"has no case 5; its cases are 1 to 4\."):
        loaded.run(5)
    with pytest.raises(archord.InputError, match=r"ffffffffffff: is not a run folder: scene\.toml is missing\."):
        loaded.run(4)


def test_show_prints_the_cases_and_draws_them(sweep, tmp_path, capsys):
    """Varied keys, last values, why one failed; and a picture, of the runs that can be read."""
    copy = shutil.copytree(sweep, tmp_path / "sweep")
    assert command(["show", str(copy)]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith(f"{copy}: 4 cases: 3 done, 1 failed\nin all cases: analysis.plane = strain\n")
    rows = {line.split()[0]: line.split() for line in printed.splitlines() if line.split()[:1]}
    assert rows["1"][2] == "0.1"
    assert float(rows["1"][5]) == pytest.approx(archord.load(copy).run(1).history["P"].iloc[-1], rel=1e-5)
    assert rows["1"][2:12] == rows["3"][2:12]
    assert "case 4: no mesh" in printed
    assert matplotlib.image.imread(copy / "picture.png").std() > 0.05
    (copy / "cases" / NAMES["coarse"] / "run.json").write_text("{")
    assert list(archord.load(copy).runs) == [1]
    assert command(["show", str(copy)]) == 0


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "case,run,status,message\n1,2,3,4,5\n"])
def test_broken_tables_are_one_sentence(tmp_path, refused, text):
    """No table, or another one."""
    (tmp_path / "sweep.toml").write_text("")
    (tmp_path / "cases.csv").write_text(text)
    assert refused(["show", str(tmp_path)]) == f"{tmp_path}/cases.csv: cannot be read as a table of a sweep.\n"
    (tmp_path / "cases.csv").unlink()
    said = f"is not the folder of a sweep: cases.csv is missing; archord sweep {tmp_path} --gather writes it."
    assert said in refused(["show", str(tmp_path)])


@pytest.mark.parametrize("arguments", [["compare", "{0}", "{0}"], ["export", "{0}", "--csv", "x"], ["picture", "{0}"]])
def test_a_sweep_is_no_run(sweep, tmp_path, monkeypatch, refused, arguments):
    monkeypatch.chdir(tmp_path)
    said = f"{sweep}: is a sweep, not a run; its runs are the folders in {sweep}/cases.\n"
    assert refused([argument.format(sweep) for argument in arguments]) == said
    assert not list(tmp_path.iterdir())
