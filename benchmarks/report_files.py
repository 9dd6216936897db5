"""What a benchmark leaves behind: its rows as CSV, its tables as Markdown, perhaps a picture."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

Row = Mapping[str, object]
_BAR = "\\|"


def markdown_table(headings: Iterable[object], rows: Iterable[Iterable[object]]) -> list[str]:
    """The lines of a Markdown table; a bar within a cell is escaped, where it would end the cell."""
    headings = list(headings)
    return [_line(headings), "|---" * len(headings) + "|", *map(_line, rows)]


def rows_table(rows: Sequence[Row]) -> list[str]:
    """The lines of a Markdown table of ``rows``, which all have the headings of the first."""
    return markdown_table(rows[0], [row.values() for row in rows])


def write_rows(rows: Sequence[Row], path: Path) -> None:
    """Write ``rows``, which all have the headings of the first, as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def write_files(
    folder: Path, name: str, rows: Sequence[Row], markdown: str, draw: Callable[[Path], None] | None = None
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


def _line(cells: Iterable[object]) -> str:
    return f"| {' | '.join(str(cell).replace('|', _BAR) for cell in cells)} |"
