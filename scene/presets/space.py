"""The section ``space`` of a preset: how long its bodies are along z, and the rims of its holes."""

from __future__ import annotations

from collections.abc import Sequence

from archord.report.by_name import ByName
from archord.scene.sections.bodies import NotNegative
from archord.scene.sections.keys import Positive, Section, key, require

COARSE = 0.15  # element size over R, where none is given: solids cost more than planes
_BLUNTEST = 0.2  # chamfer or fillet over R
_SHORTEST = 0.02  # length over R
_HOLLOWEST = 0.9  # bore over R


class Depth(Section):
    """The third dimension of a joint, mirrored at z = 0: what all joints have of it."""

    half: bool = key("model the half z >= 0 alone", default=True)
    chamfer: NotNegative = key(
        "leg of a chamfer of 45 degrees at the rims of the holes that the pin lies in",
        "length",
        default=0.0,
    )
    fillet: NotNegative = key(
        "radius of the rounded rims of these holes, instead of a chamfer; elements there are no "
        "larger than the radius, so that a small one takes many",
        "length",
        default=0.0,
    )
    rim_ratio: float = key(
        "element size at these rims over element_size", default=0.5, ge=0.02, le=1
    )

    @property
    def blunt(self) -> float:
        """How far from the faces the rims end, and the holes begin to bear."""
        return self.chamfer or self.fillet

    def check_rims(self, radius: float, thickness: float) -> None:
        """Raise `Fault` for rims that do not fit a hole of this ``radius`` in a plate."""
        require(not (self.chamfer and self.fillet), "space.fillet", "is instead of a chamfer")
        for name in ("chamfer", "fillet"):
            most = min(_BLUNTEST * radius, 0.45 * thickness)
            said = f"must be at most {most:g}: {_BLUNTEST:g} R, and 0.45 of the thickness"
            require(getattr(self, name) <= most, ("space", name), said)


class Space(Depth):
    """The joint in space instead of a plane: bodies of a length along z."""

    thickness: Positive = key(
        "length along z of all bodies but the pin, the whole",
        "length",
        example=10.0,
    )
    pin_length: Positive | None = key(
        "length of the pin, the whole; the thickness if absent; a rigid pin is infinitely long",
        "length",
        other=15.0,
    )

    def check(self, radius: float) -> None:
        """Raise `Fault` for lengths that do not fit a pin of this ``radius``."""
        for name, length in (("thickness", self.thickness), ("pin_length", self.pin_length)):
            said = f"must be at least {_SHORTEST:g} R"
            require(length is None or length >= _SHORTEST * radius, ("space", name), said)
        self.check_rims(radius, self.thickness)

    def arguments(self) -> ByName:
        """What draws it."""
        return self.model_dump() | {"pin_length": self.pin_length or self.thickness}


class ClevisSpace(Depth):
    """The clevis in space instead of a plane: its plates beside each other on one pin."""

    gap: NotNegative = key("between the inner plate and each outer one", "length", default=0.0)
    overhang: NotNegative = key("of the pin beyond each outer plate", "length", default=0.0)
    bore: NotNegative = key("radius of the bore of a hollow pin", "length", default=0.0)

    def check(self, radius: float) -> None:
        """Raise `Fault` for lengths that do not fit a pin of this ``radius``."""
        said = f"must be at most {_HOLLOWEST:g} R"
        require(self.bore <= _HOLLOWEST * radius, "space.bore", said)

    def arguments(self) -> ByName:
        """What draws it."""
        return self.model_dump()


def held(name: str, *fixed: str, on: str = "") -> ByName:
    """The section of a support that holds the set ``on``, by default of its ``name``, in the
    directions ``fixed``."""
    return {"name": name, "on": on or name, "fixed": list(fixed)}


def solid(general: ByName, space: Depth, middles: Sequence[str]) -> ByName:
    """The ``general`` scene of a plane joint in ``space``, with the mid-plane as a mirror; of the
    whole, the ``middles`` of these facet sets are held along z, where the mirror leaves them."""
    shape = general["mesh"]["shape"] | {"space": space.model_dump(exclude_none=True)}
    mirrors = ["mid-plane"] if space.half else [f"{name} middle" for name in middles]
    supports = [held(name, "z") for name in mirrors]
    analysis = general["analysis"]
    copies = 2 if space.half else 1
    in_space = {"plane": "space", "symmetry": copies * analysis["symmetry"]}
    contacts = [
        part | {"rigid": _cylinder(part["rigid"])} if "rigid" in part else part
        for part in general["interaction"]
    ]
    return general | {
        "mesh": {"shape": shape},
        "interaction": contacts,
        "support": [*general["support"], *supports],
        "analysis": analysis | in_space,
    }


def _cylinder(disc: ByName) -> ByName:
    """The cylinder along z over a ``disc``."""
    return disc | {"centre": [*disc["centre"], 0.0], "axis": [0.0, 0.0, 1.0]}
