"""VTKHDF files: a grid that stands still, and values that change with time."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

Arrays = dict[str, np.ndarray]

# VTK's numbers of cells; of curved ones of second order by the number of their nodes
VERTEX = 1
LINE = 3
SECOND_ORDER = {6: 22, 9: 28, 10: 24, 27: 29}
_COUNTED = {"Points": "Points", "Cells": "Types", "ConnectivityIds": "Connectivity"}


@dataclass(frozen=True)
class Grid:
    """Cells on points, and what does not change of them."""

    points: np.ndarray  # (n, 3)
    cells: np.ndarray  # (m, a) nodes in VTK's order
    kind: int  # VTK's number of the cells
    fixed: Arrays = field(default_factory=dict)  # "CellData/NAME" (m,), "PointData/NAME" (n,)

    def arrays(self) -> Arrays:
        """All that does not change, as VTKHDF names it."""
        m, a = self.cells.shape
        named = {
            "Points": self.points,
            "Connectivity": self.cells.ravel().astype(np.int64),
            "Offsets": np.arange(0, m * a + 1, a),
            "Types": np.full(m, self.kind, dtype=np.uint8),
        }
        return named | self.fixed


def write_vtkhdf(
    path: Path, grid: Grid, times: Mapping[int, float], values: Callable[[int], Arrays]
) -> None:
    """Write ``grid`` and the steps of the ``times``, which go by the number of the step;
    ``values(step)`` are "PointData/NAME" ``(n, ...)`` and "CellData/NAME" ``(m, ...)``. Raises
    `OSError`."""
    n = len(times)
    with _Target(path, "w+") as target:
        with h5py.File(target, "w") as file:
            root = file.create_group("VTKHDF")
            root.attrs["Version"] = [2, 0]
            root.attrs["Type"] = np.bytes_("UnstructuredGrid")
            for name, array in grid.arrays().items():
                root[name] = array
            for name, counted in _COUNTED.items():
                root[f"NumberOf{name}"] = [len(root[counted])]
            steps = root.create_group("Steps")
            steps.attrs["NSteps"] = n
            steps["Values"] = list(times.values())
            steps["NumberOfParts"] = np.ones(n, dtype=np.int64)
            begin = np.zeros(n, dtype=np.int64)  # where in arrays that do not change a step begins
            steps["PartOffsets"] = begin
            steps["PointOffsets"] = begin
            steps["CellOffsets"] = begin[:, None]
            steps["ConnectivityIdOffsets"] = begin[:, None]
            for name in grid.fixed:
                steps[_offsets(name)] = begin
            for k, step in enumerate(times):
                for name, array in values(step).items():
                    rows = len(array)
                    if name not in root:
                        root.create_dataset(name, (n * rows, *array.shape[1:]), array.dtype)
                        steps[_offsets(name)] = np.arange(n) * rows
                    root[name][k * rows : (k + 1) * rows] = array
        target.require_written()


def in_space(vectors: np.ndarray) -> np.ndarray:
    """Vectors ``(n, d)`` with three components."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def _offsets(name: str) -> str:
    return name.replace("/", "Offsets/")


class _Target(io.FileIO):
    """A file that HDF5 writes to. HDF5 may crash where a write fails: the first error is kept, and
    what follows goes nowhere."""

    error: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all of the ``data``."""
        view = memoryview(data).cast("B")
        done = 0
        while done < len(view) and self.error is None:
            try:
                done += super().write(view[done:]) or 0
            except OSError as error:
                self.error = error
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Reserve places up to the ``size``."""
        try:
            return super().truncate(size)
        except OSError as error:
            self.error = self.error or error
            return size or 0

    def readinto(self, buffer: Any) -> int:
        """Fill the ``buffer``, with zeros beyond the end of the file."""
        view = memoryview(buffer).cast("B")
        done = super().readinto(view) or 0
        view[done:] = bytes(len(view) - done)
        return len(view)

    def require_written(self) -> None:
        """Raise the `OSError` of the first write that failed."""
        if self.error is not None:
            raise self.error
