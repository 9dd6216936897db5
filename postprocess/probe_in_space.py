"""Points inside bodies in space, and the edges where their named surfaces meet."""

from __future__ import annotations

import numpy as np

from archord.materials.material import Array
from archord.output.files.xdmf import CELLS
from archord.postprocess.fields import EDGES, Fields
from archord.report.errors import InputError

_BULGE = 0.1  # of a cell's size, by which a curved cell may reach beyond its nodes
_NEWTON = 10
_BESIDE = 1e-6  # beyond the reference cell, where a point still lies on its side


def located(fields: Fields, x: Array) -> tuple[np.ndarray, np.ndarray, Array]:
    """For each point ``x`` ``(k, 3)`` its cell ``(k,)``, -1 outside the bodies, the cell's nodes
    and their weights ``(k, a)`` at the point."""
    per_cell = fields.cells.shape[1]
    cells = fields.cells[:, np.argsort(CELLS[per_cell][1])]  # in basix' order
    nodes = fields.coordinates[cells]
    low = nodes.min(axis=1)
    high = nodes.max(axis=1)
    bulge = _BULGE * (high - low)
    low -= bulge
    high += bulge
    found = np.full(len(x), -1)
    weights = np.zeros((len(x), per_cell))
    for k in range(len(x)):
        near = np.flatnonzero(((low <= x[k]) & (x[k] <= high)).all(axis=1))
        shapes, beyond = _reached(nodes[near], x[k : k + 1])
        if len(near) and beyond.min() < _BESIDE:
            best = int(beyond.argmin())
            found[k] = near[best]
            weights[k] = shapes[best]
    return found, cells[found], weights


def _reached(nodes: Array, point: Array) -> tuple[Array, Array]:
    """The weights ``(m, a)`` of the ``nodes`` ``(m, a, 3)`` of cells at the ``point`` ``(1, 3)``,
    and how far ``(m,)`` beyond the reference cells it lies."""
    # with bases, which most readers of runs do without
    from archord.geometry.basis import HEXAHEDRON, TETRAHEDRON, tabulate

    is_simplex = nodes.shape[1] == 10
    kind = TETRAHEDRON if is_simplex else HEXAHEDRON
    X: Array = np.full((len(nodes), 3), 0.25 if is_simplex else 0.5)
    for _ in range(_NEWTON):
        shape, *slopes = tabulate(kind, 2, X)
        misfit = point - np.einsum("na,nai->ni", shape, nodes)
        jacobian = np.einsum("jna,nai->nij", slopes, nodes)
        X = X + np.linalg.solve(jacobian, misfit[..., None])[..., 0]
        X = np.clip(X, -1.0, 2.0)
    sides = np.column_stack([-X, X.sum(axis=1) - 1 if is_simplex else X - 1])
    return tabulate(kind, 2, X)[0], sides.max(axis=1)


def meeting(fields: Fields, edge: str) -> np.ndarray:
    """Nodes ``(k, 3)`` along the edge "A & B" where two named surfaces meet. Raises `InputError`
    for other names, and for surfaces that do not meet in one curve."""
    sides = [name.strip() for name in edge.split("&")]
    if len(sides) != 2 or not fields.edges.keys() >= {*sides}:
        known = ", ".join(fields.edges) or "none"
        raise InputError(
            f'edge {edge!r}: in space an edge is "A & B", where two of the surfaces meet: {known}.'
        )
    one, other = (_edges_of(fields.edges[name]) for name in sides)
    nodes = one[np.isin(one[:, 1], other[:, 1])]
    nodes = nodes[np.unique(nodes[:, 1], return_index=True)[1]]
    return _chained(nodes, edge)


def _edges_of(faces: np.ndarray) -> np.ndarray:
    """The edges ``(k, 3)`` of ``faces`` ``(m, 6)`` or ``(m, 9)``."""
    return faces[:, EDGES[faces.shape[1]]].reshape(-1, 3)


def _chained(nodes: np.ndarray, edge: str) -> np.ndarray:
    """Edges ``(k, 3)`` in the order of one curve, each turned along it. Raises `InputError`."""
    left = {k: (int(nodes[k, 0]), int(nodes[k, 2])) for k in range(len(nodes))}
    vertices, count = np.unique(nodes[:, [0, 2]], return_counts=True)
    ends = vertices[count == 1]
    at = int(ends[0]) if len(ends) else int(vertices.min(initial=0))
    order = []
    while following := [k for k, pair in left.items() if at in pair]:
        a, b = left.pop(following[0])
        order.append(following[0] if a == at else ~following[0])
        at = b if a == at else a
    if left or not len(nodes) or count.max() > 2:
        raise InputError(f"edge {edge!r}: the surfaces do not meet in one curve.")
    return np.array([nodes[k] if k >= 0 else nodes[~k, ::-1] for k in order])
