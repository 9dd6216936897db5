"""Tables, on a terminal and as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any


def in_digits(value: Any, digits: int) -> float:
    """The ``value`` as it is written in so many digits."""
    return float(f"{value:.{digits}g}")


class Table:
    """Rows of cells under ``headings``; ``str()`` is the table in aligned columns, `markdown` the
    table of a document.

    The first ``left`` columns hold text, the others numbers, which are aligned on the right. Cells
    may be anything that has a `str`. A heading may end in the format of the numbers below it, as
    ``"error {:.1e}"`` does; text below it stays as it is.
    """

    def __init__(
        self, *headings: str, rows: Iterable[Iterable[object]] = (), left: int = 0
    ) -> None:
        parts = [heading.partition(" {:") for heading in headings]
        self.headings = [heading for heading, _, _ in parts]
        self.formats = [form.rstrip("}") for _, _, form in parts]
        self.left = left
        self.rows: list[list[str]] = []
        for row in rows:
            self.add(*row)

    @classmethod
    def of(cls, rows: Sequence[Mapping[str, object]], left: int = 0) -> Table:
        """The table of ``rows``, at least one, which all have the headings of the first."""
        return cls(*rows[0], rows=[row.values() for row in rows], left=left)

    def add(self, *cells: object) -> None:
        """Add a row. Raises `ValueError` if it is not as long as the headings."""
        if len(cells) != len(self.headings):
            raise ValueError(f"a row of {len(cells)} cells under {len(self.headings)} headings")
        pairs = zip(cells, self.formats, strict=True)
        self.rows.append([str(x) if isinstance(x, str) else format(x, form) for x, form in pairs])

    def __str__(self) -> str:
        """In columns two spaces apart; without a line of headings where all are empty."""
        lines = [self.headings, *self.rows] if any(self.headings) else self.rows
        columns = []
        for k, cells in enumerate(zip(*lines, strict=True)):
            width = max(map(len, cells))
            aligned = str.ljust if k < self.left else str.rjust
            columns.append([aligned(cell, width) for cell in cells])
        aligned_lines = zip(*columns, strict=True)
        return "\n".join("  ".join(line).rstrip() for line in aligned_lines)

    def within(self, width: int) -> str:
        """As `str`, but in blocks of columns that are no wider than ``width``, each beginning with
        the first column."""
        lines = [self.headings, *self.rows]
        wide = [2 + max(map(len, column)) for column in zip(*lines, strict=True)]
        room = width + 2 - wide[0]
        blocks: list[list[int]] = [[]]
        for k in range(1, len(wide)):
            if blocks[-1] and sum(wide[j] for j in blocks[-1]) + wide[k] > room:
                blocks.append([])
            blocks[-1].append(k)
        parts = []
        for block in blocks:
            columns = [0, *block]
            headings = [self.headings[k] for k in columns]
            rows = ([row[k] for k in columns] for row in self.rows)
            part = Table(*headings, rows=rows, left=self.left)
            parts.append(str(part))
        return "\n\n".join(parts)

    def markdown(self) -> str:
        """As Markdown, a bar within a cell escaped, with a line break at the end."""
        lines = [_line(self.headings), "|---" * len(self.headings) + "|", *map(_line, self.rows)]
        return "\n".join(lines) + "\n"


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
