"""The edges where named surfaces of bodies in space meet."""

from __future__ import annotations

import numpy as np

from archord.materials.kinematics import Ints
from archord.postprocess.arrays.fields import EDGES, Fields
from archord.report.errors import InputError


def meeting(fields: Fields, edge: str) -> Ints:
    """Nodes ``(k, 3)`` along the edge "A & B" where two named surfaces meet. Raises `InputError`
    for other names, and for surfaces that do not meet in one curve."""
    sides = [name.strip() for name in edge.split("&")]
    if len(sides) != 2 or not fields.edges.keys() >= {*sides}:
        known = ", ".join(fields.edges) or "none"
        raise InputError(
            f'edge {edge!r}: in space an edge is "A & B", where two of the surfaces meet: {known}.'
        )
    one, other = (_edges_of(fields.edges[name]) for name in sides)
    is_shared = np.isin(one[:, 1], other[:, 1])  # edges have their middles alone
    shared = one[is_shared]
    _, once = np.unique(shared[:, 1], return_index=True)
    return _chained(shared[once], edge)


def _edges_of(faces: Ints) -> Ints:
    """The edges ``(k, 3)`` of ``faces`` ``(m, 6)`` or ``(m, 9)``."""
    of_face = EDGES[faces.shape[1]]
    return faces[:, of_face].reshape(-1, 3)


def _chained(edges: Ints, name: str) -> Ints:
    """The ``edges`` ``(k, 3)`` in the order of one curve, each turned along it. Raises
    `InputError`."""
    vertices, count = np.unique(edges[:, [0, 2]], return_counts=True)
    ends = vertices[count == 1]
    starts = [*ends, *vertices]  # a closed curve has no end
    at = int(starts[0]) if starts else 0
    left = [(int(start), middle, int(end)) for start, middle, end in edges]
    chain = []
    while following := [edge for edge in left if at in (edge[0], edge[2])]:
        start, middle, end = following[0]
        left.remove(following[0])
        onward = end if start == at else start
        chain.append((at, middle, onward))
        at = onward
    if left or not chain or count.max() > 2:
        raise InputError(f"edge {name!r}: the surfaces do not meet in one curve.")
    return np.array(chain)
