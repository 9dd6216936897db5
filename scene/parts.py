"""The parts of a general scene: mesh, bodies, interactions, couplings, supports, loads, and the path of the loads."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from archord.scene.keys import LINE, Positive, Section, key, require
from archord.scene.sections import Modelling, NotNegative, Solid, Steps, Targets
from archord.scene.shapes import Bushing, JointShape, Lug

Point = Annotated[list[float], Field(min_length=2, max_length=2)]
Freedom = Literal["x", "y", "rotation"]
VALUES = ("displacement", "force", "pressure")


def name_of(what: str, example: str) -> Any:
    """The key ``name`` of a part."""
    return key(f"name of the {what}", example=example, min_length=1, pattern=LINE)


def set_of(what: str, **more: Any) -> Any:
    """A key that names a set of the mesh, or something else."""
    return key(what, min_length=1, pattern=LINE, **more)


class Circle(Section):
    """A circle on which a set of facets lies."""

    facets: str = set_of("facet set whose nodes are put on the circle", example="hole")
    centre: Point = key("centre", "length", example=[0.0, 0.0])
    radius: Positive = key("radius", "length", example=10.0)


class Mesh(Section):
    """Where the mesh comes from: a file, or the shape of a preset."""

    file: str | None = key(
        "mesh file beside the scene: gmsh (.msh), Abaqus or CalculiX (.inp), dolfinx (.xdmf)",
        default=None,
        example="lug.msh",
        min_length=1,
        pattern=LINE,
    )
    scale: Positive = key("factor on the coordinates, 1000 for a file in metres", default=1.0)
    order: Literal[1, 2, 3] | None = key(
        "order of the geometry; that of the file if absent, 2 puts middle nodes on the circles", default=None, other=2
    )
    refine: int = key("how often every cell is cut in four", default=0, ge=0, le=6)
    circle: list[Circle] = Field(default_factory=list, description="circles that facet sets lie on")
    shape: Annotated[Lug | Bushing | JointShape, Field(discriminator="kind")] | None = Field(
        None, description="the shape of a preset, as `archord scene --expand` prints it"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Mesh:
        require(self.file is not None or self.shape is not None, "file", "is missing")
        require(self.file is None or self.shape is None, "file", "must not be given together with mesh.shape")
        for name in ("scale", "order", "refine", "circle") if self.shape is not None else ():
            unsaid = getattr(self, name) == type(self).model_fields[name].get_default(call_default_factory=True)
            require(unsaid, name, "is for a mesh file: mesh.shape has sizes of its own")
        return self


class Body(Solid):
    """A deformable body: a set of cells, of one material."""

    name: str = name_of("body", "pin")
    cells: str | None = set_of("its set of cells, that of its name if absent", default=None, other="plate")


class RigidCircle(Section):
    """A rigid disc."""

    centre: Point = key("centre", "length", example=[0.0, 0.0])
    radius: Positive = key("radius", "length", example=10.0)


class Interaction(Section):
    """What two surfaces do to each other, or a rigid disc to one."""

    name: str = name_of("interaction", "contact")
    surfaces: Annotated[list[str], Field(min_length=1, max_length=2)] = key(
        "two facet sets, or one beside a rigid disc", example=["pin", "hole"]
    )
    rigid: RigidCircle | None = key(
        "rigid disc in the place of the first surface", default=None, other={"centre": [0.0, 0.0], "radius": 10.0}
    )
    law: Literal["frictionless", "tied"] = key(
        "contact without friction, or surfaces tied together", default="frictionless"
    )
    integrated: str | None = set_of(
        "the one facet set whose points carry the contact; both do if absent", default=None, other="hole"
    )
    interference: NotNegative = key(
        "how far the surfaces as drawn are pushed into each other, in a stage of its own", "length", default=0.0
    )
    overlap: NotNegative = key(
        "how far the surfaces are drawn into each other, which the same stage lets arise gradually",
        "length",
        default=0.0,
    )

    @model_validator(mode="after")
    def _surfaces(self) -> Interaction:
        wanted = 1 if self.rigid else 2
        said = "must name one facet set beside a rigid disc" if self.rigid else "must name two facet sets"
        require(len(self.surfaces) == wanted, "surfaces", said)
        require(len(set(self.surfaces)) == wanted, "surfaces", "must be two different facet sets")
        inside = self.integrated is None or self.integrated in self.surfaces
        require(inside, "integrated", f"must be one of the surfaces {self.surfaces}")
        given = self.interference or self.overlap
        require(not (given and self.law == "tied"), "interference", "is not for tied surfaces")
        return self


class Coupling(Section):
    """A reference point that stands for a set of facets: supports and loads may be on it."""

    name: str = name_of("coupling", "reference point")
    facets: str = set_of("facet set", example="bore")
    point: Point = key("the reference point", "length", example=[0.0, 0.0])
    kind: Literal["rigid", "distributing"] = key(
        "rigid: the facets move as one rigid body; distributing: only on average, and forces are spread",
        default="rigid",
    )


class Support(Section):
    """What is held."""

    name: str = name_of("support", "clamp")
    on: str = set_of("coupling, or facet, point or cell set: the first that has the name", example="clamp")
    fixed: Annotated[list[Freedom], Field(min_length=1)] = key(
        "directions held; rotation is of couplings alone", example=["x", "y"]
    )


class Load(Section):
    """What moves or presses: one value, or a list of values at the ends of the path's stages."""

    name: str = name_of("load", "press")
    on: str = set_of(
        "interaction with a rigid disc, coupling, or facet, point or cell set: the first that has the name",
        example="flat",
    )
    direction: Freedom | None = key(
        "of displacement and force; rotation is of couplings alone", default=None, example="x"
    )
    displacement: Targets | None = key("displacement (rotation: angle in rad)", "length", default=None, example=0.1)
    force: Targets | None = key(
        "force on the whole (rotation: moment); a facet set that carries one stays straight",
        "force",
        default=None,
        other=1e3,
    )
    core: RigidCircle | None = key(
        "circle in which a force on cells is spread, less and less outward, instead of evenly",
        default=None,
        other={"centre": [0.0, 0.0], "radius": 1.0},
    )
    pressure: Targets | None = key("pressure on a facet set", "stress", default=None, other=10.0)

    @model_validator(mode="after")
    def _one_value(self) -> Load:
        given = [name for name in VALUES if getattr(self, name) is not None]
        require(len(given) > 0, "displacement", "is missing (or force, pressure)")
        require(len(given) == 1, given[0], f"must not be given together with {' and '.join(given[1:])}")
        require(self.core is None or self.force is not None, "core", "is for a force on cells")
        directed = (self.direction is None) == (self.pressure is not None)
        said = "is missing" if self.pressure is None else "is not for a pressure, which acts along the normal"
        require(directed, "direction", said)
        return self

    @property
    def kind(self) -> str:
        """The key that holds the value."""
        return next(name for name in VALUES if getattr(self, name) is not None)

    @property
    def stages(self) -> list[float]:
        """Values at the ends of the stages, as given."""
        value = getattr(self, self.kind)
        return value if isinstance(value, list) else [value]


class Path(Section):
    """How the loads reach their values: in stages, one for every value of the longest list; a load with fewer values
    keeps its last one."""

    steps: Steps | Annotated[list[Steps], Field(min_length=1)] = key(
        "output steps of each stage: one number for all, or a list with one for each", default=20
    )
    fit_steps: Steps = key("output steps of the stage before, in which interferences arise", default=1)


class ProblemAnalysis(Modelling):
    """How a general problem is modelled and solved."""

    symmetry: int = key(
        "how many times the modelled part makes up the whole, whose forces and energies are told",
        default=1,
        ge=1,
        le=100,
    )
