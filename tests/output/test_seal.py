"""Files of a run that were changed after it ended are noticed by every command that reads them."""

import os
import shutil
from pathlib import Path

import pytest

from archord.cli import run as command
from archord.output.files.seal import read_report
from archord.output.history import read_history
from archord.output.restart import plan_restart
from archord.postprocess.run import Run
from archord.report.errors import InputError
from tests.output.run_files import rewrite_report

_BY_SIZE = "bytes, not the"
_BY_SUM = "was changed after the run"


def _lines(path: Path) -> list[str]:
    return path.read_text().splitlines(keepends=True)


def _names(heading: str) -> list[str]:
    return [name.partition(" [")[0] for name in heading.split(",")]


def _cut_at_a_row(run: Path) -> None:
    (run / "history.csv").write_text("".join(_lines(run / "history.csv")[:3]))


def _cut_within_a_row(run: Path) -> None:
    os.truncate(run / "history.csv", (run / "history.csv").stat().st_size - 20)


def _edit_a_number(run: Path) -> None:
    heading, *rows = _lines(run / "history.csv")
    cells = rows[-1].split(",")
    cells[_names(heading).index("P/(E* R)")] = "7.125"
    (run / "history.csv").write_text("".join([heading, *rows[:-1], ",".join(cells)]))


def _drop_a_column(run: Path) -> None:
    kept = [line.rstrip().rpartition(",")[0] + "\n" for line in _lines(run / "history.csv")]
    (run / "history.csv").write_text("".join(kept))


def _flip_a_bit(name: str):
    def flip(run: Path) -> None:
        content = bytearray((run / name).read_bytes())
        content[len(content) * 2 // 3] ^= 1
        (run / name).write_bytes(content)

    return flip


def _edit_the_scene(run: Path) -> None:
    text = (run / "scene.toml").read_text()
    assert "nu = 0.3\n" in text
    (run / "scene.toml").write_text(text.replace("nu = 0.3\n", "nu = 0.2\n"))


DAMAGES = [
    (_cut_at_a_row, "history.csv: has 2 of the 6 steps of run.json: it was cut short"),
    (_cut_within_a_row, "history.csv: has 5 of the 6 steps of run.json: it was cut short"),
    (
        lambda run: (run / "history.csv").write_text(""),
        "history.csv: cannot be read as the history of a run",
    ),
    (lambda run: (run / "history.csv").unlink(), "is not a run folder: history.csv is missing"),
    (_edit_a_number, _BY_SIZE),
    (_drop_a_column, "history.csv: cannot be read as the history of a run"),
    (_flip_a_bit("history.csv"), "history.csv: "),
    (_edit_the_scene, f"scene.toml: {_BY_SUM}"),
    (_flip_a_bit("run.json"), "run.json: cannot be read as the report of a run"),
    (
        lambda run: (run / "run.json").write_text("[" * 100_000),
        "run.json: cannot be read as the report of a run",
    ),
    (
        lambda run: os.truncate(run / "run.json", 900),
        "run.json: cannot be read as the report of a run",
    ),
]


@pytest.mark.parametrize(("damage", "said"), DAMAGES)
def test_every_reader_notices_a_changed_table(runs, tmp_path, refused, damage, said):
    """One sentence and exit code 2, whatever the command."""
    copy = shutil.copytree(runs["coarse"], tmp_path / "run")
    damage(copy)
    readers = [["show"], ["fit"], ["picture"], ["export", "--csv", str(tmp_path / "x")]]
    readers += [
        ["compare", str(runs["elastic"])],
        ["probe", "--edge", "hole", "--quantity", "pressure"],
    ]
    for reader, *options in readers:
        assert said in refused([reader, *options, str(copy)])


@pytest.mark.parametrize("name", ["contact.h5", "fields.h5", "fields/0000.h5", "fields/0006.h5"])
def test_every_reader_notices_changed_fields(runs, tmp_path, name):
    """A flipped bit within a number is no number of the run; what does not need the file can still
    be read."""
    copy = shutil.copytree(runs["coarse"], tmp_path / "run")
    _flip_a_bit(name)(copy)
    read = Run(copy)
    with pytest.raises(
        InputError, match=rf"{name}: {_BY_SUM}: its sha256 .*solves the run again\."
    ):
        read.contact() if name == "contact.h5" else read.fields()
    assert read.fields(3) if name in ("contact.h5", "fields/0006.h5") else read.contact()
    with pytest.raises(InputError, match=rf"{name}: {_BY_SUM}"):
        plan_restart(copy)


def test_the_run_of_another_scene_copied_over_is_noticed(runs, tmp_path):
    """Each of its files alone."""
    for name in ("scene.toml", "history.csv", "contact.h5"):
        copy = shutil.copytree(runs["elastic"], tmp_path / name)
        shutil.copy(runs["coarse"] / name, copy)
        with pytest.raises(InputError, match=rf"{name}: (has|was)"):
            Run(copy).contact()


def test_a_restart_writes_changed_tables_again(runs, tmp_path):
    """Of a finished run, of which nothing else is to be done; the numbers are what they were."""
    copy = shutil.copytree(runs["coarse"], tmp_path / "run")
    before = read_history(copy / "history.csv")
    _edit_a_number(copy)
    assert plan_restart(copy).said.endswith("is finished: writing history.csv again")
    assert command(["solve", str(copy), "--restart", "-q"]) == 0
    assert read_history(copy / "history.csv") == before
    assert plan_restart(copy).finished


def test_a_run_without_seals_is_compared_with_its_report(runs, tmp_path):
    """As those of earlier versions and of kills are: one row more may be there, another number
    not."""
    copy = shutil.copytree(runs["coarse"], tmp_path / "run")
    report = read_report(copy / "run.json")
    rewrite_report(copy, files={}, status="running", steps=report["steps"][:-1])
    assert Run(copy).steps == 6
    rewrite_report(copy, status="done", steps=report["steps"][:-1])
    with pytest.raises(InputError, match=r"history\.csv: has 6 steps, run\.json has 5; "):
        Run(copy)
    rewrite_report(copy, steps=report["steps"])
    heading, *rows = _lines(copy / "history.csv")
    cells = rows[1].split(",")
    cells[_names(heading).index("P")] = "0.5"
    (copy / "history.csv").write_text("".join([heading, rows[0], ",".join(cells), *rows[2:]]))
    with pytest.raises(
        InputError, match=r"has P = 0\.5 at step 2, run\.json .*: one of the two was changed; "
    ):
        Run(copy)
