"""Material points and their history: what is committed, and what the current iterate would make of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from archord.materials.elasticity import Array, Elastic, elastic_stress, elastic_tangent


class ElasticPoints:
    """Points of a linear elastic body: no history."""

    def __init__(self, material: Elastic) -> None:
        self.material = material
        self.elastic_tangent = elastic_tangent(material.E, material.nu, material.plane)
        self._tangent = np.empty((0, 3, 3))

    def update(self, strain: Array) -> tuple[Array, Array]:
        """Stress ``(n, 4)`` and tangent ``(n, 3, 3)`` at ``strain`` ``(n, 3)``."""
        m = self.material
        if len(self._tangent) != len(strain):
            self._tangent = np.tile(self.elastic_tangent, (len(strain), 1, 1))
        return elastic_stress(strain, m.E, m.nu, m.plane), self._tangent

    def commit(self) -> None:
        """Nothing to keep."""


class PlasticPoints:
    """``n`` points of an elastic-plastic body with their history; ``trial`` belongs to the last strain seen.

    With ``elastic_only`` set, `update` answers as if the points could not yield (further).
    """

    def __init__(self, material, n: int) -> None:
        from archord.materials.j2 import PlasticState

        self.material = material
        self.elastic_tangent = elastic_tangent(material.E, material.nu, material.plane)
        self.state = self.trial = PlasticState.virgin(n)
        self._unyielding = replace(material, yield_stress=np.inf)
        self.elastic_only = False

    def update(self, strain: Array) -> tuple[Array, Array]:
        """Stress ``(n, 4)`` and consistent tangent ``(n, 3, 3)`` at ``strain`` ``(n, 3)``, from the committed
        history."""
        material = self._unyielding if self.elastic_only else self.material
        stress, tangent, self.trial = material.return_map(strain, self.state)
        return stress, tangent

    def increment(self) -> float:
        """Largest increment of PEEQ from the committed history to the last strain seen."""
        return float((self.trial.peeq - self.state.peeq).max(initial=0.0))

    def commit(self) -> None:
        """Make the history of the last strain seen the committed one."""
        self.state = self.trial


def material_points(material, n: int) -> ElasticPoints | PlasticPoints:
    """``n`` points of ``material``."""
    return ElasticPoints(material) if isinstance(material, Elastic) else PlasticPoints(material, n)
