"""contact.h5: the contact along the arcs at every output step.

Per side ("pin", "hole"; a side whose edge is not integrated is absent): ``s`` and ``angle`` from the contact axis and
``weight`` (measure), each ``(n facets, q points)``; per step ``coordinates`` ``(n, q, 2)`` (deformed), ``pressure`` (linear on
each facet, with the facet's force), ``raw_pressure`` (as the solver integrates it) and ``gap`` (positive when open).
"""

from __future__ import annotations

from pathlib import Path

from archord.solver.contact_profile import ArcProfile
from archord.solver.step_file import StepFile

_PER_STEP = ("coordinates", "pressure", "raw_pressure", "gap")


class ContactWriter:
    """Writes contact.h5; used on rank 0 only."""

    def __init__(self, folder: Path, profiles: dict[str, ArcProfile], steps: int) -> None:
        shapes, fixed = {}, {}
        for name, p in profiles.items():
            shapes |= {f"{name}/{key}": (getattr(p, key).shape, "f8") for key in _PER_STEP}
            fixed |= {f"{name}/{key}": getattr(p, key) for key in ("s", "angle", "weight")}
        self._file = StepFile(folder / "contact.h5", steps, shapes, fixed)

    def write(self, step: int, load: float, profiles: dict[str, ArcProfile]) -> None:
        """Add ``step``."""
        self._file.write(
            step, load, {f"{name}/{key}": getattr(p, key) for name, p in profiles.items() for key in _PER_STEP}
        )
