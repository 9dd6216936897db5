"""The scene: what a TOML file says about a joint, checked, with every key's unit and default.

Any consistent set of units will do; ``[units]`` only names them. Where a key has an alternative (``clearance`` and
``relative_clearance``), the scene gives one of the two; an override drops the other.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from archord.materials.elasticity import Elastic, contact_modulus

ALTERNATIVES = {
    "joint": [("clearance", "relative_clearance"), ("element_size", "relative_element_size")],
    "load": [("displacement", "displacement_absolute")],
}

Positive = Annotated[float, Field(gt=0)]


def _key(description: str, unit: str = "", *, default: Any = ..., example: Any = None, **limits: Any) -> Any:
    """A documented key: its unit is the scene's unit of that kind, `example` is what ``--example`` shows."""
    extra: Any = {"unit": unit} if unit else {}
    example = default if example is None else example
    return Field(default, description=description, examples=[example], json_schema_extra=extra, **limits)


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class Units(_Section):
    """Names of the scene's units, for headings; they must be consistent (force = stress times length squared)."""

    length: str = _key("unit of length", default="mm", min_length=1)
    stress: str = _key("unit of stress and of Young's modulus", default="MPa", min_length=1)

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


class JointGeometry(_Section):
    """The pin of radius ``R`` in a hole of radius ``R + dR``, and the mesh of both."""

    radius: float = _key("radius R of the pin", "length", gt=0, example=10.0)
    clearance: Positive | None = _key("radial clearance dR = hole radius - pin radius", "length", default=None)
    relative_clearance: Positive | None = _key("dR/R, instead of clearance", default=None, example=0.005)
    block_size: Positive | None = _key("width and depth of the block; 100 R if absent", "length", default=None)
    element_size: Positive | None = _key("edge length of the elements on both arcs", "length", default=None)
    relative_element_size: Positive | None = _key(
        "element_size / R, instead of element_size; 0.04 if both are absent", default=None, example=0.04
    )
    growth: float = _key("growth of the element size per unit of distance from the arcs", default=0.25, gt=0, le=2)

    @model_validator(mode="after")
    def _geometry(self) -> JointGeometry:
        if (self.clearance is None) == (self.relative_clearance is None):
            raise ValueError("clearance|must be given, or else relative_clearance, and not both")
        name = "clearance" if self.relative_clearance is None else "relative_clearance"
        if not 1e-6 <= self.dR / self.radius <= 0.5:
            raise ValueError(f"{name}|must be a clearance: between 1e-6 and 0.5 times the radius")
        if self.element_size is not None and self.relative_element_size is not None:
            raise ValueError("element_size|must not be given together with relative_element_size")
        if not 1e-4 <= self.h / self.radius <= 0.5:
            name = "element_size" if self.element_size is not None else "relative_element_size"
            raise ValueError(f"{name}|must be between 1e-4 and 0.5 times the radius")
        if 2 * (self.radius + self.dR) > self.W:
            raise ValueError("block_size|must be at least twice the radius of the hole")
        return self

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
        """Element size on the arcs."""
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
    nu: float = _key("Poisson's ratio", gt=-1, lt=0.5, example=0.3)

    def material(self, plane: Literal["strain", "stress"]):
        """The constitutive law: `Elastic`, or `J2Material` if there is a yield stress."""
        if self.yield_stress is None:
            return Elastic(self.E, self.nu, plane)
        from archord.materials.j2 import J2Material

        return J2Material(self.E, self.nu, self.yield_stress, self.hardening, plane)


class Pin(_Strength):
    """The pin: a solid like the block, or rigid."""

    E: Positive | None = _key("Young's modulus", "stress", default=None, example=210000.0)
    nu: float | None = _key("Poisson's ratio", default=None, gt=-1, lt=0.5, example=0.3)
    rigid: bool = _key("a rigid pin: no mesh, no other key", default=False)

    @model_validator(mode="after")
    def _rigid_or_solid(self) -> Pin:
        for key in self.model_fields_set - {"rigid"}:
            if self.rigid and getattr(self, key):
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
        gt=0.25,
        le=1000,
    )
    tolerance: float = _key("residual over reaction at which Newton stops", default=1e-10, ge=1e-12, le=1e-4)
    max_iterations: int = _key("Newton iterations before a step is cut", default=25, ge=2, le=1000)


class Load(_Section):
    """The displacement of the pin, from first touch, in equal output steps."""

    displacement: Positive | None = _key(
        "largest displacement delta of the pin, in clearances dR", default=None, example=2.0
    )
    displacement_absolute: Positive | None = _key(
        "largest displacement delta of the pin, instead of displacement", "length", default=None
    )
    steps: int = _key("equal output steps up to it", default=20, ge=1, le=100000)
    max_cutbacks: int = _key("times an output step may be halved before the run ends", default=10, ge=0, le=30)

    @model_validator(mode="after")
    def _one_displacement(self) -> Load:
        if (self.displacement is None) == (self.displacement_absolute is None):
            raise ValueError("displacement|must be given, or else displacement_absolute, and not both")
        return self


class Scene(_Section):
    """A pin joint and how to load it."""

    units: Units = Field(default_factory=Units, description="names of the units")
    joint: JointGeometry = Field(description="geometry and mesh")
    pin: Pin = Field(description="material of the pin")
    block: Solid = Field(description="material of the block")
    analysis: Analysis = Field(default_factory=Analysis, description="model and solver")
    load: Load = Field(description="loading")

    @model_validator(mode="after")
    def _consistent(self) -> Scene:
        if self.pin.rigid and self.analysis.integration == "pin":
            raise ValueError("analysis.integration|a rigid pin has no contact edge to integrate: block or both")
        if self.delta > 0.5 * self.joint.radius:
            name = "displacement" if self.load.displacement_absolute is None else "displacement_absolute"
            raise ValueError(f"load.{name}|must not exceed half the radius ({0.5 * self.joint.radius:g})")
        return self

    @property
    def delta(self) -> float:
        """Largest displacement of the pin."""
        if self.load.displacement_absolute is not None:
            return self.load.displacement_absolute
        return (self.load.displacement or 0.0) * self.joint.dR

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


def load_scene(path: str | Path, overrides: list[str] | tuple[str, ...] = ()) -> Scene:
    """Read and check the scene file ``path``, with ``overrides`` like ``"joint.clearance=0.01"`` on top.

    Raises `SceneError` with one sentence per fault: file, key, value, and what is allowed.
    """
    try:
        data = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror or error}.") from None
    except UnicodeDecodeError:
        raise SceneError(f"{path}: cannot be read: it is not UTF-8 text.") from None
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{path}: is not valid TOML: {error}.") from None
    origin = {}
    for override in overrides:
        origin[_override(data, override)] = f"--set {override}"
    return parse_scene(data, str(path), origin)


def parse_scene(data: dict[str, Any], source: str = "scene", origin: dict[str, str] | None = None) -> Scene:
    """Check scene ``data`` as read from ``source``; ``origin`` names another source of some keys. Raises
    `SceneError`."""
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        sentences = [_sentence(e, data, source, origin or {}) for e in error.errors()]
        raise SceneError("\n".join(sentences)) from None


def _override(data: dict[str, Any], override: str) -> str:
    """Set one ``a.b=value`` in ``data`` (value: TOML, a number, else text; nothing: drop it); returns the dotted
    key."""
    key, sign, text = override.partition("=")
    key = key.strip()
    section, dot, name = key.partition(".")
    if not (sign and dot and section and name and "." not in name):
        raise SceneError(f"--set {override}: must read section.key=value, like joint.clearance=0.01.")
    table = data.setdefault(section, {})
    if not isinstance(table, dict):
        raise SceneError(f"--set {override}: {section} is not a section of the scene.")
    for pair in ALTERNATIVES.get(section, []):
        if name in pair:
            for other in pair:
                table.pop(other, None)
    if not text.strip():
        table.pop(name, None)
        return key
    value = _value(text.strip())
    if key == "pin.rigid" and value is True:
        table.clear()
    table[name] = value
    return key


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        pass
    try:
        return float(text)
    except ValueError:
        return text


def _sentence(error: Any, data: dict[str, Any], source: str, origin: dict[str, str]) -> str:
    """One sentence for one fault that pydantic found."""
    location, kind, context = [str(part) for part in error["loc"]], error["type"], error.get("ctx", {})
    said = None
    if kind == "value_error":
        name, said = str(context["error"]).split("|", 1)
        location += name.split(".")
    key = ".".join(location)
    given: Any = data
    for part in location:
        given = given.get(part) if isinstance(given, dict) else None
    where = next((said_in for name, said_in in origin.items() if name == key or name.startswith(f"{key}.")), source)
    shown = "" if given is None or isinstance(given, dict) or where != source else f" = {_toml(given)}"
    limits = {
        "greater_than": "must be greater than {gt:g}",
        "greater_than_equal": "must be at least {ge:g}",
        "less_than": "must be less than {lt:g}",
        "less_than_equal": "must be at most {le:g}",
        "literal_error": "must be {expected}",
        "float_type": "must be a number",
        "int_type": "must be a whole number",
        "bool_type": "must be true or false",
        "string_type": "must be text",
        "string_too_short": "must not be empty",
        "finite_number": "must be a finite number",
        "missing": "is missing",
        "model_type": "must be a section, [{name}]",
    }
    if said is None and kind == "extra_forbidden":
        allowed = _keys(location[:-1])
        near = difflib.get_close_matches(location[-1], allowed, 1)
        hint = f"did you mean {near[0]}? " if near else ""
        said = f"is not a known key; {hint}{'Sections' if len(location) == 1 else 'Keys'} are {', '.join(allowed)}"
    elif said is None:
        said = limits.get(kind, error["msg"]).format(**{**context, "name": key})
    return f"{where}: {key}{shown} {said}."


def _keys(location: list[str]) -> list[str]:
    model: Any = Scene
    for part in location:
        model = model.model_fields[part].annotation
    return list(model.model_fields)


def _toml(value: Any) -> str:
    import json

    return json.dumps(value, default=str, ensure_ascii=False)


def resolved(scene: Scene) -> str:
    """The scene as TOML, with every default filled in; it loads as the same scene."""
    import tomli_w

    data = scene.model_dump(exclude_none=True)
    joint = data["joint"]
    joint["block_size"] = scene.joint.W
    if "element_size" not in joint:
        joint.setdefault("relative_element_size", 0.04)
    if scene.pin.rigid:
        data["pin"] = {"rigid": True}
    return tomli_w.dumps(data)


def _sections() -> Iterator[tuple[str, Any, list[tuple[str, Any]]]]:
    """Name, field and documented keys of every section."""
    for section, info in Scene.model_fields.items():
        model: Any = info.annotation
        names = sorted(model.model_fields, key=lambda name: name not in ("E", "nu"))
        yield section, info, [(name, model.model_fields[name]) for name in names]


def _unit(key: Any) -> str:
    return (key.json_schema_extra or {}).get("unit", "")


_SHOWN = {"block_size": 1000.0, "clearance": 0.05, "element_size": 0.4, "displacement_absolute": 0.1}


def example() -> str:
    """A commented scene that shows every key; alternatives and absent defaults are commented out."""
    lines = ["# An archord scene: archord solve scene.toml", ""]
    for section, info, keys in _sections():
        lines += [f"[{section}]  # {info.description}"]
        for name, key in keys:
            shown = (key.examples or [None])[0]
            hidden = "# " if shown is None or name == "rigid" else ""
            default = "" if key.is_required() or key.default is None else f", default {_toml(key.default)}"
            unit = f" [{_unit(key)}]" if _unit(key) else ""
            lines.append(f"{hidden}{name} = {_toml(_SHOWN.get(name, shown))}  # {key.description}{unit}{default}")
        lines.append("")
    return "\n".join(lines)


def reference() -> str:
    """All sections and keys as Markdown tables."""
    lines = [
        "# Scene reference",
        "",
        "Printed by `archord scene --reference`. Units are the scene's own: any consistent set.",
        "",
    ]
    for section, info, keys in _sections():
        lines += [f"## [{section}]", "", f"{info.description[0].upper()}{info.description[1:]}.", ""]
        lines += ["| key | unit | default | allowed | what |", "|---|---|---|---|---|"]
        schema = info.annotation.model_json_schema()["properties"]
        for name, key in keys:
            default = "required" if key.is_required() else "" if key.default is None else f"`{_toml(key.default)}`"
            what = key.description.replace("|", "\\|")
            lines.append(f"| `{name}` | {_unit(key)} | {default} | {_allowed(schema[name])} | {what} |")
        lines.append("")
    return "\n".join(lines)


def _allowed(schema: dict[str, Any]) -> str:
    """Type and limits of a key from its JSON schema, in words."""
    schema = next((s for s in schema.get("anyOf", []) if s.get("type") != "null"), schema)
    if "enum" in schema:
        return ", ".join(f"`{_toml(value)}`" for value in schema["enum"])
    signs = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
    limits = [f"{sign} {schema[name]:g}" for name, sign in signs.items() if name in schema]
    kind = {"number": "number", "integer": "whole number", "boolean": "true, false", "string": "text"}[schema["type"]]
    return " ".join([kind, ", ".join(limits)]).strip()
