"""HDF5 files that grow step by step and survive a kill.

All datasets of all steps are allocated when the file is made; a step is written in place and the file closed again, so
the structure of the file is never half written. ``accepted`` tells how many steps hold data.
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np


class StepFile:
    """An HDF5 file with room for ``steps`` steps of the named arrays, as ``name/0001`` and so on."""

    def __init__(
        self, path: Path, steps: int, shapes: dict[str, tuple[tuple[int, ...], str]], fixed: dict[str, np.ndarray]
    ):
        self.path, self.steps = path, steps
        with h5py.File(path, "w") as file:
            for name, values in fixed.items():
                file[name] = values
            file["accepted"] = np.int64(0)
            file["load"] = np.zeros(steps)
            for name, (shape, dtype) in shapes.items():
                group = file.require_group(name)
                for step in range(1, steps + 1):
                    _allocate(group, step_name(step), shape, dtype)

    def write(self, step: int, load: float, arrays: dict[str, np.ndarray]) -> None:
        """Write the arrays of ``step`` (counted from 1), reached at ``load``, and close the file."""
        with h5py.File(self.path, "r+") as file:
            for name, values in arrays.items():
                file[f"{name}/{step_name(step)}"][...] = values
            file["load"][step - 1] = load
            file["accepted"][()] = step


def step_name(step: int) -> str:
    """Name of a step's dataset: its number in four digits or more."""
    return f"{step:04d}"


def _allocate(group: h5py.Group, name: str, shape: tuple[int, ...], dtype: str) -> None:
    """Reserve space without touching it (fields of many steps would take long to fill with zeros)."""
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    space = h5py.h5s.create_simple(shape)
    h5py.h5d.create(group.id, name.encode(), h5py.h5t.py_create(np.dtype(dtype)), space, dcpl=properties)
