"""Meshes of archord's own in .npz files: the arrays of a `PlaneMesh`, and as JSON the kind of its
cells and the names of its sets. Nothing is pickled."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, BinaryIO

import basix
import numpy as np

from archord.geometry.basis import QUADRILATERAL, TRIANGLE, order_of
from archord.geometry.meshes.plane_mesh import PlaneMesh, flat

# the arrays, each with the kind of its numbers and its dimension
_ARRAYS = {
    "x": ("f", 2),
    "cells": ("i", 2),
    "bodies": ("i", 1),
    "edges": ("i", 2),
    "tags": ("i", 1),
}
_KIND = "kind"
# cells in files of archord 0.2, which do not name their kind, by their number of nodes
_KIND_IN_OLD_FILES = dict.fromkeys((3, 6, 10), TRIANGLE) | dict.fromkeys((4, 9, 16), QUADRILATERAL)


def store_mesh(mesh: PlaneMesh, file: BinaryIO) -> None:
    """Write ``mesh`` to ``file``. `stored_mesh` reads it to the last bit, its sets in their
    order."""
    words = {
        _KIND: mesh.kind.name,
        "cell_sets": mesh.cell_sets,
        "facet_sets": mesh.facet_sets,
        "point_sets": {name: nodes.tolist() for name, nodes in mesh.point_sets.items()},
    }
    sets = np.frombuffer(json.dumps(words).encode(), dtype=np.uint8)
    np.savez(file, sets=sets, **{name: getattr(mesh, name) for name in _ARRAYS})


def stored_mesh(path: Path) -> PlaneMesh:
    """The mesh that `store_mesh` wrote to ``path``. Raises ValueError for anything else."""
    with np.load(path, allow_pickle=False) as file:
        if not {"sets", *_ARRAYS} <= set(getattr(file, "files", ())):
            raise ValueError("is no mesh that archord wrote")
        arrays = {name: file[name] for name in _ARRAYS}
        words = json.loads(file["sets"].tobytes())
    found = {name: (array.dtype.kind, array.ndim) for name, array in arrays.items()}
    if found != _ARRAYS or arrays["x"].shape[1] != 2:
        raise ValueError("has arrays of other shapes than a mesh has")
    kind = _kind_of(words, arrays["cells"].shape[1])
    cell_sets, facet_sets = (
        {name: tuple(tags) for name, tags in words[sets].items()}
        for sets in ("cell_sets", "facet_sets")
    )
    points = {name: np.array(nodes, dtype=np.int64) for name, nodes in words["point_sets"].items()}
    flat(arrays["x"])
    mesh = PlaneMesh(
        kind=kind, **arrays, cell_sets=cell_sets, facet_sets=facet_sets, point_sets=points
    )
    _require_whole(mesh)
    return mesh


def _kind_of(words: dict[str, Any], nodes: int) -> basix.CellType:
    """The kind of the cells, each of so many ``nodes``. Raises ValueError."""
    kind = basix.CellType[words[_KIND]] if _KIND in words else _KIND_IN_OLD_FILES.get(nodes)
    if kind not in (TRIANGLE, QUADRILATERAL):
        raise ValueError("has cells that are no triangles or quadrilaterals")
    return kind


def _require_whole(mesh: PlaneMesh) -> None:
    """Raise ValueError for arrays and sets that do not fit together."""
    order = order_of(mesh.kind, mesh.cells.shape[1])
    fitting = (
        mesh.edges.shape[1] == order + 1
        and len(mesh.cells) == len(mesh.bodies)
        and len(mesh.edges) == len(mesh.tags)
    )
    used = np.concatenate([mesh.cells.ravel(), mesh.edges.ravel(), *mesh.point_sets.values()])
    if not fitting or not len(mesh.cells) or used.min() < 0 or used.max() >= len(mesh.x):
        raise ValueError("has cells, edges or sets that do not fit together")
