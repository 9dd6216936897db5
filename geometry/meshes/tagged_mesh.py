"""A mesh with named sets of cells and facets: what a problem's bodies, surfaces and supports are found by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from dolfinx.mesh import Mesh, MeshTags, compute_incident_entities


@dataclass(frozen=True)
class TaggedMesh:
    """A mesh of triangles, its ``cells`` and ``facets`` with tags, and the tags' names; all bodies live in one mesh."""

    mesh: Mesh
    cells: MeshTags
    facets: MeshTags
    cell_sets: Mapping[str, int]
    facet_sets: Mapping[str, int]

    def cell_tag(self, name: str) -> int:
        """Tag of the cell set ``name``. Raises ValueError."""
        return _tag("cell", self.cell_sets, name)

    def facet_tag(self, name: str) -> int:
        """Tag of the facet set ``name``. Raises ValueError."""
        return _tag("facet", self.facet_sets, name)

    def tags_behind(self, name: str) -> set[int]:
        """Tags of the cells at the facets of the set ``name``, over all ranks. Collective."""
        self.mesh.topology.create_connectivity(1, 2)
        cells = compute_incident_entities(self.mesh.topology, self.facets.find(self.facet_tag(name)), 1, 2)
        here = np.unique(self.cells.values[np.isin(self.cells.indices, cells)]).tolist()
        return set().union(*self.mesh.comm.allgather(here))


def _tag(kind: str, sets: Mapping[str, int], name: str) -> int:
    if name not in sets:
        raise ValueError(f"there is no {kind} set {name!r}; there are {', '.join(map(repr, sets))}")
    return sets[name]
