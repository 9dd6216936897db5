"""A mesh of curved triangles as arrays, as the mesh generator made it and before dolfinx distributes it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import basix
import numpy as np
from dolfinx.cpp.io import perm_gmsh
from dolfinx.mesh import CellType

from archord.geometry.basis import Array

_ENDS = basix.topology(basix.CellType.triangle)[1]  # vertices of a triangle's edges


@dataclass(frozen=True)
class PlaneMesh:
    """Nodes ``x`` ``(n, 2)``, ``cells`` ``(m, a)`` of the ``bodies`` ``(m,)`` and ``edges`` ``(k, b)`` of the curves
    ``tags`` ``(k,)``; the nodes of cells and edges come in basix' order. ``cell_sets`` and ``facet_sets`` name bodies
    and tags."""

    x: Array
    cells: np.ndarray
    bodies: np.ndarray
    edges: np.ndarray
    tags: np.ndarray
    cell_sets: dict[str, int] = field(default_factory=dict)
    facet_sets: dict[str, int] = field(default_factory=dict)

    @classmethod
    def empty(cls, order: int) -> PlaneMesh:
        """No cells of this order: what the ranks have that did not make the mesh."""
        nodes, none = (order + 1) * (order + 2) // 2, np.zeros(0, dtype=np.int32)
        cells, edges = (np.zeros((0, a), dtype=np.int64) for a in (nodes, order + 1))
        return cls(np.zeros((0, 2)), cells, none, edges, none)

    @classmethod
    def from_gmsh(cls, gmsh) -> PlaneMesh:
        """What gmsh's model has in physical groups."""
        numbers, x, _ = gmsh.model.mesh.getNodes()
        cells, bodies = _elements(gmsh, CellType.triangle, 2)
        edges, tags = _elements(gmsh, CellType.interval, 1)
        used = np.zeros(int(numbers.max()) + 1, dtype=bool)  # but for centres of arcs, which dolfinx does not expect
        used[cells] = True
        number = np.cumsum(used) - 1
        nodes = np.empty((number[-1] + 1, 2))
        kept = used[numbers]
        nodes[number[numbers[kept]]] = x.reshape(-1, 3)[kept, :2]
        return cls(nodes, number[cells], bodies, number[edges], tags, _named_groups(gmsh, 2), _named_groups(gmsh, 1))

    def save(self, path: Path) -> None:
        """Write the mesh to the .npz file ``path``."""
        names = json.dumps([self.cell_sets, self.facet_sets])
        np.savez(path, self.x, self.cells, self.bodies, self.edges, self.tags, np.array(names))

    @classmethod
    def load(cls, path: Path) -> PlaneMesh:
        """The mesh that `save` wrote. Raises OSError or ValueError."""
        with np.load(path) as file:
            *arrays, names = (file[f"arr_{i}"] for i in range(6))
        return cls(*arrays, *json.loads(str(names)))

    def second_order(self) -> PlaneMesh:
        """This mesh of straight triangles with nodes on the middles of their edges, behind the others."""
        ends = np.concatenate([self.cells[:, _ENDS].reshape(-1, 2), self.edges])
        first, which = distinct_edges(ends)
        x = np.concatenate([self.x, self.x[ends[first]].mean(axis=1)])
        middle = len(self.x) + which
        of_cells, of_edges = np.split(middle, [3 * len(self.cells)])
        cells, edges = np.hstack([self.cells, of_cells.reshape(-1, 3)]), np.column_stack([self.edges, of_edges])
        return replace(self, x=x, cells=cells, edges=edges)

    def adjust(self, move: Callable[[Array, int], Array]) -> None:
        """Put the nodes ``x`` ``(n, 2)`` of each curve where ``move(x, tag)`` says."""
        for tag in np.unique(self.tags):
            nodes = np.unique(self.edges[self.tags == tag])
            self.x[nodes] = move(self.x[nodes], int(tag))


def distinct_edges(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each edge comes first among those with these ``ends`` ``(k, 2)``, either way round, and which one each of
    them is ``(k,)``."""
    low, high = np.sort(ends.astype(np.int64), axis=1).T
    number = low * (high.max(initial=0) + 1) + high
    _, first, which = np.unique(number, return_index=True, return_inverse=True)
    return first, which


def _named_groups(gmsh, dim: int) -> dict[str, int]:
    """Tags of gmsh's physical groups of dimension ``dim`` by their names, by their numbers where they have none."""
    tags = [tag for _, tag in gmsh.model.getPhysicalGroups(dim)]
    return {gmsh.model.getPhysicalName(dim, tag) or str(tag): tag for tag in tags}


def _elements(gmsh, kind: CellType, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """gmsh's numbers of the nodes ``(n, a)`` of elements in physical groups of dimension ``dim``, and the groups' tags
    ``(n,)``."""
    nodes, tags = [], []
    for _, tag in gmsh.model.getPhysicalGroups(dim):
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            types, _, found = gmsh.model.mesh.getElements(dim, entity)
            per_element = gmsh.model.mesh.getElementProperties(types[0])[3]
            nodes.append(found[0].reshape(-1, per_element)[:, perm_gmsh(kind, per_element)])
            tags.append(np.full(len(nodes[-1]), tag, dtype=np.int32))
    return np.concatenate(nodes), np.concatenate(tags)
