"""Meshes with tags as dolfinx writes them in XDMF files, in HDF5 or as text."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import h5py
import numpy as np
from dolfinx.cpp.io import perm_vtk

from archord.geometry.meshes.plane_mesh import PlaneMesh, in_basix_order


def read_xdmf(path: Path) -> PlaneMesh:
    """The first grid with a geometry; sets are what other grids, or it, have as values of cells and of lines, and
    their names are those values as text. Raises ValueError."""
    grids = [grid for grid in ElementTree.parse(path).iter("Grid") if grid.find("Topology/DataItem") is not None]
    meshes = [grid for grid in grids if grid.find("Geometry/DataItem") is not None]
    if not meshes:
        raise ValueError("there is no grid with topology and geometry")
    x, cells = (_data(path, meshes[0], part) for part in ("Geometry", "Topology"))
    corners = 3 if cells.shape[1] in (3, 6, 10) else 4
    cell_sets: dict[str, np.ndarray] = {}
    facet_sets: dict[str, np.ndarray] = {}
    for grid in grids:
        if grid.find("Attribute[@Center='Cell']/DataItem") is None:
            continue
        entities, values = _data(path, grid, "Topology"), _data(path, grid, "Attribute[@Center='Cell']").ravel()
        if entities.shape[1] == cells.shape[1]:
            vertices = np.sort(np.concatenate([cells[:, :corners], entities[:, :corners]]), axis=1)
            _, first, which = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
            found = first[which.ravel()[len(cells) :]]
            cell_sets |= {f"{value:g}": found[values == value] for value in np.unique(values)}
        else:
            facet_sets |= {f"{value:g}": entities[values == value, :2] for value in np.unique(values)}
    return PlaneMesh.of_sets(*in_basix_order(x, cells.astype(np.int64), perm_vtk), cell_sets, facet_sets, {})


def _data(path: Path, grid: ElementTree.Element, part: str) -> np.ndarray:
    """The numbers of a ``part`` of a ``grid``, in rows."""
    item = grid.find(f"{part}/DataItem")
    if item is None or not item.text:
        raise ValueError(f"a grid has no {part}")
    rows = int(item.attrib["Dimensions"].split()[0])
    if item.attrib.get("Format") == "HDF":
        name, _, place = item.text.strip().partition(":")
        with h5py.File(path.parent / name) as file:
            return file[place][()].reshape(rows, -1)
    numbers = np.array(item.text.split(), dtype=float)
    return (numbers.astype(np.int64) if part == "Topology" else numbers).reshape(rows, -1)
