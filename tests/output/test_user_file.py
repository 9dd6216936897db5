"""Files that a user names: the old one stays until the new one is whole, and whatever can be
written to is."""

from __future__ import annotations

import os
import re
import resource
import stat
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from archord.cli import run
from archord.output.user_file import check_target, writing
from archord.report.errors import InputError
from archord.report.figure import new_figure, save
from archord.report.files import replacing, write_report

ROOT = Path(__file__).parents[2]
SCENE = str(ROOT / "scenes" / "steel_pin.toml")
SMALL = ["--set", "joint.relative_element_size=0.3", "--set", "joint.block_size=50"]
COMMANDS = {
    "joint.h": ["law", "--scene", SCENE, "--force", "--export"],
    "joint.json": ["law", "--scene", SCENE, "--force", "--export"],
    "laws.png": ["law", "paper", "--scene", SCENE, "--plot"],
    "deck.inp": ["export-deck", SCENE, *SMALL, "--force", "-o"],
    "mesh.png": ["mesh", SCENE, *SMALL, "-o"],
}


@contextmanager
def full_disk(room: int = 1500) -> Iterator[None]:
    """No file grows beyond ``room`` bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_full_disk_takes_no_old_file(name, tmp_path, capsys):
    """Exit code 2, one sentence, the old file as it was, and nothing beside it."""
    target = tmp_path / name
    target.write_text("what was there")
    with full_disk():
        assert run([*COMMANDS[name], str(target)]) == 2
    assert f"{target}: cannot be written: File too large." in capsys.readouterr().err
    assert target.read_text() == "what was there"
    assert os.listdir(tmp_path) == [name]
    assert run([*COMMANDS[name], str(target)]) == 0
    assert target.stat().st_size > 1500


def test_reports_and_pictures_of_benchmarks_stay_as_well(tmp_path):
    rows = [{"a": k, "b": "x" * 20} for k in range(200)]
    figure = new_figure(3, 3)

    def draw(file):
        with replacing(file) as new:
            save(figure, new)

    for name in ("t.csv", "t.md", "t.png"):
        (tmp_path / name).write_text("old")
    with full_disk(), pytest.raises(OSError, match="File too large"):
        write_report(tmp_path, "t", rows, "| a |")
    with full_disk(100), pytest.raises(OSError, match="File too large"):
        draw(tmp_path / "t.png")
    assert {(tmp_path / f"t.{end}").read_text() for end in ("csv", "md", "png")} == {"old"}
    assert len(os.listdir(tmp_path)) == 3
    assert len(write_report(tmp_path, "t", rows, "| a |", draw)) == 3
    assert (tmp_path / "t.csv").stat().st_size > 1500


def test_what_fails_half_way_leaves_the_old_file(tmp_path):
    """Whatever fails: also what is no fault of the system."""
    target = tmp_path / "x.txt"
    target.write_text("old")
    with pytest.raises(ZeroDivisionError), writing(target) as new:
        raise ZeroDivisionError(new.write_text("half"))
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["x.txt"]


def test_links_and_permissions_stay(tmp_path):
    """A link goes on pointing to its file, which keeps who may read it; a new file gets what the
    user's are given."""
    real, link, fresh = (tmp_path / name for name in ("real.txt", "link.txt", "fresh.txt"))
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to("real.txt")
    for target in (link, fresh):
        with writing(target) as new:
            new.write_text("new")
    assert link.is_symlink()
    assert real.read_text() == "new"
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE(fresh.stat().st_mode) == 0o666 & ~mask
    dangling = tmp_path / "dangling.txt"
    dangling.symlink_to("later.txt")
    with writing(dangling) as new:
        new.write_text("new")
    assert (tmp_path / "later.txt").read_text() == "new"


def test_pipes_and_devices_are_written_to(tmp_path):
    """No file takes their place."""
    pipe = tmp_path / "pipe.txt"
    os.mkfifo(pipe)
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    with writing(pipe) as new:
        new.write_text("through")
    reader.join(timeout=10)
    assert read == ["through"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    with writing(Path("/dev/null")) as new:
        new.write_text("gone")
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    program = "from pathlib import Path; from archord.output.user_file import *\n"
    program += (
        "p = Path('/dev/stdout'); check_target(p, force=False)\nwith writing(p) as new: "
        "new.write_text('told')"
    )
    with (tmp_path / "out").open("w") as out:
        subprocess.run([sys.executable, "-c", program], stdout=out, cwd=ROOT, check=True)
    assert (tmp_path / "out").read_text() == "told"


def test_a_full_device_is_told(tmp_path):
    said = "/dev/full: cannot be written: No space left on device"
    with pytest.raises(InputError, match=said), writing(Path("/dev/full")) as new:
        new.write_text("x")
    (tmp_path / "old").touch()
    with pytest.raises(InputError, match="is there already"):
        check_target(tmp_path / "old", force=False)


def test_nothing_that_users_name_is_written_in_place():
    """What commands, exports and pictures write, they write to the ``new`` that `writing` and
    `replacing` give."""
    fits = (
        "law_fit.py",
        "hardening_fit.py",
        "factor_fit.py",
    )  # their tables are of this checkout, not of a user
    tables = {f"postprocess/laws/general/{file}" for file in fits}
    writes = re.compile(
        r"(\w+)\.write_(?:text|bytes)\(|to_csv\((\w+)|\bsave\((?:figure|canvas), (\w+)"
    )
    for room in ("archord", "postprocess", "report", "benchmarks/paper"):
        for file in sorted((ROOT / room).rglob("*.py")):
            name = str(file.relative_to(ROOT))
            if name in tables or file.relative_to(ROOT).parts[1] in os.listdir(ROOT):
                continue
            found = {
                name
                for names in writes.findall(file.read_text(encoding="utf-8"))
                for name in names
                if name
            }
            assert found <= {"new"}, name
