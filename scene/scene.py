"""The scene: a joint and its loading, checked, with every key's unit and default.

Any consistent set of units will do; ``[units]`` only names them. Where a key has an alternative (``clearance`` and
``relative_clearance``), the scene gives one of the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Literal

from pydantic import BaseModel, Field, ValidationError, model_validator

from archord.materials.elasticity import contact_modulus
from archord.scene.errors import InputError
from archord.scene.faults import in_sentences, shortened
from archord.scene.geometry import JointGeometry
from archord.scene.keys import Section, key, toml_value
from archord.scene.sections import Analysis, Load, Output, Pin, Solid, Stepping, Units

_RANGE = 1e-30, 1e30  # of lengths and moduli; powers of them must not leave the range of numbers
FORMAT = 1  # version of the scene format: rises when a scene gets a meaning that an older archord would get wrong
_SOFTEST = 1e-8  # ratio of the moduli
_WEAKEST = 1e-7  # yield stress over E; below it nothing elastic is left but round-off
# what an accuracy chooses
CHOSEN = (
    ("joint", "element_size"),
    ("joint", "relative_element_size"),
    ("joint", "growth"),
    ("stepping", "initial"),
    ("stepping", "maximum"),
)


class Scene(Section):
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

    def __init__(self, **sections: Any) -> None:
        data = plain(sections)
        load = data.get("load")
        if isinstance(load, dict) and "path" in load:
            raise InputError(
                f'scene: load.path = "{load["path"]}" is for scene files alone; give the list of its targets instead.'
            )
        self._fill(data, "scene", {})

    def _fill(self, data: dict[str, Any], source: str, origin: dict[str, str]) -> None:
        """Take the keys of ``data``. Raises `InputError`."""
        _check_format(data, source)
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise InputError(in_sentences(error.errors(), data, Scene, source, origin)) from None

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
        if self.joint.is_ring and not self.force_controlled:
            raise ValueError(f'{name}|does not load a joint whose model is "ring"; give force or relative_force')
        if self.joint.is_ring and self.pin.rigid:
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


def parse_scene(data: dict[str, Any], source: str = "scene", origin: dict[str, str] | None = None) -> Scene:
    """Check scene ``data`` as read from ``source``; ``origin`` names another source of some keys. Raises
    `InputError`."""
    scene = Scene.__new__(Scene)
    scene._fill(data, source, origin or {})
    return scene


def plain(value: Any) -> Any:
    """``value`` as a TOML file would give it: tables, lists and numbers of Python."""
    if isinstance(value, BaseModel):
        value = value.model_dump(exclude_unset=True)
    if isinstance(value, Mapping):
        return {str(name): plain(part) for name, part in value.items() if part is not None}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return value.tolist() if hasattr(value, "tolist") else value


def _check_format(data: dict[str, Any], source: str) -> None:
    """Look at the version first: a newer scene may hold anything else that is unknown here. Raises `InputError`."""
    version = data.get("format", FORMAT)
    said = f"{source}: format = {shortened(toml_value(version))}"
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise InputError(f"{said} must be a whole number, the version of the scene format: {FORMAT}.")
    if version > FORMAT:
        raise InputError(f"{said} is newer than this archord, which reads format {FORMAT}; use a newer archord.")
