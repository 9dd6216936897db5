"""The paper's joint as a shape of a general scene, and the general scene that it stands for."""

from __future__ import annotations

from typing import Any, Literal

from archord.scene.presets.joint import Scene
from archord.scene.presets.joint_geometry import JointGeometry
from archord.scene.presets.preset import PinPart, general_scene
from archord.scene.sections.keys import key


class JointShape(JointGeometry):
    """The paper's joint: half a block or a ring with a pin."""

    pin: PinPart = "half"
    core_radius: float = key("ring: radius over R of the core that the force acts on", default=0.1)
    kind: Literal["joint"] = "joint"

    def arguments(self) -> dict[str, Any]:
        """What draws it."""
        return {"kind": "joint", "geometry": self, "pin": self.pin, "core_radius": self.core_radius}


def general_joint(scene: Scene) -> dict[str, Any]:
    """The general scene that the ``scene`` of a joint stands for; its pin is pressed along -y."""
    g = scene.joint
    pin = scene.pin
    load = scene.load
    contact: dict[str, Any] = {
        "name": "contact",
        "surfaces": ["pin", "hole"],
        "overlap": max(-g.dR, 0.0),
    }
    if pin.rigid:
        contact |= {"surfaces": ["hole"], "rigid": {"centre": [0.0, -g.dR], "radius": g.radius}}
    elif scene.analysis.integration != "both":
        contact["integrated"] = "pin" if scene.analysis.integration == "pin" else "hole"
    on = "pin" if g.is_ring else "pin top"
    if pin.rigid:
        on = "contact"
    press: dict[str, Any] = {"name": "press", "on": on, "direction": "y"}
    press["force" if scene.force_controlled else "displacement"] = [
        -at * scene.load_unit for at in load.stages
    ]
    if g.is_ring:
        press["core"] = {"centre": [0.0, 0.0], "radius": load.core_radius * g.radius}
    shape = g.model_dump(exclude_none=True) | {"kind": "joint", "core_radius": load.core_radius}
    axis = {"name": "axis", "on": "symmetry", "fixed": ["x"]}
    block = {"name": "block", "on": "block held", "fixed": ["x", "y"]}
    parts = {
        "interaction": [contact],
        "support": [axis, block],
        "load": [press],
        "path": {"steps": load.stage_steps},
    }
    return general_scene(scene, shape, 2, {"block": scene.block}, **parts)
