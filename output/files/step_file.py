"""HDF5 files that grow step by step and survive a kill.

The file itself is written whole after every step and put into its place in one move. Large arrays
lie apart, in a file for each step that never changes again, and the file has links to them: what is
written then grows with the steps, not with their square. A reader opens one file and finds
``name/0001`` and so on, whatever lies where.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import count, pairwise
from pathlib import Path

import h5py
import numpy as np

from archord.output.files.disk import replace_file
from archord.report.errors import InputError

Arrays = dict[str, np.ndarray]

_GROUPS = h5py.h5p.create(h5py.h5p.LINK_CREATE)
_GROUPS.set_create_intermediate_group(True)
# what reading a damaged file may raise
UNREADABLE = (MemoryError, OSError, LookupError, RuntimeError, TypeError, ValueError)
_NUMBERS = count()  # HDF5 tells open files apart by name


class StepFile:
    """``path`` with the arrays ``fixed``, ``name/0001`` and so on for each step, ``accepted``, the
    number of steps, and ``load``, what each was reached at.

    ``apart`` puts the arrays into files of their own, NAME/0000.h5 for the fixed ones. The file
    appears with the next step, the first one or that ``after`` some steps that are there, as this
    version or version 0.1 wrote them. Raises `OSError`, and `InputError` if a file that should go
    on is missing, damaged or does not hold these steps. ``loads`` and ``names`` are of all
    steps and their arrays.

    A file that holds one more step keeps it where `write` adds a step at the same load: arrays that
    are evaluated from an accepted state once more differ from those of the step itself, where laws
    and materials depend on the length of the step or on their state at its beginning.
    """

    def __init__(self, path: Path, fixed: Arrays, after: int = 0, *, apart: bool = False) -> None:
        self.path = path
        self._apart = apart
        self.loads: list[float] = []
        self.names: list[set[str]] = []
        self._next = self._read_next(after) if path.exists() else None
        earlier = self._read(fixed, after) if after else []
        self._file = hdf5_in_memory()
        self._file["accepted"] = 0
        self._file.create_dataset("load", (0,), "f8", maxshape=(None,), chunks=(64,))
        self._add(0, fixed)
        for load, arrays in earlier:
            self._add_step(load, arrays)

    def write(self, load: float, arrays: Arrays) -> None:
        """Add a step, reached at ``load``. Raises `OSError`: then the file is what it was, this
        object of no use."""
        self._add_step(load, self._kept(load, arrays))
        replace_file(self.path, image(self._file))

    def _kept(self, load: float, arrays: Arrays) -> Arrays:
        """The ``arrays``, those that the file has of this step as they are there."""
        there = self._next
        self._next = None
        if there is None:
            return arrays
        load_there, arrays_there = there
        if load_there != load:
            return arrays
        kept = {name: arrays_there.get(name, array) for name, array in arrays.items()}
        same = all(kept[name].shape == np.shape(array) for name, array in arrays.items())
        return kept if same else arrays

    def _add_step(self, load: float, arrays: Arrays) -> None:
        self.loads.append(load)
        self.names.append(set(arrays))
        n_steps = len(self.loads)
        self._add(n_steps, arrays)
        self._file["accepted"][()] = n_steps
        loads = self._file["load"]
        loads.resize((n_steps,))
        loads[-1:] = load

    def _add(self, step: int, arrays: Arrays) -> None:
        """The arrays of ``step``, 0 for the fixed ones."""
        if not self._apart:
            for name, array in arrays.items():
                put(self._file, _dataset(name, step), array)
            return
        beside = f"{self.path.stem}/{step_name(step)}.h5"
        with hdf5_in_memory() as own:
            for name, array in arrays.items():
                put(own, name, array)
            content = image(own)
        self.path.with_suffix("").mkdir(exist_ok=True)
        replace_file(self.path.parent / beside, content)
        for name in arrays:
            self._file[_dataset(name, step)] = h5py.ExternalLink(beside, name)

    def _read_next(self, after: int) -> tuple[float, Arrays] | None:
        """Load and arrays of the step ``after`` so many, None where the file has no whole one."""
        ending = f"/{step_name(after + 1)}"
        try:
            with h5py.File(self.path) as file:
                if file["accepted"][()] <= after:
                    return None
                load = float(file["load"][after])
                found = {
                    path.removesuffix(ending): array
                    for path, array in all_arrays(file)
                    if path.endswith(ending)
                }
                return load, found
        except UNREADABLE:
            return None

    def _read(self, fixed: Arrays, after: int) -> list[tuple[float, Arrays]]:
        """Load and arrays of the first steps, as many as ``after``."""
        steps: dict[str, Arrays] = {}
        try:
            with h5py.File(self.path) as file:
                there = {name: a for name, a in fixed.items() if name in file}
                fits = all(file[name].shape == a.shape for name, a in there.items())
                if not fits:
                    raise ValueError("its arrays belong to another mesh, or another version")
                if file["accepted"][()] < after:
                    raise ValueError(f"it does not hold the first {after} steps of this run")
                loads = file["load"][:after].tolist()
                if not fixed:  # a run without contact has nothing to tell of it
                    return [(load, {}) for load in loads]
                for path, array in all_arrays(file):
                    name, _, step = path.rpartition("/")
                    steps.setdefault(step, {})[name] = array
                return [(load, steps[step_name(k)]) for k, load in enumerate(loads, start=1)]
        except UNREADABLE as error:
            said = f"is missing or damaged, so that the run cannot be continued ({error})"
            raise InputError(self.path, f"{said}.") from None


def put(file: h5py.File, name: str, values: np.ndarray) -> None:
    """``file[name] = values``, in a third of its time."""
    array = np.ascontiguousarray(values)
    kind = h5py.h5t.py_create(array.dtype)
    space = h5py.h5s.create_simple(array.shape)
    dataset = h5py.h5d.create(file.id, name.encode(), kind, space, lcpl=_GROUPS)
    dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, array)


def hdf5_in_memory() -> h5py.File:
    """A new file that never comes near a disk."""
    return h5py.File(
        f"in memory {next(_NUMBERS)}", "w", driver="core", backing_store=False, block_size=4096
    )


def image(file: h5py.File) -> bytes:
    """What the open ``file`` is as bytes."""
    file.flush()
    return file.id.get_file_image()


def all_arrays(group: h5py.Group, prefix: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Every array of an open file by its name, also those that lie apart, which `h5py.Group.visit`
    leaves out."""
    for name in group:
        item = group[name]
        if isinstance(item, h5py.Dataset):
            yield prefix + name, item[()]
        else:
            yield from all_arrays(item, f"{prefix}{name}/")


def step_name(step: int) -> str:
    """Name of a step's dataset: its number in four digits or more."""
    return f"{step:04d}"


def times(loads: Sequence[float]) -> list[float]:
    """The times of steps reached at ``loads``: the loads, or the numbers of the steps where the
    loads do not only grow."""
    if all(a < b for a, b in pairwise(loads)):
        return [float(load) for load in loads]
    return [float(number) for number in range(1, len(loads) + 1)]


def _dataset(name: str, step: int) -> str:
    return f"{name}/{step_name(step)}" if step else name
