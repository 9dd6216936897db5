"""How programs of the Abaqus family number the nodes and the sides of an element."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import basix
import numpy as np

from archord.geometry.basis import HEXAHEDRON, QUADRILATERAL, TETRAHEDRON, TRIANGLE
from archord.geometry.meshes.formats.abaqus import SIDES
from archord.materials.kinematics import Ints

# corners of a cell as elements count them, by their numbers in basix, and the order of those in a
# mirror
_CORNERS = {
    TRIANGLE: [0, 1, 2],
    QUADRILATERAL: [0, 1, 3, 2],
    TETRAHEDRON: [0, 1, 2, 3],
    HEXAHEDRON: [0, 1, 3, 2, 4, 5, 7, 6],
}
_MIRRORED = {
    TRIANGLE: [0, 2, 1],
    QUADRILATERAL: [0, 3, 2, 1],
    TETRAHEDRON: [0, 2, 1, 3],
    HEXAHEDRON: [0, 3, 2, 1, 4, 7, 6, 5],
}
# corners at the ends of edges, in the order of the nodes in their middles
_EDGES = {
    TRIANGLE: ["01", "12", "20"],
    QUADRILATERAL: ["01", "12", "23", "30"],
    TETRAHEDRON: ["01", "12", "20", "03", "13", "23"],
    HEXAHEDRON: ["01", "12", "23", "30", "45", "56", "67", "74", "04", "15", "26", "37"],
}


class Numbering(NamedTuple):
    """The numbering of a kind of element.

    nodes : (k,) its nodes, as numbered in the cell: corners, then the middles of edges
    side_of : (f,) the side that each facet of the cell is
    on_sides : (f, j) the nodes of each side, as numbered in the cell: corners, then middles
    """

    nodes: Ints
    side_of: Ints
    on_sides: Ints


@cache
def numbering(kind: basix.CellType, *, mirrored: bool) -> Numbering:
    """The numbering of elements on cells of this ``kind``, also on ``mirrored`` ones, whose
    determinant is negative."""
    corners = np.array(_CORNERS[kind])
    if mirrored:
        corners = corners[_MIRRORED[kind]]
    topology = basix.topology(kind)
    edges = [set(edge) for edge in topology[1]]

    def middle(ends: Iterable[Any]) -> int:
        return len(corners) + edges.index({int(corners[int(end)]) for end in ends})

    sides = [corners[side].tolist() for side in SIDES[kind]]
    on_sides = []
    for side, own in zip(sides, SIDES[kind], strict=True):
        on_sides.append([*side, *map(middle, _around(own))])
    facets = topology[len(topology) - 2]
    side_of = [[set(side) for side in sides].index(set(facet)) for facet in facets]
    nodes = [*corners, *map(middle, _EDGES[kind])]
    return Numbering(np.array(nodes), np.array(side_of), np.array(on_sides))


def _around(side: list[int]) -> list[tuple[int, ...]]:
    """The edges of a ``side`` by their ends; a side of a plane element is one."""
    return list(pairwise([*side, *side[: len(side) > 2]]))
