"""Files that grow step by step: kept and continued; a full disk costs at most the step in
progress."""

import errno
import os
import re
import resource
from contextlib import contextmanager

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from archord.output.files.disk import WriteError, replace_file
from archord.output.files.step_file import StepFile
from archord.output.history import read_history
from archord.output.ranks import agreed
from archord.output.run import solve_scene
from archord.report.errors import InputError
from tests.output.run_files import accepted_steps
from tests.solver.solving import scene

SHAPES = {"a": ((5000,), "<f8"), "pin/b": ((20, 3, 2), "<f8")}
FIXED = {"mesh/x": np.arange(30.0).reshape(10, 3), "mesh/tag": np.arange(5, dtype=np.int8)}


def values(step: int) -> dict[str, np.ndarray]:
    random = np.random.default_rng(step)
    return {name: random.normal(size=shape) for name, (shape, _) in SHAPES.items()}


def holds(path, steps: int) -> None:
    """The first ``steps`` steps and what is fixed, read by the HDF5 library."""
    with h5py.File(path) as file:
        assert file["accepted"][()] == steps
        assert file["load"][:steps] == pytest.approx(0.1 * np.arange(1, steps + 1))
        for name, fixed in FIXED.items():
            assert np.array_equal(file[name][()], fixed)
            assert file[name].dtype == fixed.dtype
        for step in range(1, steps + 1):
            for name, array in values(step).items():
                assert np.array_equal(file[f"{name}/{step:04d}"][()], array)


@contextmanager
def file_size_limit(size: int):
    """No file may grow beyond ``size``, as on a disk that is full (EFBIG in the place of
    ENOSPC)."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@pytest.fixture(params=[False, True], ids=["in one file", "apart"])
def apart(request) -> bool:
    return request.param


@pytest.fixture
def file(tmp_path, apart) -> StepFile:
    return StepFile(tmp_path / "x.h5", FIXED, apart=apart)


def test_steps_are_kept_and_continued(file, apart):
    """A run that goes on after one of two steps forgets the other."""
    for step in (1, 2):
        file.write(0.1 * step, values(step))
        holds(file.path, step)
    for after in (2, 1):
        again = StepFile(file.path, FIXED, after, apart=apart)
        assert again.loads == pytest.approx([0.1, 0.2][:after])
        again.write(0.1 * (after + 1), values(after + 1))
        holds(file.path, after + 1)
    assert not list(file.path.parent.rglob("*.new"))


def test_the_next_step_stays_at_the_same_load_and_not_at_another(file, apart):
    """A run that goes on keeps what its halted step wrote."""
    for step in (1, 2):
        file.write(0.1 * step, values(step))
    StepFile(file.path, FIXED, 1, apart=apart).write(0.1 * 2, values(7))
    holds(file.path, 2)
    StepFile(file.path, FIXED, 1, apart=apart).write(0.3, values(7))
    with h5py.File(file.path) as reader:
        assert np.array_equal(reader["pin/b/0002"][()], values(7)["pin/b"])


def test_a_file_of_version_0_1_goes_on(tmp_path):
    """It has room for steps to come, and all in one file."""
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as old:
        for name, array in FIXED.items():
            old[name] = array
        old["accepted"] = np.int64(2)
        old["load"] = np.array([0.1, 0.2, 0.0])
        for step in (1, 2, 3):
            for name, array in values(step).items():
                old[f"{name}/{step:04d}"] = array if step < 3 else 0 * array
    StepFile(path, FIXED, 2, apart=True).write(0.1 * 3, values(3))
    holds(path, 3)


def test_what_is_written_grows_with_the_steps(file, apart):
    """XDMF finds every array; the file of a step that lies apart never changes again, and readers
    see whole files."""
    file.write(0.1, values(1))
    with h5py.File(file.path) as reader:
        file.write(0.1 * 2, values(2))
        assert reader["accepted"][()] == 1
    if apart:
        with h5py.File(file.path.parent / "x" / "0001.h5") as one:
            assert np.array_equal(one["pin/b"][()], values(1)["pin/b"])
    beside = {path: path.stat() for path in file.path.parent.glob("x/*.h5")}
    file.write(0.1 * 3, values(3))
    assert {path: path.stat() for path in beside} == beside
    assert len(beside) == (3 if apart else 0)
    if apart:
        assert file.path.stat().st_size < sum(array.nbytes for array in values(1).values())


def two_steps(path, fixed) -> None:
    file = StepFile(path, fixed, apart=True)
    for step in (1, 2):
        file.write(0.1 * step, values(step))


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda path: path.unlink(), "is missing or damaged"),
        (lambda path: os.truncate(path, 3000), "is missing or damaged"),
        (lambda path: path.write_bytes(b"text"), "is missing or damaged"),
        (lambda path: os.truncate(path.parent / "x" / "0001.h5", 3000), "is missing or damaged"),
        (lambda path: (path.parent / "x" / "0001.h5").unlink(), "is missing or damaged"),
        (
            lambda path: two_steps(path, FIXED | {"mesh/tag": np.arange(6)}),
            "its arrays belong to another mesh, or another version",
        ),
        (
            lambda path: StepFile(path, FIXED).write(0.1, values(1)),
            "does not hold the first 2 steps",
        ),
    ],
)
def test_a_file_that_cannot_go_on_is_refused(tmp_path, damage, said):
    """Missing, cut short, no HDF5, a step missing or cut short, another mesh, fewer steps."""
    path = tmp_path / "x.h5"
    two_steps(path, FIXED)
    damage(path)
    with pytest.raises(InputError, match=said):
        StepFile(path, FIXED, 2, apart=True)


def test_a_file_that_cannot_be_replaced_stays(tmp_path, file):
    """The old content, no half successor, and an error that names the file; the same for a file
    that grows."""
    path = tmp_path / "x.txt"
    replace_file(path, "old")
    with file_size_limit(10), pytest.raises(OSError, match=r"x\.txt") as error:
        replace_file(path, "new" * 10)
    assert error.value.errno == errno.EFBIG
    assert path.read_text() == "old"
    file.write(0.1, values(1))
    with file_size_limit(9000), pytest.raises(OSError, match=r"x/0002\.h5|x\.h5"):
        file.write(0.2, values(2))
    holds(file.path, 1)
    assert not list(tmp_path.rglob("*.new"))


def test_a_missing_end_of_a_table_is_ignored(tmp_path):
    """A copy of history.csv cut anywhere in its last row reads as the rows before it."""
    path = tmp_path / "history.csv"
    whole = b"step,P [N/mm]\r\n1,0.25\r\n2,0.75\r\n"
    for end in range(len(whole) - 8, len(whole)):
        path.write_bytes(whole[:end])
        assert read_history(path) == {"step": [1.0], "P": [0.25]}
    path.write_bytes(whole)
    assert read_history(path)["P"] == [0.25, 0.75]


PROBLEM = scene(0.25, 4, yield_stress=0.002)


@pytest.fixture(scope="module")
def sizes(tmp_path_factory):
    """Sizes of the files of a whole run, smallest first, and what it solved."""
    folder = tmp_path_factory.mktemp("whole")
    assert solve_scene(PROBLEM, folder, MPI.COMM_SELF).status == "done"
    assert accepted_steps(folder) == 4
    assert len(list(folder.rglob("*.*"))) == 12
    files = sorted(
        (path for path in folder.rglob("*") if path.is_file()), key=lambda path: path.stat().st_size
    )
    return {f"{path.relative_to(folder)}": path.stat().st_size for path in files}


@pytest.mark.parametrize("place", range(12))
def test_a_full_disk_stops_the_run_and_keeps_its_steps(tmp_path, sizes, place):
    """One byte too few for each of the files in turn: stopped with a sentence, all that is there
    opens."""
    with file_size_limit(list(sizes.values())[place] - 1):
        outcome = solve_scene(PROBLEM, tmp_path, MPI.COMM_SELF)
    assert outcome.status == "stopped"
    found = re.fullmatch(rf"{tmp_path}/(\S+) cannot be written: File too large", outcome.message)
    assert found
    assert found[1] in sizes
    steps = accepted_steps(tmp_path)
    assert len(outcome.steps) <= steps <= len(outcome.steps) + 1
    assert not list(tmp_path.rglob("*.new"))


@pytest.mark.mpi
def test_an_error_of_rank_0_is_raised_on_every_rank(comm):
    """Only rank 0 writes, all ranks learn that it could not, with the file's name."""

    def fails():
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "run/fields.h5")

    with pytest.raises(
        WriteError, match=r"^run/fields\.h5 cannot be written: No space left on device$"
    ):
        agreed(comm, fails)
    assert agreed(comm, lambda: 7) == 7
