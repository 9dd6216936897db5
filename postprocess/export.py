"""A run as files for other programs: CSV tables for anything, and .vtkhdf files for VTK's readers
(ParaView, pyvista).

In VTK the bodies keep their curved second-order cells, as fields.h5 has them. The contact is a line
through the integration points of each facet, undeformed like the mesh, with the displacement of the
points, so that the same filters deform both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from archord.materials.material import Array
from archord.output.files.vtkhdf import LINE, SECOND_ORDER, Arrays, Grid, VtkHdf, times
from archord.output.folder import claim_folder
from archord.output.user_file import check_target, writing
from archord.postprocess.run import Run

_DATA_OF_ARC = ("pressure", "raw_pressure", "gap", "angle", "s")


def export_csv(run: Run, folder: Path, *, force: bool = False) -> list[Path]:
    """Write history.csv and contact.csv (`Run.pressure` of all steps), headed ``name [unit]``, into
    ``folder``; returns the files. Raises `InputError` if the run has no accepted step, a file of it
    is damaged, or one that would be written is there already and ``force`` is not given."""
    import pandas as pd

    from archord.postprocess.frames import with_headings

    run.number(None)
    tables = {folder / "history.csv": run.history}
    if run.has_contact:
        names = ["step", "delta" if run.is_joint else "load_factor"]
        steps = {(n, load): run.pressure(n) for n, load in enumerate(run.path, 1)}
        contact = pd.concat(steps, names=names).reset_index(level=[0, 1])
        contact.attrs["units"] = run.pressure().attrs["units"] | {
            n: run.units[n] for n in names if n in run.units
        }
        tables[folder / "contact.csv"] = contact
    _check_new(tables, folder, force)
    for file, table in tables.items():
        with writing(file) as new:
            with_headings(table).to_csv(new, index=False, float_format="%.12g", lineterminator="\n")
    return list(tables)


def export_vtk(
    run: Run, folder: Path, step: int | None = None, *, force: bool = False
) -> list[Path]:
    """Write all steps of ``run``, or one ``step`` alone, into ``folder``; returns the files, the
    bodies' first. Time is delta, or the load factor; the number of the step, where that does not
    only grow. Raises `InputError` as `export_csv`, and if the run wrote no fields."""
    steps = [run.number(step)] if step is not None else range(1, run.number(None) + 1)
    parts = {"bodies": _bodies(run, steps[-1])} | (
        {"contact": _contact(run, steps[-1])} if run.has_contact else {}
    )
    files = {folder / f"{name}.vtkhdf": part for name, part in parts.items()}
    _check_new(files, folder, force)
    at = [times(run.path)[n - 1] for n in steps]
    for file, (grid, values) in files.items():
        with writing(file) as new:
            whole = VtkHdf(new, grid, len(steps))
            for k, n in enumerate(steps, 1):
                whole.write(at[:k], values(n))
    return list(files)


def _bodies(run: Run, step: int) -> tuple[Grid, Callable[[int], Arrays]]:
    """All bodies, and their data at a step."""
    mesh = run.fields(step)
    grid = Grid(
        _in_space(mesh.coordinates),
        [(SECOND_ORDER[mesh.cells.shape[1]], mesh.cells)],
        {"CellData/body": mesh.body},
    )

    def values(step: int) -> Arrays:
        fields = run.fields(step)
        nodal = {"displacement": _in_space(fields.displacement)} | fields.nodal_fields()
        found = {f"PointData/{name}": value for name, value in nodal.items()}
        return found | {f"CellData/{name}": value for name, value in fields.cell_fields().items()}

    return grid, values


def _contact(run: Run, step: int) -> tuple[Grid, Callable[[int], Arrays]]:
    """The integration points of the arcs, joined by lines within each facet, and their data at a
    step; ``side`` is 1 on the pin and 2 on the hole, or counts the surfaces."""
    table = run.pressure(step)
    sides = ["pin", "hole"] if run.is_joint else list(table["side"].unique())
    facet, side = table["facet"].to_numpy(), table["side"].map(sides.index).to_numpy(np.int8) + 1
    first = np.flatnonzero((np.diff(facet) == 0) & (np.diff(side) == 0))
    lines = [(LINE, np.stack([first, first + 1], axis=1))]
    grid = Grid(_in_space(table[["x", "y"]].to_numpy()), lines, {"PointData/side": side})

    def values(step: int) -> Arrays:
        table = run.pressure(step)
        data = {"displacement": _in_space(table[["ux", "uy"]].to_numpy())}
        data |= {name: table[name].to_numpy() for name in _DATA_OF_ARC if name in table}
        return {f"PointData/{name}": value for name, value in data.items()}

    return grid, values


def _in_space(values: Array) -> Array:
    return np.pad(values, ((0, 0), (0, 1)))


def _check_new(files: Iterable[Path], folder: Path, force: bool) -> None:
    """Make ``folder`` and check that all ``files`` in it can be written. Raises `InputError`."""
    claim_folder(folder, force=True)
    for file in files:
        check_target(file, (), force=force)
