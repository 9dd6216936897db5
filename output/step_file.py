"""HDF5 files that grow step by step and survive a kill.

All datasets of all steps are laid out when the file is made, in memory, and the file appears on disk in one move. A
step is written in place, past the HDF5 library, at the offsets of its datasets: no byte of the file's structure changes
after its birth. ``accepted`` tells how many steps hold data; it is written last.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from archord.output.disk import naming, replace_file, write_at
from archord.scene.errors import InputError

Shapes = dict[str, tuple[tuple[int, ...], str]]


class StepFile:
    """The existing file ``path``, with room for ``steps`` steps of named arrays: ``name/0001`` and so on.

    ``shapes`` holds shape and dtype of the arrays by name, ``loads`` those of the ``accepted`` steps. Raises
    `InputError` if it is missing or no such file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with h5py.File(path, "r") as file:
                self.steps = len(file["load"])
                self.accepted = int(file["accepted"][()])
                self.loads = [float(x) for x in file["load"][: self.accepted]]
                self.shapes: Shapes = {}
                self._offset: dict[str, int] = {}
                self._fixed: list[str] = []
                file.visititems(self._note)
        except FileNotFoundError:
            raise InputError(f"{path}: is missing, so that the run cannot be continued.") from None
        except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
            raise InputError(f"{path}: is damaged, so that the run cannot be continued ({error}).") from None

    @classmethod
    def create(cls, path: Path, steps: int, shapes: Shapes, fixed: dict[str, np.ndarray]) -> StepFile:
        """A new file with room for ``steps`` steps of arrays of ``shapes``, and the ``fixed`` arrays. Raises
        `OSError`."""
        layout, offset = _layout(steps, shapes, fixed)
        replace_file(path, layout.pieces, layout.size)
        file = cls.__new__(cls)  # as it would read itself
        file.path, file.steps, file.accepted, file.loads = path, steps, 0, []
        file.shapes, file._offset, file._fixed = shapes, offset, list(fixed)
        return file

    def grow(self, steps: int) -> None:
        """Make room for at least ``steps`` steps; what is there stays. Raises `OSError`."""
        if steps <= self.steps:
            return
        with h5py.File(self.path, "r") as file:
            layout, offset = _layout(steps, self.shapes, {name: file[name][()] for name in self._fixed})

            def pieces() -> Iterator[tuple[int, bytes]]:
                yield from layout.pieces
                for name in self._offset:
                    if _step_of(name) <= self.accepted:
                        yield offset[name], file[name][()].tobytes()

            replace_file(self.path, pieces(), layout.size)
        self.__init__(self.path)  # type: ignore[misc]

    def write(self, step: int, load: float, arrays: dict[str, np.ndarray]) -> None:
        """Write the arrays of ``step`` (counted from 1), reached at ``load``; later ones are forgotten. Raises
        `OSError`."""
        with naming(self.path):
            descriptor = os.open(self.path, os.O_WRONLY)
            try:
                for name, values in arrays.items():
                    shape, dtype = self.shapes[name]
                    data = np.ascontiguousarray(values, dtype=dtype)
                    if data.shape != shape:
                        raise ValueError(f"{name} has the shape {data.shape}, its place in {self.path} {shape}")
                    write_at(descriptor, self._offset[f"{name}/{step_name(step)}"], data.tobytes())
                write_at(descriptor, self._offset["load"] + 8 * (step - 1), np.float64(load).tobytes())
                write_at(descriptor, self._offset["accepted"], np.int64(step).tobytes())
            finally:
                os.close(descriptor)
        self.accepted = step
        self.loads[step - 1 :] = [load]

    def _note(self, name: str, item: h5py.Group | h5py.Dataset) -> None:
        """Where the steps' data lie, and what else there is."""
        if not isinstance(item, h5py.Dataset):
            return
        if name in ("load", "accepted") or _step_of(name):
            offset = item.id.get_offset()
            if offset is None:
                raise ValueError(f"{name} has no place in the file")
            self._offset[name] = offset
            if _step_of(name):
                self.shapes[name.rpartition("/")[0]] = item.shape, item.dtype.str
        else:
            self._fixed.append(name)


def open_or_create(path: Path, steps: int, shapes: Shapes, fixed: dict[str, np.ndarray], after: int) -> StepFile:
    """The file ``path`` with room for ``steps`` steps: a new one, or that of the run that goes on ``after`` some.

    Raises `OSError`, and `InputError` if a file that should go on is missing, damaged or does not hold these steps.
    """
    if not after:
        return StepFile.create(path, steps, shapes, fixed)
    file = StepFile(path)
    if file.shapes != shapes or file.accepted < after:
        raise InputError(f"{path}: does not hold the first {after} steps of this run, so that it cannot be continued.")
    file.grow(steps)
    return file


def step_name(step: int) -> str:
    """Name of a step's dataset: its number in four digits or more."""
    return f"{step:04d}"


def _step_of(name: str) -> int:
    """Number of the step whose dataset ``name`` is; 0 if it is none."""
    last = name.rpartition("/")[2]
    return int(last) if last.isdigit() else 0


class _Layout(io.RawIOBase):
    """A file in memory without the places that nobody wrote to."""

    def __init__(self) -> None:
        self.pieces: list[tuple[int, bytes]] = []
        self.size = self._at = 0

    def readable(self) -> bool:
        """It is."""
        return True

    def seekable(self) -> bool:
        """It is."""
        return True

    def writable(self) -> bool:
        """It is."""
        return True

    def seek(self, offset: int, whence: int = 0) -> int:
        """Go to ``offset`` from the beginning or from the end."""
        self._at = offset + (self.size if whence == 2 else 0)
        return self._at

    def tell(self) -> int:
        """The place."""
        return self._at

    def truncate(self, size: int | None = None) -> int:
        """Set the length."""
        self.size = self._at if size is None else size
        return self.size

    def write(self, data) -> int:
        """Keep ``data`` as a piece."""
        self.pieces.append((self._at, bytes(data)))
        self._at += len(self.pieces[-1][1])
        self.size = max(self.size, self._at)
        return len(self.pieces[-1][1])

    def readinto(self, target) -> int:
        """Put the pieces together."""
        start, end = self._at, min(self._at + len(target), self.size)
        target[:] = bytes(len(target))
        for at, piece in self.pieces:
            first, last = max(start, at), min(end, at + len(piece))
            if first < last:
                target[first - start : last - start] = piece[first - at : last - at]
        self._at = max(start, end)
        return max(end - start, 0)


def _layout(steps: int, shapes: Shapes, fixed: dict[str, np.ndarray]) -> tuple[_Layout, dict[str, int]]:
    """The file before its first step, and where the data of load, accepted and all steps go."""
    layout, offset = _Layout(), {}
    # space without touching it: fields of many steps would take long to fill with zeros
    reserved = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    reserved.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    reserved.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    with h5py.File(layout, "w") as file:
        for name, values in fixed.items():
            file[name] = values
        file["accepted"] = np.int64(0)
        file["load"] = np.zeros(steps)
        for name, (shape, dtype) in shapes.items():
            place = file.require_group(name).id
            kind, space = h5py.h5t.py_create(np.dtype(dtype)), h5py.h5s.create_simple(shape)
            for step in range(1, steps + 1):
                dataset = h5py.h5d.create(place, step_name(step).encode(), kind, space, dcpl=reserved)
                offset[f"{name}/{step_name(step)}"] = dataset.get_offset()
        file.flush()  # gives the small ones their place
        offset |= {name: file[name].id.get_offset() for name in ("load", "accepted")}
    return layout, offset
