"""history.csv: one row per accepted output step, in the scene's units with the dimensionless forms beside them."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from archord.output.disk import replace_file

if TYPE_CHECKING:
    from archord.presets.account import Column


def write_history(path: Path, columns: Sequence[Column], steps: Sequence[Any]) -> None:
    """Replace ``path`` by the table of ``steps`` in one move; whole numbers stay whole. Raises `OSError`."""
    text = io.StringIO(newline="")
    table = csv.writer(text)
    table.writerow([heading for heading, _ in columns])
    for m in steps:
        values = (value(m) for _, value in columns)
        table.writerow([str(v) if isinstance(v, int) else f"{v:.12g}" for v in values])
    replace_file(path, text.getvalue())


def read_history(path: str | Path) -> dict[str, list[float]]:
    """The columns of a history.csv by name without unit: ``read_history(p)["P"]``, ``["P/(E* R)"]``, ... A last row
    that does not end in a line break (a copy cut short) is ignored."""
    text = Path(path).read_bytes().decode()
    heading, *rows = csv.reader(io.StringIO(text[: text.rfind("\n") + 1], newline=""))
    names = [h.split(" [")[0] for h in heading]
    return {name: [float(row[i]) for row in rows] for i, name in enumerate(names)}
