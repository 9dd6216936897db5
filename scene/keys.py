"""What the sections of a scene are made of: documented keys with a unit, a default, limits and an example."""

from __future__ import annotations

import json
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

LINE = r"^[^\x00-\x1f]*$"  # a pattern: text on one line
SEPARATOR = "\0"  # of the parts of a key
Positive = Annotated[float, Field(gt=0)]


def key(
    description: str, unit: str = "", *, default: Any = ..., example: Any = None, other: Any = None, **limits: Any
) -> Any:
    """A documented key; its ``unit`` is the scene's unit of that kind. ``--example`` shows ``example``, by default the
    ``default``, or commented out what ``other`` scenes may say."""
    shown = example if other is None else other
    extra: Any = {"unit": unit, "shown": default if shown is None else shown, "hidden": other is not None}
    return Field(default, description=description, json_schema_extra=extra, **limits)


def require(holds: bool, name: str | tuple[str, ...], said: str) -> None:
    """Raise ValueError unless it ``holds`` what is ``said`` of the key ``name``: "section.key", or the section, the
    name of one of its tables and the key there."""
    if not holds:
        raise ValueError(f"{name if isinstance(name, str) else SEPARATOR.join(name)}|{said}")


def toml_value(value: Any) -> str:
    """``value`` as TOML writes it."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{name} = {toml_value(part)}' for name, part in value.items())}}}"
    return json.dumps(value, default=str, ensure_ascii=False)


class Section(BaseModel):
    """A section of a scene: no unknown keys, no conversions, no numbers that are not finite, not to be changed."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True, defer_build=True)
