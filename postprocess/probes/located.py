"""Points inside bodies in space."""

from __future__ import annotations

import numpy as np

from archord.materials.kinematics import Ints
from archord.materials.material import Array
from archord.output.files.xdmf import CELLS
from archord.postprocess.arrays.fields import Fields

_BULGE = 0.1  # of a cell's size, by which a curved cell may reach beyond its nodes
_NEWTON = 10
_BESIDE = 1e-6  # beyond the reference cell, where a point still lies on its side


def located(fields: Fields, x: Array) -> tuple[Ints, Ints, Array]:
    """For each point ``x`` ``(k, 3)`` its cell ``(k,)``, -1 outside the bodies, the cell's nodes
    and their weights ``(k, a)`` at the point. Where bodies meet, the cell is of the first one."""
    per_cell = fields.cells.shape[1]
    cells = fields.cells[:, np.argsort(CELLS[per_cell][1])]  # in basix' order
    nodes = fields.coordinates[cells]  # (cells, a, 3)
    low = nodes.min(axis=1)
    high = nodes.max(axis=1)
    bulge = _BULGE * (high - low)
    low -= bulge
    high += bulge
    marks = list(fields.bodies.values())
    place = np.argmax(fields.body[:, None] == marks, axis=1)  # of a cell's body among all
    found = np.full(len(x), -1)
    weights = np.zeros((len(x), per_cell))
    for k in range(len(x)):
        in_box = ((low <= x[k]) & (x[k] <= high)).all(axis=1)
        near = np.flatnonzero(in_box)
        if not len(near):
            continue
        shapes, beyond = _reached(nodes[near], x[k])
        holding = np.flatnonzero(beyond < _BESIDE)
        if not len(holding):
            continue
        best = holding[np.lexsort((beyond[holding], place[near[holding]]))[0]]
        found[k] = near[best]
        weights[k] = shapes[best]
    return found, cells[found], weights


def _reached(nodes: Array, point: Array) -> tuple[Array, Array]:
    """The weights ``(m, a)`` of the ``nodes`` ``(m, a, 3)`` of cells at the ``point`` ``(3,)``,
    and how far ``(m,)`` beyond the reference cells it lies."""
    # with bases, which most readers of runs do without
    from archord.geometry.basis import HEXAHEDRON, TETRAHEDRON, tabulate

    is_simplex = nodes.shape[1] == 10
    kind = TETRAHEDRON if is_simplex else HEXAHEDRON
    middle = 0.25 if is_simplex else 0.5
    X: Array = np.full((len(nodes), 3), middle)
    for _ in range(_NEWTON):
        shape, *slopes = tabulate(kind, 2, X)
        misfit = point - np.einsum("na,nai->ni", shape, nodes)
        jacobian = np.einsum("jna,nai->nij", slopes, nodes)
        X = X + np.linalg.solve(jacobian, misfit[..., None])[..., 0]
        X = np.clip(X, -1.0, 2.0)
    far_sides = X.sum(axis=1) - 1 if is_simplex else X - 1
    beyond_sides = np.column_stack([-X, far_sides])
    return tabulate(kind, 2, X)[0], beyond_sides.max(axis=1)
