"""history.csv: one row per accepted output step, in the scene's units with the dimensionless forms
beside them."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from archord.measures.measure import Column
from archord.measures.record import Record
from archord.output.files.disk import replace_file

_SAME = 1e-9  # relative difference of a number in history.csv, of 12 digits, and in run.json
_NOTHING = 1e-290


def write_history(path: Path, columns: Sequence[Column], steps: Sequence[Record]) -> None:
    """Replace ``path`` by the table of ``steps`` in one move; whole numbers stay whole. Raises
    `OSError`."""
    text = io.StringIO(newline="")
    table = csv.writer(text)
    table.writerow([heading for heading, _ in columns])
    for step in steps:
        values = [value(step) for _, value in columns]
        row = [str(v) if isinstance(v, int) else f"{v:.12g}" for v in values]
        table.writerow(row)
    replace_file(path, text.getvalue())


def read_history(path: str | Path) -> dict[str, list[float]]:
    """Read the columns of a history.csv.

    Parameters
    ----------
    path : str or Path
        The file. A last row that does not end in a line break is ignored: it is of a copy cut
        short.

    Returns
    -------
    dict of str to list of float
        The columns by their names without units: "P", "P/(E* R)" and so on.

    Raises
    ------
    OSError
        For a file that cannot be read.
    ValueError
        For a file that is no table of numbers.

    Examples
    --------
    >>> from pathlib import Path
    >>> from archord.output.history import read_history
    >>> _ = Path("history.csv").write_text("step,P [N/mm]\\n1,120.5\\n2,260.0\\n")
    >>> read_history("history.csv")["P"]
    [120.5, 260.0]
    """
    text = Path(path).read_bytes().decode()
    whole = text[: text.rfind("\n") + 1]
    headings, *rows = csv.reader(io.StringIO(whole, newline=""))
    names = [heading.split(" [")[0] for heading in headings]
    if any(len(row) != len(names) for row in rows):
        raise ValueError("rows are not as long as the headings")
    return {name: [float(row[i]) for row in rows] for i, name in enumerate(names)}


def fault_of_history(columns: Mapping[str, Sequence[float]], report: Mapping[str, Any]) -> str:
    """Where the ``columns`` of a history.csv contradict the steps of the run.json ``report``, in
    words; nothing where they agree. A run that goes on or was killed may have one row more."""
    steps = report["steps"]
    rows = len(columns["step"])
    if rows < len(steps):
        return f"has {rows} of the {len(steps)} steps of run.json: it was cut short"
    if rows > len(steps) and report["status"] == "done":
        return f"has {rows} steps, run.json has {len(steps)}"
    if list(columns["step"]) != list(range(1, rows + 1)):
        return f"does not count its steps from 1 to {rows}"
    for k, step in enumerate(steps):
        values = step.get("values", step)
        lost = [name for name in step.get("values", ()) if name not in columns]
        if lost:
            return f"has no column {lost[0]!r}, which run.json has"
        for name in values.keys() & columns.keys():
            told = values[name]
            here = columns[name][k]
            if isinstance(told, int | float) and not math.isclose(
                told, here, rel_tol=_SAME, abs_tol=_NOTHING
            ):
                differing = f"{name} = {here:g} at step {k + 1}, run.json {told:g}"
                return f"has {differing}: one of the two was changed"
    return ""
