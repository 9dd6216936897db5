"""The sections ``pin`` and ``block`` of a scene: what the bodies are made of."""

from __future__ import annotations

from pydantic import model_validator

from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.material import Material, Plane
from archord.scene.keys import Positive, Section, key

_NU = -0.999, 0.499999  # shear or bulk modulus leave E by a factor below 1e6: round-off stays below the tolerances


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
