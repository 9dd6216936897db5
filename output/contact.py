"""contact.h5: the contact along the arcs at every output step.

Per side ("pin", "hole"; a side whose edge is not integrated is absent): ``s`` and ``angle`` from the contact axis and
``weight`` (measure), each ``(n facets, q points)``; per step ``coordinates`` ``(n, q, 2)`` (deformed), ``pressure``
(linear on each facet, with the facet's force), ``raw_pressure`` (as the solver integrates it) and ``gap`` (positive
when open).
"""

from __future__ import annotations

from pathlib import Path

from archord.output.step_file import Shapes, StepFile, open_or_create
from archord.presets.arc import ArcProfile

_FIXED = ("s", "angle", "weight")
_PER_STEP = ("coordinates", "pressure", "raw_pressure", "gap")


class ContactWriter:
    """Writes contact.h5 in ``folder``, with room for ``steps`` steps; used on rank 0 only."""

    def __init__(self, folder: Path, steps: int) -> None:
        self._path, self._steps = folder / "contact.h5", steps
        self._file: StepFile | None = None

    def write(self, step: int, load: float, profiles: dict[str, ArcProfile], *, again: bool = False) -> None:
        """Make this ``step`` the last one; ``again``, if it is not there yet.

        The first call makes the file, or opens that of the steps before. Raises `OSError`, and `InputError` if that
        file is not this run's.
        """
        arrays = {f"{name}/{key}": getattr(p, key) for name, p in profiles.items() for key in _PER_STEP}
        if self._file is None:
            shapes: Shapes = {name: (values.shape, "<f8") for name, values in arrays.items()}
            fixed = {f"{name}/{key}": getattr(p, key) for name, p in profiles.items() for key in _FIXED}
            self._file = open_or_create(self._path, self._steps, shapes, fixed, step - 1)
        if not again or self._file.accepted < step:
            self._file.write(step, load, arrays)
