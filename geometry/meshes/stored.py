"""Meshes of archord's own in .npz files: the arrays of a `PlaneMesh`, and the names of its sets as
JSON; no pickle."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from archord.geometry.basis import cell_kind
from archord.geometry.meshes.plane_mesh import PlaneMesh, flat

_ARRAYS = {
    "x": "f",
    "cells": "i",
    "bodies": "i",
    "edges": "i",
    "tags": "i",
}  # and the kind of their numbers
_SETS = ("cell_sets", "facet_sets", "point_sets")


def store_mesh(mesh: PlaneMesh, file: BinaryIO) -> None:
    """Write ``mesh`` to ``file``, from which `stored_mesh` reads it to the last bit, its sets in
    their order."""
    points = {name: nodes.tolist() for name, nodes in mesh.point_sets.items()}
    sets = {"cell_sets": mesh.cell_sets, "facet_sets": mesh.facet_sets, "point_sets": points}
    named = np.frombuffer(json.dumps(sets).encode(), dtype=np.uint8)
    np.savez(file, sets=named, **{name: getattr(mesh, name) for name in _ARRAYS})


def stored_mesh(path: Path) -> PlaneMesh:
    """The mesh that `store_mesh` wrote to ``path``. Raises ValueError for anything else."""
    with np.load(path, allow_pickle=False) as file:
        if not {"sets", *_ARRAYS} <= set(getattr(file, "files", ())):
            raise ValueError("is no mesh that archord wrote")
        arrays = {name: file[name] for name in _ARRAYS}
        sets = json.loads(file["sets"].tobytes())
    _require_whole(arrays, sets)
    x = flat(arrays.pop("x"))
    cell_sets, facet_sets = (
        {name: tuple(tags) for name, tags in sets[kind].items()} for kind in _SETS[:2]
    )
    points = {name: np.array(nodes, dtype=np.int64) for name, nodes in sets["point_sets"].items()}
    return PlaneMesh(x, **arrays, cell_sets=cell_sets, facet_sets=facet_sets, point_sets=points)


def _require_whole(arrays: dict[str, np.ndarray], sets: dict[str, dict[str, Any]]) -> None:
    """Raise ValueError for arrays and sets that do not fit together."""
    x, cells, bodies, edges, tags = arrays.values()
    dimensions = [array.ndim for array in arrays.values()]
    kinds = [array.dtype.kind for array in arrays.values()]
    if dimensions != [2, 2, 1, 2, 1] or kinds != list(_ARRAYS.values()) or x.shape[1] != 2:
        raise ValueError("has arrays of other shapes than a mesh has")
    _, order = cell_kind(cells.shape[1])
    fitting = edges.shape[1] == order + 1 and len(cells) == len(bodies) and len(edges) == len(tags)
    numbers = [nodes for named in sets["point_sets"].values() for nodes in named]
    used = np.concatenate([cells.ravel(), edges.ravel(), np.array(numbers, dtype=np.int64)])
    if not fitting or not len(cells) or used.min() < 0 or used.max() >= len(x):
        raise ValueError("has cells, edges or sets that do not fit together")
