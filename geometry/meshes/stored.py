"""Meshes of archord's own in .npz files: the arrays of `MeshArrays`, and as JSON the kind of its
cells and the names of its sets. Nothing is pickled."""

from __future__ import annotations

import json
from pathlib import Path
from typing import BinaryIO

import basix
import numpy as np

from archord.geometry.basis import QUADRILATERAL, TRIANGLE, dimension_of, order_of
from archord.geometry.meshes.cells import sides_of
from archord.geometry.meshes.mesh_arrays import MeshArrays, coordinates
from archord.report.by_name import ByName

# the arrays of a file, each with the kind of its numbers and its dimension
_ARRAYS = {
    "x": ("f", 2),
    "cells": ("i", 2),
    "bodies": ("i", 1),
    "edges": ("i", 2),
    "tags": ("i", 1),
}
_NAMES = {"edges": "facets"}  # in files, and here
_KIND = "kind"
_KINDS = ("triangle", "quadrilateral", "tetrahedron", "hexahedron")
# cells in files of archord 0.2, which do not name their kind, by their number of nodes
_KIND_IN_OLD_FILES = dict.fromkeys((3, 6, 10), TRIANGLE) | dict.fromkeys((4, 9, 16), QUADRILATERAL)


def store_mesh(mesh: MeshArrays, file: BinaryIO) -> None:
    """Write ``mesh`` to ``file``. `stored_mesh` reads it to the last bit, its sets in their
    order."""
    words = {
        _KIND: mesh.kind.name,
        "cell_sets": mesh.cell_sets,
        "facet_sets": mesh.facet_sets,
        "point_sets": {name: nodes.tolist() for name, nodes in mesh.point_sets.items()},
        "notes": mesh.notes,
    }
    sets = np.frombuffer(json.dumps(words).encode(), dtype=np.uint8)
    arrays = {name: getattr(mesh, _NAMES.get(name, name)) for name in _ARRAYS}
    np.savez(file, sets=sets, **arrays)


def stored_mesh(path: Path) -> MeshArrays:
    """The mesh that `store_mesh` wrote to ``path``. Raises ValueError for anything else."""
    with np.load(path, allow_pickle=False) as file:
        if not {"sets", *_ARRAYS} <= set(getattr(file, "files", ())):
            raise ValueError("is no mesh that archord wrote")
        arrays = {name: file[name] for name in _ARRAYS}
        words = json.loads(file["sets"].tobytes())
    found = {name: (array.dtype.kind, array.ndim) for name, array in arrays.items()}
    shapes_fit = found == _ARRAYS
    kind = _kind_of(words, arrays["cells"].shape[1]) if shapes_fit else None
    if kind is None or arrays["x"].shape[1] != dimension_of(kind):
        raise ValueError("has arrays of other shapes than a mesh has")
    cell_sets, facet_sets = (
        {name: tuple(tags) for name, tags in words[sets].items()}
        for sets in ("cell_sets", "facet_sets")
    )
    points = {name: np.array(nodes, dtype=np.int64) for name, nodes in words["point_sets"].items()}
    coordinates(arrays["x"], dimension_of(kind))
    own = {_NAMES.get(name, name): array for name, array in arrays.items()}
    mesh = MeshArrays(
        kind=kind,
        **own,
        cell_sets=cell_sets,
        facet_sets=facet_sets,
        point_sets=points,
        notes=tuple(words.get("notes", ())),
    )
    _require_whole(mesh)
    return mesh


def _kind_of(words: ByName, nodes: int) -> basix.CellType:
    """The kind of the cells, each of so many ``nodes``. Raises ValueError."""
    old = _KIND_IN_OLD_FILES.get(nodes)
    name = words.get(_KIND, old and old.name)
    if name not in _KINDS:
        raise ValueError("has cells of no kind that is known")
    return basix.CellType[name]


def _require_whole(mesh: MeshArrays) -> None:
    """Raise ValueError for arrays and sets that do not fit together."""
    order_of(mesh.kind, mesh.cells.shape[1])
    side = sides_of(mesh.kind, mesh.cells[:1])
    used = np.concatenate([mesh.cells.ravel(), mesh.facets.ravel(), *mesh.point_sets.values()])
    is_whole = (
        len(mesh.cells) > 0
        and len(mesh.cells) == len(mesh.bodies)
        and len(mesh.facets) == len(mesh.tags)
        and mesh.facets.shape[1] == side.shape[1]
        and used.min() >= 0
        and used.max() < len(mesh.x)
    )
    if not is_whole:
        raise ValueError("has cells, edges or sets that do not fit together")
