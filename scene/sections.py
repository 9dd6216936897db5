"""The sections of a scene but for the geometry: units, bodies, load, model and solver, steps,
output."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag, ValidationInfo, model_validator

from archord.materials.elasticity import Elastic
from archord.materials.hardening import Hardening
from archord.materials.material import Material, Plane
from archord.scene.errors import Fault
from archord.scene.keys import Name, Positive, Section, given, key, require
from archord.scene.plasticity import IN_WORDS, HardeningKey, filled, hardening_law

NotNegative = Annotated[float, Field(ge=0)]
LOADS = ("displacement", "displacement_absolute", "force", "relative_force")
# shear or bulk modulus leave E by a factor below 1e6: round-off stays below the tolerances
Ratio = Annotated[float, Field(ge=-0.999, le=0.499999)]
_E = "Young's modulus, unless a material brings it"
_NU = "Poisson's ratio, unless a material brings it"
_STUCK = 1000.0  # coefficient of friction from which points are meant to stick
MOST_STEPS = 10_000  # output steps
_COERCIVE = 0.25  # gamma over the trace constant, from which on Nitsche's form is coercive
Accuracy = Annotated[float, Field(ge=1e-5, le=0.1)]
Side = Literal["both", "pin", "block"]
Steps = Annotated[int, Field(ge=1, le=MOST_STEPS)]
_Kind = Discriminator(lambda value: "list" if isinstance(value, list) else "number")
StepCounts = Annotated[
    Annotated[Steps, Tag("number")] | Annotated[list[Steps], Field(min_length=1), Tag("list")],
    _Kind,
]
Targets = Annotated[
    Annotated[float, Tag("number")] | Annotated[list[float], Field(min_length=1), Tag("list")],
    _Kind,
]
BackStress = Annotated[list[NotNegative], Field(min_length=2, max_length=2)]


_FORCES = {  # units of stress and length, and of the force that is stress times length squared
    ("MPa", "mm"): "N",
    ("N/mm2", "mm"): "N",
    ("Pa", "m"): "N",
    ("GPa", "mm"): "kN",
    ("kPa", "m"): "kN",
    ("MPa", "m"): "MN",
    ("psi", "in"): "lbf",
    ("ksi", "in"): "kip",
}
_INCHES = {"in": "in", "inch": "in"}
_LENGTHS = ("mm", "cm", "m", "um", *_INCHES, "ft")


def friction_doubts(frictions: dict[str, float]) -> list[str]:
    """A question for each coefficient, by its key, that may be one in per cent."""
    doubted = {name: friction for name, friction in frictions.items() if 2 < friction < _STUCK}
    return [
        f"{name} = {friction:g} is far above what surfaces have: is it in per cent? Then give "
        f"{friction / 100:g}"
        for name, friction in doubted.items()
    ]


class Units(Section):
    """Names of the scene's units, for headings; they must be consistent (force = stress times
    length squared)."""

    length: Name = key("unit of length", default="mm")
    stress: Name = key("unit of stress and of Young's modulus", default="MPa")

    def force_of(self, thickness: float | None) -> str:
        """Unit of force of a joint of this thickness, per unit thickness without."""
        known = _FORCES.get((self.stress, _INCHES.get(self.length, self.length)))
        if thickness is None:
            return f"{known}/{self.length}" if known else f"{self.stress} {self.length}"
        return known or f"{self.stress} {self.length}2"

    @property
    def doubts(self) -> list[str]:
        """What to warn of: inches beside metric stresses or the other way round, as a default may
        do it."""
        imperial = self.stress in ("psi", "ksi"), self.length in (*_INCHES, "ft")
        if imperial[0] == imperial[1] or self.length not in _LENGTHS:
            return []
        cure = 'units.length = "in"' if imperial[0] else 'units.stress = "psi" or "ksi"'
        force = self.force_of(1.0)
        given = f"units.stress = {self.stress!r} with units.length = {self.length!r}"
        return [f"{given} makes {force} the unit of force; {cure} would make it lbf or kip"]

    def energy_of(self, thickness: float | None) -> str:
        """Unit of energy of a joint of this thickness, per unit thickness without."""
        return self.force_of(1.0) + ("" if thickness is None else f" {self.length}")


class Solid(Section):
    """Isotropic elastic solid, elastic-plastic (J2) with a yield stress."""

    material: str | None = key(
        "metal of docs/materials.md, for keys not given", other="S355", exclude=True
    )
    yield_stress: Positive | None = key(
        "yield stress; elastic if absent", "stress", default=None, example=300.0
    )
    hardening: HardeningKey = key(
        "modulus d(yield stress)/d(PEEQ), 0: perfect plasticity; or points [PEEQ, true stress]; or "
        f"the parameters of a law: {IN_WORDS}",
        "stress",
        default=0.0,
    )
    back_stresses: Annotated[list[BackStress], Field(min_length=1, max_length=3)] | None = key(
        "back stresses (Armstrong and Frederick): up to three [modulus, rate of recovery]",
        other=[[20000.0, 100.0]],
    )
    E: Positive = key(_E, "stress", example=210000.0)
    nu: Ratio = key(_NU, example=0.3)

    @model_validator(mode="before")
    @classmethod
    def _filled(cls, data: Any, info: ValidationInfo) -> Any:
        return filled(data, (info.context or {}).get("stress", "MPa"))

    @model_validator(mode="after")
    def _plasticity(self):
        require(
            self.yield_stress is not None or self.hardening == 0,
            "hardening",
            "needs a yield_stress",
        )
        require(
            self.yield_stress is not None or not self.back_stresses,
            "back_stresses",
            "need a yield_stress",
        )
        require(
            all(C > 0 for C, _ in self.back_stresses or ()),
            "back_stresses",
            "must have positive moduli",
        )
        if self.yield_stress is not None and self.E is not None:
            try:
                first, rise = (
                    float(np.max(of(np.zeros(1)))) for of in (self.law.stress, self.law.slope)
                )
            except ValueError as error:
                raise Fault(("hardening",), f"is no hardening law: {error}") from None
            test = getattr(self.hardening, "engineering", None)
            true = f", the true stress of {test[0][1]:g}" if test else ""
            said = f"must begin at yield_stress ({self.yield_stress:g}), not at {first:g}{true}"
            require(math.isclose(first, self.yield_stress, rel_tol=1e-9), "hardening", said)
            require(
                rise >= 0, "hardening", "must not soften: saturation must be at least yield_stress"
            )
        return self

    @property
    def plastic(self) -> bool:
        """Whether the solid can yield."""
        return self.yield_stress is not None

    @property
    def perfectly_plastic(self) -> bool:
        """Whether the yield stress is a constant."""
        return self.hardening == 0 and not self.back_stresses

    def strength(self, unit: str) -> str:
        """Where the solid yields, in a ``unit`` of stress, and how it hardens, in words; "elastic"
        if it does not."""
        if self.yield_stress is None:
            return "elastic"
        said = [f"yields at {self.yield_stress:g} {unit}"]
        if self.perfectly_plastic:
            said.append("perfectly plastic")
        elif not isinstance(self.hardening, float):
            last = self.law.knots()[-1]
            said.append(f"hardens to {self.law.stress(last):g} {unit} at PEEQ {last:g}")
        elif self.hardening:
            said.append(f"hardens by {self.hardening:g} {unit} times PEEQ")
        if self.back_stresses:
            said.append(f"back stresses: {len(self.back_stresses)}")
        return ", ".join(said)

    @property
    def law(self) -> Hardening:
        """The isotropic hardening of a solid with a yield stress."""
        return hardening_law(self.yield_stress or 0.0, self.hardening, self.E)

    def constitutive(self, plane: Plane, strain: str = "small") -> Material:
        """The constitutive law: `Elastic`, `J2Material` with a yield stress, `KinematicMaterial`
        with back stresses; at "large" ``strain`` as a `LargeStrain`."""
        if strain == "large":
            from archord.materials.finite import LargeStrain

            return LargeStrain(self.constitutive(plane))
        if self.yield_stress is None:
            return Elastic(self.E, self.nu, plane)
        if self.back_stresses:
            from archord.materials.kinematic import KinematicMaterial

            back_stresses = tuple((C, gamma) for C, gamma in self.back_stresses)
            return KinematicMaterial(self.E, self.nu, plane, self.law, back_stresses)
        from archord.materials.j2 import J2Material

        return J2Material(self.E, self.nu, plane, self.law)


class Pin(Solid):
    """The pin: a solid like the block, or rigid."""

    E: Positive | None = key(  # type: ignore[assignment]
        _E, "stress", default=None, example=210000.0
    )
    nu: Ratio | None = key(_NU, default=None, example=0.3)  # type: ignore[assignment]
    rigid: bool = key("a rigid pin: no mesh, no other key", default=False, other=True)
    whole: bool = key(
        "model the unloaded half behind the pressed diameter, too", default=False, other=True
    )

    @model_validator(mode="after")
    def _rigid_or_solid(self) -> Pin:
        # a table brings the yield stress
        for name in ("material", "hardening", "yield_stress", "back_stresses", "E", "nu", "whole"):
            said = name in self.model_fields_set and getattr(self, name)
            require(not (self.rigid and said), name, "is not for a rigid pin")
        for name in ("E", "nu"):
            require(
                self.rigid or getattr(self, name) is not None,
                name,
                "is missing (or set rigid = true)",
            )
        return self


class Loading(Section):
    """A load of one of several ``kinds`` (keys): one value, or a list of values at the ends of
    stages."""

    kinds: ClassVar[tuple[str, ...]] = ("displacement", "force")

    @model_validator(mode="after")
    def _one_kind(self):
        given(self, self.kinds)
        return self

    @property
    def kind(self) -> str:
        """The key that holds the load."""
        return given(self, self.kinds)

    @property
    def stages(self) -> list[float]:
        """The values at the ends of the stages, as given."""
        value = getattr(self, self.kind)
        return value if isinstance(value, list) else [value]


def steps_of(steps: int | list[int], n: int, place: str) -> list[int]:
    """Output steps of each of ``n`` stages. Raises `Fault` if they are not that many."""
    each = steps if isinstance(steps, list) else [steps] * n
    require(len(each) == n, place, f"must have one number for each of the {n} stages")
    require(sum(each) <= MOST_STEPS, place, f"must not add up to more than {MOST_STEPS} steps")
    return each


class JointLoad(Loading):
    """The displacement of the pin, from first touch, or the force on it: a ramp to a target, or to
    several in turn."""

    kinds = (*LOADS, "path")
    displacement: Targets | None = key(
        "displacement of the pin over dR: target, or list", default=None, example=2.0
    )
    displacement_absolute: Targets | None = key(
        "displacement delta of the pin, instead", "length", other=0.1
    )
    force: Targets | None = key(
        "force P on the whole pin, instead of a displacement", "force", other=1000.0
    )
    relative_force: Targets | None = key("P/(E* R), instead of force", other=0.01)
    path: Name | None = key(
        "CSV file of targets: one column, headed by one of the names above", other="cycle.csv"
    )
    core_radius: float = key(
        "ring: radius over R of the core that the force acts on", default=0.1, ge=0.01, le=0.5
    )
    steps: StepCounts = key(
        "output steps up to each target: one number for all, or a list", default=20
    )

    @model_validator(mode="after")
    def _steps(self) -> JointLoad:
        require(
            self.path is None,
            "path",
            "is for scene files alone; give the list of its targets instead",
        )
        steps_of(self.steps, len(self.stages), "steps")
        return self

    @property
    def stage_steps(self) -> list[int]:
        """Output steps up to each target."""
        return steps_of(self.steps, len(self.stages), "steps")


class Modelling(Section):
    """How a problem is modelled and solved."""

    plane: Literal["strain", "stress"] = key("plane strain or plane stress", default="strain")
    strain: Literal["small", "large"] = key(
        "small strains, or large ones by logarithms", default="small"
    )
    kinematics: Literal["current", "reference"] = key(
        "closest points on deformed curves, or fixed", default="current"
    )
    gamma_factor: float = key(
        "Nitsche's gamma over trace constant; coercive above 0.25", default=0.5, ge=1e-3, le=1e6
    )
    accuracy: Accuracy | None = key(
        "relative error of P (delta under a force) to reach by mesh and steps", other=0.001
    )
    degree: Literal[2, 3] = key(
        "polynomial degree of displacements and of the curved geometry", default=2
    )
    thickness: Positive | None = key(
        "thickness; forces and energies are per unit if absent", "length", other=10.0
    )
    tolerance: float = key(
        "residual over reaction at which Newton stops", default=1e-10, ge=1e-12, le=1e-4
    )
    max_iterations: int = key("Newton iterations before a step is cut", default=25, ge=2, le=1000)

    @model_validator(mode="after")
    def _large(self):
        require(
            self.strain == "small" or self.kinematics == "current",
            "kinematics",
            'must be "current" at large strain',
        )
        return self

    @property
    def doubts(self) -> list[str]:
        """What to warn of before anything is solved."""
        if self.gamma_factor >= _COERCIVE:
            return []
        return [
            f"analysis.gamma_factor = {self.gamma_factor:g} is below {_COERCIVE:g}, where "
            "Nitsche's form is not coercive: forces and pressures may be wrong by a tenth and "
            "more; the default is 0.5"
        ]


class PresetAnalysis(Modelling):
    """How a preset is modelled and solved."""

    friction: float = key(
        "Coulomb's coefficient of friction of all contacts", default=0.0, ge=0, le=1e6
    )


class Analysis(PresetAnalysis):
    """How the joint is modelled and solved."""

    coarse_start: bool = key(
        "guess every step on a fine mesh from a coarser one; false: for comparison", default=True
    )
    integration: Side = key(
        "whose edge carries the contact integral: both (unbiased), or one side's", default="both"
    )


class ProblemAnalysis(Modelling):
    """How a general problem is modelled and solved."""

    plane: Literal["strain", "stress", "axisymmetric"] = key(  # type: ignore[assignment]
        "plane strain, plane stress, or bodies of revolution about x = 0: x is the radius",
        default="strain",
    )
    symmetry: int = key(
        "how many times the part makes up the whole; results are of the whole",
        default=1,
        ge=1,
        le=100,
    )

    @model_validator(mode="after")
    def _whole_rings(self):
        is_plane = self.plane != "axisymmetric"
        said = "is for planes: axisymmetric forces are of the whole ring"
        require(is_plane or self.thickness is None, "thickness", said)
        said = "must be 1, or 2 for a half that is cut across the axis, as bodies are whole rings"
        require(is_plane or self.symmetry <= 2, "symmetry", said)
        return self


class Stepping(Section):
    """Control of the steps between outputs; lengths are in output steps."""

    initial: float = key("length of the first step", default=1.0, gt=0, le=1)
    minimum: float = key("length below which a step is not cut", default=1e-3, gt=0, le=1)
    maximum: float = key("length beyond which a step does not grow", default=1.0, gt=0, le=1)
    growth: float = key("factor on the length after an easy step", default=2.0, ge=1, le=10)
    cutback: float = key("factor on the length after a failed step", default=0.5, ge=0.05, le=0.9)
    target_iterations: int = key(
        "Newton iterations up to which a step was easy", default=15, ge=1, le=1000
    )

    @model_validator(mode="after")
    def _ordered(self) -> Stepping:
        require(
            self.minimum <= self.initial <= self.maximum,
            "initial",
            "must be between stepping.minimum and maximum",
        )
        return self


class Output(Section):
    """What a run writes besides its curves."""

    fields: Literal[False, "cells", "nodes", "points"] = key(
        "write the fields of every step to fields.h5 and fields.xdmf: of stress and plastic strain "
        "the means of cells, or also values at the nodes, or also those at the integration points; "
        "true is the default",
        default="cells",
    )

    @model_validator(mode="before")
    @classmethod
    def _level(cls, data: Any) -> Any:
        """True is the default; scenes of older versions have the keys stress (at the nodes) and
        points."""
        if not isinstance(data, dict) or not isinstance(data.get("fields", True), bool):
            return data
        default = cls.model_fields["fields"].default
        old = {
            name: data[name] for name in ("stress", "points") if isinstance(data.get(name), bool)
        }
        level = "nodes" if old.get("stress", default == "nodes") else "cells"
        found = "points" if old.get("points") else level
        return {k: v for k, v in data.items() if k not in old} | {
            "fields": data.get("fields", True) and found
        }


class ProblemOutput(Output):
    """What a run of a general scene writes."""

    fields: Literal[False, "cells", "nodes", "points"] = key(
        str(Output.model_fields["fields"].description), default="nodes"
    )
