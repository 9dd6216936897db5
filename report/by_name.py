"""Values by their names, which all rooms pass on: keys of a file, arguments, columns."""

from __future__ import annotations

from typing import Any

ByName = dict[str, Any]
