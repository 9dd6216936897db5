"""Meshes of a general scene from coarse to fine: a shape with smaller elements, a file with its cells cut in four."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from archord.presets.measures import Record
from archord.scene.problem import ProblemScene
from archord.studies.mesh_family import chosen, rounded

_OF_SHAPES, _OF_FILES = 1.5, 2.0  # ratios of element sizes from one mesh to the next
_COARSEST = 2.0  # first element size of a shape over that of its scene
_MOST_DOFS = 1_500_000


class ProblemFamily:
    """The meshes ``0, 1, 2, ...`` for ``scene`` (with ``analysis.accuracy``), each by ``ratio`` finer.

    Its corners, as where an edge is clamped, let forces converge with the ``order`` 1.5 at the end, like their energy
    (Williams 1952), and where bodies yield single differences are too small for more."""

    order = 1.5

    def __init__(self, scene: ProblemScene) -> None:
        self.scene, self.shape = scene, scene.mesh.shape
        self.ratio = _OF_FILES if self.shape is None else _OF_SHAPES
        self.dofs = 0  # of the last mesh that was solved

    def scene_of(self, level: int, substeps: int) -> ProblemScene | None:
        """The scene on mesh ``level`` in ``substeps`` steps an output step; None if the mesh would be too large."""
        if level and self.dofs * self.ratio**2 > _MOST_DOFS:
            return None
        changes: dict[str, Any] = {"refine": self.scene.mesh.refine + level}
        if self.shape is not None:
            factor = _COARSEST / self.ratio**level
            sizes = {"element_size": rounded(factor * self.shape.h), "growth": rounded(factor * self.shape.growth)}
            changes = {"shape": self.shape.model_copy(update=sizes)}
        mesh = self.scene.mesh.model_copy(update=changes)
        return self.scene.model_copy(update={"mesh": mesh} | chosen(self.scene, substeps))

    def sizes(self, scene: Any) -> tuple[float, float]:
        """Element size and growth of ``scene``; of a file, the size over that of its own cells."""
        shape = scene.mesh.shape
        return (0.5**scene.mesh.refine, 0.0) if shape is None else (shape.h, shape.growth)

    def curve(self, steps: Sequence[Record]) -> list[float]:
        """The force of the last load at every step, or its displacement where it is a force or a pressure."""
        return [m.values[self.scene.accurate] for m in steps]

    def resolved(self, scene: Any, steps: Sequence[Record]) -> bool:
        """Whether something is in contact at the end, if anything is to be."""
        return steps[-1].contact_area > 0 or not self.scene.interaction
