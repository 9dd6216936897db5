"""contact.h5: the contact along the arcs at every output step.

Per surface, by name (one that is not integrated is absent): ``s`` and ``angle`` from the contact axis and
``weight`` (measure), each ``(n facets, q points)``; per step ``coordinates`` ``(n, q, 2)`` (deformed), ``pressure``
(linear on each facet, with the facet's force), ``raw_pressure`` (as the solver integrates it) and ``gap`` (positive
when open).
"""

from __future__ import annotations

from pathlib import Path

from archord.output.step_file import StepFile
from archord.presets.arc import ArcProfile

_FIXED = ("s", "angle", "weight")
_PER_STEP = ("coordinates", "pressure", "raw_pressure", "gap")


class ContactWriter:
    """Writes contact.h5 in ``folder``; used on rank 0 only."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "contact.h5"
        self._file: StepFile | None = None

    def write(self, step: int, load: float, profiles: dict[str, ArcProfile]) -> None:
        """Make this ``step`` the last one. The first call makes the file, or opens that of the steps before.

        Raises `OSError`, and `InputError` if that file is not this run's.
        """
        arrays = {f"{name}/{key}": getattr(p, key) for name, p in profiles.items() for key in _PER_STEP}
        if self._file is None:
            fixed = {f"{name}/{key}": getattr(p, key) for name, p in profiles.items() for key in _FIXED}
            self._file = StepFile(self._path, fixed, list(arrays), after=step - 1)
        self._file.write(load, arrays)
