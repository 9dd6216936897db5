"""What presets share: the shape around a pin, its load, and the general scene made of them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

from pydantic import Field

from archord.report.by_name import ByName
from archord.scene.presets.space import COARSE, Space, held, solid
from archord.scene.sections.analysis import PresetAnalysis, ProblemOutput, Stepping
from archord.scene.sections.bodies import Pin, Solid
from archord.scene.sections.checked import Checked
from archord.scene.sections.keys import Positive, Section, after, key, plain, require
from archord.scene.sections.loading import Loading, StepCounts, Targets
from archord.scene.sections.units import Units

# walls, overlaps and lengths over the pin's radius
THINNEST = 0.02 * (1 - 1e-9)
DEEPEST = 0.03
FARTHEST = 1e3
_MATERIAL = {*Solid.model_fields}
PinPart = Literal["half", "whole", "none"]


class Shape(Section):
    """A shape around a pin, and how finely it is meshed."""

    # of a shape with a kind, what draws it, "module:function": scenes load without gmsh
    drawing: ClassVar[str] = ""
    radius: float = key("radius R of the pin", "length", example=10.0, ge=1e-30, le=1e30)
    element_size: Positive | None = key(
        "edge length of elements on the arcs; 0.04 R if absent", "length", other=0.4
    )
    growth: float = key(
        "growth of the element size per unit of distance from the arcs", default=0.25, ge=0.01, le=2
    )

    @after
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

    def arguments(self) -> ByName:
        """What draws it: lengths, and what is drawn."""
        found = self.model_dump(exclude={"space"}) | {"element_size": self.h}
        space = getattr(self, "space", None)
        return found if space is None else found | {"space": space.arguments()}


class BoredShape(Shape):
    """A shape whose hole leaves the pin a clearance."""

    clearance: float = key(
        "hole radius - pin radius: up to 0.5 R, negative for an interference", "length", example=0.1
    )

    @after
    def _clearance(self):
        between = f"must be between {-DEEPEST:g} and 0.5 times the radius"
        require(-DEEPEST <= self.clearance / self.radius <= 0.5, "clearance", between)
        return self


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

    @after
    def _at(self) -> PinLoad:
        require(
            self.at == "diameter" or self.force is not None,
            "at",
            'must be "diameter" for a displacement',
        )
        return self


class Preset(Checked):
    """What the scenes of presets share; each says the ``shape`` of its mesh and defines
    `general`."""

    shape: ClassVar[type[Shape]]

    format: Literal[2] = key("version of the scene format", default=2)
    units: Units = Field(default_factory=Units, description="names of the units")
    pin: Pin = Field(description="material of the pin")
    load: PinLoad = Field(description="loading")
    space: Space | None = Field(None, description="the joint in space instead of a plane")
    analysis: PresetAnalysis = Field(default_factory=PresetAnalysis, description="model and solver")
    stepping: Stepping = Field(
        default_factory=Stepping, description="control of the steps between outputs"
    )
    output: ProblemOutput = Field(default_factory=ProblemOutput, description="what is written")

    @after
    def _in_space(self):
        if self.space is not None:
            require_solid(self, self.load.at == "diameter", self.drawn.radius)
        return self

    @property
    def drawn(self) -> Shape:
        """The section that tells the shape."""
        return getattr(self, self.shape.model_fields["kind"].default)

    def arguments(self) -> ByName:
        """What draws the shape; elements in space are larger by default."""
        found = self.drawn.arguments()
        if self.space is not None and self.drawn.element_size is None:
            found["element_size"] = COARSE * self.drawn.radius
        return found

    @abstractmethod
    def general(self) -> ByName:
        """The general scene that it stands for."""

    def require_whole(self, name: str, gap: float) -> None:
        """Raise `Fault` of the key ``name`` where half a pin would have to be pressed in."""
        fits = self.pin.whole or self.pin.rigid or gap >= 0
        require(fits, name, "needs pin.whole = true, as half a pin cannot be pressed in")

    def pulled(
        self,
        shape: ByName,
        solids: Mapping[str, Solid],
        clamp: str,
        surfaces: list[str],
        gaps: list[float],
        laws: Sequence[str] = (),
    ) -> ByName:
        """The general scene of ``solids``, from the pin outward, with the edge ``clamp`` held; of
        their ``surfaces`` the first faces the second at the first of the ``gaps`` by the first of
        the ``laws``, the third the fourth, ..."""
        half, touching = (shape.get(name, True) for name in ("half", "touching"))
        rigid = self.pin.rigid
        names = ["pin", *solids]
        contacts = list[ByName]()
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
        supports = [held(clamp, "x", "y")]
        if half or not rigid:
            supports.append(held("axis", "y", on="axis" if half else "centre"))
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
        outward = laws[1:] or [""] * (len(gaps) - 1)
        sleeves = zip(surfaces[1:-1:2], outward, strict=True)
        middles = [clamp, *(name for name, law in sleeves if law != "tied")]
        if not rigid:
            middles.insert(0, place)
        return general_scene(self, shape, 2 if half else 1, solids, middles, **parts)


def general_scene(
    scene: Any,
    shape: ByName,
    symmetry: int,
    solids: Mapping[str, Solid],
    middles: Sequence[str] = (),
    /,
    **parts: Any,
) -> ByName:
    """The general scene of a pin in ``solids``, with its other ``parts``; of ``middles`` see
    `solid`. Of the sections that ``scene`` has, too, the keys that were given, as an accuracy
    chooses some others."""
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
    general = said | parts | {"analysis": said["analysis"] | {"symmetry": symmetry}}
    return general if scene.space is None else solid(general, scene.space, middles)


def require_solid(scene: Any, on_face: bool, radius: float) -> None:
    """Raise `Fault` for what a ``scene`` in space cannot have; a load is ``on_face`` if it acts on
    a face of the pin of this ``radius``."""
    scene.space.check(radius)
    analysis = scene.analysis
    has_length = getattr(scene.space, "pin_length", None) is not None
    said = "is not for a rigid pin, which is infinitely long"
    require(not (scene.pin.rigid and has_length), "space.pin_length", said)
    require(on_face, "load.at", 'must be "diameter" in space')
    require(analysis.thickness is None, "analysis.thickness", "is for planes; give space.thickness")
    is_plane = "plane" in analysis.model_fields_set
    require(not is_plane, "analysis.plane", "is not for a joint in space")
    require(analysis.degree == 2, "analysis.degree", "must be 2 in space")
