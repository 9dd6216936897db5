"""A clevis: a pin through one inner and two outer plates."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from archord.report.by_name import ByName
from archord.scene.presets.lug import Lug, PlateOutline
from archord.scene.presets.preset import BoredShape, PinPart, Preset, general_scene
from archord.scene.presets.space import ClevisSpace, held
from archord.scene.sections.bodies import NotNegative, Solid
from archord.scene.sections.keys import Positive, after, key, require


class PlateOfClevis(PlateOutline):
    """One plate of a clevis."""

    def lug(self, clevis: Clevis) -> Lug:
        """The plate as a lug, unchecked."""
        outline = self.model_dump(include={*PlateOutline.model_fields})
        return Lug.model_construct(radius=clevis.radius, clearance=clevis.clearance, **outline)

    def outline(self, clevis: Clevis) -> ByName:
        """What draws it."""
        found = self.lug(clevis).arguments()
        return {name: found[name] for name in PlateOutline.model_fields}


class ClevisPlate(PlateOfClevis, Solid):
    """The inner plate of a clevis, or each of its two outer ones."""

    thickness: Positive = key("thickness of this plate", "length", example=10.0)


class DrawnPlate(PlateOfClevis):
    """The outline of one plate of a clevis, and what a margin of safety needs beside it."""

    thickness: Positive | None = key(
        "thickness of the plate, for its margins of safety", "length", default=None
    )


class PlateBushing(Solid):
    """A bushing in every plate of a clevis, bonded to it: the pin lies in it with the clearance."""

    thickness: Positive = key("thickness of its wall", "length", example=2.0)


class Clevis(BoredShape):
    """A pin through one inner and two outer plates, and how finely they are meshed."""


class ClevisShape(Clevis):
    """A clevis with what a preset says elsewhere."""

    inner: DrawnPlate
    outer: DrawnPlate
    pin: PinPart = "half"
    wall: NotNegative = key("in space: thickness of the bushings' walls", "length", default=0.0)
    space: ClevisSpace | None = Field(None, description="lengths along z of a clevis in space")
    kind: Literal["clevis"] = "clevis"
    drawing: ClassVar[str] = "archord.geometry.shapes.clevis:clevis"

    @after
    def _plates(self) -> ClevisShape:
        for name in ("inner", "outer"):
            plate = getattr(self, name)
            plate.lug(self).check(self.radius + self.clearance + self.wall, place=(name,))
            said = "is missing, as a clevis in space has one"
            require(self.space is None or plate.thickness is not None, (name, "thickness"), said)
        return self

    def arguments(self) -> ByName:
        """What draws it: lengths, and what is drawn."""
        found = super().arguments()
        wall = found.pop("wall")
        for name in ("inner", "outer"):
            plate = getattr(self, name)
            found[name] = plate.outline(self)
            if self.space is not None:
                found[name]["thickness"] = plate.thickness
        if self.space is not None:
            found["space"] |= {"wall": wall}
        return found


class ClevisScene(Preset):
    """A pin through one inner plate and two outer ones: the plane problem of the inner plate, under
    the force P, beside the one of an outer plate, under P/2, each per unit of its own thickness."""

    shape = ClevisShape
    clevis: Clevis = Field(description="radius of the pin, clearance in all plates, and mesh")
    inner: ClevisPlate = Field(description="geometry and material of the inner plate")
    outer: ClevisPlate = Field(description="geometry and material of each of the two outer plates")
    bushing: PlateBushing | None = Field(
        None, description="a bushing in every plate of a clevis in space"
    )
    space: ClevisSpace | None = Field(  # type: ignore[assignment]
        None, description="the clevis in space instead of a plane"
    )

    @after
    def _consistent(self) -> ClevisScene:
        self.require_whole("clevis.clearance", self.clevis.clearance)
        hole = self.clevis.radius + self.clevis.clearance + self._wall
        for name, plate in self._plates.items():
            plate.lug(self.clevis).check(hole, place=(name,))
            if self.space is not None:
                self.space.check_rims(self.clevis.radius, plate.thickness)
        said = (
            "is not for a clevis: its plates share a force, and the displacement is the sum of "
            "both; give force"
        )
        in_space = self.space is not None
        require(in_space or self.load.displacement is None, "load.displacement", said)
        require(in_space or self.bushing is None, "bushing", "is for a clevis in space: give space")
        said = "must not be negative in space"
        require(not in_space or self.clevis.clearance >= 0, "clevis.clearance", said)
        require(not self.pin.rigid, "pin.rigid", "must be false in a clevis")
        said = "is not for a clevis, whose plates have a thickness each"
        require(self.analysis.thickness is None, "analysis.thickness", said)
        return self

    @property
    def _plates(self) -> dict[str, ClevisPlate]:
        return {"inner": self.inner, "outer": self.outer}

    @property
    def _wall(self) -> float:
        return self.bushing.thickness if self.bushing else 0.0

    def general(self) -> ByName:
        """The general scene that it stands for."""
        return self._in_plane() if self.space is None else self._solid()

    def _in_plane(self) -> ByName:
        """Two plane problems, each of a plate and its own pin."""
        parts: dict[str, list[ByName]] = {"interaction": [], "support": [], "load": []}
        shape = self.arguments() | {"kind": "clevis"}
        overlap = max(-self.clevis.clearance, 0.0)
        bodies: dict[str, Solid] = {}
        for (name, plate), share in zip(self._plates.items(), (1.0, 0.5), strict=True):
            shape[name] = plate.outline(self.clevis) | {"thickness": plate.thickness}
            surfaces = [f"{name} pin", f"{name} hole"]
            contact = {"name": f"pin in {name}", "surfaces": surfaces, "overlap": overlap}
            place = {"diameter": f"{name} flat"}.get(self.load.at, f"{name} centre")
            forces = [share / plate.thickness * force for force in self.load.stages]
            parts["load"].append(
                {"name": f"{name} pull", "on": place, "direction": "x", "force": forces}
            )
            parts["support"].append(held(f"{name} clamp", "x", "y"))
            parts["interaction"].append(contact)
            bodies |= {f"{name} pin": self.pin, name: plate}
        parts["support"].append(held("axis", "y"))
        return general_scene(self, shape, 2, bodies, **parts, path={"steps": self.load.steps})

    def _solid(self) -> ByName:
        """One pin through all plates: the outer ones are pulled away from the inner one."""
        shape = self.arguments() | {"kind": "clevis", "wall": self._wall}
        bodies: dict[str, Solid] = {"pin": self.pin}
        contacts = []
        for name, plate in self._plates.items():
            shape[name] = plate.outline(self.clevis) | {"thickness": plate.thickness}
            bodies[name] = plate
            hole = f"{name} hole"
            if self.bushing is not None:
                sleeve = f"{name} bushing"
                bodies[sleeve] = self.bushing
                surfaces = [f"{sleeve} outside", hole]
                contacts.append(
                    {"name": f"{sleeve} in {name}", "surfaces": surfaces, "law": "tied"}
                )
                hole = f"{sleeve} inside"
            contacts.append({"name": f"pin in {name}", "surfaces": [f"{name} pin", hole]})
        pull = {"name": "pull", "on": "outer clamp", "direction": "x"}
        return general_scene(
            self,
            shape,
            2,
            bodies,
            ["flat", "inner clamp"],
            interaction=contacts,
            support=[
                held("inner clamp", "x", "y"),
                held("outer clamp", "y", "z"),
                held("axis", "y"),
            ],
            load=[pull | {self.load.kind: getattr(self.load, self.load.kind)}],
            path={"steps": self.load.steps},
        )
