"""Meshes with tags as dolfinx writes them in XDMF files, in HDF5 or as text."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import h5py
import numpy as np
from dolfinx.cpp.io import perm_vtk

from archord.geometry.meshes.formats.beside import beside
from archord.geometry.meshes.plane_mesh import SOLID, PlaneMesh, in_basix_order
from archord.report.readable import require_memory

_SOLIDS = ("tet", "hex", "wedge", "pyramid")


def read_xdmf(path: Path) -> PlaneMesh:
    """The first grid with a geometry; sets are what other grids, or it, have as values of cells,
    lines and points, and their names are those values as text. Raises ValueError."""
    grids = [
        grid
        for grid in ElementTree.parse(path).iter("Grid")
        if grid.find("Topology/DataItem") is not None
    ]
    meshes = [grid for grid in grids if grid.find("Geometry/DataItem") is not None]
    if not meshes:
        raise ValueError("there is no grid with topology and geometry")
    topology = meshes[0].find("Topology")
    kind = "" if topology is None else topology.attrib.get("TopologyType", "").lower()
    if kind.startswith(_SOLIDS):
        raise ValueError(SOLID)
    x, cells = (_data(path, meshes[0], part) for part in ("Geometry", "Topology"))
    sets: dict[int, dict[str, np.ndarray]] = {
        1: {},
        2: {},
        cells.shape[1]: {},
    }  # by the number of nodes
    for grid in grids:
        if grid.find("Attribute[@Center='Cell']/DataItem") is None:
            continue
        entities, values = (
            _data(path, grid, "Topology"),
            _data(path, grid, "Attribute[@Center='Cell']").ravel(),
        )
        n = entities.shape[1] if entities.shape[1] in sets else 2
        for value in np.unique(values):
            if (name := str(int(value))) in sets[n]:
                raise ValueError(
                    f"two tags have the value {name}, which is to name a set: give them other values"
                )
            sets[n][name] = entities[values == value][:, : max(n, 2)]
    corners = 3 if cells.shape[1] in (3, 6, 10) else 4
    tagged = np.concatenate([cells, *sets[cells.shape[1]].values()])[:, :corners]
    _, first, which = np.unique(
        np.sort(tagged, axis=1), axis=0, return_index=True, return_inverse=True
    )
    ends = np.cumsum([len(cells), *map(len, sets[cells.shape[1]].values())])
    cell_sets = dict(
        zip(sets[cells.shape[1]], np.split(first[which.ravel()], ends[:-1])[1:], strict=True)
    )
    points = {name: nodes[:, 0] for name, nodes in sets[1].items()}
    return PlaneMesh.of_sets(
        *in_basix_order(x, cells.astype(np.int64), perm_vtk), cell_sets, sets[2], points
    )


def _data(path: Path, grid: ElementTree.Element, part: str) -> np.ndarray:
    """The numbers of a ``part`` of a ``grid``, in rows."""
    item = grid.find(f"{part}/DataItem")
    if item is None or not item.text:
        raise ValueError(f"a grid has no {part}")
    rows = int(item.attrib["Dimensions"].split()[0])
    if item.attrib.get("Format") == "HDF":
        name, _, place = item.text.strip().partition(":")
        with h5py.File(beside(path, name)) as file:
            require_memory(file[place].nbytes)
            return file[place][()].reshape(rows, -1)
    numbers = np.array(item.text.split(), dtype=float)
    return (numbers.astype(np.int64) if part == "Topology" else numbers).reshape(rows, -1)
