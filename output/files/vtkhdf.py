"""VTKHDF files that grow step by step and survive a kill: a grid that stands still, and values that
change with time.

The HDF5 library composes a file that has room for all steps from the beginning, and writes it to
memory, without any values. On disk it is a sparse file, which takes no more than what is there. The
values of a step are written to their place; the step counts once the page of the file is replaced
that holds how many there are, which no kill can interrupt.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np

from archord.output.files.disk import naming, new_name
from archord.scene.errors import InputError

Arrays = dict[str, np.ndarray]

# VTK's numbers of cells: with straight sides, curved ones of second order by the number of their
# nodes, and Lagrange's of any degree by that of their corners
VERTEX, LINE = 1, 3
SECOND_ORDER = {6: 22, 9: 28}
LAGRANGE = {2: 68, 3: 69, 4: 70}
_PAGE = 4096

_AT_ONCE = h5py.h5p.create(
    h5py.h5p.DATASET_CREATE
)  # a place in the file from the beginning, with nothing written
_AT_ONCE.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
_AT_ONCE.set_fill_time(h5py.h5d.FILL_TIME_NEVER)


def times(loads: Sequence[float]) -> list[float]:
    """The times of steps reached at ``loads``: those, or the numbers of the steps if they do not
    only grow."""
    grow = all(a < b for a, b in pairwise(loads))
    return [float(load) if grow else float(number) for number, load in enumerate(loads, 1)]


@dataclass(frozen=True)
class Grid:
    """``points`` ``(n, 3)``, and ``m`` cells as pairs of VTK's number and nodes ``(k, a)`` in VTK's
    order, and what is ``fixed`` of them, "CellData/NAME" ``(m,)``."""

    points: np.ndarray
    cells: Sequence[tuple[int, np.ndarray]]
    fixed: Arrays = field(default_factory=dict)

    def arrays(self) -> Arrays:
        """All that does not change, as VTKHDF names it."""
        sizes = np.concatenate([np.full(len(nodes), nodes.shape[1]) for _, nodes in self.cells])
        return self.fixed | {
            "Points": self.points,
            "Connectivity": np.concatenate([nodes.ravel() for _, nodes in self.cells]).astype(
                np.int64
            ),
            "Offsets": np.append(0, np.cumsum(sizes)),
            "Types": np.concatenate(
                [np.full(len(nodes), kind, dtype=np.uint8) for kind, nodes in self.cells]
            ),
        }


class VtkHdf:
    """The file ``path`` with a ``grid``, and room for ``total`` steps, or more if they come. It
    appears with a step."""

    def __init__(self, path: Path, grid: Grid, total: int) -> None:
        self.path, self._total, self._room = path, total, 0
        self._fixed = {name: np.ascontiguousarray(values) for name, values in grid.arrays().items()}
        self._values: Arrays = {}
        self._times: list[float] = []

    def write(self, times: Sequence[float], arrays: Arrays) -> None:
        """Add a step: "PointData/NAME" ``(n, ...)`` and "CellData/NAME" ``(m, ...)``; ``times`` are
        those of all steps, of which those before are in the file. Raises `OSError`: then the file
        is what it was, this object of no use; and `InputError` if the file is missing, damaged or
        does not hold the steps before."""
        arrays = {name: np.ascontiguousarray(values) for name, values in arrays.items()}
        if len(times) <= self._room:
            with naming(self.path), self.path.open("r+b") as file:
                self._add(file, times, arrays)
        else:
            self._values = arrays
            self._renew(max(self._total, len(times)), times, arrays)
        self._times = list(times)

    def end(self) -> None:
        """Give up the room of steps that never came, if there is space to do so."""
        if 0 < len(self._times) < self._room:
            with suppress(OSError, InputError):
                self._renew(len(self._times), self._times, {})

    def _renew(self, room: int, times: Sequence[float], arrays: Arrays) -> None:
        """Replace the file by one with ``room`` for so many steps, in which the last one has these
        ``arrays``, if any, and the others what they had."""
        self._lay_out(room)
        new = new_name(self.path)
        try:
            with naming(self.path):
                with new.open("w+b") as file:
                    file.truncate(self._head.size)
                    self._head.save(file)
                    for name, values in self._fixed.items():
                        _put(file, self._places[name], values)
                    for place, values in self._earlier(len(times) - bool(arrays)):
                        _put(file, place, values)
                    self._add(file, times, arrays)
                new.replace(self.path)
        except (OSError, InputError):
            new.unlink(missing_ok=True)
            raise
        self._room = room

    def _lay_out(self, room: int) -> None:
        """Compose a file with ``room`` for so many steps."""
        self._head = _Head()
        with h5py.File(self._head, "w") as file:
            root = file.create_group("VTKHDF")
            root.attrs["Version"], root.attrs["Type"] = [2, 0], np.bytes_("UnstructuredGrid")
            # first, so that both the number of steps and that of their times lie within the first
            # page
            steps = root.create_group("Steps")
            steps.attrs["NSteps"] = 0
            steps.create_dataset(
                "Values", (1,), "f8", maxshape=(room,), chunks=(room,), dcpl=_AT_ONCE.copy()
            )
            shapes = {name: values.shape for name, values in self._fixed.items()}
            shapes |= {
                name: (room * len(values), *values.shape[1:])
                for name, values in self._values.items()
            }
            self._places = {}
            for name, values in (self._fixed | self._values).items():
                dataset = root.create_dataset(name, shapes[name], values.dtype, dcpl=_AT_ONCE)
                self._places[name] = dataset.id.get_offset()
            for name, counted in {
                "Points": "Points",
                "Cells": "Types",
                "ConnectivityIds": "Connectivity",
            }.items():
                root[f"NumberOf{name}"] = [len(self._fixed[counted])]
            nothing = np.zeros(room, dtype=np.int64)  # where in the arrays a step begins
            steps["NumberOfParts"], steps["PartOffsets"], steps["PointOffsets"] = (
                nothing + 1,
                nothing,
                nothing,
            )
            steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = nothing[:, None]
            for name in (name for name in shapes if "/" in name):
                rows = len(self._values.get(name, ()))
                steps[name.replace("/", "Offsets/")] = np.arange(room) * rows

    def _add(self, file: BinaryIO, times: Sequence[float], arrays: Arrays) -> None:
        """Write the last step's ``arrays``, and then that it is there."""
        for name, values in arrays.items():
            _put(file, self._places[name] + (len(times) - 1) * values.nbytes, values)
        with h5py.File(self._head, "r+") as head:
            steps = head["VTKHDF/Steps"]
            steps.attrs.modify("NSteps", len(times))
            steps["Values"].resize((len(times),))
            steps["Values"][:] = times
        self._head.save(file)

    def _earlier(self, kept: int) -> Iterator[tuple[int, np.ndarray]]:
        """The places of the ``kept`` steps' arrays, and what the file has for them."""
        if not kept:
            return
        try:
            with h5py.File(self.path) as old:
                root = old["VTKHDF"]
                if root["Steps"].attrs["NSteps"] < kept or not np.array_equal(
                    root["Types"], self._fixed["Types"]
                ):
                    raise ValueError(f"it does not hold the first {kept} steps of this run")
                for name, like in self._values.items():
                    for k in range(kept):
                        yield (
                            self._places[name] + k * like.nbytes,
                            root[name][k * len(like) : (k + 1) * len(like)],
                        )
        except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
            said = f"is missing or damaged, so that the run cannot be continued ({error})"
            raise InputError(f"{self.path}: {said}.") from None


def _put(file: BinaryIO, place: int, values: np.ndarray | bytearray) -> None:
    """Write ``values`` at a ``place`` of ``file`` before anything that comes later."""
    file.seek(place)
    file.write(values)
    file.flush()


class _Head:
    """What HDF5 writes to a file, by pages: a file for h5py, of the length ``size``."""

    def __init__(self) -> None:
        self.size = self._at = 0
        self._pages: dict[int, bytearray] = defaultdict(lambda: bytearray(_PAGE))
        self._changed: dict[int, list[int]] = defaultdict(
            list
        )  # begin and end of what was changed of a page

    def save(self, file: BinaryIO) -> None:
        """Write what is new to ``file``: one piece of each page, that of the first one last."""
        for number in sorted(self._changed, reverse=True):
            begin, end = min(self._changed[number]), max(self._changed[number])
            _put(file, number * _PAGE + begin, self._pages[number][begin:end])
        self._changed.clear()

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """The place of what is read or written next."""
        self._at = offset + (0, self._at, self.size)[whence]
        return self._at

    def tell(self) -> int:
        """That place."""
        return self._at

    def truncate(self, size: int) -> None:
        """HDF5 reserves places by it."""
        self.size = size

    def flush(self) -> None:
        """Nothing is kept back."""

    def readinto(self, buffer: memoryview) -> int:
        """Fill the ``buffer``, with zeros where nothing was written."""
        for number, begin, piece in self._pieces(buffer):
            piece[:] = self._pages[number][begin : begin + len(piece)]
        return len(buffer)

    read = readinto  # h5py takes for a file what has it

    def write(self, buffer: memoryview) -> int:
        """Keep what is in the ``buffer``."""
        for number, begin, piece in self._pieces(buffer):
            old = np.frombuffer(self._pages[number], np.uint8, len(piece), begin)
            differs = np.flatnonzero(old != np.frombuffer(piece, np.uint8))
            if len(differs):
                self._changed[number] += begin + differs[0], begin + differs[-1] + 1
            self._pages[number][begin : begin + len(piece)] = piece
        self.size = max(self.size, self._at)
        return len(buffer)

    def _pieces(self, buffer: memoryview) -> Iterator[tuple[int, int, memoryview]]:
        """The ``buffer``, read or written from here on, by pages: number of the page, place in it,
        piece."""
        while len(buffer):
            number, begin = divmod(self._at, _PAGE)
            piece = buffer[: _PAGE - begin]
            yield number, begin, piece
            buffer, self._at = buffer[len(piece) :], self._at + len(piece)
