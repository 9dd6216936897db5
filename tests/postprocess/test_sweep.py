"""A sweep's folder from Python and on the terminal."""

import shutil

import matplotlib.image
import numpy as np
import pytest

import archord
from archord.cli import run as command
from archord.postprocess.arrays.frames import read_frame
from tests.studies import parts
from tests.studies.parts import STUCK

SIZES = [f"[[list]]\njoint.relative_element_size = {size}\n" for size in (0.3, 0.4, 0.3, 0.5)]


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    """Four cases: two that share a run, one on another mesh, one that stops at its first step."""
    folder = tmp_path_factory.mktemp("sweep")
    design = "".join(
        [*SIZES, STUCK, '[grid]\nanalysis.plane = ["strain"]\noutput.fields = [true]\n']
    )
    parts.sweep(parts.written(folder, design), "-o", folder / "out", "-q")
    return folder / "out"


def test_the_tables_are_those_of_the_folder(sweep):
    """Rows, columns without units, and the numbers of the runs; cases share runs."""
    loaded = archord.load(sweep)
    assert isinstance(loaded, archord.Sweep)
    assert (len(loaded), len(loaded.keys), len(loaded.moving)) == (4, 5, 3)
    assert "joint.relative_element_size" in loaded.moving
    assert loaded.cases["status"].tolist() == ["done", "done", "done", "stopped"]
    assert np.isnan(loaded.cases["P"].iloc[3])
    for case in (1, 2, 3):
        rows = loaded.history[loaded.history["case"] == case]
        run = loaded.run(case)
        for name in ("delta", "P", "eps", "iterations"):
            np.testing.assert_array_equal(rows[name], run.history[name])
        assert loaded.cases["P"][case - 1] == run.history["P"].iloc[-1]
    assert loaded.run(1).folder == loaded.run(3).folder == loaded.run(loaded.cases["run"][0]).folder
    assert list(loaded.runs) == [1, 2]
    with pytest.raises(archord.InputError, match=r"has no case 5; its cases are 1 to 4\."):
        loaded.run(5)


def test_names_of_runs_may_look_like_numbers(tmp_path):
    (tmp_path / "cases.csv").write_text(
        "case,run,message,P [N]\n1,000123456789,,1.5\n2,48976689e411,nan,\n"
    )
    table = read_frame(tmp_path / "cases.csv")
    assert table["run"].tolist() == ["000123456789", "48976689e411"]
    assert table["message"].tolist() == ["", "nan"]
    assert table.attrs["units"] == {"P": "N"}


def test_columns_of_one_name_keep_their_units(tmp_path, capsys):
    """A joint without a thickness and one with it have forces in other units."""
    design = "list = [{}, {analysis.thickness = 10.0}]\n"
    parts.sweep(parts.written(tmp_path, design), "-o", tmp_path / "out", "-q")
    sweep = archord.load(tmp_path / "out")
    per_length = sweep.cases["P [E* R]"]
    total = sweep.cases["P [E* R2]"]
    assert np.isnan([per_length[1], total[0]]).all()
    assert total[1] == pytest.approx(10 * per_length[0])
    assert "P" not in sweep.cases.attrs["units"]
    assert command(["show", str(tmp_path / "out"), "--no-pictures"]) == 0
    headings, *rows = capsys.readouterr().out.splitlines()[2:5]
    assert headings.index("P [E* R]") < headings.index("P [E* R2]")
    assert f"{total[1]:.6g}" in rows[1]


def test_show_prints_the_cases_and_draws_them(sweep, tmp_path, capsys):
    """Varied keys, last values, why one stopped; and a picture, of the runs that can be read."""
    copy = shutil.copytree(sweep, tmp_path / "sweep")
    assert command(["show", str(copy)]) == 0
    printed = capsys.readouterr().out
    loaded = archord.load(copy)
    assert printed.startswith(
        f"{copy}: 4 cases: 3 done, 1 stopped\nin all cases: analysis.plane = strain"
    )
    rows = {line.split()[0]: line.split() for line in printed.splitlines() if line.split()[:1]}
    assert f"{loaded.cases['P'][0]:.6g}" in rows["1"]
    assert rows["1"][1:] == rows["3"][1:]
    assert "case 4: no equilibrium at delta" in printed
    warnings = [line for line in printed.splitlines() if line.startswith("warning: case 1")]
    assert any("only" in line and "facets in contact" in line for line in warnings)
    assert len(warnings) == len({line.partition(": ")[2] for line in warnings})
    assert matplotlib.image.imread(copy / "picture.png").std() > 0.05
    (loaded.run(2).folder / "run.json").write_text("{")
    assert list(archord.load(copy).runs) == [1]
    assert command(["show", str(copy)]) == 0


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "case,run,status,message\n1,2,3,4,5\n"])
def test_broken_tables_are_one_sentence(tmp_path, refused, text):
    """No table, or another one."""
    (tmp_path / "sweep.toml").write_text("")
    (tmp_path / "cases.csv").write_text(text)
    assert (
        refused(["show", str(tmp_path)])
        == f"{tmp_path}/cases.csv: cannot be read as a table of a sweep.\n"
    )
    (tmp_path / "cases.csv").unlink()
    said = (
        f"is not the folder of a sweep: cases.csv is missing; archord sweep {tmp_path} --gather "
        "writes it."
    )
    assert said in refused(["show", str(tmp_path)])


@pytest.mark.parametrize("command", ["compare", "export --csv x", "picture"])
def test_a_sweep_is_no_run(sweep, refused, command):
    said = f"{sweep}: is a sweep, not a run; its runs are the folders in {sweep}/cases.\n"
    assert refused([*command.split(), str(sweep), *[str(sweep)] * (command == "compare")]) == said


def test_a_legend_has_the_varied_values(sweep, tmp_path, capsys):
    """Not the names of cases; a case that is done and cannot be read is told, not left out in
    silence."""
    copy = shutil.copytree(sweep, tmp_path / "sweep")
    loaded = archord.load(copy)
    assert len(loaded.moving) > 0
    for case in loaded.runs:
        label = loaded.label(case)
        for key in loaded.moving:
            assert f"{key.rpartition('.')[2]} = " in label
    assert len({loaded.label(case) for case in loaded.runs}) == len(loaded.runs)
    assert loaded.unread == {}
    (loaded.run(2).folder / "history.csv").write_text("")
    assert command(["show", str(copy), "--no-pictures"]) == 0
    assert "case 2 is left out: " in capsys.readouterr().out
