"""archord sweep as a user runs it, in this process: what is solved, what is not solved again, what
the tables say."""

import os
import shutil
from pathlib import Path

import pytest

import archord
from archord.cli import run
from archord.output.history import read_history
from archord.studies.cases import read_sweep
from archord.studies.sweep import of_case, result_of
from tests.studies.parts import SOFT, STUCK, break_mesh, numbers, sweep, table, times, written


@pytest.fixture(scope="module")
def solved(tmp_path_factory) -> Path:
    """A folder with some.sweep.toml, six cases, solved into ``out``."""
    folder = tmp_path_factory.mktemp("sweep")
    assert sweep(written(folder, SOFT), "-o", folder / "out", "-q") == 0
    return folder


def test_each_case_is_what_solve_makes_of_it(solved, tmp_path):
    """To the last digit, though the process and its mesh had other cases before."""
    (tmp_path / "base.toml").write_text(
        (solved / "some.sweep.toml").read_text().partition("[base]")[2]
    )
    for number, E, steps in ((1, 0.5, 2), (6, 1.82, 3)):
        keys = ["--set", f"pin.E={E}", "--set", f"load.steps={steps}"]
        assert (
            run(
                [
                    "solve",
                    str(tmp_path / "base.toml"),
                    *keys,
                    "-o",
                    str(tmp_path / f"{number}"),
                    "-q",
                ]
            )
            == 0
        )
        alone = read_history(tmp_path / f"{number}" / "history.csv")
        rows = [row for row in table(solved / "out" / "sweep.csv") if row["case"] == str(number)]
        for name in set(alone) - {"seconds"}:
            column = next(c for c in rows[0] if c.split(" [")[0] == name)
            assert [float(row[column]) for row in rows] == alone[name], name


def test_tables_are_tidy(solved):
    """A row per case and step, the varied keys in columns with their units; a row per case with the
    last step."""
    rows = table(solved / "out" / "sweep.csv")
    assert list(rows[0])[:6] == ["case", "run", "status", "pin.E [E*]", "load.steps", "step"]
    assert "".join(row["case"] for row in rows) == "112223344455666"
    assert [row["load.steps"] for row in rows] == 3 * ["2", "2", "3", "3", "3"]
    assert [row["pin.E [E*]"] for row in rows] == 5 * ["0.5"] + 5 * ["1"] + 5 * ["1.82"]
    ends = table(solved / "out" / "cases.csv")
    assert len(ends) == 6
    for end in ends:
        own = [row for row in rows if row["case"] == end["case"]]
        assert all(end[name] == own[-1][name] for name in ("P [E* R]", "eps [rad]", "work/(E* R2)"))
        assert int(end["iterations"]) == sum(int(row["iterations"]) for row in own)
        assert (end["status"], end["message"], end["steps"]) == ("done", "", str(len(own)))


def test_cases_with_other_columns_share_a_table(tmp_path):
    """An elastic joint has none of PEEQ by body: its cells are empty, and every number stands under
    its heading."""
    text = '[grid]\nblock.yield_stress = ["none", 0.002]\npin.yield_stress = ["none", 0.002]\n'
    assert sweep(written(tmp_path, text), "-o", tmp_path / "out", "-q") == 0
    rows = table(tmp_path / "out" / "sweep.csv")
    ends = table(tmp_path / "out" / "cases.csv")
    for k, (row, end) in enumerate(zip(rows[1::2], ends, strict=True)):
        own = read_history(tmp_path / "out" / "cases" / row["run"] / "history.csv")
        values = {
            heading.split(" [")[0]: value
            for heading, value in row.items()
            if heading not in list(row)[:5]
        }
        assert {name: float(value) for name, value in values.items() if value} == {
            n: v[-1] for n, v in own.items()
        }
        assert [bool(row[f"{place} peeq_max"]) for place in ("pin", "block", "contact")] == [
            k % 2 == 1,
            k > 1,
            k > 0,
        ]
        assert end["contact peeq_max"] == row["contact peeq_max"]


def test_a_varied_force_stands_under_its_own_unit(tmp_path, capsys):
    """It is per unit thickness where the case has no thickness."""
    text = """
list = [{ load.force = 0.002 }, { load.force = 0.004, analysis.thickness = 2.0 }]
"""
    file = written(tmp_path, text)
    assert sweep(file, "--dry-run") == 0
    assert "load.force [E* R]  load.force [E* R2]" in capsys.readouterr().out
    assert sweep(file, "-o", tmp_path / "out", "-q") == 0
    for row in table(tmp_path / "out" / "cases.csv"):
        for unit in ("E* R", "E* R2"):
            given = row[f"load.force [{unit}]"]
            found = row[f"P [{unit}]"]
            assert bool(given) == bool(found)
            if given:
                assert float(found) == pytest.approx(float(given), rel=1e-6)
    assert archord.load(tmp_path / "out").label(1).startswith("force [E* R] = 0.002")


def test_a_sweep_tells_each_kind_of_warning_once(tmp_path, capsys):
    """As a solve tells its own; a tolerance that a sweep chooses is none."""
    text = "[grid]\njoint.relative_element_size = [0.5, 0.4]\npin.E = [0.5, 1.82]\n"
    assert sweep(written(tmp_path, text), "-o", tmp_path / "out", "-q") == 0
    told = capsys.readouterr().err.splitlines()
    assert len(told) == len(set(told))
    assert any("facets in contact; a smaller element_size would resolve it" in t for t in told)
    assert all(line.startswith("archord: warning: case 1 and ") for line in told)
    loose = "[grid]\npin.E = [0.5, 1.82]\nanalysis.tolerance = [1e-4]\nload.steps = [2]\n"
    assert sweep(written(tmp_path, loose), "-o", tmp_path / "loose", "-q") == 0
    assert "forces at pin" not in capsys.readouterr().err


def test_what_is_solved_is_not_solved_again(solved, tmp_path, capsys):
    """By the same file, by one with another design, and by the folder itself."""
    before = times(solved / "out")
    assert sweep(written(solved, SOFT), "-o", solved / "out") == 0
    assert "6 cases" in capsys.readouterr().out
    more = written(solved, SOFT.replace("[0.5,", "[0.25,"), "more")
    assert sweep(more, "-o", solved / "out") == 0
    out = capsys.readouterr().out
    assert "4 of 6 cases are there already" in out
    after = times(solved / "out")
    assert {name: after[name] for name in before} == before
    assert len({name.split("/")[1] for name in after}) == 8
    assert {row["pin.E [E*]"] for row in table(solved / "out" / "cases.csv")} == {
        "0.25",
        "1",
        "1.82",
    }
    assert sweep(written(solved, SOFT), "-o", solved / "out", "-q") == 0
    rows = numbers(solved / "out")
    assert sweep(solved / "out", "-q") == 0
    assert numbers(solved / "out") == rows
    assert times(solved / "out") == after


def test_the_folder_of_another_sweep_is_left_alone(solved, tmp_path, refused, capsys):
    out = _again(solved)
    capsys.readouterr()  # warnings of the sweep
    before = {p: p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}
    other = written(tmp_path, SOFT.replace("[2, 3]", "[4]"), "other")
    said = (
        f"{out}: holds another sweep, which has no case in common with {other}; choose another "
        "folder with -o, or "
    )
    assert refused(["sweep", other, "-o", str(out), "-q"]) == f"{said}remove this one.\n"
    assert {p: p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()} == before


def test_a_case_that_is_refused_is_told_in_one_sentence(tmp_path, capsys):
    """By the scene of the sweep, and the key."""
    scene = Path(__file__).parents[2] / "scenes" / "ball.toml"
    base = scene.read_text(encoding="utf-8").replace("ball.msh", "nowhere.msh")
    (tmp_path / "base.toml").write_text(base, encoding="utf-8")
    file = tmp_path / "some.sweep.toml"
    file.write_text('base = "base.toml"\n[grid]\npath.steps = [1]\n', encoding="utf-8")
    assert sweep(file, "-o", tmp_path / "out", "-q") == 3
    said = f'{file}: mesh.file = "{tmp_path / "nowhere.msh"}" must be a file that is there.\n'
    assert capsys.readouterr().err.endswith(f": failed: {said}")


def test_a_failure_stops_nobody_else(tmp_path, monkeypatch, capsys):
    """A case that finds no equilibrium, and one with an error that nobody foresaw: noted, exit code
    3, and left alone until --retry. The error's traceback is in failure.txt, its sentence in the
    table, and a retry removes it."""
    break_mesh(monkeypatch, "two\nlines", below=0.75)
    text = (
        f"[[list]]\nload.steps = 1\n[[list]]\n{STUCK}[[list]]\npin.E = 0.5\n[[list]]\npin.nu = "
        "0.2\n"
    )
    file = written(tmp_path, text)
    out = tmp_path / "out"
    cases = read_sweep(file).cases
    runs = [case.run for case in cases]
    assert sweep(file, "-o", out) == 3
    said, err = capsys.readouterr()
    assert "2 done, 1 failed, 1 stopped" in said
    assert f"archord: case 2, {runs[1]}: stopped: " in err
    ends = table(out / "cases.csv")
    assert [end["status"] for end in ends] == ["done", "stopped", "failed", "done"]
    assert "no equilibrium" in ends[1]["message"]
    assert (ends[2]["message"], ends[2]["P [E* R]"]) == ("ValueError: two lines", "")
    failure = out / "cases" / runs[2] / "failure.txt"
    assert "in broken" in failure.read_text()
    before = times(out)
    assert sweep(file, "-o", out, "-q") == 3
    assert times(out) == before
    monkeypatch.undo()
    assert sweep(file, "-o", out, "-q", "--retry") == 3
    assert [end["status"] for end in table(out / "cases.csv")] == [
        "done",
        "stopped",
        "done",
        "done",
    ]
    assert result_of(cases[2], out).status == "done"
    assert not failure.exists()


def test_an_array_solves_the_whole(tmp_path, solved):
    """Part by part into one folder, whatever is in a case's way; the last part leaves the whole, as
    does --gather."""
    file = written(tmp_path, SOFT)
    out = tmp_path / "out"
    out.joinpath("cases").mkdir(parents=True)
    out.joinpath("sweep.toml").touch()
    in_the_way = out / "cases" / read_sweep(file).cases[-1].run
    in_the_way.write_text("a file where a run folder belongs")
    assert sweep(file, "-o", out, "--array", "1/2", "-q") == 3
    in_the_way.unlink()
    for part, done in (("2/2", 5), ("1/2", 6)):
        assert sweep(file, "-o", out, "--array", part, "-q") == 0
        assert sum(row["status"] == "done" for row in table(out / "cases.csv")) == done
    assert numbers(out) == numbers(_again(solved))
    for name in ("sweep.csv", "cases.csv"):
        (out / name).unlink()
    (out / "sweep.h5").touch()  # a table that version 0.1 wrote, too
    before = times(out)
    assert sweep(file, "-o", out, "--gather", "-q") == 0
    assert numbers(out) == numbers(solved / "out")
    assert not (out / "sweep.h5").exists()
    assert times(out) == before


def _again(solved: Path) -> Path:
    """The folder of `solved` with the tables of its own file."""
    assert sweep(written(solved, SOFT), "-o", solved / "out", "--gather", "-q") == 0
    return solved / "out"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["FILE", "--dry-run"], ""),
        (["FILE", "--array", "3/2"], "--array 3/2: must be I/N, with I from 1 to N.\n"),
        (["FILE", "--gather"], "runs/some: holds no sweep to gather.\n"),
        (
            ["FILE", "-o", "full"],
            "full: is not empty and holds no sweep; choose another folder with -o.\n",
        ),
        (["FILE", "-o", "full/file"], "full/file: cannot be used for a sweep: Not a directory.\n"),
        (["WRONG"], "WRONG: case 2: pin.E = -1.0 must be greater than 0.\n"),
        (["full"], "full/sweep.toml: cannot be read: No such file or directory.\n"),
        (["nowhere.toml"], "nowhere.toml: cannot be read: No such file or directory.\n"),
    ],
)
def test_nothing_is_written_by_a_dry_run_or_bad_input(
    tmp_path, monkeypatch, capsys, arguments, said
):
    """Exit code 2 with a sentence; a dry run prints a line for each case."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    file = written(tmp_path, SOFT)
    wrong = written(tmp_path, "[grid]\npin.E = [1.0, -1.0]\n", "wrong")
    before = sorted(tmp_path.rglob("*"))
    code = sweep(*(a.replace("FILE", file).replace("WRONG", wrong) for a in arguments))
    out, err = capsys.readouterr()
    assert err == said.replace("WRONG", wrong)
    assert code == (2 if said else 0)
    if not said:
        assert out.startswith("6 cases, 6 of them distinct; about ")
        assert [line.split()[0] for line in out.splitlines()[2:]] == ["1", "2", "3", "4", "5", "6"]
    assert sorted(tmp_path.rglob("*")) == before


def test_absent_keys_lists_and_identical_cases(tmp_path, capsys):
    """An absent key is empty, lists are as in TOML; cases of one scene are solved once and have
    their rows each."""
    text = """
        [[list]]
        block.yield_stress = "none"
        [[list]]
        block.yield_stress = 0.05
        [grid]
        load.displacement = [0.5, [0.5, 0.2], [0.5, 0.20]]
        analysis.plane = ["stress"]
        output.contact = [false]
    """
    out = tmp_path / "out"
    assert sweep(written(tmp_path, text), "-o", out) == 0
    assert "6 cases, 4 of them distinct" in capsys.readouterr().out
    rows = numbers(out, "cases.csv")
    assert [row.pop("case") for row in rows] == ["1", "2", "3", "4", "5", "6"]
    assert (rows[1], rows[4]) == (rows[2], rows[5])
    assert len(list((out / "cases").iterdir())) == 4
    assert [row["block.yield_stress [E*]"] for row in rows] == ["", "", "", "0.05", "0.05", "0.05"]
    assert [row["load.displacement"] for row in rows] == 2 * ["0.5", "[0.5, 0.2]", "[0.5, 0.2]"]
    assert run(["show", str(out)]) == 0  # p0 over the load, as no case has contact.h5


def _cut(run: Path) -> None:
    os.truncate(run / "history.csv", 200)


def _swap(run: Path) -> None:
    other = next(case for case in sorted(run.parent.iterdir()) if case != run)
    shutil.rmtree(run)
    shutil.copytree(other, run)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (_cut, "history.csv has 200 bytes, not the "),
        (_swap, "scene.toml is of another scene"),
        (lambda run: os.truncate(run / "contact.h5", 2000), "contact.h5 has 2000 bytes, not the "),
    ],
)
def test_a_case_whose_files_disagree_is_solved_again(solved, tmp_path, capsys, damage, said):
    """Not called done with empty columns: the tables are what they were; a gathering has no numbers
    for it."""
    out = shutil.copytree(solved / "out", tmp_path / "out")
    design = read_sweep(solved / "some.sweep.toml")
    case = design.distinct[2]
    damage(of_case(case, out))
    assert sweep(solved / "some.sweep.toml", "-o", out, "--gather", "-q") == 0
    assert said in capsys.readouterr().err
    row = table(out / "cases.csv")[2]
    assert (row["status"], row["P [E* R]"]) == ("open", "")
    assert said in row["message"]
    assert sweep(solved / "some.sweep.toml", "-o", out) == 0
    printed = capsys.readouterr()
    assert f"{case.run}: {said}" in printed.err
    assert printed.err.count("the case is solved again") == 1
    assert "5 of 6 cases are there already" in printed.out
    assert numbers(out) == numbers(solved / "out")


def test_force_solves_all_cases_again(solved, tmp_path, capsys):
    """And nothing else goes with it that keeps cases."""
    out = shutil.copytree(solved / "out", tmp_path / "out")
    before = times(out)
    assert sweep(solved / "some.sweep.toml", "-o", out, "--force") == 0
    assert "there already" not in capsys.readouterr().out
    own = {case.run for case in read_sweep(solved / "some.sweep.toml").distinct}
    kept = [name for name, now in times(out).items() if now <= before[name]]
    assert own.isdisjoint(name.split("/")[1] for name in kept)
    assert numbers(out) == numbers(solved / "out")
    assert sweep(solved / "some.sweep.toml", "-o", out, "--force", "--gather") == 2
