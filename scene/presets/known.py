"""The presets by name: a new preset is a file of this room, a drawing in geometry/shapes, and a row
here."""

from __future__ import annotations

from typing import Annotated, Any, Union

from pydantic import Field

from archord.scene.presets.bushing import BushingScene
from archord.scene.presets.clevis import ClevisScene
from archord.scene.presets.joint_geometry import JointShape
from archord.scene.presets.lug import LugScene
from archord.scene.presets.preset import Preset, Shape

PRESETS: dict[str, type[Preset]] = {
    "lug": LugScene,
    "clevis": ClevisScene,
    "bushing": BushingScene,
}  # by the section that tells them; a scene is the first of them that it has a section of
# what meshes are drawn from
SHAPES: dict[str, type[Shape] | type[JointShape]] = {
    **{name: scene.shape for name, scene in PRESETS.items()},
    "joint": JointShape,
}
AnyShape: Any = Annotated[Union[*SHAPES.values()], Field(discriminator="kind")]
