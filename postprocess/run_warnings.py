"""What a run warned about, said briefly."""

from __future__ import annotations

import re


def first_of_each_kind(warnings: list[str]) -> list[str]:
    """Each kind of warning once, at the first step that gave it; kinds differ in more than their numbers."""
    first: dict[str, str] = {}
    for warning in warnings:
        kind = re.sub(r"[0-9.e+-]+", "#", warning.partition(": ")[2])
        first.setdefault(kind, warning)
    return list(first.values())
