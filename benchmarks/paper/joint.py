"""The paper's joint in units of its radius and contact modulus, which every benchmark varies."""

from __future__ import annotations

from archord.scene.file import parse_scene
from archord.scene.scene import Scene

E = 2 * (1 - 0.3**2)  # E* = 1 for two like bodies in plane strain


def paper_joint(
    element_size: float = 0.04, steps: int = 4, yield_stress: float | None = None, **sections: dict
) -> Scene:
    """Plane strain, like bodies, nu = 0.3, dR/R = 0.5 %, block 100 R, delta = 2 dR, with R = E* = 1.

    ``sections`` override keys of the scene's sections: ``joint={"clearance": 0.01}``.
    """
    solid = {"E": E, "nu": 0.3} | ({"yield_stress": yield_stress} if yield_stress else {})
    data: dict = {
        "joint": {"radius": 1.0, "clearance": 0.005, "element_size": element_size},
        "pin": solid,
        "block": solid,
        "load": {"displacement": 2.0, "steps": steps},
    }
    for name, values in sections.items():
        data[name] = values if values.get("rigid") else data.get(name, {}) | values
    return parse_scene(data)
