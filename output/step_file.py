"""HDF5 files that grow step by step and survive a kill.

The file itself is written whole after every step and put into its place in one move. Large arrays lie apart, in a file
for each step that never changes again, and the file has links to them: what is written then grows with the steps, not
with their square. A reader opens one file and finds ``name/0001`` and so on, whatever lies where.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path

import h5py
import numpy as np

from archord.output.disk import replace_file
from archord.scene.errors import InputError

Arrays = dict[str, np.ndarray]

_GROUPS = h5py.h5p.create(h5py.h5p.LINK_CREATE)
_GROUPS.set_create_intermediate_group(True)
_NUMBERS = count()  # HDF5 tells open files apart by name


class StepFile:
    """``path`` with the arrays ``fixed``, ``name/0001`` and so on for each step, ``accepted``, the number of steps, and
    ``load``, what each was reached at.

    ``apart`` puts the arrays into files of their own, NAME/0000.h5 for the fixed ones. The file is made, or goes on
    ``after`` some steps that are there, as this version or version 0.1 wrote them, with arrays of these ``names``.
    Raises `OSError`, and `InputError` if a file that should go on is missing, damaged or does not hold these steps.
    """

    def __init__(self, path: Path, fixed: Arrays, names: list[str], *, after: int = 0, apart: bool = False) -> None:
        self.path, self._apart = path, apart
        self.loads: list[float] = []
        earlier = list(self._earlier(fixed, names, after)) if after else []
        self._file = _in_memory()
        self._file["accepted"] = 0
        self._file.create_dataset("load", (0,), "f8", maxshape=(None,), chunks=(64,))
        self._add(0, fixed)
        for load, arrays in earlier:
            self._add_step(load, arrays)
        self._save()

    def write(self, load: float, arrays: Arrays) -> None:
        """Add a step, reached at ``load``. Raises `OSError`; the file then is what it was."""
        step = len(self.loads) + 1
        try:
            self._add_step(load, arrays)
            self._save()
        except OSError:
            for name in arrays:
                if _dataset(name, step) in self._file:
                    del self._file[_dataset(name, step)]
            del self.loads[step - 1 :]
            self._count()
            raise

    def place(self, name: str, step: int = 0) -> str:
        """Where XDMF finds the array ``name`` of ``step``, by default a fixed one."""
        if self._apart:
            return f"{self.path.stem}/{step_name(step)}.h5:/{name}"
        return f"{self.path.name}:/{_dataset(name, step)}"

    def _save(self) -> None:
        replace_file(self.path, _image(self._file))

    def _add_step(self, load: float, arrays: Arrays) -> None:
        self._add(len(self.loads) + 1, arrays)
        self.loads.append(load)
        self._count()

    def _count(self) -> None:
        self._file["accepted"][()] = len(self.loads)
        self._file["load"].resize((len(self.loads),))
        self._file["load"][-1:] = self.loads[-1:]

    def _add(self, step: int, arrays: Arrays) -> None:
        """The arrays of ``step``, 0 for the fixed ones."""
        values = arrays
        if self._apart:
            beside = Path(self.path.stem) / f"{step_name(step)}.h5"
            with _in_memory() as own:
                for name, array in arrays.items():
                    _put(own, name, array)
                content = _image(own)
            (self.path.parent / beside.parent).mkdir(exist_ok=True)
            replace_file(self.path.parent / beside, content)
            values = {name: h5py.ExternalLink(str(beside), name) for name in arrays}
        for name, value in values.items():
            _put(self._file, _dataset(name, step), value)

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


def _put(file: h5py.File, name: str, value: np.ndarray | h5py.ExternalLink) -> None:
    """``file[name] = value``, in a third of its time."""
    if isinstance(value, h5py.ExternalLink):
        file.id.links.create_external(name.encode(), value.filename.encode(), value.path.encode(), _GROUPS)
        return
    array = np.ascontiguousarray(value)
    kind, space = h5py.h5t.py_create(array.dtype), h5py.h5s.create_simple(array.shape)
    dataset = h5py.h5d.create(file.id, None, kind, space)
    dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, array)
    h5py.h5o.link(dataset, file.id, name.encode(), _GROUPS)


def _in_memory() -> h5py.File:
    return h5py.File(f"in memory {next(_NUMBERS)}", "w", driver="core", backing_store=False, block_size=4096)


def _image(file: h5py.File) -> bytes:
    """What the open ``file`` is as bytes."""
    file.flush()
    return file.id.get_file_image()


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
