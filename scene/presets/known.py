"""The presets by name: a new preset is a file of this room, a drawing in geometry/shapes, and a row
here and in presets/problem.py."""

from __future__ import annotations

from typing import Annotated, Any, Union

from pydantic import Field

from archord.scene.presets.bushing import BushingScene, BushingShape
from archord.scene.presets.clevis import ClevisScene, ClevisShape
from archord.scene.presets.joint_shape import JointShape
from archord.scene.presets.lug import LugScene, LugShape
from archord.scene.presets.preset import Preset, Shape

# scenes by the section that tells them, and the shapes that meshes are drawn from
PRESETS: dict[str, type[Preset]] = {
    "lug": LugScene,
    "clevis": ClevisScene,
    "bushing": BushingScene,
}
SHAPES: dict[str, type[Shape] | type[JointShape]] = {
    "lug": LugShape,
    "clevis": ClevisShape,
    "bushing": BushingShape,
    "joint": JointShape,
}
AnyShape: Any = Annotated[Union[*SHAPES.values()], Field(discriminator="kind")]
