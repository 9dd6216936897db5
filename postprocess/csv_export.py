"""A run as CSV files: history, contact along the arcs, and the fields of a step; columns are headed ``name [unit]``."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from archord.output.output_file import writing
from archord.output.step_file import step_name
from archord.postprocess.export_files import check_new
from archord.postprocess.frames import cell_frame, contact_frame, node_frame, with_headings, with_units
from archord.postprocess.run_result import Run

_DIGITS = "%.12g"


def export_csv(run: Run, folder: Path, step: int | None = None, *, force: bool = False) -> tuple[list[Path], list[str]]:
    """Write history.csv, contact.csv (all steps) and nodes and cells of ``step`` (the last) into ``folder``, which is
    made if need be; the files, and a sentence for what is left out.

    Raises `InputError` if the run has no such step, a file of it is damaged, or one that would be written is there
    already and ``force`` is not given.
    """
    number = run.number(step)
    tables = {"history.csv": run.history, "contact.csv": _contact(run)}
    left_out = []
    if run.scene.output.fields:
        fields = run.fields(number)
        tables[f"nodes_{step_name(number)}.csv"] = node_frame(fields, run.scene)
        tables[f"cells_{step_name(number)}.csv"] = cell_frame(fields, run.scene)
    else:
        left_out.append("no nodes and cells: the run was solved with output.fields = false.")
    check_new([folder / name for name in tables], folder, force)
    files = []
    for name, table in tables.items():
        with writing(folder / name):
            with_headings(table).to_csv(folder / name, index=False, float_format=_DIGITS, lineterminator="\n")
        files.append(folder / name)
    return files, left_out


def _contact(run: Run) -> pd.DataFrame:
    """The contact at all steps, with step and delta before it."""
    parts = []
    for n in range(1, run.steps + 1):
        table = contact_frame(run.contact(n), run.scene)
        table.insert(0, "step", n)
        table.insert(1, "delta", run.columns["delta"][n - 1])
        parts.append(table)
    units = parts[0].attrs["units"] | {"delta": run.scene.units.length}
    return with_units(pd.concat(parts, ignore_index=True), units)
