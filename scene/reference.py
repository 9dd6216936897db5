"""What a scene file may hold: the schema, a commented example, the reference tables, and limits in words."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from archord.scene.scene import Scene

TOP_LEVEL = ("format",)


def toml_value(value: Any) -> str:
    """``value`` as TOML writes it."""
    return json.dumps(value, default=str, ensure_ascii=False)


def key_names(location: list[str]) -> list[str]:
    """Keys of the section at ``location`` (none: the sections)."""
    model: Any = Scene
    for part in location:
        model = model.model_fields[part].annotation
    return list(model.model_fields)


def schema() -> dict[str, Any]:
    """The JSON schema of scene files."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scene.model_json_schema()}


def limits_in_words(section: str, key: str) -> str:
    """Limits of a key: ``greater than -1 and less than 0.5``."""
    properties = Scene.model_fields[section].annotation.model_json_schema()["properties"]  # type: ignore[union-attr]
    signs = {">": "greater than", "≥": "at least", "<": "less than", "≤": "at most"}
    return " and ".join(f"{signs[sign]} {value:g}" for sign, value in _limits(properties[key])[1])


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
    lines = [
        "# Scene reference",
        "",
        "Printed by `archord scene --reference`. Units are the scene's own: any consistent set.",
        "",
        "Above the sections a scene may say, and what archord writes does say:",
        "",
        "| key | default | what |",
        "|---|---|---|",
    ]
    for name in TOP_LEVEL:
        info = Scene.model_fields[name]
        lines.append(f"| `{name}` | `{toml_value(info.default)}` | {info.description} |")
    lines.append("")
    for section, info, keys in _sections():
        lines += [f"## [{section}]", "", f"{info.description[0].upper()}{info.description[1:]}.", ""]
        lines += ["| key | unit | default | allowed | what |", "|---|---|---|---|---|"]
        schema = info.annotation.model_json_schema()["properties"]
        for name, key in keys:
            default = "required" if key.is_required() else "" if key.default is None else f"`{toml_value(key.default)}`"
            what = key.description.replace("|", "\\|")
            lines.append(f"| `{name}` | {_unit(key)} | {default} | {_allowed(schema[name])} | {what} |")
        lines.append("")
    return "\n".join(lines)


def _allowed(schema: dict[str, Any]) -> str:
    """Type and limits of a key from its JSON schema, for a table."""
    given = _given(schema)
    if "enum" in given:
        return ", ".join(f"`{toml_value(value)}`" for value in given["enum"])
    if given["type"] == "boolean":
        return "true, false"
    kind, limits = _limits(schema)
    return " ".join([kind, ", ".join(f"{sign} {value:g}" for sign, value in limits)]).strip()


def _given(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema of a key that may be absent, when it is not."""
    return next((s for s in schema.get("anyOf", []) if s.get("type") != "null"), schema)


def _limits(schema: dict[str, Any]) -> tuple[str, list[tuple[str, float]]]:
    listed = any(s.get("type") == "array" for s in schema.get("anyOf", []))
    schema = _given(schema)
    signs = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
    kind = {"number": "number", "integer": "whole number", "string": "text"}[schema["type"]]
    kind += " or list" if listed else ""
    return kind, [(sign, schema[name]) for name, sign in signs.items() if name in schema]
