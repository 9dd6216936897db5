"""Files that grow in place: kept, grown and continued; a full disk costs at most the step in progress."""

import errno
import os
import re
import resource
from contextlib import contextmanager

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from archord.output.disk import WriteError, on_root, replace_text
from archord.output.history import read_history
from archord.output.run import solve_scene
from archord.output.step_file import StepFile, open_or_create
from archord.scene.errors import InputError
from tests.output.run_files import accepted_steps
from tests.solver.solving import scene

SHAPES = {"a": ((1000,), "<f8"), "pin/b": ((20, 3, 2), "<f8")}
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
    """No file may grow beyond ``size``, as on a disk that is full (EFBIG in the place of ENOSPC)."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_steps_are_kept_grown_and_overwritten(tmp_path):
    """Room for three, grown to five after two; a run that goes on after one of them overwrites the rest."""
    file = StepFile.create(tmp_path / "x.h5", 3, SHAPES, FIXED)
    holds(file.path, 0)
    for step in (1, 2):
        file.write(step, 0.1 * step, values(step))
        holds(file.path, step)
    file = open_or_create(file.path, 5, SHAPES, FIXED, 2)
    holds(file.path, 2)
    assert file.steps == 5
    for step in (3, 4, 5):
        file.write(step, 0.1 * step, values(step))
    holds(file.path, 5)
    file = open_or_create(file.path, 4, SHAPES, FIXED, 1)
    file.write(2, 0.1 * 2, values(2))
    holds(file.path, 2)
    assert file.loads == [0.1, 0.2]
    assert os.listdir(tmp_path) == ["x.h5"]


def test_a_reader_does_not_disturb_the_run(tmp_path):
    """The file may be open in another program, which locks it for HDF5's own writers, while steps are written."""
    file = StepFile.create(tmp_path / "x.h5", 3, SHAPES, FIXED)
    with h5py.File(file.path) as reader:
        file.write(1, 0.1, values(1))
        assert reader["load"].shape == (3,)
    holds(file.path, 1)


def test_no_byte_of_the_structure_changes(tmp_path):
    """A step changes its own data, its load and the count, and nothing else: nothing to break in a kill."""
    file = StepFile.create(tmp_path / "x.h5", 3, SHAPES, FIXED)
    before = np.fromfile(file.path, dtype=np.uint8)
    file.write(1, 0.1, values(1))
    file.write(2, 0.2, values(2))
    after = np.fromfile(file.path, dtype=np.uint8)
    assert len(before) == len(after)
    data = np.zeros(len(after), dtype=bool)
    with h5py.File(file.path) as reader:
        for name in ["load", "accepted", *(f"{n}/{s:04d}" for n in SHAPES for s in (1, 2))]:
            start = reader[name].id.get_offset()
            data[start : start + reader[name].nbytes] = True
    assert (before[~data] == after[~data]).all()
    assert (before[data] != after[data]).any()


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda path: path.unlink(), "is missing"),
        (lambda path: os.truncate(path, 3000), "is damaged"),
        (lambda path: path.write_bytes(b"text"), "is damaged"),
        (lambda path: StepFile.create(path, 3, {"a": ((7,), "<f8")}, FIXED), "does not hold the first 1 steps"),
        (lambda path: StepFile.create(path, 3, SHAPES, FIXED), "does not hold the first 1 steps"),
    ],
)
def test_a_file_that_cannot_go_on_is_refused(tmp_path, damage, said):
    """Missing, cut short, no HDF5, other fields, fewer steps."""
    path = tmp_path / "x.h5"
    StepFile.create(path, 3, SHAPES, FIXED).write(1, 0.1, values(1))
    damage(path)
    with pytest.raises(InputError, match=said):
        open_or_create(path, 5, SHAPES, FIXED, 1)


def test_a_file_that_cannot_be_replaced_stays(tmp_path):
    """The old content, no half successor, and an error that names the file; the same for a file that grows."""
    path = tmp_path / "x.txt"
    replace_text(path, "old")
    with file_size_limit(10), pytest.raises(OSError, match=r"x\.txt") as error:
        replace_text(path, "new" * 10)
    assert error.value.errno == errno.EFBIG
    assert path.read_text() == "old"
    file = StepFile.create(tmp_path / "x.h5", 3, SHAPES, FIXED)
    file.write(1, 0.1, values(1))
    with file_size_limit(os.path.getsize(file.path)), pytest.raises(OSError, match=r"x\.h5"):
        file.grow(20)
    holds(file.path, 1)
    assert sorted(os.listdir(tmp_path)) == ["x.h5", "x.txt"]


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
    return {path.name: path.stat().st_size for path in sorted(folder.iterdir(), key=lambda p: p.stat().st_size)}


@pytest.mark.parametrize("place", range(7))
def test_a_full_disk_stops_the_run_and_keeps_its_steps(tmp_path, sizes, place):
    """One byte too few for each of the files in turn: stopped with a sentence, all that is there opens."""
    with file_size_limit(list(sizes.values())[place] - 1):
        outcome = solve_scene(PROBLEM, tmp_path, MPI.COMM_SELF)
    assert outcome.status == "stopped"
    found = re.fullmatch(r".*/(\S+) cannot be written: File too large", outcome.message)
    assert found
    assert found[1] in sizes
    steps = accepted_steps(tmp_path)
    assert len(outcome.steps) <= steps <= len(outcome.steps) + 1
    assert not list(tmp_path.glob("*.new"))


@pytest.mark.mpi
def test_an_error_of_rank_0_is_raised_on_every_rank(comm):
    """Only rank 0 writes, all ranks learn that it could not, with the file's name."""

    def fails():
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "run/fields.h5")

    with pytest.raises(WriteError, match=r"^run/fields\.h5 cannot be written: No space left on device$"):
        on_root(comm, fails)
    assert on_root(comm, lambda: 7) == (7 if comm.rank == 0 else None)
