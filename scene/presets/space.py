"""The section ``space`` of a preset: how long its bodies are along z, and the rims of its holes."""

from __future__ import annotations

from typing import Any

from archord.scene.sections.bodies import NotNegative
from archord.scene.sections.keys import Positive, Section, key, require

COARSE = 0.15  # element size over R, where none is given: solids cost more than planes
_BLUNTEST = 0.2  # chamfer or fillet over R
_SHORTEST = 0.02  # length over R


class Space(Section):
    """The joint in space instead of a plane: bodies of a length along z, mirrored at z = 0."""

    thickness: Positive = key(
        "length along z of all bodies but the pin, the whole: half of it is modelled",
        "length",
        example=10.0,
    )
    pin_length: Positive | None = key(
        "length of the pin, the whole; the thickness if absent", "length", other=15.0
    )
    chamfer: NotNegative = key(
        "leg of a chamfer of 45 degrees at the rims of the hole that the pin lies in",
        "length",
        default=0.0,
    )
    fillet: NotNegative = key(
        "radius of the rounded rims of this hole, instead of a chamfer", "length", default=0.0
    )
    rim_ratio: float = key(
        "element size at these rims over element_size", default=0.5, ge=0.02, le=1
    )

    def check(self, radius: float) -> None:
        """Raise `Fault` for lengths that do not fit a pin of this ``radius``."""
        for name, length in (("thickness", self.thickness), ("pin_length", self.pin_length)):
            said = f"must be at least {_SHORTEST:g} R"
            require(length is None or length >= _SHORTEST * radius, ("space", name), said)
        require(not (self.chamfer and self.fillet), "space.fillet", "is instead of a chamfer")
        for name in ("chamfer", "fillet"):
            most = min(_BLUNTEST * radius, 0.45 * self.thickness)
            said = f"must be at most {most:g}: {_BLUNTEST:g} R, and 0.45 of the thickness"
            require(getattr(self, name) <= most, ("space", name), said)

    def arguments(self) -> dict[str, Any]:
        """What draws it."""
        return self.model_dump() | {"pin_length": self.pin_length or self.thickness}


def solid(general: dict[str, Any], space: Space) -> dict[str, Any]:
    """The ``general`` scene of a plane joint in ``space``, with the mid-plane as a mirror."""
    shape = general["mesh"]["shape"] | {"space": space.model_dump(exclude_none=True)}
    middle = {"name": "mid-plane", "on": "mid-plane", "fixed": ["z"]}
    analysis = general["analysis"]
    in_space = {"plane": "space", "symmetry": 2 * analysis["symmetry"]}
    return general | {
        "mesh": {"shape": shape},
        "support": [*general["support"], middle],
        "analysis": analysis | in_space,
    }
