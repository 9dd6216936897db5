"""HDF5 files that grow step by step and survive a kill.

The file itself is written whole after every step and put into its place in one move. Large arrays lie apart, in a file
for each step that never changes again, and the file has links to them: what is written then grows with the steps, not
with their square. A reader opens one file and finds ``name/0001`` and so on, whatever lies where.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from archord.output.disk import replace_file
from archord.scene.errors import InputError

Arrays = dict[str, np.ndarray]


class StepFile:
    """``path`` with the arrays ``fixed``, ``name/0001`` and so on for each step, ``accepted``, the number of steps, and
    ``load``, what each was reached at.

    ``apart`` puts the arrays into files of their own, NAME/0000.h5 for the fixed ones. The file is made, or goes on
    ``after`` some steps that are there, as this version or version 0.1 wrote them, with arrays of these ``names``.
    Raises `OSError`, and `InputError` if a file that should go on is missing, damaged or does not hold these steps.
    """

    def __init__(self, path: Path, fixed: Arrays, names: list[str], *, after: int = 0, apart: bool = False) -> None:
        self.path, self.loads, self._apart = path, [], apart
        memory = io.BytesIO()
        with h5py.File(memory, "w") as file:
            file["accepted"] = 0
            file.create_dataset("load", (0,), "f8", maxshape=(None,), chunks=(64,))
            self._add(file, 0, fixed)
            for load, arrays in self._earlier(fixed, names, after) if after else ():
                self._add_step(file, load, arrays)
                self.loads.append(load)
        self._save(memory)

    def write(self, load: float, arrays: Arrays) -> None:
        """Add a step, reached at ``load``. Raises `OSError`; the file then is what it was."""
        memory = io.BytesIO(self._content)
        with h5py.File(memory, "r+") as file:
            self._add_step(file, load, arrays)
        self._save(memory)
        self.loads.append(load)

    def place(self, name: str, step: int = 0) -> str:
        """Where XDMF finds the array ``name`` of ``step``, by default a fixed one."""
        if self._apart:
            return f"{self.path.stem}/{step_name(step)}.h5:/{name}"
        return f"{self.path.name}:/{_dataset(name, step)}"

    def _save(self, memory: io.BytesIO) -> None:
        content = memory.getvalue()
        replace_file(self.path, content)
        self._content = content

    def _add_step(self, file: h5py.File, load: float, arrays: Arrays) -> None:
        step = len(self.loads) + 1
        self._add(file, step, arrays)
        file["accepted"][()] = step
        file["load"].resize((step,))
        file["load"][-1] = load

    def _add(self, file: h5py.File, step: int, arrays: Arrays) -> None:
        """The arrays of ``step``, 0 for the fixed ones."""
        values = arrays
        if self._apart:
            beside = Path(self.path.stem) / f"{step_name(step)}.h5"
            memory = io.BytesIO()
            with h5py.File(memory, "w") as own:
                for name, array in arrays.items():
                    own[name] = array
            (self.path.parent / beside.parent).mkdir(exist_ok=True)
            replace_file(self.path.parent / beside, memory.getvalue())
            values = {name: h5py.ExternalLink(str(beside), name) for name in arrays}
        for name, value in values.items():
            file[_dataset(name, step)] = value

    def _earlier(self, fixed: Arrays, names: list[str], after: int) -> Iterator[tuple[float, Arrays]]:
        """Load and arrays of the steps that are there."""
        try:
            with h5py.File(self.path) as file:
                if file["accepted"][()] < after or any(file[name].shape != a.shape for name, a in fixed.items()):
                    raise InputError(
                        f"{self.path}: does not hold the first {after} steps of this run, so that it cannot be "
                        "continued."
                    )
                for step in range(1, after + 1):
                    yield float(file["load"][step - 1]), {name: file[_dataset(name, step)][()] for name in names}
        except FileNotFoundError:
            raise InputError(f"{self.path}: is missing, so that the run cannot be continued.") from None
        except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
            raise InputError(f"{self.path}: is damaged, so that the run cannot be continued ({error}).") from None


def all_arrays(group: h5py.Group, prefix: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Every array of an open file by its name, also those that lie apart, which `h5py.Group.visit` leaves out."""
    for name, item in group.items():
        if isinstance(item, h5py.Dataset):
            yield prefix + name, item[()]
        else:
            yield from all_arrays(item, f"{prefix}{name}/")


def step_name(step: int) -> str:
    """Name of a step's dataset: its number in four digits or more."""
    return f"{step:04d}"


def _dataset(name: str, step: int) -> str:
    return f"{name}/{step_name(step)}" if step else name
