"""Plane meshes of quadrilaterals, extruded in layers along z to hexahedra."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

import basix
import numpy as np

from archord.geometry.basis import HEXAHEDRON, QUADRILATERAL, Array, lagrange_element
from archord.geometry.meshes.fenicsx import distribute, gathered
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.tagged_mesh import TaggedMesh, unknown

_INTERVAL = basix.CellType.interval


def graded(begin: float, end: float, layers: int, last: float = 1.0) -> Array:
    """Heights ``(layers + 1,)`` from ``begin`` to ``end`` between layers that become thicker or
    thinner by the same factor; the ``last`` one is so many times as thick as the first."""
    thickness = np.geomspace(1.0, last, layers)
    share = np.concatenate([[0.0], thickness.cumsum() / thickness.sum()])
    return begin + (end - begin) * share


def layered(plane: TaggedMesh, heights: Mapping[str, Sequence[float]]) -> TaggedMesh:
    """Extrude a ``plane`` mesh of quadrilaterals to hexahedra. Collective.

    ``heights`` between the layers are given for each body, from the lowest on, by its set of cells.
    Facet sets keep their names over their edges, and point sets over their points. The lowest faces
    of a body "pin" become the set "pin below", its highest ones "pin above". Raises ValueError for
    heights that do not fit, and for triangles, whose prisms are not supported.
    """
    comm = plane.mesh.comm
    made = comm.bcast(gathered(plane))  # small: all ranks find its faults
    solid = extruded(made, heights)
    return distribute(comm, solid if comm.rank == 0 else None)


def extruded(plane: MeshArrays, heights: Mapping[str, Sequence[float]]) -> MeshArrays:
    """The arrays of a `layered` mesh."""
    if plane.kind != QUADRILATERAL:
        raise ValueError("layers of triangles would be prisms, which are not supported")
    parts: dict[tuple[float, ...], list[str]] = defaultdict(list)
    for name, of_body in heights.items():
        if name not in plane.cell_sets:
            raise ValueError(unknown("cell set", name, list(plane.cell_sets)))
        if len(of_body) < 2 or not np.all(np.diff(of_body) > 0):
            raise ValueError(f"heights of {name!r} must be two or more, and increase")
        parts[tuple(of_body)].append(name)
    stacks = []
    first = 0
    for levels, names in parts.items():
        stacks.append(_Stack(plane, names, np.array(levels), first))
        first += stacks[-1].number.size
    _require_all(plane, stacks)
    return _joined(plane, stacks)


class _Stack:
    """The bodies of the cell sets ``names`` with the same ``levels`` between layers, whose nodes
    have numbers from ``first`` on.

    chosen : (m,) cells of the plane mesh
    nodes : (p,) their nodes
    x : (p l, 3) the nodes in space
    number : (p, l) their numbers
    """

    def __init__(self, plane: MeshArrays, names: list[str], levels: Array, first: int) -> None:
        self.plane = plane
        self.names = names
        tags = [tag for name in names for tag in plane.cell_sets[name]]
        self.chosen = np.flatnonzero(np.isin(plane.bodies, tags))
        self.nodes = np.unique(plane.cells[self.chosen])
        self._layers = len(levels) - 1
        steps = np.arange(plane.order * self._layers + 1) / plane.order
        z = np.interp(steps, np.arange(len(levels)), levels)
        over = np.repeat(plane.x[self.nodes], len(z), axis=0)
        self.x = np.column_stack([over, np.tile(z, len(self.nodes))])
        self.number = first + np.arange(len(self.x)).reshape(len(self.nodes), len(z))

    def over(self, rows: np.ndarray, base: basix.CellType, cell: basix.CellType) -> np.ndarray:
        """Cells ``(n layers, b)`` over ``rows`` ``(n, a)`` of nodes of the kind ``base``."""
        order = self.plane.order
        points = lagrange_element(cell, order).points
        on_base = lagrange_element(base, order).points
        apart = np.abs(points[:, None, :-1] - on_base).sum(axis=-1)
        column = apart.argmin(axis=1)
        level = np.rint(order * points[:, -1]).astype(int)
        of_layers = order * np.arange(self._layers)[:, None] + level
        found = self.number[self._place(rows)[:, None, column], of_layers]
        return found.reshape(-1, len(points))

    def at(self, level: int, name: str) -> np.ndarray:
        """The lowest (``level`` 0) or highest (-1) faces ``(n, b)`` of a body."""
        is_body = np.isin(self.plane.bodies, self.plane.cell_sets[name])
        return self.number[self._place(self.plane.cells[is_body]), level]

    def _place(self, nodes: np.ndarray) -> np.ndarray:
        return np.searchsorted(self.nodes, nodes)

    def cells(self) -> np.ndarray:
        """The hexahedra."""
        return self.over(self.plane.cells[self.chosen], QUADRILATERAL, HEXAHEDRON)

    def bodies(self) -> np.ndarray:
        """The tags of the hexahedra."""
        return self.plane.bodies[self.chosen].repeat(self._layers)

    def sides(self) -> tuple[np.ndarray, np.ndarray]:
        """The faces over the edges in sets, and their tags."""
        is_own = np.isin(self.plane.facets, self.nodes).all(axis=1)
        faces = self.over(self.plane.facets[is_own], _INTERVAL, QUADRILATERAL)
        return faces, self.plane.tags[is_own].repeat(self._layers)

    def points(self, nodes: np.ndarray) -> np.ndarray:
        """The nodes over these ``nodes`` of the plane mesh."""
        return self.number[np.isin(self.nodes, nodes)].ravel()


def _require_all(plane: MeshArrays, stacks: list[_Stack]) -> None:
    """Raise ValueError for cells without heights, and for bodies that share nodes but not their
    heights."""
    without = len(plane.cells) - sum(len(stack.chosen) for stack in stacks)
    if without:
        raise ValueError(f"{without} cells have no heights: give heights of every body")
    nodes = np.concatenate([stack.nodes for stack in stacks])
    if len(np.unique(nodes)) < len(nodes):
        raise ValueError("bodies that share nodes must have the same heights")


def _joined(plane: MeshArrays, stacks: list[_Stack]) -> MeshArrays:
    """All ``stacks`` as one mesh."""
    sides, tags = zip(*(stack.sides() for stack in stacks), strict=True)
    faces = list(sides)
    tags = list(tags)
    facet_sets = dict(plane.facet_sets)
    new = 1 + int(plane.tags.max(initial=0))
    for stack in stacks:
        for name in stack.names:
            for end, level in (("below", 0), ("above", -1)):
                at_end = stack.at(level, name)
                faces.append(at_end)
                tags.append(np.full(len(at_end), new, dtype=np.int32))
                facet_sets[f"{name} {end}"] = (new,)
                new += 1
    of_points = {
        name: np.concatenate([stack.points(nodes) for stack in stacks])
        for name, nodes in plane.point_sets.items()
    }
    return replace(
        plane,
        x=np.concatenate([stack.x for stack in stacks]),
        kind=HEXAHEDRON,
        cells=np.concatenate([stack.cells() for stack in stacks]),
        bodies=np.concatenate([stack.bodies() for stack in stacks]),
        facets=np.concatenate(faces),
        tags=np.concatenate(tags),
        facet_sets=facet_sets,
        point_sets=of_points,
    )
