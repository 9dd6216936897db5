"""Meshes of a scene from coarse to fine, near and far elements alike, and the scene on each.

Of a joint, lengths are in the size of the contact that is to be expected: a small contact in a
large pin is resolved as a wide one is, by elements that are as much smaller as it is and grow as
fast. Of a general scene, a shape gets smaller elements, and of a file the cells are cut
in four, in space in eight. A coarser mesh is for guesses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from archord.measures.record import Record
from archord.report.by_name import ByName
from archord.report.table import in_digits
from archord.scene.file import AnyScene
from archord.scene.presets.joint import Scene
from archord.scene.presets.joint_geometry import JointGeometry
from archord.scene.problem import ProblemScene

RATIO = 1.5  # of the element sizes from one mesh to the next
_GROWTH = 6.25  # over the element size in R, for a wide contact
# semi-angle [rad] of the contact for which the constants below hold: the paper's joint at 2 dR
_WIDE = 1.17
_COARSEST = 0.2  # element size over R, for a wide contact
_CONSTANTS = {2: 1.4, 3: 0.15}  # error of P over (h/R)^3 by degree (docs/accuracy.md)
_MARGIN = 2.0  # an estimate over the error itself, where the order is 3 and the estimate assumes 2
_SMALLEST = 1e-4  # element size over R that a scene may ask for
_LEVELS = 3  # meshes that should do
_FEWEST_FACETS = 3.0  # in contact: of a contact of fewer facets nothing can be learnt
_OF_FILES = 2.0  # ratio of the element sizes of a file
_FIRST_OF_SHAPE = 2.0  # first element size of a shape over the size in its scene
_MOST_DOFS = 1_500_000
_LEAST_RATIO = 1.02  # of two meshes that are told apart
_FEWEST_IN_SPACE = 3  # meshes of shapes in space: two of them may agree by chance
_REFINED = 8.0  # times as many dofs: of three meshes that hardly refine, all may agree by chance
_DIGITS = 4  # of sizes: a scene can be read, and round-off of its units does not matter
_COARSER = 3.0  # element size of a mesh for guesses over the size of the mesh itself
_COARSEST_GUESS = 0.3  # element size over R


class MeshFamily:
    """The meshes ``0, 1, 2, ...`` for ``scene`` that are to make the error of the mesh fall below
    ``accuracy`` with the third, or with the second if that is coarse; each by ``ratio`` finer.
    Whoever solves them notes their ``dofs``. Estimates assume the ``order``: 1 of rings, as few
    cells lie in the core that is loaded. They need the ``fewest`` meshes."""

    ratio = RATIO
    fewest = 2
    dofs = 0

    def __init__(self, scene: Scene, accuracy: float) -> None:
        self.scene = scene
        g = scene.joint
        self.order = 1.0 if g.is_ring else 2.0
        finest = (accuracy / _MARGIN / _CONSTANTS[scene.analysis.degree]) ** (1 / 3)
        self.first = min(_COARSEST, finest * RATIO ** (_LEVELS - 1))
        edge = g.edge_ratio if g.edge_angle is not None else 1.0
        smallest = _SMALLEST * max(1.0, 1 / g.size_ratio, 1 / edge)
        scale = min(1.0, expected_angle(scene) / _WIDE) / max(1.0, g.size_ratio)
        self.scale = max(scale, RATIO * smallest / self.first)

    def scene_of(self, level: int, substeps: int) -> Scene | None:
        """The scene on mesh ``level`` in ``substeps`` steps an output step; None if the mesh would
        be too fine for the limits of the keys."""
        size = self.first / RATIO**level
        keys = self.scene.joint.model_dump(exclude_none=True)
        keys |= {
            "relative_element_size": in_digits(size * self.scale, _DIGITS),
            "growth": in_digits(min(2.0, _GROWTH * size), _DIGITS),
        }
        try:
            joint = JointGeometry.model_validate(keys)
        except ValidationError:
            return None
        return self.scene.model_copy(update={"joint": joint} | chosen(self.scene, substeps))

    def ratio_of(self, coarser: int, finer: int) -> float:
        """The ratio of the element sizes of two meshes of so many dofs."""
        return self.ratio

    def are_enough(self, dofs: Sequence[int]) -> bool:
        """Whether meshes of so many ``dofs`` tell their error."""
        return len(dofs) >= self.fewest

    def sizes(self, scene: Any) -> tuple[float, float]:
        """Element size over R and growth of ``scene``."""
        return scene.joint.h / scene.joint.radius, scene.joint.growth

    def curve(self, steps: Sequence[Record]) -> list[float]:
        """P at every step, under a force delta; P is round-off where nothing touches."""
        if self.scene.force_controlled:
            return [m["delta"] for m in steps]
        touching = any(m.contact_area for m in steps)
        return [m["P"] if touching else 0.0 for m in steps]

    def resolved(self, scene: Any, steps: Sequence[Record]) -> bool:
        """Whether enough facets are in contact to learn from, if any are to be."""
        area = max(m.contact_area for m in steps)
        joint = scene.joint
        facets = area / 2 / joint.h / max(1.0, joint.size_ratio)
        return facets >= _FEWEST_FACETS or max(m["delta"] for m in steps) <= 0


class ProblemFamily:
    """The meshes ``0, 1, 2, ...`` for ``scene``, each by ``ratio`` finer. Its corners, as where an
    edge is clamped, let forces converge with the ``order`` 1.5 at the end, like their energy
    (Williams 1952), and where bodies yield single differences are too small for more. Whoever
    solves them notes their ``dofs``. Estimates need the ``fewest`` meshes."""

    order = 1.5
    dofs = 0

    def __init__(self, scene: ProblemScene) -> None:
        self.scene = scene
        self.shape = scene.mesh.shape
        self.ratio = _OF_FILES if self.shape is None else RATIO
        self.is_drawn_in_space = scene.in_space and self.shape is not None
        self.fewest = _FEWEST_IN_SPACE if self.is_drawn_in_space else 2

    def scene_of(self, level: int, substeps: int) -> ProblemScene | None:
        """The scene on mesh ``level`` in ``substeps`` steps an output step; None if the mesh would
        be too large."""
        dimension = 3 if self.scene.in_space else 2
        if level and self.dofs * self.ratio**dimension > _MOST_DOFS:
            return None
        changes = {"refine": self.scene.mesh.refine + level}
        if self.shape is not None:
            factor = _FIRST_OF_SHAPE / self.ratio**level
            changes = {"shape": resized(self.shape, factor * self.shape.h, factor)}
        mesh = self.scene.mesh.model_copy(update=changes)
        return self.scene.model_copy(update={"mesh": mesh} | chosen(self.scene, substeps))

    def ratio_of(self, coarser: int, finer: int) -> float:
        """The ratio of the element sizes of two meshes of so many dofs: solids that are thin beside
        coarse elements have hardly more of smaller ones."""
        if not self.is_drawn_in_space:
            return self.ratio
        found = (finer / coarser) ** (1 / 3)
        return min(self.ratio, max(_LEAST_RATIO, found))

    def are_enough(self, dofs: Sequence[int]) -> bool:
        """Whether meshes of so many ``dofs`` tell their error: in space one more is needed where
        they hardly refine."""
        hardly = self.is_drawn_in_space and dofs[-1] < _REFINED * dofs[0]
        return len(dofs) >= self.fewest + hardly

    def sizes(self, scene: Any) -> tuple[float, float]:
        """Element size over R and growth of ``scene``; of a file, the size over the size of its own
        cells."""
        shape = scene.mesh.shape
        return (
            (0.5**scene.mesh.refine, 0.0)
            if shape is None
            else (shape.h / shape.radius, shape.growth)
        )

    def curve(self, steps: Sequence[Record]) -> list[float]:
        """The force of the last load at every step, or its displacement where it is a force or a
        pressure."""
        return [m[self.scene.accurate] for m in steps]

    def resolved(self, scene: Any, steps: Sequence[Record]) -> bool:
        """Whether something is in contact at any step, if anything is to be."""
        return any(m.contact_area for m in steps) or not self.scene.interaction


def coarser(scene: ProblemScene, share: float = 1.0) -> ProblemScene | None:
    """The ``scene`` on larger elements, for guesses, or on a ``share`` of their size; None where
    they would be hardly larger, and for a mesh from a file."""
    shape = scene.mesh.shape
    if shape is None:
        return None
    size = share * min(_COARSER * shape.h, _COARSEST_GUESS * shape.radius)
    if size < RATIO * shape.h:
        return None
    mesh = scene.mesh.model_copy(update={"shape": resized(shape, size, size / shape.h)})
    return scene.model_copy(update={"mesh": mesh})


def resized(shape: Any, size: float, steeper: float) -> Any:
    """The ``shape`` with elements of another ``size``, which grow by a factor ``steeper``."""
    sizes: ByName = {
        "element_size": in_digits(size, _DIGITS),
        "growth": in_digits(steeper * shape.growth, _DIGITS),
    }
    if hasattr(shape, "relative_element_size"):
        sizes["relative_element_size"] = None  # the other way to give the size
    return shape.model_copy(update=sizes)


def expected_angle(scene: Scene) -> float:
    """About the largest semi-angle [rad] of the contact, rather too large: where circles that go
    through each other unchanged by the largest ``delta`` meet, ``cos(angle) = dR/(dR + delta)``; a
    force P stands for ``P/(E* t)``."""
    dR = scene.joint.dR
    if dR <= 0:
        return math.pi
    delta = max([0.0, *scene.targets]) / (
        scene.E_star * scene.thickness if scene.force_controlled else 1.0
    )
    return math.atan2(math.sqrt(delta * (2 * dR + delta)), dR) if delta else _WIDE


def chosen(scene: AnyScene, substeps: int) -> ByName:
    """The sections of ``scene`` that make it ask for no accuracy, but for so many ``substeps`` an
    output step."""
    length = 1 / substeps
    stepping = {
        "initial": length,
        "maximum": length,
        "minimum": min(scene.stepping.minimum, length),
    }
    return {
        "stepping": scene.stepping.model_copy(update=stepping),
        "analysis": scene.analysis.model_copy(update={"accuracy": None}),
    }
