"""The parts of a general scene: mesh, bodies, interactions, couplings, supports, loads, and the
path of the loads."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from archord.report.by_name import Words
from archord.scene.presets.known import AnyShape
from archord.scene.sections.bodies import NotNegative, Solid
from archord.scene.sections.contact import CONTACT_LAWS, PARAMETERS_IN_WORDS, require_parameters
from archord.scene.sections.keys import (
    Axis,
    Name,
    PartName,
    Place,
    Positive,
    Section,
    after,
    given,
    key,
    require,
)
from archord.scene.sections.loading import Loading, StepCounts, Steps, Targets

IN_PLANE = ("x", "y", "rotation")  # directions, of couplings alone the rotations
IN_SPACE = ("x", "y", "z", "rotation x", "rotation y", "rotation z")
Freedom = Literal["x", "y", "rotation", "z", "rotation x", "rotation y", "rotation z"]
ContactLawName: Any = Literal[tuple(CONTACT_LAWS)]
Surfaces = Annotated[list[Name], Field(min_length=1, max_length=2)]
_FULL_TURN = 6.2832
_OF_CONTACT = {"load", "accepted", ".", ".."}  # names in contact.h5 that are no surface's
Freedoms = Annotated[list[Freedom], Field(min_length=1)]


def turns(freedom: str | None) -> bool:
    """Whether a direction is a rotation."""
    return freedom is not None and freedom.startswith("rotation")


class _RoundSection(Section):
    """A circle; in space around an axis."""

    centre: Place = key("centre, in space also a point of the axis", "length", example=[0.0, 0.0])
    radius: Positive = key("radius", "length", example=10.0)


class DiscSection(_RoundSection):
    """A rigid disc; in space a cylinder, infinitely long, or without an axis a ball."""

    axis: Axis | None = key(
        "in space: direction of the axis of a cylinder, which is infinitely long; a ball if absent",
        other=[0.0, 0.0, 1.0],
    )

    @after
    def _axis(self) -> DiscSection:
        require(self.axis is None or any(self.axis), "axis", "must not be zero")
        return self


class CoreSection(Section):
    """A circle, in space a ball."""

    centre: Place = key("centre", "length", example=[0.0, 0.0])
    radius: Positive = key("radius", "length", example=10.0)


class CircleSection(_RoundSection):
    """A circle on which a set of facets lies; in space a cylinder, or without an axis a sphere."""

    axis: Axis | None = key("in space: direction of a cylinder's axis", other=[0.0, 0.0, 1.0])
    facets: Name = key("facet set whose nodes are put on the circle", example="hole")


class MeshSection(Section):
    """Where the mesh comes from: a file, or the shape of a preset."""

    file: Name | None = key(
        "file of gmsh (.msh), Abaqus, CalculiX (.inp), dolfinx (.xdmf), archord (.npz), "
        "CAD (.step, .stp, .brep)",
        default=None,
        example="a.msh",
    )
    scale: Positive = key("factor on the coordinates, 1000 for a file in metres", default=1.0)
    order: Literal[1, 2, 3] | None = key(
        "order of the geometry, the file's if absent; 2 for circles", other=2
    )
    refine: int = key("how often the edges of every cell are cut in two", default=0, ge=0, le=6)
    size: Positive | None = key(
        "of CAD: largest element size, a tenth of the extent if absent", "length", other=2.0
    )
    sizes: dict[str, Positive] = key(
        "of CAD: element size on faces, {hole = 0.5}; it grows away from them", "length", default={}
    )
    sets: dict[str, list[str]] = key(
        'new facet sets, made of others: {hole = ["face 7", "face 8"]}', default={}
    )
    circle: list[CircleSection] = Field(
        default_factory=list, description="circles that facet sets lie on"
    )
    shape: AnyShape | None = Field(
        None, description="the shape of a preset, as `archord scene --expand` prints it"
    )

    @after
    def _one_source(self) -> MeshSection:
        given(self, ("file", "shape"))
        of_file = ("scale", "order", "refine", "circle", "size", "sizes", "sets")
        for name in of_file if self.shape is not None else ():
            unsaid = getattr(self, name) == type(self).model_fields[name].get_default(
                call_default_factory=True
            )
            require(unsaid, name, "is for a mesh file: mesh.shape has sizes of its own")
        return self


class OwnSection(Section):
    """An object of a class of one's own, given from Python: a run's scene.toml tells of it, and no
    scene is solved with it."""

    kind: Name = key("the class", example="Archard")
    text: str = key("what Python prints of the object", example="Archard(rate=1e-8)")
    attributes: Words = key("its attributes, by which a change is known", default={})


class OwnMaterial(OwnSection):
    """A material of a class of one's own; E and nu of the body are taken from its elastic
    moduli."""

    plastic: bool = key("whether it can leave its elastic moduli", default=False)


class OwnLaw(OwnSection):
    """A contact law of a class of one's own."""

    friction: bool = key("whether it has shear", default=False)
    quantities: dict[PartName, str] = key("units of what the law tells, by name", default={})


class BodySection(Solid):
    """A deformable body: a set of cells, of one material."""

    name: PartName = key("name of the body", example="pin")
    cells: Name | None = key("its set of cells, the set of its name if absent", other="plate")
    own: OwnMaterial | None = Field(
        None, description="of a run from Python: its own material, in words"
    )

    @property
    def plastic(self) -> bool:
        """Whether the body has plastic strain to tell of."""
        return super().plastic or (self.own is not None and self.own.plastic)

    def strength(self, unit: str) -> str:
        """Where the body yields, and how it hardens, in words."""
        return self.own.text if self.own else super().strength(unit)


class InteractionSection(Section):
    """What two surfaces do to each other, or a rigid disc (in space a cylinder or a ball) to
    one."""

    name: PartName = key("name of the interaction", example="contact")
    surfaces: Surfaces = key("two facet sets, or one beside a rigid disc", example=["pin", "hole"])
    rigid: DiscSection | None = key(
        "rigid disc, the first surface; in space a cylinder, infinitely long, with an axis = "
        "[x, y, z], or a ball without",
        other={"centre": [0.0, 0.0], "radius": 10.0},
    )
    law: ContactLawName = key(
        "contact without friction, with Coulomb's friction, tied surfaces, or soft contact",
        default="frictionless",
    )
    parameters: dict[str, Positive] | None = key(
        f"parameters of the law; {PARAMETERS_IN_WORDS}",
        other={"pressure": 50.0, "clearance": 0.01},
    )
    friction: float = key(
        "Coulomb's coefficient of friction, also without law = coulomb", default=0.0, ge=0, le=1e6
    )
    own: OwnLaw | None = Field(
        None, description="of a run from Python: its own contact law, in words"
    )
    integrated: Name | None = key(
        "the one facet set whose points carry the contact; both do if absent, or the one on which "
        "no support, coupling or load acts",
        other="hole",
    )
    interference: NotNegative = key(
        "press fit that the mesh does not show: how far the surfaces, which are drawn in touch, "
        "are pushed together, in a stage before the loads; a drawn gap is subtracted",
        "length",
        default=0.0,
    )
    overlap: NotNegative = key(
        "press fit that the mesh shows: how deep the surfaces are drawn into each other, for the "
        "stage before the loads; instead of interference",
        "length",
        default=0.0,
    )

    @property
    def quantities(self) -> Words:
        """Units of what the law tells besides forces, by name."""
        return self.own.quantities if self.own else {}

    @property
    def has_friction(self) -> bool:
        """Whether the surfaces have shear to tell of."""
        return self.friction > 0 or (self.own is not None and self.own.friction)

    @after
    def _surfaces(self) -> InteractionSection:
        wanted, said = (
            (1, "one facet set beside a rigid disc") if self.rigid else (2, "two facet sets")
        )
        require(len(self.surfaces) == wanted, "surfaces", f"must name {said}")
        require(len({*self.surfaces}) == wanted, "surfaces", "must be two different facet sets")
        taken = [name for name in self.surfaces if name in _OF_CONTACT or "/" in name]
        said = (
            f"must not name {taken}: contact.h5 has no room for such a name, rename the set in the "
            "mesh"
        )
        require(not taken, "surfaces", said)
        require(
            self.integrated in (None, *self.surfaces),
            "integrated",
            f"must be one of the surfaces {self.surfaces}",
        )
        require_parameters(self.law, self.parameters or {})
        require(not (self.friction and self.law == "tied"), "friction", "is not for tied surfaces")
        soft = bool(CONTACT_LAWS[self.law])
        require(not (self.friction and soft), "friction", f'is not for law = "{self.law}"')
        rubs = self.law != "coulomb" or self.friction > 0
        require(rubs, "friction", 'must be positive where law = "coulomb"')
        fits = self.interference or self.overlap
        require(not (fits and self.law == "tied"), "interference", "is not for tied surfaces")
        return self


class CouplingSection(Section):
    """A reference point that stands for a set of facets: supports and loads may be on it."""

    name: PartName = key("name of the coupling", example="reference point")
    facets: Name = key("facet set", example="bore")
    point: Place = key("the reference point, three numbers in space", "length", example=[0.0, 0.0])
    kind: Literal["rigid", "distributing"] = key(
        "rigid: the facets move as one body; distributing: only on average, forces are spread",
        default="rigid",
    )


class SupportSection(Section):
    """What is held."""

    name: PartName = key("name of the support", example="clamp")
    on: Name = key(
        "coupling, or facet, point or cell set: the first with this name", example="clamp"
    )
    fixed: Freedoms = key(
        "directions held, also at nodes that a load shares; z in space; rotation is for couplings "
        "only, in space rotation x, rotation y and rotation z",
        example=["x", "y"],
    )


class LoadSection(Loading):
    """What moves or presses: one value, or a list of values at the ends of the path's stages."""

    kinds = ("displacement", "force", "pressure")
    name: PartName = key("name of the load", example="press")
    on: Name = key(
        "interaction of a disc, or coupling, facet, point or cell set: the first with this name",
        example="flat",
    )
    direction: Freedom | None = key(
        "of displacement and force; z in space; rotation (in space rotation x, rotation y and "
        "rotation z): of couplings",
        default=None,
        example="x",
    )
    displacement: Targets | None = key(
        "displacement, up to the size of the mesh (rotation: angle in rad)",
        "length",
        default=None,
        example=0.1,
    )
    force: Targets | None = key(
        "force on the whole or moment; a facet set with it stays straight", "force", other=1e3
    )
    core: CoreSection | None = key(
        "circle, in space a ball, in which a force on cells is spread, less and less outward",
        other={"centre": [0.0, 0.0], "radius": 1.0},
    )
    pressure: Targets | None = key(
        "pressure on a facet set, on its undeformed area", "stress", other=10.0
    )

    @after
    def _directed(self) -> LoadSection:
        require(self.core is None or self.force is not None, "core", "is for a force on cells")
        directed = (self.direction is None) == (self.pressure is not None)
        said = (
            "is missing"
            if self.pressure is None
            else "is not for a pressure, which acts along the normal"
        )
        require(directed, "direction", said)
        said = "must be at most 6.2832, a full turn in radians"
        require(self.largest_turn <= _FULL_TURN, "displacement", said)
        return self

    @property
    def largest_turn(self) -> float:
        """The largest angle by which it turns a coupling, 0 if it does not."""
        if not turns(self.direction) or self.displacement is None:
            return 0.0
        return max(map(abs, self.stages))


class PathSection(Section):
    """How the loads reach their values: in stages, one for every value of the longest list; a load
    with fewer values keeps its last one."""

    steps: StepCounts = key(
        "output steps of each stage: one number for all, or a list with one for each", default=20
    )
    fit_steps: Steps = key(
        "output steps of the stage before, in which interferences arise", default=1
    )
