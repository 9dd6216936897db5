"""The scene: a joint and its loading, checked, with every key's unit and default.

Any consistent set of units will do; ``[units]`` only names them. Where a key has an alternative (``clearance`` and
``relative_clearance``), the scene gives one of the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, ClassVar, Literal

from pydantic import BaseModel, Field, ValidationError, model_validator

from archord.materials.elasticity import contact_modulus
from archord.scene.errors import InputError
from archord.scene.faults import in_sentences
from archord.scene.geometry import JointGeometry
from archord.scene.keys import Section, key, require
from archord.scene.sections import Analysis, Load, Output, Pin, Solid, Stepping, Units

RANGE = 1e-30, 1e30  # of lengths and moduli; powers of them must not leave the range of numbers
FORMAT = 1  # version of the scene format: rises when a scene gets a meaning that an older archord would get wrong
SOFTEST = 1e-8  # ratio of the moduli
WEAKEST = 1e-7  # yield stress over E; below it nothing elastic is left but round-off
# what an accuracy chooses
CHOSEN = ("joint.element_size", "joint.relative_element_size", "joint.growth", "stepping.initial", "stepping.maximum")


class Checked(Section):
    """A scene, checked: sections given as tables or as their classes; `newest` is the version of its format."""

    newest: ClassVar[int] = FORMAT

    def __init__(self, source: str = "scene", origin: Mapping[str, str] | None = None, /, **sections: Any) -> None:
        """Check ``sections`` as read from ``source``; ``origin`` names another source of some keys."""
        try:
            data = plain(sections)
        except RecursionError:
            raise InputError(f"{source}: is not a scene: its tables are nested too deeply.") from None
        version = data.get("format", self.newest)
        if isinstance(version, int) and version > self.newest:  # it may hold anything else that is unknown here
            said = f"is for a newer archord; this one reads format {self.newest}"
            raise InputError(f"{source}: format = {version} {said}.")
        try:
            units = data.get("units")
            context = {"stress": str(units.get("stress", "MPa"))} if isinstance(units, dict) else {}
            self.__pydantic_validator__.validate_python(data, self_instance=self, context=context)
        except ValidationError as error:
            raise InputError(in_sentences(error.errors(), data, type(self), source, dict(origin or {}))) from None


class Scene(Checked):
    """A pin joint and how to load it.

    ``Scene(joint={"radius": 10.0, "clearance": 0.05}, ...)`` makes one from sections: tables or their classes, whose
    numbers and lists may be numpy's; None means absent. Raises `InputError`, a sentence for each fault.
    """

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
        joint, pin, load = self.joint, self.pin, f"load.{self.load.name}"
        for name in CHOSEN if self.analysis.accuracy is not None else ():
            section, key = name.split(".")
            given: BaseModel = getattr(self, section)
            free = key not in given.model_fields_set or getattr(given, key) is None
            require(free, name, "must not be given together with analysis.accuracy, which chooses it")
        said = 'must be "block" or "both": a rigid pin has no contact edge to integrate'
        require(not pin.rigid or self.analysis.integration != "pin", "analysis.integration", said)
        sizes = {"joint.radius": joint.radius} | {f"{name}.E": body.E for name, body in self.solids.items()}
        for name, size in sizes.items():
            require(RANGE[0] <= size <= RANGE[1], name, "must be between 1e-30 and 1e30; choose other units")
        for name, body in self.solids.items():
            strong = body.yield_stress is None or body.yield_stress >= WEAKEST * body.E
            require(strong, f"{name}.yield_stress", f"must be at least {WEAKEST:g} times {name}.E")
            allowed = not isinstance(body.hardening, float) or body.hardening <= body.E / WEAKEST
            require(allowed, f"{name}.hardening", f"must not exceed {1 / WEAKEST:g} times {name}.E")
        alike = all(SOFTEST <= body.E / self.block.E <= 1 / SOFTEST for body in self.solids.values())
        require(alike, "pin.E", "must be between 1e-8 and 1e8 times block.E (or set rigid = true)")
        if joint.is_ring:
            said = 'does not load a joint whose model is "ring"; give force or relative_force'
            require(self.force_controlled, load, said)
            require(not pin.rigid, "pin.rigid", 'must be false where joint.model is "ring"')
            require(not pin.whole, "pin.whole", 'is for joint.model = "block": the pin of a ring is whole anyway')
        scale = self.E_star * self.thickness if self.force_controlled else 1.0
        largest, most = max(map(abs, self.targets)), 0.5 * scale * joint.radius
        what = "E* R" if self.force_controlled else "the radius"
        require(largest <= most, load, f"must not exceed half {what} ({most:g})")
        return self

    def require_mesh(self) -> None:
        """Raise `InputError` if the scene leaves its mesh to `archord.studies.accuracy`."""
        if self.analysis.accuracy is not None:
            raise InputError(f"analysis.accuracy = {self.analysis.accuracy:g}: leaves the mesh open.")

    @property
    def force_controlled(self) -> bool:
        """Whether the load is a force."""
        return self.load.name in ("force", "relative_force")

    @property
    def load_unit(self) -> float:
        """What the targets of the section load are multiplied by."""
        scale = {"displacement": self.joint.dR, "relative_force": self.E_star * self.joint.radius * self.thickness}
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
    def steps_numbered(self) -> bool:
        """Whether results name steps by number, as the displacement does not grow or is not known before."""
        return self.force_controlled or not all(a < b for a, b in pairwise([0.0, *self.targets]))

    @property
    def travelled(self) -> list[list[float]]:
        """The load at every output step: what two scenes share as far as they agree."""
        return [[target] for target in self.targets]

    @property
    def loaded_by(self) -> Any:
        """What a run must be loaded by to be continued with this scene."""
        return self.force_controlled

    @property
    def accurate(self) -> str:
        """Name of what an accuracy is asked of."""
        return "delta" if self.force_controlled else "P"

    @property
    def loading(self) -> str:
        """The load in words."""
        return f"load.{self.load.name}"

    @property
    def loads_said(self) -> str:
        """Targets and steps in words."""
        return f"{self.load.legs} and {self.load.leg_steps}"

    @property
    def E_star(self) -> float:
        """Contact modulus of the pair, ``1/E* = sum over deformable bodies of 1/E*_i`` (Johnson 1985, eq. 4.20)."""
        return 1 / sum(1 / contact_modulus(s.E, s.nu, self.analysis.plane) for s in self.solids.values())

    @property
    def thickness(self) -> float:
        """Thickness, 1 if forces are per unit thickness."""
        return self.analysis.thickness or 1.0

    @property
    def plastic(self) -> bool:
        """Whether any body can yield."""
        return any(solid.yield_stress is not None for solid in self.solids.values())

    @property
    def solids(self) -> dict[str, Solid]:
        """The deformable bodies by name."""
        return {"block": self.block} if self.pin.rigid else {"pin": self.pin, "block": self.block}


def plain(value: Any) -> Any:
    """``value`` as a TOML file would give it: tables, lists and numbers of Python."""
    if isinstance(value, BaseModel):
        value = value.model_dump(exclude_unset=True)
    if isinstance(value, Mapping):
        return {str(name): plain(part) for name, part in value.items() if part is not None}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return value.tolist() if hasattr(value, "tolist") else value
