"""A run as files for other programs: CSV tables for anything, and .vtu files for VTK's readers (ParaView, pyvista).

In VTK the bodies keep their curved second-order cells. The contact is a line through the integration points of each
facet, undeformed like the mesh, with the displacement of the points, so that the same filters deform both.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

import numpy as np

from archord.output.folder import claim_folder
from archord.output.step_file import step_name
from archord.output.user_file import check_target, writing
from archord.postprocess.fields import Fields
from archord.postprocess.run import Run

_DATA_OF_ARC = ("pressure", "raw_pressure", "gap", "angle", "s")


def export_csv(run: Run, folder: Path, *, force: bool = False) -> list[Path]:
    """Write history.csv and contact.csv (`Run.pressure` of all steps), headed ``name [unit]``, into ``folder``; returns
    the files. Raises `InputError` if the run has no accepted step, a file of it is damaged, or one that would be
    written is there already and ``force`` is not given."""
    import pandas as pd

    from archord.postprocess.frames import with_headings

    run.number(None)
    tables = {folder / "history.csv": run.history}
    if run.has_contact:
        names = ["step", "delta" if run.is_joint else "load_factor"]
        steps = {(n, load): run.pressure(n) for n, load in enumerate(run.path, 1)}
        contact = pd.concat(steps, names=names).reset_index(level=[0, 1])
        contact.attrs["units"] = run.pressure().attrs["units"] | {n: run.units[n] for n in names if n in run.units}
        tables[folder / "contact.csv"] = contact
    _check_new(tables, folder, force)
    for file, table in tables.items():
        with writing(file):
            with_headings(table).to_csv(file, index=False, float_format="%.12g", lineterminator="\n")
    return list(tables)


def export_vtk(run: Run, folder: Path, step: int | None = None, *, force: bool = False) -> list[Path]:
    """Write all steps of ``run``, or one ``step`` alone, into ``folder``; returns the files, the .pvd first. Time is
    delta, or the load factor; the number of the step, where that does not only grow. Raises `InputError` as
    `export_csv`, and if the run wrote no fields."""
    import meshio

    steps = [run.number(step)] if step is not None else range(1, run.number(None) + 1)
    run.fields(steps[-1])
    parts = ("bodies", "contact")[: 1 + run.has_contact]
    files = {(n, part): folder / f"{part}_{step_name(n)}.vtu" for n in steps for part in parts}
    collection, delta, entries = folder / "run.pvd", run.path, ""
    _check_new([collection, *files.values()], folder, force)
    grows = all(a < b for a, b in pairwise(delta))
    for (n, part), file in files.items():
        mesh = _bodies(run.fields(n)) if part == "bodies" else _contact(run, n)
        with writing(file):
            meshio.Mesh(**mesh).write(file)
        time, number = delta[n - 1] if grows else float(n), int(part == "contact")
        entries += f'<DataSet timestep="{time!r}" part="{number}" name="{part}" file="{file.name}"/>\n'
    text = f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n{entries}</Collection>\n'
    with writing(collection):
        collection.write_text(f"{text}</VTKFile>\n", encoding="utf-8")
    return [collection, *files.values()]


def _bodies(fields: Fields) -> dict:
    """All bodies, as meshio takes them."""
    return {
        "points": np.pad(fields.coordinates, ((0, 0), (0, 1))),
        "cells": [({6: "triangle6", 9: "quad9"}[fields.cells.shape[1]], fields.cells)],
        "point_data": {"displacement": np.pad(fields.displacement, ((0, 0), (0, 1)))} | fields.nodal_fields(),
        "cell_data": {"body": [fields.body], **{name: [value] for name, value in fields.cell_fields().items()}},
    }


def _contact(run: Run, step: int) -> dict:
    """The integration points of the arcs, joined by lines within each facet, and their data; ``side`` is 1 on the pin
    and 2 on the hole, or counts the surfaces."""
    table = run.pressure(step)
    sides = ["pin", "hole"] if run.is_joint else list(table["side"].unique())
    facet, side = table["facet"].to_numpy(), table["side"].map(sides.index).to_numpy(np.int8) + 1
    first = np.flatnonzero((np.diff(facet) == 0) & (np.diff(side) == 0))
    data = {name: table[name].to_numpy() for name in _DATA_OF_ARC if name in table}
    return {
        "points": np.pad(table[["x", "y"]], ((0, 0), (0, 1))),
        "cells": [("line", np.stack([first, first + 1], axis=1))],
        "point_data": {"displacement": np.pad(table[["ux", "uy"]], ((0, 0), (0, 1))), "side": side, **data},
    }


def _check_new(files: Iterable[Path], folder: Path, force: bool) -> None:
    """Make ``folder`` and check that all ``files`` in it can be written. Raises `InputError`."""
    claim_folder(folder, force=True)
    for file in files:
        check_target(file, (), force=force)
