"""contact.h5: the contact along the arcs at every output step.

Per surface, by name (one that is not integrated is absent): ``s`` and ``angle`` from the contact axis and
``weight`` (measure), each ``(n facets, q points)``; per step ``coordinates`` ``(n, q, 2)`` (deformed), ``pressure``
(linear on each facet, with the facet's force), ``raw_pressure`` (as the solver integrates it) and ``gap`` (positive
when open).
"""

from __future__ import annotations

import numpy as np

from archord.presets.arc import ArcProfile

FIXED = ("s", "angle", "weight")
PER_STEP = ("coordinates", "pressure", "raw_pressure", "gap")


def contact_arrays(profiles: dict[str, ArcProfile], names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """The arrays of all ``profiles`` that have these ``names``, by surface and name."""
    return {f"{side}/{name}": getattr(profile, name) for side, profile in profiles.items() for name in names}
