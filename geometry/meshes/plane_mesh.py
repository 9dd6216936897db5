"""A mesh of curved triangles or quadrilaterals as arrays, as the mesh generator made it and before dolfinx distributes
it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import basix
import numpy as np
from dolfinx.cpp.io import perm_gmsh
from dolfinx.mesh import CellType, to_type

from archord.geometry.basis import TRIANGLE, Array, cell_kind, lagrange_element

_FAR = 1e30  # coordinates beyond overflow
_THICK = 1e-6  # difference of z over the mesh's size


@dataclass(frozen=True)
class PlaneMesh:
    """Nodes ``x`` ``(n, 2)``, ``cells`` ``(m, a)`` of the ``bodies`` ``(m,)`` and ``edges`` ``(k, b)`` of the curves
    ``tags`` ``(k,)``; the nodes of cells and edges come in basix' order. ``cell_sets`` and ``facet_sets`` name bodies
    and tags, of which a set has several where sets overlap; ``point_sets`` are node numbers."""

    x: Array
    cells: np.ndarray
    bodies: np.ndarray
    edges: np.ndarray
    tags: np.ndarray
    cell_sets: dict[str, tuple[int, ...]] = field(default_factory=dict)
    facet_sets: dict[str, tuple[int, ...]] = field(default_factory=dict)
    point_sets: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def empty(cls, nodes: int) -> PlaneMesh:
        """No cells of so many ``nodes``: what the ranks have that did not make the mesh."""
        none, order = np.zeros(0, dtype=np.int32), cell_kind(nodes)[1]
        cells, edges = (np.zeros((0, a), dtype=np.int64) for a in (nodes, order + 1))
        return cls(np.zeros((0, 2)), cells, none, edges, none)

    @classmethod
    def from_gmsh(cls, gmsh) -> PlaneMesh:
        """What gmsh's model has in physical groups. Raises ValueError if that is not one kind of cells."""
        numbers, x, _ = gmsh.model.mesh.getNodes()
        points, edges, faces = (_groups(gmsh, dim) for dim in range(3))
        kind = one_kind({group.nodes.shape[1] for group in faces.values() if len(group.nodes)})
        of_groups = np.concatenate([group.nodes.reshape(-1, kind) for group in faces.values()])
        alike = of_groups.view(f"V{of_groups.dtype.itemsize * kind}").ravel()  # whole rows
        _, first, which = np.unique(alike, return_index=True, return_inverse=True)
        cells, place_of = of_groups[np.sort(first)], np.argsort(np.argsort(first))[which]
        parts = np.split(place_of, np.cumsum([len(group.nodes) for group in faces.values()])[:-1])
        order = np.argsort(numbers)

        def place(found: np.ndarray) -> np.ndarray:
            return np.searchsorted(numbers[order], found)

        return cls.of_sets(
            *in_basix_order(x.reshape(-1, 3)[order], place(cells), perm_gmsh),
            dict(zip(faces, parts, strict=True)),
            {name: place(group.nodes[:, :2]) for name, group in edges.items()},
            {name: place(group.nodes[:, 0]) for name, group in points.items()},
            ({name: group.tag for name, group in faces.items()}, {name: group.tag for name, group in edges.items()}),
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
        """The mesh of ``cells``, in basix' order, with those of the nodes ``x`` ``(n, 2 or 3)`` that they use.

        Sets are given by cells ``(k,)``, by the ends ``(k, 2)`` of facets, and by nodes. ``tags`` number those of cells
        and facets, else from 1. Raises ValueError for what is not plane, and for facets that no cell has.
        """
        used, of_cells = np.unique(cells, return_inverse=True)
        new = np.full(len(x) + 1, -1)
        new[used] = np.arange(len(used))
        x, cells, bodies = flat(x[used]), of_cells.reshape(cells.shape), np.zeros(len(cells), dtype=np.int32)
        cell_sets = cell_sets or {"all": np.arange(len(cells))}
        numbers = tags or [{name: k for k, name in enumerate(sets, 1)} for sets in (cell_sets, facet_sets)]
        cell, tag = _members(cell_sets, numbers[0], ())
        first, one, named_cells = one_tag_each(cell, tag, numbers[0])
        bodies[cell[first]] = one
        sides, (ends, tag) = sides_of(cells), _members(facet_sets, numbers[1], (2,))
        side = sides_between(cells, new[ends])
        for name, number in numbers[1].items():
            if lost := (side[tag == number] >= len(sides)).sum():
                raise ValueError(f"{lost} of the edges of the facet set {name!r} are not edges of cells")
        first, one, named_facets = one_tag_each(side, tag, numbers[1])
        points = {name: new[nodes][new[nodes] >= 0] for name, nodes in point_sets.items()}
        return cls(x, cells, bodies, sides[side[first]], one, named_cells, named_facets, points)

    def second_order(self) -> PlaneMesh:
        """This mesh of straight cells with nodes on the middles of edges and of quadrilaterals, behind the others."""
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
    """Nodes and cells ``(m, 9)`` of quadrilaterals ``cells`` ``(m, 8)``, four vertices before the middles of four edges
    in any order, with nodes ``x`` ``(n, 2)``: a middle node each, behind the others, where its 8 nodes interpolate."""
    middle = len(x) + np.arange(len(cells))
    return np.concatenate([x, np.einsum("b,cbk->ck", _within(9)[0], x[cells])]), np.column_stack([cells, middle])


def _within(nodes: int) -> Array:
    """Weights ``(i, b)`` with which the ``b`` nodes on the sides of a cell of so many ``nodes`` place those within.

    They are exact for all polynomials that the sides determine (Coons 1967), in cubic triangles for quadratic ones.
    """
    kind, order = cell_kind(nodes)
    element, p = lagrange_element(kind, order), np.arange(order + 1)
    x, y = (element.points[:, k, None] ** p for k in range(2))
    i, j = np.nonzero(p[:, None] + p < order if kind == TRIANGLE else np.minimum(p[:, None], p) <= 1)
    values, n = x[:, i] * y[:, j], len(element.entity_dofs[2][0])
    return values[len(values) - n :] @ np.linalg.pinv(values[: len(values) - n])


def distinct_edges(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each edge comes first among those with these ``ends`` ``(k, 2)``, either way round, and which one each of
    them is ``(k,)``."""
    low, high = np.sort(ends.astype(np.int64), axis=1).T
    number = low * (high.max(initial=0) + 1) + high
    _, first, which = np.unique(number, return_index=True, return_inverse=True)
    return first, which


def one_tag_each(
    entity: np.ndarray, tags: np.ndarray, names: Mapping[str, int]
) -> tuple[np.ndarray, np.ndarray, dict[str, tuple[int, ...]]]:
    """Where each ``entity`` ``(k,)`` comes first, its tag, and all tags of the sets with these ``names``.

    An entity with one of the ``tags`` ``(k,)`` keeps it; those of the same several sets share a new one.
    """
    _, first, which = np.unique(entity, return_index=True, return_inverse=True)
    groups, group = np.unique(tags, return_inverse=True)
    member = np.zeros((len(first), len(groups)), dtype=bool)
    member[which, group] = True
    one, several = tags[first].astype(np.int32), member.sum(axis=1) > 1
    together, combination = np.unique(member[several], axis=0, return_inverse=True)
    new = groups.max(initial=0) + 1 + np.arange(len(together))
    one[several] = new[combination.ravel()]
    tags_of = {int(tag): new[column].tolist() for tag, column in zip(groups, together.T, strict=True)}
    alone = set(map(int, one))
    sets = {name: tuple([tag] * (tag in alone) + tags_of.get(tag, [])) for name, tag in names.items()}
    order = np.argsort(first)
    return first[order], one[order], sets


class _Group(NamedTuple):
    tag: int
    nodes: np.ndarray  # (k, a) gmsh's numbers


def _groups(gmsh, dim: int) -> dict[str, _Group]:
    """gmsh's physical groups of dimension ``dim`` by their names, by their tags where they have none."""
    groups = {}
    for _, tag in gmsh.model.getPhysicalGroups(dim):
        nodes = []
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            _, numbers, found = gmsh.model.mesh.getElements(dim, entity)
            nodes += [of_kind.reshape(len(number), -1) for number, of_kind in zip(numbers, found, strict=True)]
        if nodes:
            one_kind({part.shape[1] for part in nodes})
        name = gmsh.model.getPhysicalName(dim, tag) or str(tag)
        groups[name] = _Group(tag, np.concatenate(nodes or [np.zeros((0, dim + 1), dtype=np.uint64)]))
    return groups


def _members(
    sets: Mapping[str, np.ndarray], numbers: Mapping[str, int], shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """The members of all ``sets``, of this ``shape`` each, and the number of the set of each."""
    members = [np.zeros((0, *shape), dtype=np.int64), *sets.values()]
    repeated = np.repeat([0, *(numbers[name] for name in sets)], [len(found) for found in members])
    return np.concatenate(members).astype(np.int64), repeated.astype(np.int32)


def flat(x: Array) -> Array:
    """The first two coordinates of ``x`` ``(n, 2 or 3)``. Raises ValueError where the third differs, and for nan."""
    if not np.isfinite(x).all() or not np.abs(x).max(initial=0) < _FAR:
        raise ValueError("some nodes have coordinates that are not finite or beyond 1e30")
    size = np.ptp(x, axis=0)
    if len(size) == 3 and size[2] > _THICK * size[:2].max():
        raise ValueError(f"the mesh is not plane: z differs by {size[2]:g}, and must be the same for all nodes")
    return x[:, :2]


def one_kind(nodes: set[int]) -> int:
    """The number of ``nodes`` of all cells. Raises ValueError if there is not one."""
    if len(nodes) == 1:
        return nodes.pop()
    held = f"cells of {' and '.join(map(str, sorted(nodes)))} nodes" if nodes else "no plane cells in named sets"
    raise ValueError(f"the mesh has {held}; it must have one kind: all triangles or all quadrilaterals, of one order")


def in_basix_order(
    x: Array, cells: np.ndarray, order: Callable[[CellType, int], list[int]]
) -> tuple[Array, np.ndarray]:
    """Nodes and ``cells`` ``(m, a)`` whose nodes come in the ``order`` of another program, with middle nodes in
    quadrilaterals of 8 nodes."""
    if cells.shape[1] == 8:
        x, cells = with_middle_nodes(x, cells)
    return x, cells[:, order(to_type(cell_kind(cells.shape[1])[0].name), cells.shape[1])]


def sides_of(cells: np.ndarray) -> np.ndarray:
    """Nodes ``(m s, b)`` of the sides of ``cells`` ``(m, a)``, those of a cell after each other; ends come first."""
    kind, order = cell_kind(cells.shape[1])
    return cells[:, lagrange_element(kind, order).entity_closure_dofs[1]].reshape(-1, order + 1)


def sides_between(cells: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Which of `sides_of` ``cells`` has each pair of ``ends`` ``(k, 2)``; a number beyond them where none has."""
    sides = sides_of(cells)
    first, which = distinct_edges(np.concatenate([sides[:, :2], ends]))
    return first[which[len(sides) :]]


def outer_sides(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Those of `sides_of` ``cells`` that one cell alone has, and the place ``(k,)`` of that cell."""
    sides = sides_of(cells)
    first, which = distinct_edges(sides[:, :2])
    alone = first[np.bincount(which) == 1]
    return sides[alone], alone * len(cells) // len(sides)
