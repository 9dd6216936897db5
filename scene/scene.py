"""The scene: a joint and its loading, checked, with every key's unit and default.

Any consistent set of units will do; ``[units]`` only names them. Where a key has an alternative (``clearance`` and
``relative_clearance``), the scene gives one of the two. What a geometry, a body and a load are is in files of their
own beside this one; their names are here as well.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel, Field, model_validator

from archord.materials.elasticity import contact_modulus
from archord.scene.bodies import Pin, Solid
from archord.scene.errors import InputError
from archord.scene.geometry import JointGeometry
from archord.scene.keys import LINE, Section, key
from archord.scene.load import LOADS, Load

__all__ = (
    "CHOSEN", "FORMAT", "LOADS", "Analysis", "JointGeometry", "Load", "Output", "Pin", "Scene", "Solid",
    "Stepping", "Units",
)  # fmt: skip
_RANGE = 1e-30, 1e30  # of lengths and moduli; powers of them must not leave the range of numbers
FORMAT = 1  # version of the scene format: rises when a scene gets a meaning that an older archord would get wrong
_SOFTEST = 1e-8  # ratio of the moduli
_WEAKEST = 1e-7  # yield stress over E; below it nothing elastic is left but round-off


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
        from archord.scene.sections import scene_from

        return scene_from(sections)


class Scene(Section, metaclass=_Checked):
    """A pin joint and how to load it.

    ``Scene(joint={"radius": 10.0, "clearance": 0.05}, ...)`` makes one from sections, tables or their classes. Raises
    `InputError`, a sentence for each fault.
    """

    if TYPE_CHECKING:

        def __init__(self, **sections: Any) -> None: ...

    format: Literal[1] = key("version of the scene format; a scene of a newer version is refused", default=FORMAT)
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
        for section, chosen in CHOSEN if self.analysis.accuracy is not None else ():
            given: BaseModel = getattr(self, section)
            if chosen in given.model_fields_set and getattr(given, chosen) is not None:
                raise ValueError(
                    f"{section}.{chosen}|must not be given together with analysis.accuracy, which chooses it"
                )
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
        """Raise `InputError` if the scene leaves its mesh to `archord.studies.accuracy`."""
        if self.analysis.accuracy is not None:
            raise InputError(
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
