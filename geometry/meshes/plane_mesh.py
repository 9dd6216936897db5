"""A mesh of curved triangles or quadrilaterals as arrays, as the mesh generator made it and before dolfinx distributes
it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import basix
import numpy as np
from dolfinx.cpp.io import perm_gmsh
from dolfinx.mesh import CellType, to_type

from archord.geometry.basis import Array, cell_kind


@dataclass(frozen=True)
class PlaneMesh:
    """Nodes ``x`` ``(n, 2)``, ``cells`` ``(m, a)`` of the ``bodies`` ``(m,)`` and ``edges`` ``(k, b)`` of the curves
    ``tags`` ``(k,)``; the nodes of cells and edges come in basix' order. ``cell_sets`` and ``facet_sets`` name bodies
    and tags, of which a set has several where sets overlap."""

    x: Array
    cells: np.ndarray
    bodies: np.ndarray
    edges: np.ndarray
    tags: np.ndarray
    cell_sets: dict[str, tuple[int, ...]] = field(default_factory=dict)
    facet_sets: dict[str, tuple[int, ...]] = field(default_factory=dict)

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
        cells, bodies, cell_sets = _elements(gmsh, 2)
        edges, tags, facet_sets = _elements(gmsh, 1)
        used, of_cells = np.unique(cells, return_inverse=True)  # no centres of arcs, which dolfinx does not expect
        place = np.empty(int(numbers.max()) + 1, dtype=np.int64)
        place[numbers] = np.arange(len(numbers))
        nodes, cells = x.reshape(-1, 3)[place[used], :2], of_cells.reshape(cells.shape)
        if cells.shape[1] == 8:
            nodes, cells = with_middle_nodes(nodes, cells)
        cell, order = cell_kind(cells.shape[1])
        cells = cells[:, perm_gmsh(to_type(cell.name), cells.shape[1])]
        edges = edges.reshape(-1, order + 1)[:, perm_gmsh(CellType.interval, order + 1)]
        return cls(nodes, cells, bodies, np.searchsorted(used, edges), tags, cell_sets, facet_sets)

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

    def centre(self) -> None:
        """Put the middle nodes of second-order quadrilaterals where their edges want them."""
        if self.cells.shape[1] == 9:
            self.x[self.cells[:, 8]] = _middles(self.x, self.cells)


def with_middle_nodes(x: Array, cells: np.ndarray) -> tuple[Array, np.ndarray]:
    """Nodes and cells ``(m, 9)`` of quadrilaterals ``cells`` ``(m, 8)``, four vertices before the middles of four edges
    in any order, with nodes ``x`` ``(n, 2)``: a middle node each, behind the others, where its 8 nodes interpolate."""
    middle = len(x) + np.arange(len(cells))
    return np.concatenate([x, _middles(x, cells)]), np.column_stack([cells, middle])


def _middles(x: Array, cells: np.ndarray) -> Array:
    return x[cells[:, 4:8]].sum(axis=1) / 2 - x[cells[:, :4]].sum(axis=1) / 4


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


def _elements(gmsh, dim: int) -> tuple[np.ndarray, np.ndarray, dict[str, tuple[int, ...]]]:
    """gmsh's numbers of the nodes ``(n, a)`` of elements in physical groups of dimension ``dim``, their tags ``(n,)``,
    and the tags of the groups by their names, by their numbers where they have none."""
    nodes, numbers, tags, names = [], [np.zeros(0, dtype=np.uint64)], [np.zeros(0, dtype=np.int32)], {}
    for _, tag in gmsh.model.getPhysicalGroups(dim):
        names[gmsh.model.getPhysicalName(dim, tag) or str(tag)] = tag
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            for _, found, of_found in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
                nodes.append(of_found.reshape(len(found), -1))
                numbers.append(found)
                tags.append(np.full(len(found), tag, dtype=np.int32))
    counts = sorted({part.shape[1] for part in nodes})
    if len(counts) > 1 or (dim == 2 and not counts):
        held = f"elements of {' and '.join(map(str, counts))} nodes" if counts else "no elements"
        raise ValueError(f"the physical groups of dimension {dim} hold {held}, and must hold one kind")
    first, one, sets = one_tag_each(np.concatenate(numbers), np.concatenate(tags), names)
    return np.concatenate(nodes or [np.zeros((0, 0), dtype=np.uint64)])[first], one, sets
