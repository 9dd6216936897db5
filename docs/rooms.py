"""The files of every room, with the first sentence of each docstring: ``python3 docs/rooms.py``."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PLAN = ROOT / "docs" / "architecture.md"


def rooms() -> list[str]:
    """The folders of code that the table of rooms in architecture.md names, in its order."""
    return re.findall(r"^\| `([\w/]+)/` \|", PLAN.read_text(encoding="utf-8"), re.M)


def sentence(file: Path) -> str:
    """The first sentence of a file's docstring, on one line."""
    docstring = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    text = " ".join(docstring.partition("\n\n")[0].split())
    return re.split(r"(?<=[.])\s", text)[0].rstrip(".")


def listed() -> Iterator[str]:
    """A Markdown list of every room's files."""
    for room in rooms():
        files = sorted((ROOT / room).glob("*.py"))
        lines = [f"- `{f.name}`: {sentence(f)}" for f in files if f.name != "__init__.py"]
        if lines:
            yield "\n".join([f"**`{room}/`**\n", *lines, ""])


if __name__ == "__main__":
    print("\n".join(listed()))
