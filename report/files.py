"""What a benchmark leaves behind: its rows as CSV, its tables as Markdown, perhaps a picture."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

Row = Mapping[str, object]


def write_rows(rows: Sequence[Row], path: Path) -> None:
    """Write ``rows``, at least one, which all have the headings of the first, as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def write_report(
    folder: Path, name: str, rows: Sequence[Row], markdown: str, draw: Callable[[Path], object] | None = None
) -> list[Path]:
    """Write ``name``.csv (the rows), ``name``.md and, if there is ``draw`` for it, ``name``.png into ``folder``, which
    is made if it is not there; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"{name}.csv", folder / f"{name}.md"]
    write_rows(rows, files[0])
    files[1].write_text(markdown, encoding="utf-8")
    if draw is not None:
        files.append(folder / f"{name}.png")
        draw(files[-1])
    return files
