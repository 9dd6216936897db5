"""The scene: a joint and its loading, checked, with every key's unit and default.

Any consistent set of units will do; ``[units]`` only names them. Where a key has an alternative (``clearance`` and
``relative_clearance``), the scene gives one of the two.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from archord.materials.elasticity import Elastic, contact_modulus

_LINE = r"^[^\x00-\x1f]*$"
_RANGE = 1e-30, 1e30  # of lengths and moduli; powers of them must not leave the range of numbers
FORMAT = 1  # version of the scene format: rises when a scene gets a meaning that an older archord would get wrong
_SOFTEST = 1e-8  # ratio of the moduli
_WEAKEST = 1e-7  # yield stress over E; below it nothing elastic is left but round-off
_NU = -0.999, 0.499999  # shear or bulk modulus leave E by a factor below 1e6: round-off stays below the tolerances
_WIDEST = 1e6  # block_size over R
_MOST_CELLS = 1e6  # triangles: some 10 GB, and minutes for a mesh generator that is not parallel
Positive = Annotated[float, Field(gt=0)]


def _key(description: str, unit: str = "", *, default: Any = ..., example: Any = None, **limits: Any) -> Any:
    """A documented key: its unit is the scene's unit of that kind, `example` is what ``--example`` shows."""
    extra: Any = {"unit": unit} if unit else {}
    example = default if example is None else example
    return Field(default, description=description, examples=[example], json_schema_extra=extra, **limits)


def _one_of(other: str, value: float | None) -> str:
    return f"is missing (or {other})" if value is None else f"must not be given together with {other}"


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class Units(_Section):
    """Names of the scene's units, for headings; they must be consistent (force = stress times length squared)."""

    length: str = _key("unit of length", default="mm", min_length=1, pattern=_LINE)
    stress: str = _key("unit of stress and of Young's modulus", default="MPa", min_length=1, pattern=_LINE)

    @property
    def force(self) -> str:
        """Unit of force per unit thickness."""
        return {("mm", "MPa"): "N/mm", ("m", "Pa"): "N/m"}.get(
            (self.length, self.stress), f"{self.stress} {self.length}"
        )

    @property
    def energy(self) -> str:
        """Unit of energy per unit thickness."""
        return {("mm", "MPa"): "N", ("m", "Pa"): "N"}.get((self.length, self.stress), f"{self.stress} {self.length}2")


Model = Literal["block", "ring"]


class JointGeometry(_Section):
    """The pin of radius ``R`` in a hole of radius ``R + dR``, and the mesh of both."""

    model: Model = _key(
        "block: the paper's quarter joint, pressed at the pin's horizontal diameter; ring: half a whole pin in a ring "
        "held at its outer edge, loaded by a force at the pin's core (Persson's joint)",
        default="block",
    )

    radius: float = _key("radius R of the pin", "length", gt=0, example=10.0)
    clearance: float | None = _key(
        "radial clearance dR = hole radius - pin radius, 1e-6 to 0.5 times R; in a ring also negative (interference)",
        "length",
        default=None,
    )
    relative_clearance: float | None = _key("dR/R, instead of clearance: 1e-6 to 0.5", default=None, example=0.005)
    block_size: Positive | None = _key(
        "width and depth of the block or radius of the ring, at least the hole's diameter, at most 1e6 R; 100 R "
        "if absent",
        "length",
        default=None,
    )
    element_size: Positive | None = _key(
        "edge length of the elements on the arcs, 1e-4 to 0.5 times R", "length", default=None
    )
    relative_element_size: Positive | None = _key(
        "element_size / R, instead of element_size: 1e-4 to 0.5; 0.04 if both are absent", default=None, example=0.04
    )
    size_ratio: float = _key(
        "element size on the pin's arc over that on the hole's, which then is element_size",
        default=1.0,
        ge=0.01,
        le=100,
    )
    edge_angle: float | None = _key(
        "semi-angle [rad] at which the contact is to end: elements on the arcs shrink toward it; not in a ring",
        default=None,
        gt=0,
        lt=math.pi / 2,
    )
    edge_ratio: float = _key("element size at edge_angle over element_size", default=0.25, ge=0.01, le=1)
    growth: float = _key("growth of the element size per unit of distance from the arcs", default=0.25, ge=0.01, le=2)

    @model_validator(mode="after")
    def _geometry(self) -> JointGeometry:
        if (self.clearance is None) == (self.relative_clearance is None):
            raise ValueError("clearance|" + _one_of("relative_clearance", self.clearance))
        name = "clearance" if self.relative_clearance is None else "relative_clearance"
        if self.model == "block" and not 1e-6 <= self.dR / self.radius <= 0.5:
            raise ValueError(f"{name}|must be a clearance: between 1e-6 and 0.5 times the radius")
        if not 1e-6 <= abs(self.dR) / self.radius <= 0.5:
            raise ValueError(f"{name}|must be between 1e-6 and 0.5 times the radius, or minus that")
        if self.element_size is not None and self.relative_element_size is not None:
            raise ValueError("element_size|must not be given together with relative_element_size")
        if not 1e-4 <= self.h / self.radius <= 0.5:
            name = "element_size" if self.element_size is not None else "relative_element_size"
            raise ValueError(f"{name}|must be between 1e-4 and 0.5 times the radius")
        if not 1e-4 <= self.size_ratio * self.h / self.radius <= 0.5:
            raise ValueError("size_ratio|must leave the pin's elements between 1e-4 and 0.5 times the radius")
        if self.edge_angle is not None and self.model == "ring":
            raise ValueError("edge_angle|is only for the model block")
        if self.edge_angle is not None and self.edge_ratio * self.h / self.radius < 1e-4:
            raise ValueError("edge_ratio|must leave elements of at least 1e-4 times the radius")
        if 2 * (self.radius + self.dR) > self.W:
            raise ValueError("block_size|must be at least twice the radius of the hole")
        if self.W / self.radius > _WIDEST:
            raise ValueError(f"block_size|must not exceed {_WIDEST:g} times the radius")
        if self.expected_cells > _MOST_CELLS:
            name = "relative_element_size" if self.element_size is None else "element_size"
            raise ValueError(
                f"{name}|with growth = {self.growth:g} would make about {self.expected_cells:.0e} triangles, and "
                f"{_MOST_CELLS:.0e} are allowed; choose larger elements or a larger growth"
            )
        return self

    @property
    def expected_cells(self) -> float:
        """About how many triangles the mesh will have: the bodies' area over that of equilateral triangles of the size
        ``t = h + growth |r - R|`` at radius r, integrated in closed form (lengths in R)."""
        h, g, width = self.h / self.radius, self.growth, self.W / self.radius

        def ring(sign: int, depth: float) -> float:  # integral of r dr / t^2 from the arc outward (1) or inward (-1)
            t = h + g * depth
            return (1 - sign * h / g) / g * (1 / h - 1 / t) + sign * math.log(t / h) / g**2

        angle = math.pi if self.model == "ring" else math.pi / 2
        return angle * (ring(-1, 1.0) + ring(1, width - 1)) / (math.sqrt(3) / 4)

    @property
    def dR(self) -> float:
        """Clearance."""
        return self.clearance if self.clearance is not None else (self.relative_clearance or 0.0) * self.radius

    @property
    def W(self) -> float:
        """Width of the block."""
        return 100 * self.radius if self.block_size is None else self.block_size

    @property
    def h(self) -> float:
        """Element size on the arcs, or on the hole's alone (see `size_ratio`)."""
        return (self.relative_element_size or 0.04) * self.radius if self.element_size is None else self.element_size


class _Strength(_Section):
    yield_stress: Positive | None = _key("yield stress; elastic if absent", "stress", default=None, example=300.0)
    hardening: float = _key(
        "hardening modulus d(yield stress)/d(PEEQ); 0: perfect plasticity", "stress", default=0.0, ge=0
    )

    @model_validator(mode="after")
    def _plasticity(self):
        if self.yield_stress is None and self.hardening > 0:
            raise ValueError("hardening|needs a yield_stress")
        return self


class Solid(_Strength):
    """Isotropic elastic solid, elastic-plastic (J2, linear hardening) with a yield stress."""

    E: Positive = _key("Young's modulus", "stress", example=210000.0)
    nu: float = _key("Poisson's ratio", ge=_NU[0], le=_NU[1], example=0.3)

    def material(self, plane: Literal["strain", "stress"]):
        """The constitutive law: `Elastic`, or `J2Material` if there is a yield stress."""
        if self.yield_stress is None:
            return Elastic(self.E, self.nu, plane)
        from archord.materials.j2 import J2Material

        return J2Material(self.E, self.nu, self.yield_stress, self.hardening, plane)


class Pin(_Strength):
    """The pin: a solid like the block, or rigid."""

    E: Positive | None = _key("Young's modulus", "stress", default=None, example=210000.0)
    nu: float | None = _key("Poisson's ratio", default=None, ge=_NU[0], le=_NU[1], example=0.3)
    rigid: bool = _key("a rigid pin: no mesh, no other key", default=False)

    @model_validator(mode="after")
    def _rigid_or_solid(self) -> Pin:
        for key in type(self).model_fields:  # in their order, which that of a set is not
            if self.rigid and key != "rigid" and key in self.model_fields_set and getattr(self, key):
                raise ValueError(f"{key}|is not for a rigid pin")
        for key in ("E", "nu"):
            if not self.rigid and getattr(self, key) is None:
                raise ValueError(f"{key}|is missing (or set rigid = true)")
        return self

    @property
    def solid(self) -> Solid | None:
        """The pin as a solid; None if it is rigid."""
        return None if self.rigid else Solid.model_validate(self.model_dump(exclude={"rigid"}))


class Analysis(_Section):
    """How the joint is modelled and solved."""

    plane: Literal["strain", "stress"] = _key("plane strain or plane stress", default="strain")
    kinematics: Literal["current", "reference"] = _key(
        "contact pairs: closest points on the deformed curves, or fixed pairs of the touching configuration",
        default="current",
    )
    integration: Literal["both", "pin", "block"] = _key(
        "whose contact edge carries the integral: both halves (unbiased), or one side's alone", default="both"
    )
    gamma_factor: float = _key(
        "Nitsche's gamma over the trace constant of each contact cell; coercive above 0.25",
        default=0.5,
        ge=1e-3,
        le=1e6,
    )
    accuracy: float | None = _key(
        "relative error of P (of delta under a force) to reach, 1e-5 to 0.1: element_size, growth and the length of "
        "the steps are chosen accordingly, and the error is estimated",
        default=None,
        ge=1e-5,
        le=0.1,
    )
    degree: Literal[2, 3] = _key("polynomial degree of displacements and of the curved geometry", default=2)
    coarse_start: bool = _key(
        "take the guess for every step from a coarser mesh, where the mesh is fine; false is for comparison",
        default=True,
    )
    tolerance: float = _key("residual over reaction at which Newton stops", default=1e-10, ge=1e-12, le=1e-4)
    max_iterations: int = _key("Newton iterations before a step is cut", default=25, ge=2, le=1000)


LOADS = ("displacement", "displacement_absolute", "force", "relative_force")
Targets = float | Annotated[list[float], Field(min_length=1, max_length=10_000)]
Steps = Annotated[int, Field(ge=1, le=10_000)]


class Load(_Section):
    """The displacement of the pin, from first touch, or the force on it: a ramp to a target, or to several in turn."""

    displacement: Targets | None = _key(
        "displacement delta of the pin, in clearances dR, at most R/2: the target, or a list of targets in turn",
        default=None,
        example=2.0,
    )
    displacement_absolute: Targets | None = _key(
        "displacement delta of the pin, instead of displacement", "length", default=None
    )
    force: Targets | None = _key(
        "force P on the whole pin per unit thickness, instead of a displacement", "force", default=None
    )
    relative_force: Targets | None = _key("P/(E* R), instead of force", default=None)
    path: str | None = _key(
        "CSV file with the targets, instead of a list: one column, headed by one of the four names above; each row is "
        "one step unless steps is given",
        default=None,
        min_length=1,
        pattern=_LINE,
    )
    core_radius: float = _key(
        "ring: radius of the core over which the force is spread, over R", default=0.1, ge=0.01, le=0.5
    )
    steps: Steps | Annotated[list[Steps], Field(min_length=1)] = _key(
        "equal output steps up to each target: one number for all, or a list with one for each", default=20
    )

    @model_validator(mode="after")
    def _one_load(self) -> Load:
        given = [name for name in LOADS if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"{given[0]}|must not be given together with {given[1]}")
        if not given:
            raise ValueError(f"displacement|is missing (or {', '.join(LOADS[1:])}, path)")
        n = len(self.legs)
        if isinstance(self.steps, list) and len(self.steps) != n:
            raise ValueError(f"steps|must have one number for each of the {n} targets of {self.name}")
        if sum(self.leg_steps) > 10_000:
            raise ValueError("steps|must not add up to more than 10000 steps")
        return self

    @property
    def name(self) -> str:
        """The key that holds the load."""
        return next(name for name in LOADS if getattr(self, name) is not None)

    @property
    def legs(self) -> list[float]:
        """The targets in turn, as given."""
        value = getattr(self, self.name)
        return value if isinstance(value, list) else [value]

    @property
    def leg_steps(self) -> list[int]:
        """Output steps up to each target."""
        return self.steps if isinstance(self.steps, list) else [self.steps] * len(self.legs)


class Stepping(_Section):
    """Control of the steps between outputs; lengths are in output steps."""

    initial: float = _key("length of the first step", default=1.0, gt=0, le=1)
    minimum: float = _key("length below which a step is not cut", default=1e-3, gt=0, le=1)
    maximum: float = _key("length beyond which a step does not grow", default=1.0, gt=0, le=1)
    growth: float = _key("factor on the length after an easy step", default=2.0, ge=1, le=10)
    cutback: float = _key("factor on the length after a failed step", default=0.5, ge=0.05, le=0.9)
    target_iterations: int = _key("Newton iterations up to which a step was easy", default=15, ge=1, le=1000)

    @model_validator(mode="after")
    def _ordered(self) -> Stepping:
        if not self.minimum <= self.initial <= self.maximum:
            raise ValueError("initial|must be between stepping.minimum and stepping.maximum")
        return self


class Output(_Section):
    """What a run writes besides its curves."""

    fields: bool = _key("write the fields of every step to fields.xdmf and fields.h5", default=True)


# what an accuracy chooses
CHOSEN = (
    ("joint", "element_size"),
    ("joint", "relative_element_size"),
    ("joint", "growth"),
    ("stepping", "initial"),
    ("stepping", "maximum"),
)


class _Checked(type(BaseModel)):  # type: ignore[misc]
    """Calls of the class are checked like a scene file, so that faults are the same sentences."""

    def __call__(cls, **sections: Any) -> Any:
        from archord.solver.scene_sections import scene_from

        return scene_from(sections)


class Scene(_Section, metaclass=_Checked):
    """A pin joint and how to load it.

    ``Scene(joint={"radius": 10.0, "clearance": 0.05}, ...)`` makes one from sections, tables or their classes. Raises
    `SceneError`, a sentence for each fault.
    """

    if TYPE_CHECKING:

        def __init__(self, **sections: Any) -> None: ...

    format: Literal[1] = _key("version of the scene format; a scene of a newer version is refused", default=FORMAT)
    units: Units = Field(default_factory=Units, description="names of the units")
    joint: JointGeometry = Field(description="geometry and mesh")
    pin: Pin = Field(description="material of the pin")
    block: Solid = Field(description="material of the block")
    analysis: Analysis = Field(default_factory=Analysis, description="model and solver")
    load: Load = Field(description="loading")
    stepping: Stepping = Field(default_factory=Stepping, description="control of the steps between outputs")
    output: Output = Field(default_factory=Output, description="what is written")

    @model_validator(mode="after")
    def _consistent(self) -> Scene:
        for section, key in CHOSEN if self.analysis.accuracy is not None else ():
            given: BaseModel = getattr(self, section)
            if key in given.model_fields_set and getattr(given, key) is not None:
                raise ValueError(f"{section}.{key}|must not be given together with analysis.accuracy, which chooses it")
        if self.pin.rigid and self.analysis.integration == "pin":
            raise ValueError(
                'analysis.integration|must be "block" or "both": a rigid pin has no contact edge to integrate'
            )
        sizes = {"joint.radius": self.joint.radius, "block.E": self.block.E, "pin.E": self.pin.E}
        for name, size in sizes.items():
            if size is not None and not _RANGE[0] <= size <= _RANGE[1]:
                raise ValueError(f"{name}|must be between 1e-30 and 1e30; choose other units")
        for name, body in (("pin", self.pin), ("block", self.block)):
            if body.E is not None and body.yield_stress is not None and body.yield_stress < _WEAKEST * body.E:
                raise ValueError(f"{name}.yield_stress|must be at least {_WEAKEST:g} times {name}.E")
            if body.E is not None and body.hardening > body.E / _WEAKEST:
                raise ValueError(f"{name}.hardening|must not exceed {1 / _WEAKEST:g} times {name}.E")
        if self.pin.E is not None and not _SOFTEST <= self.pin.E / self.block.E <= 1 / _SOFTEST:
            raise ValueError("pin.E|must be between 1e-8 and 1e8 times block.E (or set rigid = true)")
        name = f"load.{self.load.name}"
        if self.joint.model == "ring" and not self.force_controlled:
            raise ValueError(f'{name}|does not load a joint whose model is "ring"; give force or relative_force')
        if self.joint.model == "ring" and self.pin.rigid:
            raise ValueError('pin.rigid|must be false where joint.model is "ring"')
        largest = max(map(abs, self.targets))
        if self.force_controlled and not largest <= 0.5 * self.E_star * self.joint.radius:
            raise ValueError(f"{name}|must not exceed half E* R ({0.5 * self.E_star * self.joint.radius:g})")
        if not self.force_controlled and not largest <= 0.5 * self.joint.radius:
            raise ValueError(f"{name}|must not exceed half the radius ({0.5 * self.joint.radius:g})")
        return self

    def require_mesh(self) -> None:
        """Raise `SceneError` if the scene leaves its mesh to `archord.solver.accuracy`."""
        if self.analysis.accuracy is not None:
            raise SceneError(
                f"analysis.accuracy = {self.analysis.accuracy:g}: leaves the mesh open; give joint.element_size and "
                "joint.growth instead, or solve to that accuracy (archord solve, solve_to_accuracy)."
            )

    @property
    def force_controlled(self) -> bool:
        """Whether the load is a force."""
        return self.load.name in ("force", "relative_force")

    @property
    def load_unit(self) -> float:
        """What the targets of the section load are multiplied by."""
        scale = {"displacement": self.joint.dR, "relative_force": self.E_star * self.joint.radius}
        return scale.get(self.load.name, 1.0)

    @property
    def targets(self) -> list[float]:
        """The load at every output step: the displacement of the pin, or the force on it."""
        out, begin = [], 0.0
        for leg, n in zip(self.load.legs, self.load.leg_steps, strict=True):
            end = leg * self.load_unit
            out += [begin + (end - begin) * k / n for k in range(1, n)] + [end]
            begin = end
        return out

    @property
    def target(self) -> float:
        """The load at the end of the path."""
        return self.targets[-1]

    @property
    def monotonic(self) -> bool:
        """Whether the load only grows."""
        targets = [0.0, *self.targets]
        return all(a < b for a, b in pairwise(targets))

    @property
    def E_star(self) -> float:
        """Contact modulus of the pair, ``1/E* = sum over deformable bodies of 1/E*_i`` (Johnson 1985, eq. 4.20)."""
        solids = [self.block] if self.pin.solid is None else [self.pin.solid, self.block]
        return 1 / sum(1 / contact_modulus(s.E, s.nu, self.analysis.plane) for s in solids)

    @property
    def plastic(self) -> bool:
        """Whether any body can yield."""
        return self.pin.yield_stress is not None or self.block.yield_stress is not None


class SceneError(ValueError):
    """Bad input; the message holds one sentence a line."""
