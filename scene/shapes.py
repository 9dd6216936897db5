"""Presets: a lug, perhaps with a bushing, a clevis, and a pin in sleeves; what general scene they
stand for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pydantic import Field, model_validator

from archord.scene.geometry import JointGeometry
from archord.scene.keys import Pair, Positive, Section, key, require
from archord.scene.scene import Checked, Scene, plain
from archord.scene.sections import (
    Loading,
    NotNegative,
    Pin,
    PresetAnalysis,
    ProblemOutput,
    Solid,
    StepCounts,
    Stepping,
    Targets,
    Units,
)

# walls, overlaps and lengths over the pin's radius
_THINNEST = 0.02 * (1 - 1e-9)
_DEEPEST = 0.03
_FARTHEST = 1e3
_MATERIAL = {*Solid.model_fields}
PinPart = Literal["half", "whole", "none"]


class Shape(Section):
    """A shape around a pin, and how finely it is meshed."""

    radius: float = key("radius R of the pin", "length", example=10.0, ge=1e-30, le=1e30)
    element_size: Positive | None = key(
        "edge length of elements on the arcs; 0.04 R if absent", "length", other=0.4
    )
    growth: float = key(
        "growth of the element size per unit of distance from the arcs", default=0.25, ge=0.01, le=2
    )

    @model_validator(mode="after")
    def _mesh(self):
        require(
            1e-3 <= self.h / self.radius <= 0.5,
            "element_size",
            "must be between 1e-3 and 0.5 times the radius",
        )
        return self

    @property
    def h(self) -> float:
        """Element size on the arcs."""
        return self.element_size or 0.04 * self.radius

    def arguments(self) -> dict[str, Any]:
        """What draws it: lengths, and what is drawn."""
        return self.model_dump() | {"element_size": self.h}


class BoredShape(Shape):
    """A shape whose hole leaves the pin a clearance."""

    clearance: float = key(
        "hole radius - pin radius: up to 0.5 R, negative for an interference", "length", example=0.1
    )

    @model_validator(mode="after")
    def _clearance(self):
        between = f"must be between {-_DEEPEST:g} and 0.5 times the radius"
        require(-_DEEPEST <= self.clearance / self.radius <= 0.5, "clearance", between)
        return self


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

    @model_validator(mode="after")
    def _lug(self) -> Lug:
        self.check()
        return self

    @property
    def hole(self) -> float:
        """Radius of the hole in the plate."""
        return self.radius + self.clearance

    def check(self, hole: float | None = None, place: tuple[str, ...] = ()) -> None:
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
            said = f"must leave a ligament of at least {_THINNEST:g} R {where}"
            require(ligament >= _THINNEST * R, (*place, name), said)
            require(a[name] <= _FARTHEST * R, (*place, name), f"must not exceed {_FARTHEST:g} R")

    def arguments(self) -> dict[str, Any]:
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

    def check(self, lug: Lug, place: tuple[str, ...] = ()) -> float:
        """The radius of the hole that it needs in the plate of ``lug``. Raises `Fault` below
        ``place``."""
        R = lug.radius
        outer = lug.radius + lug.clearance + self.thickness
        require(
            self.thickness >= _THINNEST * R,
            (*place, "thickness"),
            f"must be at least {_THINNEST:g} R",
        )
        said = f"must not exceed {_DEEPEST:g} of its outer radius"
        require(self.interference <= _DEEPEST * outer, (*place, "interference"), said)
        fits = not (self.bonded and self.interference)
        require(fits, (*place, "interference"), "is not for a bonded bushing")
        return outer - self.interference


class LugShape(Lug):
    """A lug with what a preset says elsewhere."""

    pin: PinPart = "half"
    kind: Literal["lug"] = "lug"
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


class PlateOfClevis(PlateOutline):
    """One plate of a clevis."""

    def lug(self, clevis: Clevis) -> Lug:
        """The plate as a lug, unchecked."""
        outline = self.model_dump(include={*PlateOutline.model_fields})
        return Lug.model_construct(radius=clevis.radius, clearance=clevis.clearance, **outline)

    def outline(self, clevis: Clevis) -> dict[str, Any]:
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


class Clevis(BoredShape):
    """A pin through one inner and two outer plates, and how finely they are meshed."""


class ClevisShape(Clevis):
    """A clevis with what a preset says elsewhere."""

    inner: DrawnPlate
    outer: DrawnPlate
    pin: PinPart = "half"
    kind: Literal["clevis"] = "clevis"

    @model_validator(mode="after")
    def _plates(self) -> ClevisShape:
        for name in ("inner", "outer"):
            getattr(self, name).lug(self).check(place=(name,))
        return self

    def arguments(self) -> dict[str, Any]:
        """What draws it: lengths, and what is drawn."""
        plates = {name: getattr(self, name).outline(self) for name in ("inner", "outer")}
        return super().arguments() | plates


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
            f"must not overlap what is inside by more than {_DEEPEST:g} of its radius, nor be "
            "wider by more than 0.5"
        )
        for name, (inner, outer) in zip(names, rings, strict=True):
            require(
                outer - inner >= _THINNEST * R,
                name,
                f"must have a wall of at least {_THINNEST:g} R",
            )
            require(outer <= _FARTHEST * R, name, f"must not exceed {_FARTHEST:g} R")
            require(-_DEEPEST <= inner / edge - 1 <= 0.5, name, fits)
            edge = outer


class BushingShape(Bushing):
    """A bushing with what a preset says elsewhere."""

    rings: list[Pair] = Field(default=[], description="inner and outer radii from the pin outward")
    pin: PinPart = "half"
    kind: Literal["bushing"] = "bushing"

    @model_validator(mode="after")
    def _bushing(self) -> BushingShape:
        self.check(self.rings, ["rings"] * len(self.rings))
        return self


class JointShape(JointGeometry):
    """The paper's joint: half a block or a ring with a pin."""

    pin: PinPart = "half"
    core_radius: float = key("ring: radius over R of the core that the force acts on", default=0.1)
    kind: Literal["joint"] = "joint"

    def arguments(self) -> dict[str, Any]:
        """What draws it."""
        return {"kind": "joint", "geometry": self, "pin": self.pin, "core_radius": self.core_radius}


class Ring(Solid):
    """A sleeve or the housing; with a bore smaller than what is inside they are pressed
    together."""

    bore: Positive = key("inner radius", "length", example=10.05)
    outer: Positive = key("outer radius", "length", example=14.0)


class PinLoad(Loading):
    """How the pin is moved in +x: by its diameter across the axis, or as a rigid disc."""

    displacement: Targets | None = key(
        "displacement of the pin", "length", default=None, example=0.1
    )
    force: Targets | None = key("force on the whole pin, instead", "force", other=1000.0)
    at: Literal["diameter", "centre"] = key(
        "a force acts on the straight diameter or the centre", default="diameter"
    )
    steps: StepCounts = key("output steps up to each target", default=20)

    @model_validator(mode="after")
    def _at(self) -> PinLoad:
        require(
            self.at == "diameter" or self.force is not None,
            "at",
            'must be "diameter" for a displacement',
        )
        return self


class Preset(Checked):
    """What the scenes of presets share."""

    format: Literal[2] = key("version of the scene format", default=2)
    units: Units = Field(default_factory=Units, description="names of the units")
    pin: Pin = Field(description="material of the pin")
    load: PinLoad = Field(description="loading")
    analysis: PresetAnalysis = Field(default_factory=PresetAnalysis, description="model and solver")
    stepping: Stepping = Field(
        default_factory=Stepping, description="control of the steps between outputs"
    )
    output: ProblemOutput = Field(default_factory=ProblemOutput, description="what is written")

    def _require_whole(self, name: str, gap: float) -> None:
        fits = self.pin.whole or self.pin.rigid or gap >= 0
        require(fits, name, "needs pin.whole = true, as half a pin cannot be pressed in")

    def _pulled(
        self,
        shape: dict[str, Any],
        solids: Mapping[str, Solid],
        held: str,
        surfaces: list[str],
        gaps: list[float],
        laws: Sequence[str] = (),
    ) -> dict[str, Any]:
        """The general scene of ``solids``, from the pin outward, with the edge ``held``; of their
        ``surfaces`` the first faces the second at the first of the ``gaps`` by the first of the
        ``laws``, the third the fourth, ..."""
        half, touching = (shape.get(name, True) for name in ("half", "touching"))
        rigid = self.pin.rigid
        names = ["pin", *solids]
        contacts = list[dict[str, Any]]()
        for k, gap in enumerate(gaps):
            facing = {
                "name": f"{names[k]} in {names[k + 1]}",
                "surfaces": surfaces[2 * k : 2 * k + 2],
            }
            law = {"law": laws[k]} if laws else {}
            contacts.append(facing | law | {"overlap": max(-gap, 0.0)})
        if rigid:
            disc = {
                "centre": [touching * sum(max(gap, 0.0) for gap in gaps), 0.0],
                "radius": shape["radius"],
            }
            contacts[0] |= {"surfaces": [surfaces[1]], "rigid": disc}
        supports = [{"name": held, "on": held, "fixed": ["x", "y"]}]
        if half or not rigid:
            supports.append({"name": "axis", "on": "axis" if half else "centre", "fixed": ["y"]})
        place = contacts[0]["name"] if rigid else {"diameter": "flat"}.get(self.load.at, "centre")
        pull = {
            "name": "pull",
            "on": place,
            "direction": "x",
            self.load.kind: getattr(self.load, self.load.kind),
        }
        parts = {
            "interaction": contacts,
            "support": supports,
            "load": [pull],
            "path": {"steps": self.load.steps},
        }
        return _general(self, shape, 2 if half else 1, solids, **parts)


class LugScene(Preset):
    """A lug and its pin."""

    lug: Lug = Field(description="geometry and mesh")
    plate: Solid = Field(description="material of the lug")
    bushing: LugBushing | None = Field(None, description="a bushing pressed into the hole of a lug")

    @model_validator(mode="after")
    def _consistent(self) -> LugScene:
        self._require_whole("lug.clearance", self.lug.clearance)
        if self.bushing is not None:
            self.lug.check(self.bushing.check(self.lug, ("bushing",)), ("lug",))
        return self

    def general(self) -> dict[str, Any]:
        """The general scene that it stands for."""
        shape = self.lug.arguments() | {"kind": "lug"}
        sleeve = self.bushing
        if sleeve is None:
            return self._pulled(
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
        return self._pulled(
            shape, solids, "clamp", surfaces, [self.lug.clearance, -sleeve.interference], laws
        )


class ClevisScene(Preset):
    """A pin through one inner plate and two outer ones: the plane problem of the inner plate, under
    the force P, beside the one of an outer plate, under P/2, each per unit of its own thickness."""

    clevis: Clevis = Field(description="radius of the pin, clearance in all plates, and mesh")
    inner: ClevisPlate = Field(description="geometry and material of the inner plate")
    outer: ClevisPlate = Field(description="geometry and material of each of the two outer plates")

    @model_validator(mode="after")
    def _consistent(self) -> ClevisScene:
        self._require_whole("clevis.clearance", self.clevis.clearance)
        for name, plate in self._plates.items():
            plate.lug(self.clevis).check(place=(name,))
        said = (
            "is not for a clevis: its plates share a force, and the displacement is the sum of "
            "both; give force"
        )
        require(self.load.displacement is None, "load.displacement", said)
        require(not self.pin.rigid, "pin.rigid", "must be false in a clevis")
        said = "is not for a clevis, whose plates have a thickness each"
        require(self.analysis.thickness is None, "analysis.thickness", said)
        return self

    @property
    def _plates(self) -> dict[str, ClevisPlate]:
        return {"inner": self.inner, "outer": self.outer}

    def general(self) -> dict[str, Any]:
        """The general scene that it stands for."""
        parts: dict[str, list[dict[str, Any]]] = {"interaction": [], "support": [], "load": []}
        shape = self.clevis.arguments() | {"kind": "clevis"}
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
            parts["support"].append(
                {"name": f"{name} clamp", "on": f"{name} clamp", "fixed": ["x", "y"]}
            )
            parts["interaction"].append(contact)
            bodies |= {f"{name} pin": self.pin, name: plate}
        parts["support"].append({"name": "axis", "on": "axis", "fixed": ["y"]})
        return _general(self, shape, 2, bodies, **parts, path={"steps": self.load.steps})


class BushingScene(Preset):
    """A pin, sleeves around it and a housing; they touch on the load axis at first if the load is a
    force."""

    bushing: Bushing = Field(description="radius of the pin, and mesh")
    sleeve: list[Ring] = Field(default_factory=list, description="sleeves from the pin outward")
    housing: Ring = Field(description="geometry and material of the housing")

    @model_validator(mode="after")
    def _consistent(self) -> BushingScene:
        names = ["sleeve"] * len(self.sleeve) + ["housing"]
        self.bushing.check(self._rings, names)
        self._require_whole(names[0], self._rings[0][0] - self.bushing.radius)
        return self

    @property
    def _rings(self) -> list[list[float]]:
        return [[ring.bore, ring.outer] for ring in (*self.sleeve, self.housing)]

    def general(self) -> dict[str, Any]:
        """The general scene that it stands for."""
        sleeves = {f"sleeve {k}": sleeve for k, sleeve in enumerate(self.sleeve, 1)}
        surfaces = [
            "pin",
            *(f"{name} {side}" for name in sleeves for side in ("inside", "outside")),
            "bore",
        ]
        touching = self.bushing.touching or self.load.force is not None
        shape = self.bushing.arguments() | {
            "kind": "bushing",
            "rings": self._rings,
            "touching": touching,
        }
        inner = [self.bushing.radius, *(outer for _, outer in self._rings)]
        gaps = [bore - edge for edge, (bore, _) in zip(inner, self._rings, strict=False)]
        return self._pulled(
            shape, sleeves | {"housing": self.housing}, "outer edge", surfaces, gaps
        )


def _general(
    scene: Scene | Preset,
    shape: dict[str, Any],
    symmetry: int,
    solids: Mapping[str, Solid],
    **parts: Any,
) -> dict[str, Any]:
    """The general scene of a pin in ``solids``, with its other ``parts``. Of the sections that
    ``scene`` has, too, the keys that were given, as an accuracy chooses some others."""
    pin = scene.pin
    said = {
        name: plain(getattr(scene, name)) for name in ("units", "analysis", "stepping", "output")
    }
    for name in ("integration", "coarse_start", "friction"):  # of presets alone
        said["analysis"].pop(name, None)
    if friction := scene.analysis.friction:
        parts["interaction"] = [
            part if part.get("law") == "tied" else part | {"friction": friction}
            for part in parts["interaction"]
        ]
    bodies = solids if pin.rigid or pin in solids.values() else {"pin": pin, **solids}
    drawn = "whole" if pin.whole else "half"
    if pin.rigid:
        drawn = "none"
    parts |= {
        "mesh": {"shape": shape | {"pin": drawn}},
        "body": [
            {"name": n} | s.model_dump(exclude_none=True, include=_MATERIAL)
            for n, s in bodies.items()
        ],
    }
    return said | parts | {"analysis": said["analysis"] | {"symmetry": symmetry}}


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
    return _general(scene, shape, 2, {"block": scene.block}, **parts)


PRESETS: dict[str, type[LugScene] | type[ClevisScene] | type[BushingScene]] = {
    "lug": LugScene,
    "clevis": ClevisScene,
    "bushing": BushingScene,
}
