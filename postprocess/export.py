"""A run as files for other programs: CSV tables for anything, and .vtkhdf files for VTK's readers
(ParaView, pyvista).

In VTK the bodies keep their curved second-order cells, as fields.h5 has them. The contact is a line
through the integration points of each facet, in space a vertex at each of them; the integration
points of the bodies, where the run kept them, are vertices. All hold undeformed points and their
displacement, so that the same filters deform them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from archord.materials.material import Array
from archord.output.files.step_file import times
from archord.output.files.vtkhdf import (
    LINE,
    SECOND_ORDER,
    VERTEX,
    Arrays,
    Grid,
    in_space,
    write_vtkhdf,
)
from archord.output.files.xdmf import CELLS
from archord.output.folder import claim_folder
from archord.output.user_file import check_target, writing
from archord.postprocess.run import Run

Shown = tuple[Grid, Callable[[int], Arrays]]  # and its data at a step

_OF_CONTACT = ("pressure", "raw_pressure", "gap", "angle", "s", "slip", "shear", "sticks")


def export_csv(run: Run, folder: Path, *, force: bool = False) -> list[Path]:
    """Write history.csv and contact.csv (`Run.pressure` of all steps), headed ``name [unit]``, into
    ``folder``; returns the files. Raises `InputError` if the run has no accepted step, a file of it
    is damaged, or one that would be written is there already and ``force`` is not given."""
    import pandas as pd

    from archord.postprocess.arrays.frames import write_frame

    run.number(None)
    tables = {folder / "history.csv": run.history}
    if run.has_profiles:
        names = ["step", run.view.path_name]
        steps = {(n, load): run.pressure(n) for n, load in enumerate(run.path, 1)}
        contact = pd.concat(steps, names=names).reset_index(level=[0, 1])
        of_path = {name: run.units[name] for name in names if name in run.units}
        contact.attrs["units"] = run.pressure().attrs["units"] | of_path
        tables[folder / "contact.csv"] = contact
    _check_new(tables, folder, force)
    for file, table in tables.items():
        write_frame(table, file)
    return list(tables)


def export_vtk(
    run: Run, folder: Path, step: int | None = None, *, force: bool = False
) -> list[Path]:
    """Write all steps of ``run``, or one ``step`` alone, into ``folder``; returns the files, the
    bodies' first. Time is delta, or the load factor; the number of the step, where that does not
    only grow. Raises `InputError` as `export_csv`, and if the run wrote no fields."""
    last = run.number(step)
    steps = range(1, last + 1) if step is None else [last]
    parts = {"bodies": _bodies(run, last)}
    if run.has_profiles:
        parts["contact"] = _contact(run, last)
    if run.scene.output.fields == "points":
        parts["points"] = _points(run, last)
    files = {folder / f"{name}.vtkhdf": part for name, part in parts.items()}
    _check_new(files, folder, force)
    all_times = times(run.path)
    at = {n: all_times[n - 1] for n in steps}
    for file, (grid, values) in files.items():
        with writing(file) as new:
            write_vtkhdf(new, grid, at, values)
    return list(files)


def _bodies(run: Run, step: int) -> Shown:
    """All bodies, and their data at a step."""
    mesh = run.fields(step)
    kind = SECOND_ORDER[mesh.cells.shape[1]]
    grid = Grid(in_space(mesh.coordinates), mesh.cells, kind, {"CellData/body": mesh.body})

    def values(step: int) -> Arrays:
        fields = run.fields(step)
        found = {"PointData/displacement": in_space(fields.displacement)}
        for name, nodal in (fields.nodal | fields.nodal_fields()).items():
            found[f"PointData/{name}"] = _for_vtk(nodal)
        for name, means in fields.cell.items():
            found[f"CellData/{name}"] = _for_vtk(means)
        return found

    return grid, values


def _contact(run: Run, step: int) -> Shown:
    """The integration points of the surfaces, in a plane joined by lines within each facet, and
    their data at a step; ``side`` counts the surfaces from 1, of a joint pin and hole."""
    table = run.pressure(step)
    facet = table["facet"].to_numpy()
    side = table["side"].map(run.sides.index).to_numpy(np.int8) + 1
    axes = [axis for axis in "xyz" if axis in table]
    if len(axes) == 3:
        cells = np.arange(len(table))[:, None]
    else:
        first = np.flatnonzero((np.diff(facet) == 0) & (np.diff(side) == 0))
        cells = np.stack([first, first + 1], axis=1)
    kind = VERTEX if len(axes) == 3 else LINE
    grid = Grid(in_space(table[axes].to_numpy()), cells, kind, {"PointData/side": side})
    displacements = [f"u{axis}" for axis in axes]

    def values(step: int) -> Arrays:
        table = run.pressure(step)
        found = {"PointData/displacement": in_space(table[displacements].to_numpy())}
        for name in _OF_CONTACT:
            if name in table:
                found[f"PointData/{name}"] = table[name].to_numpy()
        return found

    return grid, values


def _points(run: Run, step: int) -> Shown:
    """A vertex for each integration point, and their data at a step; they move as the second-order
    cells around them."""
    from archord.geometry.basis import (
        HEXAHEDRON,
        QUADRILATERAL,
        TETRAHEDRON,
        TRIANGLE,
        bulk_quadrature,
        tabulate,
    )
    from archord.geometry.meshes.cells import in_mirror

    mesh = run.fields(step)
    x = run.points(step)["coordinates"]
    is_point = ~np.isnan(x).any(axis=-1)  # cells of fewer points than others have none behind
    kinds = {6: TRIANGLE, 9: QUADRILATERAL, 10: TETRAHEDRON, 27: HEXAHEDRON}
    kind = kinds[mesh.cells.shape[1]]
    _, in_vtk_order = CELLS[mesh.cells.shape[1]]
    cells = mesh.cells[:, np.argsort(in_vtk_order)]
    nodes = mesh.coordinates[cells]
    n_points = is_point.sum(axis=1)
    groups = []  # of cells with the same points, and the basis there
    for full in (False, True):
        points, _ = bulk_quadrature(kind, run.scene.analysis.degree, full=full)
        of_rule = np.flatnonzero(n_points == len(points))
        places = x[of_rule, : len(points)]
        bases = [tabulate(kind, 2, X)[0] for X in (points, in_mirror(points))]
        off = [np.abs(basis @ nodes[of_rule] - places).sum(axis=(1, 2)) for basis in bases]
        nearest = np.argmin(off, axis=0)  # cells that were mirrored count their nodes otherwise
        groups += [(of_rule[nearest == k], basis) for k, basis in enumerate(bases)]
    cell, _ = np.nonzero(is_point)
    vertices = np.arange(len(cell))[:, None]
    grid = Grid(in_space(x[is_point]), vertices, VERTEX, {"CellData/body": mesh.body[cell]})

    def values(step: int) -> Arrays:
        nodal = run.fields(step).displacement[cells]
        displacement = np.zeros_like(x)
        for of_group, basis in groups:
            displacement[of_group, : len(basis)] = basis @ nodal[of_group]
        found = {"PointData/displacement": in_space(displacement[is_point])}
        at_points = run.points(step)
        del at_points["coordinates"]
        for name, array in at_points.items():
            found[f"PointData/{name}"] = _for_vtk(array[is_point])
        return found

    return grid, values


def _for_vtk(values: Array) -> Array:
    """Tensors ``(n, 4)`` with the components of VTK: xx, yy, zz, xy, yz, xz, as tensors in space
    have them; others as they are."""
    return np.pad(values, ((0, 0), (0, 2))) if values.shape[1:] == (4,) else values


def _check_new(files: Iterable[Path], folder: Path, force: bool) -> None:
    """Make ``folder`` and check that all ``files`` in it can be written. Raises `InputError`."""
    claim_folder(folder, force=True)
    for file in files:
        check_target(file, (), force=force)
