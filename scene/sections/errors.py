"""What is said of bad input in scenes."""

from __future__ import annotations

import json
from typing import Any

from archord.report.by_name import Names


class Fault(ValueError):
    """What is ``said`` of the key at ``place``: of its section, or below sections or the names of
    tables."""

    def __init__(self, place: Names, said: str) -> None:
        super().__init__(said)
        self.place = place


def toml_value(value: Any) -> str:
    """``value`` as TOML writes it."""
    if isinstance(value, dict):
        pairs = [f"{name} = {toml_value(part)}" for name, part in value.items()]
        return f"{{{', '.join(pairs)}}}"
    return json.dumps(value, default=str, ensure_ascii=False)
