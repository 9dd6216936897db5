"""Meshes kept for the next joint of the same shape, bound to no communicator."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from archord.geometry.plane_mesh import PlaneMesh


class MeshCache:
    """The last meshes of this process, by what they were made from; ``capacity`` is how many it keeps.

    ``made`` and ``reused`` count the meshes that gmsh made for it and those that it did not have to.
    """

    def __init__(self, capacity: int = 0) -> None:
        self.capacity = capacity
        self.made = self.reused = 0
        self._kept: OrderedDict[tuple, PlaneMesh] = OrderedDict()

    def get(self, key: tuple, make: Callable[[], PlaneMesh]) -> PlaneMesh:
        """The mesh that ``key`` says all about: a kept one or what ``make`` returns, for the one not used longest."""
        if key in self._kept:
            self.reused += 1
            self._kept.move_to_end(key)
            return self._kept[key]
        mesh = make()
        if self.capacity:
            self.made += 1
            self._kept[key] = mesh
        while len(self._kept) > self.capacity:
            self._kept.popitem(last=False)
        return mesh

    def forget(self) -> None:
        """Keep none of the meshes any longer."""
        self._kept.clear()


MESHES = MeshCache()  # of this process; keeps none unless somebody gives it a capacity
