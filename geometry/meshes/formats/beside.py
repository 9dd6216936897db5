"""Files that a mesh file names: they lie in its folder or below."""

from __future__ import annotations

import os
from pathlib import Path

from archord.report.readable import require_file


def beside(path: Path, name: str) -> Path:
    """The file ``name`` that ``path`` names. Raises ValueError for one outside the folder of
    ``path``, OSError for what is no file."""
    folder = os.path.abspath(path.parent)
    found = os.path.abspath(os.path.join(folder, name))
    if os.path.commonpath([folder, found]) != folder:
        raise ValueError(f"names the file {name!r}, which is not in its folder; put it there")
    try:
        return require_file(found)
    except OSError as error:
        raise ValueError(
            f"names the file {name!r}, which cannot be read: {error.strerror}"
        ) from None
