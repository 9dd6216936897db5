"""Material points and their history: what is committed, and what the current iterate would make of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from archord.materials.material import Array


class Points:
    """``n`` points of a ``material``: the committed ``state``, and ``trial``, which belongs to the last strain seen.

    A contact law is a material too, of traction, derivative and state, whose strain are gap, slip and trial traction.

    With ``elastic_only`` set, `update` answers as if the points could not yield (further).
    """

    def __init__(self, material: Any, n: int) -> None:
        self.material, self.n = material, n
        self.state = self.trial = material.state(n)
        self.elastic_only = False

    def update(self, *strain: Array) -> tuple[Array, Array]:
        """Stress ``(n, 4)`` and consistent tangent ``(n, 3, 3)`` at ``strain`` ``(n, 3)``, from the committed state."""
        material = self.material.elastic() if self.elastic_only else self.material
        stress, tangent, self.trial = material.update(*strain, self.state)
        return stress, tangent

    @property
    def peeq(self) -> Array:
        """PEEQ ``(n,)`` at the last strain seen."""
        return np.broadcast_to(self.material.peeq(self.trial), self.n)

    @property
    def increment(self) -> Array:
        """Increment of PEEQ ``(n,)`` from the committed state to the last strain seen."""
        return self.peeq - self.material.peeq(self.state)

    def commit(self) -> None:
        """Make the state of the last strain seen the committed one."""
        self.state = self.trial
