"""What all rooms pass on: names, and values by their names, as keys of a file or columns."""

from __future__ import annotations

from typing import Any

Names = tuple[str, ...]
ByName = dict[str, Any]
Words = dict[str, str]  # by their names
Amounts = dict[str, float]  # the same
