"""The sections of a scene but for the geometry: units, bodies, load, model and solver, steps, output."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.material import Material, Plane
from archord.scene.keys import LINE, Positive, Section, key

LOADS = ("displacement", "displacement_absolute", "force", "relative_force")
Targets = float | Annotated[list[float], Field(min_length=1, max_length=10_000)]
Steps = Annotated[int, Field(ge=1, le=10_000)]
_NU = -0.999, 0.499999  # shear or bulk modulus leave E by a factor below 1e6: round-off stays below the tolerances


class Units(Section):
    """Names of the scene's units, for headings; they must be consistent (force = stress times length squared)."""

    length: str = key("unit of length", default="mm", min_length=1, pattern=LINE)
    stress: str = key("unit of stress and of Young's modulus", default="MPa", min_length=1, pattern=LINE)

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


class _Strength(Section):
    yield_stress: Positive | None = key("yield stress; elastic if absent", "stress", default=None, example=300.0)
    hardening: float = key(
        "hardening modulus d(yield stress)/d(PEEQ); 0: perfect plasticity", "stress", default=0.0, ge=0
    )

    @model_validator(mode="after")
    def _plasticity(self):
        if self.yield_stress is None and self.hardening > 0:
            raise ValueError("hardening|needs a yield_stress")
        return self


class Solid(_Strength):
    """Isotropic elastic solid, elastic-plastic (J2, linear hardening) with a yield stress."""

    E: Positive = key("Young's modulus", "stress", example=210000.0)
    nu: float = key("Poisson's ratio", ge=_NU[0], le=_NU[1], example=0.3)

    def material(self, plane: Plane) -> Material:
        """The constitutive law: `Elastic`, or `J2Material` if there is a yield stress."""
        if self.yield_stress is None:
            return Elastic(self.E, self.nu, plane)
        from archord.materials.j2 import J2Material

        return J2Material(self.E, self.nu, plane, LinearHardening(self.yield_stress, self.hardening))


class Pin(_Strength):
    """The pin: a solid like the block, or rigid."""

    E: Positive | None = key("Young's modulus", "stress", default=None, example=210000.0)
    nu: float | None = key("Poisson's ratio", default=None, ge=_NU[0], le=_NU[1], example=0.3)
    rigid: bool = key("a rigid pin: no mesh, no other key", default=False)

    @model_validator(mode="after")
    def _rigid_or_solid(self) -> Pin:
        for name in type(self).model_fields:  # in their order, which that of a set is not
            if self.rigid and name != "rigid" and name in self.model_fields_set and getattr(self, name):
                raise ValueError(f"{name}|is not for a rigid pin")
        for name in ("E", "nu"):
            if not self.rigid and getattr(self, name) is None:
                raise ValueError(f"{name}|is missing (or set rigid = true)")
        return self

    @property
    def solid(self) -> Solid | None:
        """The pin as a solid; None if it is rigid."""
        return None if self.rigid else Solid.model_validate(self.model_dump(exclude={"rigid"}))


class Load(Section):
    """The displacement of the pin, from first touch, or the force on it: a ramp to a target, or to several in turn."""

    displacement: Targets | None = key(
        "displacement delta of the pin, in clearances dR, at most R/2: the target, or a list of targets in turn",
        default=None,
        example=2.0,
    )
    displacement_absolute: Targets | None = key(
        "displacement delta of the pin, instead of displacement", "length", default=None
    )
    force: Targets | None = key(
        "force P on the whole pin per unit thickness, instead of a displacement", "force", default=None
    )
    relative_force: Targets | None = key("P/(E* R), instead of force", default=None)
    path: str | None = key(
        "CSV file with the targets, instead of a list: one column, headed by one of the four names above; each row is "
        "one step unless steps is given",
        default=None,
        min_length=1,
        pattern=LINE,
    )
    core_radius: float = key(
        "ring: radius of the core over which the force is spread, over R", default=0.1, ge=0.01, le=0.5
    )
    steps: Steps | Annotated[list[Steps], Field(min_length=1)] = key(
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


class Analysis(Section):
    """How the joint is modelled and solved."""

    plane: Literal["strain", "stress"] = key("plane strain or plane stress", default="strain")
    kinematics: Literal["current", "reference"] = key(
        "contact pairs: closest points on the deformed curves, or fixed pairs of the touching configuration",
        default="current",
    )
    integration: Literal["both", "pin", "block"] = key(
        "whose contact edge carries the integral: both halves (unbiased), or one side's alone", default="both"
    )
    gamma_factor: float = key(
        "Nitsche's gamma over the trace constant of each contact cell; coercive above 0.25",
        default=0.5,
        ge=1e-3,
        le=1e6,
    )
    accuracy: float | None = key(
        "relative error of P (of delta under a force) to reach, 1e-5 to 0.1: element_size, growth and the length of "
        "the steps are chosen accordingly, and the error is estimated",
        default=None,
        ge=1e-5,
        le=0.1,
    )
    degree: Literal[2, 3] = key("polynomial degree of displacements and of the curved geometry", default=2)
    coarse_start: bool = key(
        "take the guess for every step from a coarser mesh, where the mesh is fine; false is for comparison",
        default=True,
    )
    tolerance: float = key("residual over reaction at which Newton stops", default=1e-10, ge=1e-12, le=1e-4)
    max_iterations: int = key("Newton iterations before a step is cut", default=25, ge=2, le=1000)


class Stepping(Section):
    """Control of the steps between outputs; lengths are in output steps."""

    initial: float = key("length of the first step", default=1.0, gt=0, le=1)
    minimum: float = key("length below which a step is not cut", default=1e-3, gt=0, le=1)
    maximum: float = key("length beyond which a step does not grow", default=1.0, gt=0, le=1)
    growth: float = key("factor on the length after an easy step", default=2.0, ge=1, le=10)
    cutback: float = key("factor on the length after a failed step", default=0.5, ge=0.05, le=0.9)
    target_iterations: int = key("Newton iterations up to which a step was easy", default=15, ge=1, le=1000)

    @model_validator(mode="after")
    def _ordered(self) -> Stepping:
        if not self.minimum <= self.initial <= self.maximum:
            raise ValueError("initial|must be between stepping.minimum and stepping.maximum")
        return self


class Output(Section):
    """What a run writes besides its curves."""

    fields: bool = key("write the fields of every step to fields.xdmf and fields.h5", default=True)
