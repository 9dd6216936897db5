"""Meshes kept for the next joint of the same shape, bound to no communicator."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from archord.geometry.plane_mesh import PlaneMesh


class MeshCache:
    """The last meshes of this process, by what they were made from; ``capacity`` is how many it keeps.

    ``made`` and ``reused`` count the meshes that gmsh made and those that it did not have to.
    """

    def __init__(self, capacity: int = 0) -> None:
        self.capacity = capacity
        self.made = self.reused = 0
        self._kept: OrderedDict[tuple, PlaneMesh] = OrderedDict()

    def find(self, key: tuple) -> PlaneMesh | None:
        """The mesh that was made from ``key``; None if it is not kept."""
        if key not in self._kept:
            return None
        self.reused += 1
        self._kept.move_to_end(key)
        return self._kept[key]

    def keep(self, key: tuple, mesh: PlaneMesh) -> None:
        """Keep a ``mesh`` just made from ``key``, if there is room, and forget the one that was not used for
        longest."""
        if not self.capacity:
            return
        self.made += 1
        self._kept[key] = mesh
        while len(self._kept) > self.capacity:
            self._kept.popitem(last=False)

    def forget(self) -> None:
        """Keep none of the meshes any longer."""
        self._kept.clear()


MESHES = MeshCache()  # of this process; keeps none unless somebody gives it a capacity
