"""archord sweep in processes of its own: killed, interrupted, and under mpirun."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from archord.output.folder import report_of
from tests.studies.parts import numbers, sweep, table, times, written
from tests.test_cli import ENVIRONMENT, archord

CASES = 8  # some two seconds
TEXT = "[grid]\npin.E = [0.5, 0.7, 1.0, 1.82]\nload.steps = [5, 6]\n"
TEXT += "output.checkpoint = [true]\n"


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    """A sweep solved in one go."""
    folder = tmp_path_factory.mktemp("whole")
    assert sweep(written(folder, TEXT), "-o", folder / "out", "-q") == 0
    return folder / "out"


def started(file: str, folder: Path, ranks: int = 0) -> subprocess.Popen:
    launcher = ["mpirun", "-n", str(ranks)] if ranks else []
    command = [*launcher, sys.executable, "-m", "archord", "sweep", file, "-o", str(folder)]
    return subprocess.Popen(
        command, env=ENVIRONMENT, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


def done(folder: Path) -> set[str]:
    return {p.name for p in folder.glob("cases/*") if report_of(p).get("status") == "done"}


def until_cases_are_done(process: subprocess.Popen, number: int) -> None:
    """Wait until the process has reported so many cases; fails if it ends before."""
    for line in process.stdout:
        number -= " done, " in line
        if not number:
            return
    raise AssertionError(process.stderr.read())


def test_a_killed_sweep_goes_on_where_it_was(whole, tmp_path):
    """kill -9 at random moments: what is done stays as it is, and the end is that of the sweep in
    one go."""
    chance = random.Random(3)
    out = tmp_path / "out"
    file = written(tmp_path, TEXT)
    continued = 0
    for cases in (1, 3):
        finished = done(out)
        before = times(out)
        process = started(file, out)
        until_cases_are_done(process, cases)
        time.sleep(chance.uniform(0, 0.15))
        process.kill()
        process.communicate()
        after = times(out)
        for name, written_at in before.items():
            if name.split("/")[1] in finished:
                assert after[name] == written_at, name
        assert len(done(out)) >= len(finished) + cases
        continued += any(
            (p / "checkpoint.h5").exists() and p.name not in done(out) for p in out.glob("cases/*")
        )
    assert len(done(out)) < CASES
    assert sweep(file, "-o", out, "-q") == 0
    same_numbers(out, whole)
    assert any(report_of(p)["restarts"] for p in out.glob("cases/*")) or not continued


def same_numbers(a: Path, b: Path) -> None:
    """A continued run has the numbers of one in one go to round-off."""
    for one, other in zip(numbers(a), numbers(b), strict=True):
        for name in one:
            if name in ("run", "status", "output.checkpoint"):
                assert one[name] == other[name]
            elif name != "force_balance":
                assert float(one[name]) == pytest.approx(
                    float(other[name]), rel=1e-10, abs=1e-30
                ), name


@pytest.mark.parametrize("ranks", [0, 2])
def test_a_signal_ends_a_sweep_in_order(whole, tmp_path, ranks):
    """SIGTERM: running cases keep their accepted steps, the tables tell, and the sweep goes on to
    the same numbers."""
    out = tmp_path / "out"
    file = written(tmp_path, TEXT)
    process = started(file, out, ranks)
    until_cases_are_done(process, 2)
    process.send_signal(signal.SIGTERM)
    said, _ = process.communicate(timeout=60)
    assert process.returncode in ((1, 143) if ranks else (143,))  # Open MPI, MPICH
    if ranks:  # mpirun kills its ranks after a quarter of a second: the tables may not be there
        assert sweep(file, "-o", out, "--gather", "-q") == 0
    else:
        assert " open in " in said
    status = [row["status"] for row in table(out / "cases.csv")]
    finished = done(out)
    before = times(out)
    assert set(status) <= {"done", "interrupted", "open"}
    assert 2 <= status.count("done") == len(finished) < CASES
    assert sweep(file, "-o", out, "-q") == 0
    after = times(out)
    assert all(after[name] == at for name, at in before.items() if name.split("/")[1] in finished)
    same_numbers(out, whole)


def test_ranks_write_what_one_does(whole, tmp_path):
    """The same tables but for the seconds, to the last digit; told once."""
    result = archord("sweep", written(tmp_path, TEXT), "-o", "out", cwd=tmp_path, ranks=3)
    told = result.stderr.splitlines()
    assert len(told) == 1
    assert told[0].startswith("archord: warning: case 1 and 7 more: step 1: only 2 facets in")
    assert numbers(tmp_path / "out") == numbers(whole)
    assert numbers(tmp_path / "out", "cases.csv") == numbers(whole, "cases.csv")
    assert sum(" done, " in line for line in result.stdout.splitlines()) == CASES


def test_the_reader_of_the_progress_may_leave(tmp_path):
    """``archord sweep ... | head -1`` solves all cases."""
    file = written(tmp_path, "[grid]\npin.E = [0.5, 0.7, 1.0, 1.82]\n")
    process = started(file, tmp_path / "out")
    process.stdout.readline()
    process.stdout.close()
    assert process.wait(60) == 0
    assert len(done(tmp_path / "out")) == 4
    assert {row["status"] for row in table(tmp_path / "out" / "cases.csv")} == {"done"}


def test_the_job_script_calls_what_exists(tmp_path):
    """Without SLURM it is one part of one; within an array, it is the task's part."""
    root = Path(__file__).parents[2]
    script = root / "docs" / "cluster" / "sweep.sbatch"
    file = written(tmp_path, TEXT)
    command = ["bash", str(script), file, "-o", str(tmp_path / "out")]
    task = {
        "SLURM_ARRAY_TASK_ID": "6",
        "SLURM_ARRAY_TASK_COUNT": f"{CASES}",
        "TMPDIR": str(tmp_path),
    }
    for option, environment, said in (("--dry-run", {}, f"{CASES} cases, "), ("-q", task, "")):
        environment = ENVIRONMENT | environment
        result = subprocess.run(
            [*command, option], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert result.returncode == 0, result.stderr
        assert result.stdout.startswith(said)
    assert len(done(tmp_path / "out")) == 1
    assert not list(tmp_path.glob("archord.*"))  # its scratch is gone
