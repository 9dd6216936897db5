"""What a scene file may hold, from the model of scenes: a commented example, and the reference tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from archord.report.table import Table
from archord.scene.keys import toml_value
from archord.scene.scene import FORMAT, Scene

_SECTIONS: dict[str, Any] = {name: info for name, info in Scene.model_fields.items() if name != "format"}
_SIGNS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
_KINDS = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true, false", "array": "list"}


def example() -> str:
    """A commented scene that shows every key; alternatives and absent defaults are commented out."""
    text = f"# An archord scene: archord solve scene.toml\n\nformat = {FORMAT}  # version of the scene format\n"
    for section, info in _SECTIONS.items():
        text += f"\n[{section}]  # {info.description}\n"
        for name, key, schema in _keys(info):
            default = "" if schema.get("default") is None else f", default {toml_value(schema['default'])}"
            unit = f" [{schema['unit']}]" if schema["unit"] else ""
            shown = f"{'# ' if schema['hidden'] else ''}{name} = {toml_value(schema['shown'])}"
            text += f"{shown}  # {key.description}{unit}{default}\n"
    return text


def reference() -> str:
    """All sections and keys as Markdown tables."""
    parts = [
        "# Scene reference\n",
        "Printed by `archord scene --reference`. Units are the scene's own: any consistent set.\n",
        f"Above the sections a scene may say the version of its format, and what archord writes does say it: "
        f"`format = {FORMAT}`. A scene of a newer version is refused.\n",
    ]
    for section, info in _SECTIONS.items():
        table = Table("key", "unit", "default", "allowed", "what")
        for name, key, schema in _keys(info):
            default = "" if schema.get("default") is None else f"`{toml_value(schema['default'])}`"
            default = "required" if key.is_required() else default
            table.add(f"`{name}`", schema["unit"], default, _allowed(schema), key.description)
        parts += [f"## [{section}]\n", f"{info.description[0].upper()}{info.description[1:]}.\n", table.markdown()]
    return "\n".join(parts)


def _keys(section: Any) -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Name, field and JSON schema of every key of a section."""
    model = section.annotation
    schemas = model.model_json_schema()["properties"]
    for name in sorted(schemas, key=lambda name: name not in ("E", "nu")):
        yield name, model.model_fields[name], schemas[name]


def _allowed(schema: dict[str, Any]) -> str:
    """Type and limits of a key from its JSON schema, for a table."""
    kinds = schema.get("anyOf", schema.get("oneOf", [schema]))
    one, *more = [s for s in kinds if s.get("type") != "null"]
    if "enum" in one:
        return ", ".join(f"`{toml_value(value)}`" for value in one["enum"])
    kind = " or ".join([_KINDS[one["type"]], *(_KINDS.get(s.get("type"), "table") for s in more)])
    return f"{kind} {', '.join(f'{sign} {one[limit]:g}' for limit, sign in _SIGNS.items() if limit in one)}".strip()
