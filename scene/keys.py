"""What the sections of a scene are made of: documented keys with a unit, a default, limits and an example."""

from __future__ import annotations

import json
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

LINE = r"^[^\x00-\x1f]*$"  # a pattern: text on one line
SIGNS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
Positive = Annotated[float, Field(gt=0)]


def key(description: str, unit: str = "", *, default: Any = ..., example: Any = None, **limits: Any) -> Any:
    """A documented key: its unit is the scene's unit of that kind, `example` is what ``--example`` shows."""
    extra: Any = {"unit": unit} if unit else {}
    example = default if example is None else example
    return Field(default, description=description, examples=[example], json_schema_extra=extra, **limits)


def one_of(other: str, value: float | None) -> str:
    """What is wrong with a key that is absent, or given, as its alternative ``other`` is."""
    return f"is missing (or {other})" if value is None else f"must not be given together with {other}"


def given(schema: dict[str, Any]) -> dict[str, Any]:
    """The JSON schema of a key that may be absent, when it is not."""
    return next((s for s in schema.get("anyOf", []) if s.get("type") != "null"), schema)


def limits(schema: dict[str, Any]) -> list[tuple[str, float]]:
    """The limits in the JSON schema of a key: ``>`` or another sign, and the number."""
    return [(sign, given(schema)[name]) for name, sign in SIGNS.items() if name in given(schema)]


def toml_value(value: Any) -> str:
    """``value`` as TOML writes it."""
    return json.dumps(value, default=str, ensure_ascii=False)


class Section(BaseModel):
    """A section of a scene: no unknown keys, no conversions, no numbers that are not finite, not to be changed."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)
