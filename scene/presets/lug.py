"""A straight lug and its pin, perhaps with a bushing."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from archord.report.by_name import ByName, Names
from archord.scene.presets.preset import DEEPEST, FARTHEST, THINNEST, BoredShape, PinPart, Preset
from archord.scene.presets.space import Space
from archord.scene.sections.bodies import NotNegative, Solid
from archord.scene.sections.keys import Positive, Section, after, key, require


class PlateOutline(Section):
    """The outline of a straight lug, as each plate of a clevis is one."""

    width: Positive = key("width W", "length", example=40.0)
    edge_distance: Positive | None = key(
        "from hole's centre to the loaded end; W/2 if absent", "length", other=20.0
    )
    length: Positive | None = key(
        "from the hole's centre to the clamp; 1.5 W if absent", "length", default=None
    )
    end: Literal["round", "square"] = key(
        "the loaded end: an arc of radius W/2, or straight", default="round"
    )


class Lug(PlateOutline, BoredShape):
    """A straight lug, clamped at one end, and its pin, which pulls at the other."""

    half: bool = key("model the half y >= 0 alone", default=True)

    @after
    def _lug(self) -> Lug:
        self.check()
        return self

    @property
    def hole(self) -> float:
        """Radius of the hole in the plate."""
        return self.radius + self.clearance

    def check(self, hole: float | None = None, place: Names = ()) -> None:
        """Raise `Fault` below ``place`` for a plate in which a ``hole`` of this radius, by default
        its own, leaves no ligament."""
        a = self.arguments()
        R = self.radius
        half = self.width / 2
        hole = hole or self.hole
        behind = a["length"] - max(hole, half - a["edge_distance"])
        ligaments = {
            "width": (half - hole, "beside the hole"),
            "edge_distance": (a["edge_distance"] - hole, "before the hole"),
            "length": (behind, "behind the hole and the end's arc"),
        }
        for name, (ligament, where) in ligaments.items():
            said = f"must leave a ligament of at least {THINNEST:g} R {where}"
            require(ligament >= THINNEST * R, (*place, name), said)
            require(a[name] <= FARTHEST * R, (*place, name), f"must not exceed {FARTHEST:g} R")

    def arguments(self) -> ByName:
        """What draws it: lengths, and what is drawn."""
        lengths = {
            "edge_distance": self.edge_distance or self.width / 2,
            "length": self.length or 1.5 * self.width,
        }
        return super().arguments() | lengths


class LugBushing(Solid):
    """A bushing pressed into the hole of a lug: the pin lies in it with the clearance of the
    section lug."""

    thickness: Positive = key("thickness of its wall", "length", example=2.0)
    interference: NotNegative = key(
        "its outer radius - radius of the hole in the plate", "length", default=0.0
    )
    bonded: bool = key("bonded to the plate, without an interference", default=False)
    touching: bool = key(
        "the pin touches it on the load axis at first, as under a force", default=False
    )

    def check(self, lug: Lug, place: Names = ()) -> float:
        """The radius of the hole that it needs in the plate of ``lug``. Raises `Fault` below
        ``place``."""
        R = lug.radius
        outer = lug.radius + lug.clearance + self.thickness
        require(
            self.thickness >= THINNEST * R,
            (*place, "thickness"),
            f"must be at least {THINNEST:g} R",
        )
        said = f"must not exceed {DEEPEST:g} of its outer radius"
        require(self.interference <= DEEPEST * outer, (*place, "interference"), said)
        fits = not (self.bonded and self.interference)
        require(fits, (*place, "interference"), "is not for a bonded bushing")
        return outer - self.interference


class LugShape(Lug):
    """A lug with what a preset says elsewhere."""

    pin: PinPart = "half"
    space: Space | None = Field(None, description="lengths along z of a lug in space")
    kind: Literal["lug"] = "lug"
    drawing: ClassVar[str] = "archord.geometry.shapes.lug:lug"
    wall: Positive | None = key(
        "thickness of a bushing's wall, if there is one", "length", default=None
    )
    interference: NotNegative = key(
        "the bushing's outer radius - radius of the hole", "length", default=0.0
    )
    touching: bool = key(
        "the pin touches on the load axis at first, or is concentric", default=True
    )

    @property
    def hole(self) -> float:
        """Radius of the hole in the plate."""
        return super().hole + (self.wall or 0.0) - self.interference


class LugScene(Preset):
    """A lug and its pin."""

    shape = LugShape
    lug: Lug = Field(description="geometry and mesh")
    plate: Solid = Field(description="material of the lug")
    bushing: LugBushing | None = Field(None, description="a bushing pressed into the hole of a lug")

    @after
    def _consistent(self) -> LugScene:
        self.require_whole("lug.clearance", self.lug.clearance)
        if self.bushing is not None:
            self.lug.check(self.bushing.check(self.lug, ("bushing",)), ("lug",))
        return self

    def general(self) -> ByName:
        """The general scene that it stands for."""
        shape = self.arguments() | {"kind": "lug"}
        sleeve = self.bushing
        if sleeve is None:
            return self.pulled(
                shape, {"lug": self.plate}, "clamp", ["pin", "hole"], [self.lug.clearance]
            )
        touching = sleeve.touching or self.load.force is not None
        shape |= {
            "wall": sleeve.thickness,
            "interference": sleeve.interference,
            "touching": touching,
        }
        solids = {"bushing": sleeve, "lug": self.plate}
        surfaces = ["pin", "bushing inside", "bushing outside", "hole"]
        laws = ["frictionless", "tied" if sleeve.bonded else "frictionless"]
        return self.pulled(
            shape, solids, "clamp", surfaces, [self.lug.clearance, -sleeve.interference], laws
        )
