"""A pin in any number of sleeves in a housing."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from archord.report.by_name import ByName
from archord.scene.presets.preset import DEEPEST, FARTHEST, THINNEST, PinPart, Preset, Shape
from archord.scene.presets.space import Space
from archord.scene.sections.bodies import Solid
from archord.scene.sections.keys import Pair, Positive, after, key, require


class Bushing(Shape):
    """A pin in sleeves in a housing that is held at its outer edge."""

    touching: bool = key(
        "bodies touch on the load axis at first, as under a force, or are concentric", default=False
    )

    def check(self, rings: list[list[float]], names: list[str]) -> None:
        """Raise `Fault`, of the keys ``names``, for ``rings`` that do not fit."""
        R = self.radius
        edge = self.radius
        fits = (
            f"must not overlap what is inside by more than {DEEPEST:g} of its radius, nor be wider "
            "by more than 0.5"
        )
        for name, (inner, outer) in zip(names, rings, strict=True):
            require(
                outer - inner >= THINNEST * R,
                name,
                f"must have a wall of at least {THINNEST:g} R",
            )
            require(outer <= FARTHEST * R, name, f"must not exceed {FARTHEST:g} R")
            require(-DEEPEST <= inner / edge - 1 <= 0.5, name, fits)
            edge = outer


class BushingShape(Bushing):
    """A bushing with what a preset says elsewhere."""

    rings: list[Pair] = Field(default=[], description="inner and outer radii from the pin outward")
    pin: PinPart = "half"
    space: Space | None = Field(None, description="lengths along z of a bushing in space")
    kind: Literal["bushing"] = "bushing"
    drawing: ClassVar[str] = "archord.geometry.shapes.bushing:bushing"

    @after
    def _bushing(self) -> BushingShape:
        self.check(self.rings, ["rings"] * len(self.rings))
        return self


class Ring(Solid):
    """A sleeve or the housing; with a bore smaller than what is inside they are pressed
    together."""

    bore: Positive = key("inner radius", "length", example=10.05)
    outer: Positive = key("outer radius", "length", example=14.0)


class BushingScene(Preset):
    """A pin, sleeves around it and a housing; they touch on the load axis at first if the load is a
    force."""

    shape = BushingShape
    bushing: Bushing = Field(description="radius of the pin, and mesh")
    sleeve: list[Ring] = Field(default_factory=list, description="sleeves from the pin outward")
    housing: Ring = Field(description="geometry and material of the housing")

    @after
    def _consistent(self) -> BushingScene:
        names = ["sleeve"] * len(self.sleeve) + ["housing"]
        self.bushing.check(self._rings, names)
        self.require_whole(names[0], self._rings[0][0] - self.bushing.radius)
        return self

    @property
    def _rings(self) -> list[list[float]]:
        return [[ring.bore, ring.outer] for ring in (*self.sleeve, self.housing)]

    def general(self) -> ByName:
        """The general scene that it stands for."""
        sleeves = {f"sleeve {k}": sleeve for k, sleeve in enumerate(self.sleeve, 1)}
        surfaces = [
            "pin",
            *(f"{name} {side}" for name in sleeves for side in ("inside", "outside")),
            "bore",
        ]
        touching = self.bushing.touching or self.load.force is not None
        shape = self.arguments() | {
            "kind": "bushing",
            "rings": self._rings,
            "touching": touching,
        }
        inner = [self.bushing.radius, *(outer for _, outer in self._rings)]
        gaps = [bore - edge for edge, (bore, _) in zip(inner, self._rings, strict=False)]
        return self.pulled(shape, sleeves | {"housing": self.housing}, "outer edge", surfaces, gaps)
