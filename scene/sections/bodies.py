"""Materials of bodies in the words of a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from archord.materials.elasticity import Elastic
from archord.materials.hardening import Hardening
from archord.materials.material import Material, Plane
from archord.report.by_name import Names
from archord.scene.sections.errors import Fault
from archord.scene.sections.keys import Positive, Section, after, key, require
from archord.scene.sections.plasticity import IN_WORDS, HardeningKey, filled, hardening_law

NotNegative = Annotated[float, Field(ge=0)]
# shear or bulk modulus leave E by a factor below 1e6: round-off stays below the tolerances
Ratio = Annotated[float, Field(ge=-0.999, le=0.499999)]
_E = "Young's modulus, unless a material brings it"
_NU = "Poisson's ratio, unless a material brings it"
BackStress = Annotated[list[NotNegative], Field(min_length=2, max_length=2)]
_SOFTEST = 1e-8  # ratio of the moduli
_WEAKEST = 1e-7  # yield stress over E; below it nothing elastic is left but round-off
_PERCENT = 2.0  # strain of a table that may be given in percent
_STRONGEST = 0.5  # the same; above it no body yields, and units may be mixed


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

    @after
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
                law = self.law
                stress = law.stress(law.knots())
            except ValueError as error:
                raise Fault(("hardening",), f"is no hardening law: {error}") from None
            first = float(stress[0])
            rounding = 1e-9 * first
            test = getattr(self.hardening, "engineering", None)
            true = f", the true stress of {test[0][1]:g}" if test else ""
            said = f"must begin at yield_stress ({self.yield_stress:g}), not at {first:g}{true}"
            require(math.isclose(first, self.yield_stress, rel_tol=1e-9), "hardening", said)
            said = "must not soften: its yield stress falls with PEEQ"
            require(bool((np.diff(stress) >= -rounding).all()), "hardening", said)
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

    @after
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


def require_solids(solids: Mapping[Names, Solid]) -> None:
    """Raise `Fault` for moduli and strengths, by their places, that leave the tolerances or the
    range of numbers."""
    stiffest = max(solid.E for solid in solids.values())
    for place, solid in solids.items():
        modulus = (*place, "E")
        strength = solid.yield_stress
        require(
            1e-30 <= solid.E <= 1e30, modulus, "must be between 1e-30 and 1e30; choose other units"
        )
        said = (
            f"must be at least {_SOFTEST:g} of the largest E, {stiffest:g}: give all moduli in one "
            "unit"
        )
        require(stiffest <= solid.E / _SOFTEST, modulus, said)
        strong = strength is None or strength >= _WEAKEST * solid.E
        require(
            strong,
            (*place, "yield_stress"),
            f"must be at least {_WEAKEST:g} times E, in the same unit",
        )
        allowed = not isinstance(solid.hardening, float) or solid.hardening <= solid.E / _WEAKEST
        require(
            allowed,
            (*place, "hardening"),
            f"must not exceed {1 / _WEAKEST:g} times E, in the same unit",
        )


def strength_doubts(solids: Mapping[str, Solid]) -> list[str]:
    """A warning of each of the ``solids``, by their names, that is too strong for its E to yield,
    or hardens over strains that may be percents."""
    said = [
        f"the yield stress of {name!r}, {solid.yield_stress:g}, is "
        f"{solid.yield_stress / solid.E:.2g} times its E, {solid.E:g}: it does not yield; look "
        "whether both have the same unit"
        for name, solid in solids.items()
        if solid.yield_stress is not None and solid.yield_stress > _STRONGEST * solid.E
    ]
    for name, solid in solids.items():
        points = getattr(solid.hardening, "engineering", solid.hardening)
        if isinstance(points, list) and points[-1][0] > _PERCENT:
            said.append(
                f"the hardening of {name!r} goes to a strain of {points[-1][0]:g}, which is "
                f"{100 * points[-1][0]:g} %: look whether it is in percent"
            )
    return said
