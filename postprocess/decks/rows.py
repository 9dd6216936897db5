"""Rows of decks: numbers, names and what is too long for a line."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from archord.postprocess.decks.mesh import label, surface_name
from archord.solver.contact.interaction import Interaction

_LONGEST = 15  # entries of a row


def number(value: Any) -> str:
    """As many digits as fit into the 20 characters that CalculiX reads."""
    text = repr(float(value))
    return text if len(text) <= 20 else f"{value:.13e}"


def joined(table: Iterable[Iterable[Any]]) -> list[str]:
    """The rows of a ``table``."""
    return [", ".join(map(str, row)) for row in table]


def block(keyword: str, rows: list[str]) -> list[str]:
    """The ``rows`` below their ``keyword``; nothing where there are none."""
    return [keyword, *rows] if rows else []


def continued(entries: Iterable[Any]) -> list[str]:
    """The ``entries`` as one row, which goes on in the next line where it is too long."""
    words = list(map(str, entries))
    parts = [words[k : k + _LONGEST] for k in range(0, len(words), _LONGEST)]
    lines = [", ".join(part) for part in parts]
    return [f"{line}," for line in lines[:-1]] + lines[-1:]


def pair(interaction: Interaction) -> str:
    """The surfaces of an ``interaction``."""
    return ", ".join(f"{label(surface_name(interaction, side))}_SURFACE" for side in (0, 1))
