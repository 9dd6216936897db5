"""Scenes made in Python rather than read from a file: the same checks, the same sentences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from archord.scene.errors import InputError
from archord.scene.file import parse_scene
from archord.scene.scene import Scene


def scene_from(sections: Mapping[str, Any]) -> Scene:
    """Check ``sections``: tables or their classes, whose numbers and lists may be numpy's; None means absent.

    Raises `InputError` with one sentence per fault.
    """
    data = plain(sections)
    load = data.get("load")
    if isinstance(load, dict) and "path" in load:
        raise InputError(
            f'scene: load.path = "{load["path"]}" is for scene files alone; give the list of its targets instead.'
        )
    return parse_scene(data)


def plain(value: Any) -> Any:
    """``value`` as a TOML file would give it: tables, lists and numbers of Python."""
    if isinstance(value, BaseModel):
        value = value.model_dump(exclude_unset=True)
    if isinstance(value, Mapping):
        return {str(name): plain(part) for name, part in value.items() if part is not None}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return value.tolist() if hasattr(value, "tolist") else value
