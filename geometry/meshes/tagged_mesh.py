"""A mesh with named sets of cells, facets and points: what a problem's bodies, surfaces and
supports are found by."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh, MeshTags, compute_incident_entities
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.materials.kinematics import Bools, Ints
from archord.report.by_name import Names

SAME_PLACE = 1e-8  # of the mesh's size

Sets = Mapping[str, tuple[int, ...]]


@dataclass(frozen=True)
class TaggedMesh:
    """A mesh of one kind of cells with named sets. All bodies live in one mesh.

    - ``cells``, ``facets``: a tag for each cell, and for each facet in a set
    - ``cell_sets``, ``facet_sets``: the tags of each set, several where sets overlap
    - ``point_sets``: coordinates ``(k, 2)`` of the nodes of each set
    - ``notes``: what to warn of, by how the mesh was made
    - ``plane``: the kinematics that a deck's elements are named for, "" where none are
    - ``point_tags``: the tags of the cells at nodes of the point sets, empty where not needed: they
      tell nodes of several bodies at one place apart
    """

    mesh: Mesh
    cells: MeshTags
    facets: MeshTags
    cell_sets: Sets
    facet_sets: Sets
    point_sets: Mapping[str, Array] = field(default_factory=dict)
    notes: Names = ()
    plane: str = ""
    point_tags: Mapping[str, Sequence[frozenset[int]]] = field(default_factory=dict)

    @property
    def dimension(self) -> int:
        """Topological dimension of the cells."""
        return self.mesh.topology.dim

    def cell_tags(self, name: str) -> tuple[int, ...]:
        """Tags of the cell set ``name``. Raises ValueError, also for a set without cells."""
        return tags_of("cell", self.cell_sets, name)

    def cells_in(self, name: str) -> Ints:
        """Cells ``(n,)`` of the cell set ``name`` on this rank, ghosts included. Raises
        ValueError."""
        return _tagged(self.cells, self.cell_tags(name))

    def facets_in(self, name: str) -> Ints:
        """Facets ``(n,)`` of the facet set ``name`` on this rank, ghosts included. Raises
        ValueError."""
        return _tagged(self.facets, tags_of("facet", self.facet_sets, name))

    def dofs_in(self, V: fem.FunctionSpace, name: str) -> Ints:
        """Block dofs ``(n,)`` of ``V`` on this rank, ghosts included, in the facet and point set
        ``name``, or in the cell set where it is neither. Collective; raises ValueError."""
        found = []
        if name in self.facet_sets:
            facets = self.facets_in(name)
            found.append(fem.locate_dofs_topological(V, self.dimension - 1, facets))
        if name in self.point_sets and (len(self.point_sets[name]) or not found):
            found.append(self._nodes_at(V, name))
        if found:
            return np.unique(np.concatenate(found))
        if name in self.cell_sets:
            self.mesh.topology.create_connectivity(self.dimension, self.dimension)
            return fem.locate_dofs_topological(V, self.dimension, self.cells_in(name))
        known = [*self.facet_sets, *self.point_sets, *self.cell_sets]
        raise ValueError(unknown("facet, point or cell set", name, known))

    def _nodes_at(self, V: fem.FunctionSpace, name: str) -> Ints:
        from scipy.spatial import cKDTree  # a solve without point sets does not pay for it

        points = self.point_sets[name]
        if not len(points):
            raise ValueError(f"the point set {name!r} is empty: no cell has a node of it")
        comm = self.mesh.comm
        size = np.abs(self.mesh.geometry.x).max(initial=0.0)
        near = SAME_PLACE * comm.allreduce(size, op=MPI.MAX)
        alike = cKDTree(points).query_ball_point(points, near)
        x = V.tabulate_dof_coordinates()[:, : points.shape[1]]
        here = cKDTree(x).query_ball_point(points, near)
        n_owned = V.dofmap.index_map.size_local

        def is_told() -> Bools:
            """Whether as many nodes are at each point as the set has there. Collective."""
            owned = [sum(dof < n_owned for dof in dofs) for dofs in here]
            return comm.allreduce(np.array(owned)) == list(map(len, alike))

        told = is_told()
        tags = self.point_tags.get(name, ())
        if len(tags) == len(points):
            doubtful = np.flatnonzero(~told)
            at_tags = {these: self._dofs_at(V, these) for these in {tags[k] for k in doubtful}}
            for k in doubtful:
                here[k] = [dof for dof in here[k] if dof in at_tags[tags[k]]]
                alike[k] = [other for other in alike[k] if tags[other] == tags[k]]
            told = is_told()
        for x, y, *_ in points[~told]:
            raise ValueError(
                f"the point set {name!r} does not tell which node at ({x:g}, {y:g}) it means"
            )
        return np.concatenate([np.array(dofs, dtype=np.int32) for dofs in here])

    def _dofs_at(self, V: fem.FunctionSpace, tags: frozenset[int]) -> set[int]:
        """The block dofs of this rank's cells that have one of the ``tags``."""
        cells = self.cells.indices[np.isin(self.cells.values, list(tags))]
        return set(V.dofmap.list[cells].ravel().tolist())

    def cells_behind(self, name: str) -> Ints:
        """Cells ``(n,)`` of this rank at the facets of the set ``name``, ghosts included."""
        d = self.dimension
        self.mesh.topology.create_connectivity(d - 1, d)
        return compute_incident_entities(self.mesh.topology, self.facets_in(name), d - 1, d)

    def tags_behind(self, name: str) -> set[int]:
        """Tags of the cells at the facets of the set ``name``, over all ranks. Collective."""
        behind = np.isin(self.cells.indices, self.cells_behind(name))
        here = np.unique(self.cells.values[behind]).tolist()
        parts = self.mesh.comm.allgather(here)
        return set().union(*parts)


def _tagged(entities: MeshTags, tags: tuple[int, ...]) -> Ints:
    """The ``entities`` ``(n,)`` of this rank that have one of the ``tags``."""
    return entities.indices[np.isin(entities.values, tags)]


def unknown(kind: str, name: str, known: list[str]) -> str:
    """The sentence on the ``name`` of a ``kind`` that is not among the names ``known``."""
    near = difflib.get_close_matches(name, known, 1)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    return f"there is no {kind} {name!r}{hint}; there are {', '.join(map(repr, known)) or 'none'}"


def tags_of(kind: str, sets: Sets, name: str, by: str = "") -> tuple[int, ...]:
    """Tags of the set ``name`` of a ``kind``. Raises ValueError, which begins with ``by``, if there
    is none, or if it is empty."""
    if name not in sets:
        raise ValueError(by + unknown(f"{kind} set", name, list(sets)))
    if not sets[name]:
        raise ValueError(f"{by}the {kind} set {name!r} is empty: the mesh has no {kind} of it")
    return sets[name]
