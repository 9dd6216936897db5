"""Meshes with tags as dolfinx writes them in XDMF files, in HDF5 or as text."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from xml.etree import ElementTree

import basix
import h5py
import numpy as np
from dolfinx.cpp.io import perm_vtk

from archord.geometry.basis import HEXAHEDRON, QUADRILATERAL, TETRAHEDRON, TRIANGLE, dimension_of
from archord.geometry.meshes.cells import corners_of, in_basix_order, n_corners
from archord.geometry.meshes.formats.beside import beside
from archord.geometry.meshes.mesh_arrays import MeshArrays, require_known, split
from archord.report.readable import require_memory

_KINDS = {  # by how the names of topologies start
    "tri": TRIANGLE,
    "quad": QUADRILATERAL,
    "tet": TETRAHEDRON,
    "hex": HEXAHEDRON,
}
_TAGS = "Attribute[@Center='Cell']"


def read_xdmf(path: Path) -> MeshArrays:
    """The first grid with a geometry. Raises ValueError.

    Sets are what other grids, or this one, have as values of cells, sides and points. The names of
    sets are these values as text.
    """
    grids = [
        grid
        for grid in ElementTree.parse(path).iter("Grid")
        if grid.find("Topology/DataItem") is not None
    ]
    meshes = [grid for grid in grids if grid.find("Geometry/DataItem") is not None]
    if not meshes:
        raise ValueError("there is no grid with topology and geometry")
    mesh = meshes[0]
    kind = _kind(mesh)
    d = dimension_of(kind)
    x = _data(path, mesh, "Geometry")
    cells = _data(path, mesh, "Topology")
    sets: dict[int, dict[str, np.ndarray]] = defaultdict(dict)  # by their topological dimension
    for grid in grids:
        tags = grid.findall(f"{_TAGS}[DataItem]")
        if not tags:
            continue
        if len(tags) > 1:
            names = ", ".join(tag.attrib.get("Name", "?") for tag in tags)
            raise ValueError(f"a grid has several values of each cell, {names}; leave one of them")
        of_dimension = sets[_dimension(grid)]
        entities = _data(path, grid, "Topology")
        values = _data(path, grid, _TAGS).ravel()
        for value in np.unique(values):
            name = str(int(value))
            if name in of_dimension:
                raise ValueError(
                    f"two tags have the value {name}, which is to name a set: give them other "
                    "values"
                )
            of_dimension[name] = entities[values == value]
    corners = slice(n_corners(kind))
    parts = [np.sort(part[:, corners]) for part in (cells, *sets[d].values())]
    _, first, which = np.unique(
        np.concatenate(parts), axis=0, return_index=True, return_inverse=True
    )
    _, *members = split(first[which.ravel()], parts)
    x, cells = in_basix_order(kind, x, cells.astype(np.int64), perm_vtk)
    return MeshArrays.of_sets(
        kind,
        x,
        cells,
        dict(zip(sets[d], members, strict=True)),
        {name: corners_of(kind, sides) for name, sides in sets[d - 1].items()},
        {name: nodes[:, 0] for name, nodes in sets[0].items()},
    )


def _topology(grid: ElementTree.Element) -> str:
    """The name of a grid's topology in small letters."""
    topology = grid.find("Topology")
    return "" if topology is None else topology.attrib.get("TopologyType", "").lower()


def _kind(grid: ElementTree.Element) -> basix.CellType:
    """The kind of the cells of a ``grid``. Raises ValueError."""
    name = _topology(grid)
    require_known([name.partition("_")[0]])
    for start, kind in _KINDS.items():
        if name.startswith(start):
            return kind
    raise ValueError(
        f"a grid has cells of type {name!r}; triangles, quadrilaterals, tetrahedra and hexahedra "
        "are read"
    )


def _dimension(grid: ElementTree.Element) -> int:
    """Topological dimension of what a ``grid`` has."""
    name = _topology(grid)
    for start, kind in _KINDS.items():
        if name.startswith(start):
            return dimension_of(kind)
    return 0 if name.startswith("polyvertex") else 1


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
    kind = np.int64 if part == "Topology" else np.float64
    return np.array(item.text.split(), dtype=float).astype(kind).reshape(rows, -1)
