"""A mesh of curved triangles or quadrilaterals as arrays, as the mesh generator made it and before
dolfinx distributes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import basix
import numpy as np
from dolfinx.cpp.io import perm_gmsh, perm_vtk
from dolfinx.mesh import CellType, to_type

from archord.geometry.basis import TRIANGLE, Array, cell_kind, lagrange_element

_FAR = 1e30  # coordinates beyond overflow
_INCOMPLETE = 20  # gmsh's number of triangles of third order without a node inside
SOLID = (
    "the mesh is of solid (3D) elements, and archord is plane: mesh a plane section of the bodies"
)
_THICK = 1e-6  # difference of z over the mesh's size


@dataclass(frozen=True)
class PlaneMesh:
    """Nodes ``x`` ``(n, 2)``, ``cells`` ``(m, a)`` of the ``bodies`` ``(m,)`` and ``edges`` ``(k,
    b)`` of the curves ``tags`` ``(k,)``; the nodes of cells and edges come in basix' order.
    ``cell_sets`` and ``facet_sets`` name bodies and tags, of which a set has several where sets
    overlap; ``point_sets`` are node numbers, ``notes`` what to warn of."""

    x: Array
    cells: np.ndarray
    bodies: np.ndarray
    edges: np.ndarray
    tags: np.ndarray
    cell_sets: dict[str, tuple[int, ...]] = field(default_factory=dict)
    facet_sets: dict[str, tuple[int, ...]] = field(default_factory=dict)
    point_sets: dict[str, np.ndarray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @classmethod
    def from_gmsh(cls, gmsh) -> PlaneMesh:
        """What gmsh's model has in physical groups. Raises ValueError if that is not one kind of
        cells."""
        numbers, x, _ = gmsh.model.mesh.getNodes()
        points, edges, faces = (_groups(gmsh, dim) for dim in range(3))
        if gmsh.model.getPhysicalGroups(3) or (
            not faces and len(gmsh.model.mesh.getElementTypes(3))
        ):
            raise ValueError(SOLID)
        kind = one_kind({nodes.shape[1] for _, nodes in faces.values() if len(nodes)})
        cells = np.concatenate([nodes.reshape(-1, kind) for _, nodes in faces.values()])
        _, first, which = np.unique(
            cells, axis=0, return_index=True, return_inverse=True
        )  # old files repeat them
        place_of, order = np.argsort(np.argsort(first))[which.ravel()], np.argsort(numbers)

        def place(found: np.ndarray) -> np.ndarray:
            return np.searchsorted(numbers[order], found)

        return cls.of_sets(
            *in_basix_order(x.reshape(-1, 3)[order], place(cells[np.sort(first)]), perm_gmsh),
            dict(
                zip(
                    faces,
                    np.split(place_of, np.cumsum([len(nodes) for _, nodes in faces.values()])),
                    strict=False,
                )
            ),
            {name: place(nodes[:, :2]) for name, (_, nodes) in edges.items()},
            {name: place(nodes[:, 0]) for name, (_, nodes) in points.items()},
            (
                {name: tag for name, (tag, _) in faces.items()},
                {name: tag for name, (tag, _) in edges.items()},
            ),
        )

    @classmethod
    def of_sets(
        cls,
        x: Array,
        cells: np.ndarray,
        cell_sets: Mapping[str, np.ndarray],
        facet_sets: Mapping[str, np.ndarray],
        point_sets: Mapping[str, np.ndarray],
        tags: tuple[Mapping[str, int], Mapping[str, int]] | None = None,
    ) -> PlaneMesh:
        """The mesh of ``cells``, in basix' order, with those of the nodes ``x`` ``(n, 2 or 3)``
        that they use.

        Sets are given by cells ``(k,)``, by the ends ``(k, 2)`` of facets, and by nodes. ``tags``
        number those of cells and facets, else from 1. Raises ValueError for what is not plane, and
        for facets that no cell has.
        """
        used, of_cells = np.unique(cells, return_inverse=True)
        new = np.full(len(x) + 1, -1)
        new[used] = np.arange(len(used))
        x, cells, bodies = (
            flat(x[used]),
            of_cells.reshape(cells.shape),
            np.zeros(len(cells), dtype=np.int32),
        )
        cell_sets = cell_sets or {"all": np.arange(len(cells))}
        numbers = tags or [
            {name: k for k, name in enumerate(sets, 1)} for sets in (cell_sets, facet_sets)
        ]
        members, one, named_cells = _one_tag_each(cell_sets, numbers[0])
        bodies[members] = one
        sides = sides_of(cells)
        facets = {name: sides_between(cells, new[ends]) for name, ends in facet_sets.items()}
        for name, found in facets.items():
            if lost := (found >= len(sides)).sum():
                raise ValueError(
                    f"{lost} of the edges of the facet set {name!r} are not edges of cells"
                )
        members, one, named_facets = _one_tag_each(facets, numbers[1])
        points = {name: new[nodes][new[nodes] >= 0] for name, nodes in point_sets.items()}
        return cls(x, cells, bodies, sides[members], one, named_cells, named_facets, points)

    def second_order(self) -> PlaneMesh:
        """This mesh of straight cells with nodes on the middles of edges and of quadrilaterals,
        behind the others."""
        sides = basix.topology(cell_kind(self.cells.shape[1])[0])[1]
        ends = np.concatenate([self.cells[:, sides].reshape(-1, 2), self.edges])
        first, which = distinct_edges(ends)
        x = np.concatenate([self.x, self.x[ends[first]].mean(axis=1)])
        of_cells, of_edges = np.split(len(self.x) + which, [len(sides) * len(self.cells)])
        cells = np.hstack([self.cells, of_cells.reshape(len(self.cells), -1)])
        if cells.shape[1] == 8:
            x, cells = with_middle_nodes(x, cells)
        return replace(self, x=x, cells=cells, edges=np.column_stack([self.edges, of_edges]))

    def centred(self) -> PlaneMesh:
        """This mesh with the nodes within cells where those on the cells' sides want them."""
        weights, x = _within(self.cells.shape[1]), self.x.copy()
        if n := len(weights):
            x[self.cells[:, -n:]] = np.einsum("ib,cbk->cik", weights, x[self.cells[:, :-n]])
        return replace(self, x=x)


def with_middle_nodes(x: Array, cells: np.ndarray) -> tuple[Array, np.ndarray]:
    """Nodes and ``cells`` with a ninth, where the 8 interpolate: four vertices, then four middles
    in any order."""
    middle = len(x) + np.arange(len(cells))
    return np.concatenate([x, np.einsum("b,cbk->ck", _within(9)[0], x[cells])]), np.column_stack(
        [cells, middle]
    )


def _within(nodes: int) -> Array:
    """Weights ``(i, b)`` with which the ``b`` nodes on the sides of a cell of so many ``nodes``
    place those within.

    They are exact for all polynomials that the sides determine (Coons 1967), in cubic triangles for
    quadratic ones.
    """
    kind, order = cell_kind(nodes)
    element, p = lagrange_element(kind, order), np.arange(order + 1)
    x, y = (element.points[:, k, None] ** p for k in range(2))
    i, j = np.nonzero(
        p[:, None] + p < order if kind == TRIANGLE else np.minimum(p[:, None], p) <= 1
    )
    values, n = x[:, i] * y[:, j], len(element.entity_dofs[2][0])
    return values[len(values) - n :] @ np.linalg.pinv(values[: len(values) - n])


def distinct_edges(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each edge comes first among those with these ``ends`` ``(k, 2)``, either way round, and
    which one each of them is ``(k,)``."""
    low, high = np.sort(ends.astype(np.int64), axis=1).T
    number = low * (high.max(initial=0) + 1) + high
    _, first, which = np.unique(number, return_index=True, return_inverse=True)
    return first, which


def _one_tag_each(
    sets: Mapping[str, np.ndarray], numbers: Mapping[str, int]
) -> tuple[np.ndarray, np.ndarray, dict[str, tuple[int, ...]]]:
    """The members ``(k,)`` of all ``sets`` as they first come, a tag of each, and all tags of every
    set.

    A member of one set has the set's number; those of the same several sets share a new one.
    """
    members = np.concatenate([np.zeros(0, dtype=np.int64), *sets.values()]).astype(np.int64)
    of_set = np.repeat(np.arange(len(sets)), [len(found) for found in sets.values()])
    _, first, which = np.unique(members, return_index=True, return_inverse=True)
    within = np.zeros((len(first), len(sets)), dtype=bool)
    within[which, of_set] = True
    given = np.array([numbers[name] for name in sets], dtype=np.int32)
    tag, several = given[of_set[first]], within.sum(axis=1) > 1
    together, combination = np.unique(within[several], axis=0, return_inverse=True)
    new = given.max(initial=0) + 1 + np.arange(len(together), dtype=np.int32)
    tag[several] = new[combination.ravel()]
    tags = {
        name: tuple(np.unique(tag[column]).tolist())
        for name, column in zip(sets, within.T, strict=True)
    }
    order = np.argsort(first)
    return members[first[order]], tag[order], tags


def _groups(gmsh, dim: int) -> dict[str, tuple[int, np.ndarray]]:
    """gmsh's physical groups of dimension ``dim`` by their names, by their tags where they have
    none: the tag, and gmsh's numbers ``(k, a)`` of the nodes of its elements."""
    groups = {}
    for _, tag in gmsh.model.getPhysicalGroups(dim):
        nodes = []
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            kinds, numbers, found = gmsh.model.mesh.getElements(dim, entity)
            if _INCOMPLETE in kinds:
                raise ValueError(
                    "triangles of 9 nodes are not read; those of third order have 10, one of them inside"
                )
            nodes += [
                of_kind.reshape(len(number), -1)
                for number, of_kind in zip(numbers, found, strict=True)
            ]
        if nodes:
            one_kind({part.shape[1] for part in nodes})
        name = gmsh.model.getPhysicalName(dim, tag) or str(tag)
        groups[name] = tag, np.concatenate(nodes or [np.zeros((0, dim + 1), dtype=np.uint64)])
    return groups


def flat(x: Array) -> Array:
    """The first two coordinates of ``x`` ``(n, 2 or 3)``. Raises ValueError where the third
    differs, and for nan."""
    if not np.isfinite(x).all() or not np.abs(x).max(initial=0) < _FAR:
        raise ValueError("some nodes have coordinates that are not finite or beyond 1e30")
    size = np.ptp(x, axis=0)
    if len(size) == 3 and size[2] > _THICK * size[:2].max():
        raise ValueError(
            f"the mesh is not plane: z differs by {size[2]:g}, and must be the same for all nodes"
        )
    return x[:, :2]


def one_kind(nodes: set[int]) -> int:
    """The number of ``nodes`` of all cells. Raises ValueError if there is not one."""
    if len(nodes) == 1:
        return nodes.pop()
    held = (
        f"cells of {' and '.join(map(str, sorted(nodes)))} nodes"
        if nodes
        else "no plane cells in named sets (only points, lines or elements without a set)"
    )
    raise ValueError(
        f"the mesh has {held}; it must have one kind: all triangles or all quadrilaterals, of one order"
    )


def in_basix_order(
    x: Array, cells: np.ndarray, order: Callable[[CellType, int], list[int]]
) -> tuple[Array, np.ndarray]:
    """Nodes and ``cells`` ``(m, a)`` with nodes in the ``order`` of another program; 8 in a
    quadrilateral become 9."""
    if cells.shape[1] == 8:
        x, cells = with_middle_nodes(x, cells)
    return x, cells[:, order(to_type(cell_kind(cells.shape[1])[0].name), cells.shape[1])]


def in_vtk_order(cells: np.ndarray) -> np.ndarray:
    """Lagrange ``cells`` ``(m, a)`` of any degree with their nodes in VTK's order."""
    n = cells.shape[1]
    return cells[:, np.argsort(perm_vtk(to_type(cell_kind(n)[0].name), n))]


def sides_of(cells: np.ndarray) -> np.ndarray:
    """Nodes ``(m s, b)`` of the sides of ``cells`` ``(m, a)``, those of a cell after each other;
    ends come first."""
    kind, order = cell_kind(cells.shape[1])
    return cells[:, lagrange_element(kind, order).entity_closure_dofs[1]].reshape(-1, order + 1)


def sides_between(cells: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Which of `sides_of` ``cells`` has each pair of ``ends`` ``(k, 2)``; a number beyond them
    where none has."""
    sides = sides_of(cells)
    first, which = distinct_edges(np.concatenate([sides[:, :2], ends]))
    return first[which[len(sides) :]]


def outer_sides(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Those of `sides_of` ``cells`` that one cell alone has, and the place ``(k,)`` of that
    cell."""
    sides = sides_of(cells)
    first, which = distinct_edges(sides[:, :2])
    alone = first[np.bincount(which) == 1]
    return sides[alone], alone * len(cells) // len(sides)
