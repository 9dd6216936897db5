"""What a scene file may hold: the schema, a commented example, and the reference tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from archord.report.table import Table
from archord.scene.keys import given, limits, toml_value
from archord.scene.scene import Scene

TOP_LEVEL = ("format",)


def schema() -> dict[str, Any]:
    """The JSON schema of scene files."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scene.model_json_schema()}


def _sections() -> Iterator[tuple[str, Any, list[tuple[str, Any]]]]:
    """Name, field and documented keys of every section."""
    for section, info in Scene.model_fields.items():
        if section in TOP_LEVEL:
            continue
        model: Any = info.annotation
        names = sorted(model.model_fields, key=lambda name: name not in ("E", "nu"))
        yield section, info, [(name, model.model_fields[name]) for name in names]


def _unit(key: Any) -> str:
    return (key.json_schema_extra or {}).get("unit", "")


_SHOWN = {
    "block_size": 1000.0,
    "clearance": 0.05,
    "element_size": 0.4,
    "displacement_absolute": 0.1,
    "force": 1000.0,
    "relative_force": 0.01,
    "path": "cycle.csv",
    "accuracy": 0.001,
}


def example() -> str:
    """A commented scene that shows every key; alternatives and absent defaults are commented out."""
    lines = ["# An archord scene: archord solve scene.toml", ""]
    for name in TOP_LEVEL:
        key = Scene.model_fields[name]
        lines += [f"{name} = {toml_value(key.default)}  # {key.description}", ""]
    for section, info, keys in _sections():
        lines += [f"[{section}]  # {info.description}"]
        for name, key in keys:
            shown = (key.examples or [None])[0]
            hidden = "# " if shown is None or name == "rigid" else ""
            default = "" if key.is_required() or key.default is None else f", default {toml_value(key.default)}"
            unit = f" [{_unit(key)}]" if _unit(key) else ""
            lines.append(f"{hidden}{name} = {toml_value(_SHOWN.get(name, shown))}  # {key.description}{unit}{default}")
        lines.append("")
    return "\n".join(lines)


def reference() -> str:
    """All sections and keys as Markdown tables."""
    top = Table("key", "default", "what")
    for name in TOP_LEVEL:
        key = Scene.model_fields[name]
        top.add(f"`{name}`", f"`{toml_value(key.default)}`", key.description)
    parts = [
        "# Scene reference\n",
        "Printed by `archord scene --reference`. Units are the scene's own: any consistent set.\n",
        "Above the sections a scene may say, and what archord writes does say:\n",
        top.markdown(),
    ]
    for section, info, keys in _sections():
        schema = info.annotation.model_json_schema()["properties"]
        table = Table("key", "unit", "default", "allowed", "what")
        for name, key in keys:
            default = "required" if key.is_required() else "" if key.default is None else f"`{toml_value(key.default)}`"
            table.add(f"`{name}`", _unit(key), default, _allowed(schema[name]), key.description)
        parts += [f"## [{section}]\n", f"{info.description[0].upper()}{info.description[1:]}.\n", table.markdown()]
    return "\n".join(parts)


def _allowed(schema: dict[str, Any]) -> str:
    """Type and limits of a key from its JSON schema, for a table."""
    one = given(schema)
    if "enum" in one:
        return ", ".join(f"`{toml_value(value)}`" for value in one["enum"])
    kind = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true, false"}[one["type"]]
    if any(s.get("type") == "array" for s in schema.get("anyOf", [])):
        kind += " or list"
    return " ".join([kind, ", ".join(f"{sign} {value:g}" for sign, value in limits(schema))]).strip()
