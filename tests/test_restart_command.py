"""``archord solve --restart`` and ``--extend`` as a user runs them: exit codes, sentences, ranks;
and a full disk. Kills at random moments: whatever is on disk opens, and no accepted step is lost.

``pytest tests/test_restart_command.py --kills 50`` kills more often.
"""

import json
import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest

from archord.output.folder import occupied
from archord.output.history import read_history
from archord.report.errors import InputError
from tests.forked import Run
from tests.output.run_files import accepted_steps, same_run
from tests.test_cli import ENVIRONMENT, SCENE, archord, kill_after, run_on_two_ranks

COARSE = ["--set", "joint.relative_element_size=0.25", "--set", "load.steps=8"]
COARSEST = ["--set", "joint.relative_element_size=0.3", "--set", "load.steps=15"]


def killed(folder, after: int, ranks: int = 0) -> int:
    """Start a run, kill all its ranks once ``after`` steps are there; the number of accepted
    steps."""
    launcher = ["mpirun", "-n", str(ranks)] if ranks else []
    command = [*launcher, sys.executable, "-m", "archord", "solve", SCENE, *COARSE, "-o", "run"]
    kill_after(after, command, signal.SIGKILL, folder)
    for _ in range(300):  # mpirun's ranks outlive it by a moment
        with suppress(InputError), occupied(folder / "run"):
            return accepted_steps(folder / "run")
        time.sleep(0.1)
    raise AssertionError("the killed run lives")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The run that nobody disturbed."""
    folder = tmp_path_factory.mktemp("whole")
    archord("solve", SCENE, *COARSE, "-o", "run", cwd=folder)
    return folder / "run"


def test_a_killed_run_goes_on_and_says_where(tmp_path, whole):
    """From the run folder, with the steps that are left; a second time there is nothing to do."""
    steps = killed(tmp_path, 3)
    assert 3 <= steps < 8
    result = archord("solve", "run", "--restart", cwd=tmp_path)
    lines = result.stdout.splitlines()
    assert lines[0] == f"continuing run after step {steps} of 8."
    rows = [line.split()[0] for line in lines[1:-1] if line[:5].strip().isdigit()]
    assert rows == [str(k) for k in range(steps + 1, 9)]
    same_run(whole, tmp_path / "run", 1e-12)
    again = archord("solve", SCENE, *COARSE, "-o", "run", "--restart", cwd=tmp_path)
    assert again.stdout == "the run in run is finished: nothing to do.\n"


def test_two_ranks_are_continued_by_three(tmp_path, whole):
    """Killed on two ranks, finished on three, compared with one."""
    steps = killed(tmp_path, 2, ranks=2)
    result = archord("solve", SCENE, *COARSE, "-o", "run", "--restart", cwd=tmp_path, ranks=3)
    assert result.stdout.count(f"continuing run after step {steps} of 8.") == 1
    same_run(whole, tmp_path / "run", 1e-8, 3e-7)
    report = json.loads((tmp_path / "run" / "run.json").read_text())
    assert [(r["after_step"], r["ranks"]) for r in report["restarts"]] == [(steps, 3)]


REFUSED = [
    (
        ["run", "--restart", "--set", "pin.nu=0.31"],
        "run: was solved with pin.nu = 0.3, the scene says 0.31;",
    ),
    (["run", "--restart", "-o", "other"], "-o does not go with a run folder"),
    (["run", "--restart", "--extend"], "choose one of --force, --restart and --extend"),
    (["run", "--extend"], "run: ends at 0.1 already;"),
    (["nothing", "--restart"], "nothing: cannot be read: No such file or directory."),
    (
        [SCENE, "-o", "nothing", "--extend"],
        "nothing/checkpoint.h5: cannot be read, so that the run cannot be",
    ),
]


def test_what_cannot_be_continued_is_refused_once(tmp_path, whole):
    """All of these under one launcher: exit code 2 of each on every rank, each sentence told once,
    nothing changed."""
    (tmp_path / "run").symlink_to(whole)
    before = {path.name: path.stat().st_mtime_ns for path in whole.iterdir()}
    lists = [["solve", *arguments] for arguments, _ in REFUSED]
    result = run_on_two_ranks(lists, tmp_path)
    assert result.returncode == 2
    assert [result.stderr.count(said) for _, said in REFUSED] == [1] * len(REFUSED)
    assert "Traceback" not in result.stderr
    assert {path.name: path.stat().st_mtime_ns for path in whole.iterdir()} == before
    assert os.listdir(tmp_path) == ["run"]


def test_a_finished_run_is_extended(tmp_path):
    """Two steps become four; the resolved scene is the whole path."""
    short = [
        "--set",
        "joint.relative_element_size=0.3",
        "--set",
        "load.displacement=1",
        "--set",
        "load.steps=2",
    ]
    archord("solve", SCENE, *short, "-o", "run", "-q", cwd=tmp_path)
    longer = ["--set", "load.displacement=2", "--set", "load.steps=4"]
    result = archord("solve", "run", "--extend", *longer, cwd=tmp_path)
    assert result.stdout.splitlines()[0] == "extending run after step 2 of 4."
    assert read_history(tmp_path / "run" / "history.csv")["delta/dR"] == pytest.approx(
        [0.5, 1.0, 1.5, 2.0]
    )
    archord("solve", "run/scene.toml", "-o", "again", "-q", cwd=tmp_path)
    same_run(tmp_path / "again", tmp_path / "run", 1e-12)


@pytest.mark.parametrize("ranks", [0, 2])
def test_a_full_disk_is_one_sentence_and_the_run_can_go_on(tmp_path, whole, ranks):
    """Exit code 3 on all ranks when a file reaches the limit, whichever does first; with room again
    the run is finished by --restart."""
    # what is written before the first step is smaller
    limit = (whole / "fields" / "0000.h5").stat().st_size
    assert limit > max(
        path.stat().st_size for path in whole.iterdir() if path.suffix in (".toml", ".csv", ".json")
    )
    launcher = ["mpirun", "-n", str(ranks)] if ranks else []
    # Open MPI has large files of its own: the limit comes after its start
    code = (
        "import resource, sys; from mpi4py import MPI\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))\n"
        "from archord.cli import run; sys.exit(run(sys.argv[1:]))"
    )
    command = [*launcher, sys.executable, "-c", code, "solve", SCENE, *COARSE, "-o", "run"]
    result = subprocess.run(
        command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, timeout=120
    )
    assert result.returncode == 3
    assert result.stderr.count(" cannot be written: File too large.") == 1
    assert "Traceback" not in result.stderr
    assert json.loads((tmp_path / "run" / "run.json").read_text())["status"] == "stopped"
    steps = accepted_steps(tmp_path / "run")
    said = "run holds no accepted step: starting from the beginning."
    if steps:
        said = f"continuing run after step {steps} of 8."
    again = archord("solve", "run", "--restart", cwd=tmp_path)
    assert again.stdout.splitlines()[0] == said
    tolerances = (1e-8, 3e-7) if ranks else (1e-12,)  # steps of two ranks are among them
    same_run(whole, tmp_path / "run", *tolerances)


def test_a_run_survives_any_number_of_kills(tmp_path, request):
    """Killed at random and restarted until the kills are used up; finished runs are compared, and
    the next begins."""
    kills = request.config.getoption("--kills")
    chance = random.Random(1)
    whole = Run(tmp_path, SCENE, *COARSEST, "-o", "whole")
    assert whole.end() == 0
    seconds = time.monotonic() - whole.begun
    assert accepted_steps(tmp_path / "whole") == whole.printed == 15
    finished = steps = 0
    caught_at: list[int] = []
    while len(caught_at) < kills or steps:
        folder = tmp_path / f"run{finished}"
        run = Run(
            tmp_path,
            SCENE,
            *COARSEST,
            "-o",
            folder.name,
            *(["--restart"] if folder.exists() else []),
        )
        code = run.end(chance.uniform(0, 0.7 * seconds) if len(caught_at) < kills else None)
        before = steps
        steps = accepted_steps(folder) if folder.exists() else 0
        assert steps >= max(before, run.printed)
        if code != 0:
            caught_at.append(steps)
            continue
        assert steps == 15
        same_run(tmp_path / "whole", folder, 1e-12)
        finished = finished + 1
        steps = 0
    assert finished > 0
    assert (
        len(set(caught_at)) > min(kills, 10) / 3
    )  # at steps all over the path, on a busy machine at fewer of them
