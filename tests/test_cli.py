"""The command as a user runs it: exit codes, sentences and what is written."""

import contextlib
import json
import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import meshio
import pytest

from archord.cli import COMMANDS, run
from archord.output.history import read_history
from tests import forked

SCENE = str(Path(__file__).parents[1] / "scenes" / "steel_pin.toml")
COARSE = [
    "--set",
    "joint.relative_element_size=0.15",
    "--set",
    "joint.growth=1.0",
    "--set",
    "load.steps=4",
]
LONG = ["--set", "joint.relative_element_size=0.2", "--set", "load.steps=500"]
# a launcher inside a launcher: processes started by a test must not inherit the rank of the test
ENVIRONMENT = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_COMM", "PMIX_"))}
SOLVE = [sys.executable, "-m", "archord", "solve", SCENE]


def archord(
    *arguments: str, cwd: Path, ranks: int = 0, code: int = 0
) -> subprocess.CompletedProcess:
    """The command as it is started by hand under mpirun; without, in a fork of a process that has
    it loaded. It must end with ``code`` and without a traceback."""
    if ranks:
        command = ["mpirun", "-n", str(ranks), sys.executable, "-m", "archord", *arguments]
        result = subprocess.run(
            command, cwd=cwd, env=ENVIRONMENT, capture_output=True, text=True, timeout=300
        )
    else:
        result = forked.archord(*arguments, cwd=cwd)
    assert result.returncode == code, result.stderr
    assert "Traceback" not in result.stderr
    return result


def run_on_two_ranks(commands: list[list[str]], cwd: Path) -> subprocess.CompletedProcess:
    """All ``commands`` one after another under one launcher, whose exit code is 2 if all ended so,
    or with 0 on the ranks that had nothing to do."""
    code = (
        f"import sys; from archord.cli import run; ends = {{*map(run, {commands})}}; "
        "sys.exit(ends.pop() if ends in ({0}, {2}) else 1)"
    )
    command = ["mpirun", "-n", "2", sys.executable, "-c", code]
    return subprocess.run(
        command, cwd=cwd, env=ENVIRONMENT, capture_output=True, text=True, timeout=120
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_a_help_page(capsys, command):
    """Found in its file by its name; what arguments and options are stands beside them."""
    assert run([command, "--help"]) == 0
    page = capsys.readouterr().out
    assert page.startswith(f"Usage: archord {command} ")
    assert "Commands:" in page or "  -" in page


def test_solve_prints_steps_and_writes_the_run(tmp_path):
    """Plain lines off a terminal, results in runs/<scene name>, refused the second time without
    --force. With --quiet nothing is printed but by PETSC_OPTIONS: PETSc is finalized, and its
    output flushed, before the process ends."""
    first = archord("solve", SCENE, *COARSE, cwd=tmp_path)
    assert first.stderr == ""
    lines = first.stdout.splitlines()
    assert lines[1:3] == [
        f"{body} yields at 230.769 MPa, perfectly plastic" for body in ("pin", "block")
    ]
    assert [line.split()[0] for line in lines[4:]] == ["1", "2", "3", "4", "4"]
    history = (tmp_path / "runs" / "steel_pin" / "history.csv").read_text()
    said = (
        "runs/steel_pin: is not empty; choose another folder with -o, or overwrite a run in it "
        "with --force.\n"
    )
    assert archord("solve", SCENE, *COARSE, cwd=tmp_path, code=2).stderr == said
    assert (tmp_path / "runs" / "steel_pin" / "history.csv").read_text() == history
    for options, printed in (({}, ""), ({"PETSC_OPTIONS": "-log_view"}, "SNESSolve")):
        command = [*SOLVE, *COARSE, "--force", "--quiet"]
        environment = ENVIRONMENT | options
        quiet = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
        )
        assert (quiet.returncode, quiet.stderr) == (0, "")
        assert printed in quiet.stdout
        assert bool(printed) == bool(quiet.stdout)


def test_a_terminal_that_lacks_a_sign_shows_its_number():
    """The reference of scenes has one; it ended in a traceback."""
    command = [sys.executable, "-m", "archord", "scene", "--reference"]
    environment = ENVIRONMENT | {"PYTHONIOENCODING": "latin-1"}
    found = subprocess.run(command, env=environment, capture_output=True, timeout=300)
    assert (found.returncode, found.stderr) == (0, b"")
    assert "\\u2265" in found.stdout.decode("latin-1")


@pytest.mark.parametrize("quiet", [[], ["-q"]])
def test_a_terminal_shows_how_far_a_solve_is(tmp_path, quiet):
    """Between two lines of steps, in one line that moves; nothing of it with -q."""
    ours, theirs = pty.openpty()
    command = [*SOLVE, *COARSE, *quiet]
    environment = ENVIRONMENT | {"TERM": "xterm", "COLUMNS": "120"}
    process = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=theirs)
    said = b""
    os.close(theirs)
    with (
        contextlib.suppress(OSError),
        open(ours, "rb", buffering=0) as terminal,
    ):  # Linux' word for its end
        while read := terminal.read(1024):
            said += read
    assert process.wait() == 0
    assert (b" Newton iterations" in said, b"    4          2  " in said) == (not quiet, not quiet)
    assert (b" triangles" in said.partition(b"meshing about ")[2][:20]) == (not quiet)
    assert bool(said) == (not quiet)


def test_ranks_print_once_and_give_the_same_history(tmp_path):
    """mpirun -n 3: one report, and every number as on one rank."""
    one = archord("solve", SCENE, *COARSE, "-o", "one", cwd=tmp_path)
    three = archord("solve", SCENE, *COARSE, "-o", "three", cwd=tmp_path, ranks=3)
    assert three.stderr == ""
    assert len(three.stdout.splitlines()) == len(one.stdout.splitlines())
    a, b = (read_history(tmp_path / name / "history.csv") for name in ("one", "three"))
    for name in set(a) - {"seconds", "force_balance"}:
        assert a[name] == pytest.approx(b[name], rel=1e-9), name


def test_an_accuracy_is_reached_mesh_by_mesh(tmp_path):
    """One line a mesh, then the steps of the last one and the estimate; the run goes on from its
    folder alone."""
    asked = ["--set", "analysis.accuracy=0.05", "--set", "load.steps=4"]
    result = archord("solve", SCENE, *asked, cwd=tmp_path)
    assert result.stderr == ""
    levels = json.loads((tmp_path / "runs" / "steel_pin" / "run.json").read_text())["accuracy"][
        "levels"
    ]
    lines = result.stdout.splitlines()
    assert "P to 0.05 of its largest value" in lines[0]
    assert lines[1:3] == [
        f"{body} yields at 230.769 MPa, perfectly plastic" for body in ("pin", "block")
    ]
    assert [line.split()[4] for line in lines[4 : 4 + len(levels)]] == [
        str(level["dofs"]) for level in levels
    ]
    assert [line.split()[0] for line in lines[-5:-1]] == ["1", "2", "3", "4"]
    assert "estimated error of P" in lines[-1]
    again = archord("solve", SCENE, *asked, "--restart", cwd=tmp_path, code=2)
    assert "was solved with analysis.accuracy = absent, the scene says 0.05" in again.stderr
    again = archord("solve", "runs/steel_pin", "--restart", cwd=tmp_path)
    assert again.stdout.endswith("is finished: nothing to do.\n")


def test_a_run_that_cannot_go_on_exits_with_3(tmp_path):
    """The reason on stderr, accepted steps on disk."""
    limits = [
        "--set",
        "analysis.max_iterations=5",
        "--set",
        "stepping.minimum=1.0",
        "--set",
        "load.steps=10",
    ]
    result = archord(
        "solve", SCENE, "--set", "joint.relative_element_size=0.08", *limits, cwd=tmp_path, code=3
    )
    assert "no equilibrium at delta" in result.stderr
    assert "4 accepted steps are in runs/steel_pin" in result.stderr
    assert len(read_history(tmp_path / "runs" / "steel_pin" / "history.csv")["P"]) == 4


def test_a_load_beyond_small_strains_is_doubted_before_it_is_solved(tmp_path):
    """Once, and in run.json; other warnings of the kind follow with the steps."""
    elastic = [
        "--set",
        "pin.yield_stress=none",
        "--set",
        "block.yield_stress=none",
        "--set",
        "joint.growth=1.0",
    ]
    far = [
        "--set",
        "load.displacement=30",
        "--set",
        "load.steps=1",
        "--set",
        "joint.relative_element_size=0.2",
    ]
    result = archord("solve", SCENE, *elastic, *far, "-o", "run", cwd=tmp_path)
    said = (
        "load.displacement moves the pin by 0.15 R: small-strain theory makes P about 2.4 % too "
        "low there"
    )
    assert result.stderr.startswith(f"archord: warning: {said}")
    assert result.stderr.count("small-strain") == 1
    assert json.loads((tmp_path / "run" / "run.json").read_text())["warnings"][0].startswith(said)


def kill_after(steps: int, command: list[str], kill: int, folder: Path) -> tuple[int, bytes]:
    """Run ``command``, which writes to ``run``, send it the signal once the steps are there; exit
    code and stderr."""
    history = folder / "run" / "history.csv"
    with subprocess.Popen(
        command, cwd=folder, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        deadline = time.monotonic() + 600  # a busy machine takes minutes to start
        while process.poll() is None and time.monotonic() < deadline:
            if history.exists() and len(history.read_text().splitlines()) > steps:
                break
            time.sleep(0.01)
        process.send_signal(kill)
        errors = process.communicate(timeout=300)[1]
    return process.returncode, errors


@pytest.mark.parametrize(
    ("ranks", "kill", "code"),
    [
        (0, signal.SIGINT, 130),
        (0, signal.SIGTERM, 143),
        (0, signal.SIGKILL, -9),
        (2, signal.SIGINT, None),
    ],
)
def test_a_killed_run_leaves_its_steps_readable(tmp_path, ranks, kill, code):
    """Whatever step is on disk when the process dies can be read; Ctrl-C says so in one line.
    mpirun hands it on as SIGTERM: the run notes it before all ranks end, but for that of Open MPI
    6, which kills them at once."""
    launcher = ["mpirun", "-n", str(ranks)] if ranks else []
    returned, errors = kill_after(3, [*launcher, *SOLVE, *LONG, "-o", "run"], kill, tmp_path)
    assert returned == code or (ranks and returned != 0)
    rows = len(read_history(tmp_path / "run" / "history.csv")["P"])
    assert 3 <= rows < 500
    with meshio.xdmf.TimeSeriesReader(tmp_path / "run" / "fields.xdmf") as reader:
        assert reader.num_steps >= rows
        reader.read_points_cells()
        loads = [reader.read_data(k)[0] for k in range(reader.num_steps)]
    assert loads == sorted(loads)
    report = json.loads((tmp_path / "run" / "run.json").read_text())
    assert report["totals"]["accepted_steps"] >= rows - 1
    assert b"Traceback" not in errors
    if kill != signal.SIGKILL:
        assert ranks or f"interrupted by {kill.name} after step {rows}".encode() in errors
        kills_at_once = ranks and "(Open MPI) 6" in subprocess.check_output(
            ["mpirun", "--version"], text=True
        )
        assert report["status"] == "interrupted" or (
            kills_at_once and report["status"] == "running"
        )
        assert report["totals"]["accepted_steps"] == rows or kills_at_once


@pytest.mark.parametrize(
    ("command", "code"), [(SOLVE, 141), ([*SOLVE[:3], "scene", "--reference"], 0)]
)
def test_a_reader_that_has_seen_enough_ends_the_command_without_a_word(tmp_path, command, code):
    """As ``archord solve SCENE | head -1`` does: no trace of PETSc or Python; a solve says that it
    is not done."""
    with subprocess.Popen(
        command, cwd=tmp_path, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        if command is SOLVE:
            assert b"elastic-plastic joint" in process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait(120) == code


def test_scene_prints_an_example_that_solves(tmp_path):
    example = archord("scene", "--example", cwd=tmp_path)
    (tmp_path / "example.toml").write_text(example.stdout)
    archord("solve", "example.toml", *COARSE, cwd=tmp_path)
    archord("scene", cwd=tmp_path, code=2)
