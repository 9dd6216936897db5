"""A run as files for other programs: CSV tables for anything, and .vtu files for VTK's readers (ParaView, pyvista).

In VTK the bodies keep their curved second-order triangles (VTK_QUADRATIC_TRIANGLE) with the nodal displacement and the
means of the cells. The contact is a line through the integration points of each facet, undeformed like the mesh, with
the pressure, the gap and the displacement of the points, so that the same filters deform both.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import numpy as np

from archord.output.step_file import step_name
from archord.output.user_file import check_output, make_folder, writing
from archord.postprocess.fields import Fields
from archord.postprocess.run import Run
from archord.scene.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

_DATA_OF_ARC = ("pressure", "raw_pressure", "gap", "angle", "s")


def export_csv(run: Run, folder: Path, step: int | None = None, *, force: bool = False) -> list[Path]:
    """Write history.csv, contact.csv (all steps) and, of a run with fields, nodes and cells of ``step`` (the last) into
    ``folder``, which is made if need be; returns the files. Columns are headed ``name [unit]``.

    Raises `InputError` if the run has no such step, a file of it is damaged, or one that would be written is there
    already and ``force`` is not given.
    """
    from archord.postprocess.frames import cell_frame, node_frame, with_headings

    number = run.number(step)
    tables = {"history.csv": run.history, "contact.csv": _contact_of_all_steps(run)}
    if run.scene.output.fields:
        fields = run.fields(number)
        tables[f"nodes_{step_name(number)}.csv"] = node_frame(fields, run.scene)
        tables[f"cells_{step_name(number)}.csv"] = cell_frame(fields, run.scene)
    files = [folder / name for name in tables]
    _check_new(files, folder, force)
    for file, table in zip(files, tables.values(), strict=True):
        with writing(file):
            with_headings(table).to_csv(file, index=False, float_format="%.12g", lineterminator="\n")
    return files


def _contact_of_all_steps(run: Run) -> pd.DataFrame:
    """The contact with step and delta before it."""
    import pandas as pd

    parts = {(n, delta): run.pressure(n) for n, delta in enumerate(run.columns["delta"], 1)}
    table = pd.concat(parts, names=["step", "delta"]).reset_index(level=[0, 1])
    table.attrs["units"] = run.pressure().attrs["units"] | {"delta": run.scene.units.length}
    return table


def export_vtk(run: Run, folder: Path, step: int | None = None, *, force: bool = False) -> list[Path]:
    """Write all steps of ``run``, or one ``step`` alone, into ``folder``, which is made if need be; returns the files,
    the .pvd first. Time is delta; the number of the step, where delta does not only grow.

    Raises `InputError` if the run wrote no fields or has no such step, a file of it is damaged, or one that would be
    written is there already and ``force`` is not given.
    """
    import meshio

    steps = [run.number(step)] if step is not None else list(range(1, run.number(None) + 1))
    run.fields(steps[-1])
    names = {n: [f"{part}_{step_name(n)}.vtu" for part in ("bodies", "contact")] for n in steps}
    files = [folder / name for name in ("run.pvd", *(name for both in names.values() for name in both))]
    _check_new(files, folder, force)
    delta = run.columns["delta"]
    grows = all(a < b for a, b in pairwise(delta))
    entries = ""
    for n, both in names.items():
        time = delta[n - 1] if grows else float(n)
        for part, (name, mesh) in enumerate(zip(both, (_bodies(run.fields(n)), _contact(run, n)), strict=True)):
            with writing(folder / name):
                meshio.Mesh(**mesh).write(folder / name)
            called = quoteattr(name.partition("_")[0])
            entries += f'<DataSet timestep="{time!r}" part="{part}" name={called} file={quoteattr(name)}/>\n'
    text = f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n{entries}</Collection>\n'
    with writing(files[0]):
        files[0].write_text(f"{text}</VTKFile>\n", encoding="utf-8")
    return files


def _bodies(fields: Fields) -> dict:
    """Both bodies: points, second-order triangles and their data, as meshio takes them."""
    return {
        "points": np.pad(fields.coordinates, ((0, 0), (0, 1))),
        "cells": [("triangle6", fields.cells)],
        "point_data": {"displacement": np.pad(fields.displacement, ((0, 0), (0, 1)))},
        "cell_data": {"body": [fields.body], **{name: [value] for name, value in fields.cell_fields().items()}},
    }


def _contact(run: Run, step: int) -> dict:
    """The integration points of the arcs, joined by lines within each facet, and their data; ``side`` is 1 on the pin
    and 2 on the hole."""
    table = run.pressure(step)
    facet, side = table["facet"].to_numpy(), (table["side"] == "hole").to_numpy(np.int8) + 1
    first = np.flatnonzero((np.diff(facet) == 0) & (np.diff(side) == 0))
    data = {name: table[name].to_numpy() for name in _DATA_OF_ARC}
    return {
        "points": np.pad(table[["x", "y"]], ((0, 0), (0, 1))),
        "cells": [("line", np.stack([first, first + 1], axis=1))],
        "point_data": {"displacement": np.pad(table[["ux", "uy"]], ((0, 0), (0, 1))), "side": side, **data},
    }


def _check_new(files: Sequence[Path], folder: Path, force: bool) -> None:
    """Make ``folder`` and check that all ``files`` in it can be written, over others only with ``force``.

    Raises `InputError`.
    """
    present = [file for file in files if file.exists()]
    if present and not force:
        more = f" (and {len(present) - 1} more)" if len(present) > 1 else ""
        raise InputError(f"{present[0]}: is there already{more}; choose another folder, or overwrite with --force.")
    make_folder(folder)
    for file in files:
        check_output(file)
