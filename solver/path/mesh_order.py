"""Fields and histories in the order of the mesh generator, whatever the number of ranks and their
cut of the mesh.

Rank 0 holds what is collected. The number of a point is the number of its cell or facet times
points per cell, plus its own. The order of a cell's nodes, and so of its points, does not depend on
the ranks, nor does the order along a contact edge.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from copy import copy
from functools import cached_property

import basix
import numpy as np
from dolfinx.mesh import entities_to_geometry
from mpi4py import MPI

from archord.geometry.basis import Array, tabulate
from archord.kernels.compat import cell_degree, cell_nodes
from archord.materials.material import Points
from archord.solver.bulk.body_points import PointFields
from archord.solver.path.system import System

Arrays = dict[str, np.ndarray]


class Gather:
    """Brings values of owned entities to rank 0, in the order of their input indices.
    Collective."""

    def __init__(self, comm: MPI.Comm, index: np.ndarray) -> None:
        self.comm = comm
        parts = comm.gather(index)
        if parts is not None:
            self.unique, self._slot = np.unique(np.concatenate(parts), return_inverse=True)

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """The values of all ranks on rank 0, nothing elsewhere."""
        parts = self.comm.gather(values)
        if parts is None:
            return np.zeros(0)
        ordered = np.empty((len(self.unique), *values.shape[1:]), dtype=values.dtype)
        ordered[self._slot] = np.concatenate(parts)
        return ordered


_SOME = 1e-6  # of the largest load on a node: what is less is round-off
_NEWER = {"volume_work"}  # histories that checkpoints of 0.2 lack, and begin at rest then


class MeshOrder:
    """The generator's order of the nodes and cells of ``system``. Collective.

    Nodes are the displacement's: where the geometry is of another order, they come as the cells
    first name them. On rank 0 are

    kind : the kind of its cells, on all ranks
    coordinates : (n, 3) of the nodes
    nodes_of_cell : (n, a)
    """

    def __init__(self, system: System) -> None:
        self.system = system
        V = system.V
        mesh = V.mesh
        index_map = mesh.topology.index_map(mesh.topology.dim)
        self.kind = mesh.basix_cell()
        self.n_cells = index_map.size_local
        self._n_local = system.equilibrium.unknowns.n_local
        self._n_owned = system.equilibrium.unknowns.n_owned
        self._cell_index = np.asarray(mesh.topology.original_cell_index)[: self.n_cells]
        self.cells = Gather(system.comm, self._cell_index)
        self._take_geometry()
        if not self._has_nodes_of_mesh():
            self._number_nodes_by_cells()
        self._nodes = Gather(system.comm, self._index[: self._n_owned])
        corners = slice(len(basix.topology(mesh.basix_cell())[0]))  # come first in every cell
        self._dof_of_vertex = np.zeros(len(mesh.geometry.x), dtype=np.int64)
        self._dof_of_vertex[cell_nodes(mesh)[:, corners]] = V.dofmap.list[:, corners]

    def _has_nodes_of_mesh(self) -> bool:
        """Whether cells have the same nodes in the displacement and in the geometry."""
        V = self.system.V
        return V.dofmap.list.shape[1] == cell_nodes(V.mesh).shape[1]

    def _take_geometry(self) -> None:
        """The geometry's nodes and cells, and for the displacement's nodes ``_index`` the numbers
        of the geometry's, where both number the nodes of a cell alike."""
        mesh = self.system.V.mesh
        owned = mesh.geometry.index_map().size_local
        index = np.asarray(mesh.geometry.input_global_indices)
        of_cells = index[cell_nodes(mesh)]
        nodes = Gather(self.system.comm, index[:owned])
        self.coordinates = nodes(mesh.geometry.x[:owned])
        self.nodes_of_cell = self.cells(of_cells[: self.n_cells])
        if self.system.comm.rank == 0:
            self.nodes_of_cell = np.searchsorted(nodes.unique, self.nodes_of_cell)
        self._index = np.zeros(self._n_local, dtype=np.int64)
        if self._has_nodes_of_mesh():
            self._index[self.system.V.dofmap.list] = of_cells

    def _number_nodes_by_cells(self) -> None:
        """Number the displacement's nodes as the cells first name them."""
        V = self.system.V
        element = V.element.basix_element
        local = np.arange(self._n_local, dtype=np.int32)
        numbers = V.dofmap.index_map.local_to_global(local)
        of_cells = self.cells(numbers[V.dofmap.list[: self.n_cells]])
        first = None
        if self.system.comm.rank == 0:
            degree = cell_degree(V.mesh)
            shape = tabulate(V.mesh.basix_cell(), degree, element.points)[0]
            corners = self.coordinates[self.nodes_of_cell]
            places = np.einsum("qa,nai->nqi", shape, corners).reshape(-1, 3)
            _, first = np.unique(of_cells, return_index=True)
            in_order = np.sort(first)
            self.coordinates = places[in_order]
            self.nodes_of_cell = np.searchsorted(in_order, first[of_cells])
        self._index = self.system.comm.bcast(first)[numbers]

    def mesh_digest(self) -> str:
        """SHA-256 of coordinates and cells, on rank 0."""
        nodes = self.nodes_of_cell.astype("<i8")
        return hashlib.sha256(self.coordinates.tobytes() + nodes.tobytes()).hexdigest()

    @cached_property
    def sets_digest(self) -> str:
        """SHA-256 of the cells of the bodies, and of the nodes that are held, moved, loaded and in
        contact, on rank 0. Collective."""
        drives = self.system.equilibrium.drives
        first = self.system.V.dofmap.index_map.local_range[0]
        n_drives = len(drives.names)
        is_anchor = (drives.rate[n_drives:] != 0).any(axis=0)
        marks = [drives.fixed & ~is_anchor]
        for of_drive in (*drives.rate[:n_drives], *drives.applied[:n_drives]):
            size = np.abs(of_drive)
            largest = self.system.comm.allreduce(size.max(initial=0.0), op=MPI.MAX)
            marks.append(size > _SOME * largest)
        for surface in self.system.contact.surfaces:
            touches = np.zeros((self._n_owned, 1), dtype=bool)
            own = surface.curve_dofs - first
            is_here = (own >= 0) & (own < self._n_owned)
            touches[own[is_here]] = True
            marks.append(touches)
        arrays = [self.collect(mark).astype(np.uint8) for mark in marks]
        arrays.append(self.bodies().astype("<i4"))
        content = b"".join(array.tobytes() for array in arrays)
        return hashlib.sha256(content).hexdigest()

    def bodies(self) -> np.ndarray:
        """Tag of the body of every cell ``(n,)`` on rank 0, nothing elsewhere. Collective."""
        problem = self.system.problem
        of_cells = np.zeros(self.n_cells, dtype=np.int32)
        for body in problem.bodies:
            cells = problem.cells_of(body)
            owned = cells[cells < self.n_cells]
            of_cells[owned] = problem.tag(body)
        return self.cells(of_cells)

    def facet_sets(self) -> dict[str, np.ndarray]:
        """The vertices ``(k, v)`` of every facet of the named sets, as nodes of the mesh, on rank
        0. Collective."""
        tagged = self.system.problem.mesh
        mesh = tagged.mesh
        facet = mesh.topology.dim - 1
        n_vertices = len(basix.topology(mesh.basix_cell())[facet][0])
        found = {}
        for name, tags in tagged.facet_sets.items():
            if not tags:
                continue
            facets = tagged.facets_in(name)
            vertices = np.zeros((0, n_vertices), dtype=np.int32)
            if len(facets):  # dolfinx divides by their number
                vertices = entities_to_geometry(mesh, facet, facets)[:, :n_vertices]
            dofs = self._dof_of_vertex[vertices]
            nodes = np.sort(self._index[dofs], axis=1)
            parts = self.system.comm.gather(nodes)
            if parts is not None:
                each_once = np.unique(np.concatenate(parts), axis=0)
                found[name] = np.searchsorted(self._nodes.unique, each_once)
        return found

    def at_points(
        self, values_of: Callable[[PointFields], Array], parts: Iterable[PointFields]
    ) -> np.ndarray:
        """The ``values_of`` all ``parts``, of all cells ``(n, q, ...)`` on rank 0; NaN where a cell
        has fewer than ``q`` points. Collective."""
        found = [(part.cells, values_of(part)) for part in parts]
        most = max(values.shape[1] for _, values in found)
        whole = np.zeros((self.n_cells, most, *found[0][1].shape[2:]))
        for cells, values in found:
            q = values.shape[1]
            whole[cells, :q] = values
            whole[cells, q:] = np.nan
        return self.cells(whole)

    def collect(self, u: Array) -> Array:
        """Nodal values ``(n_local, k)`` of all ranks on rank 0, nothing elsewhere. Collective."""
        return self._nodes(u[: self._n_owned])

    def spread(self, whole: Array | None) -> Array:
        """The inverse of `collect`: this rank's nodal values ``(n_local, k)``, ghosts included.
        Collective."""
        comm = self.system.comm
        index, values = comm.bcast((self._nodes.unique, whole) if comm.rank == 0 else None)
        return values[np.searchsorted(index, self._index)]

    def collect_history(self) -> Arrays:
        """Histories on rank 0: "history/PLACE/point", numbers of points that have one in rising
        order, and "history/PLACE/NAME" for every array of their state. Collective."""
        whole = {}
        for place, points, number in self._points():
            now = vars(points.state)
            virgin = vars(points.material.state(points.n))
            used = np.zeros(points.n, dtype=bool)
            for name, values in now.items():
                differs = values != virgin[name]
                used |= differs.any(axis=tuple(range(1, values.ndim)))
            gather = Gather(self.system.comm, number[used])
            stored = {"point": number} | now
            for name, values in stored.items():
                whole[f"history/{place}/{name}"] = gather(values[used])
        return whole

    def spread_history(self, whole: Arrays | None) -> None:
        """The inverse of `collect_history`: give every point its history. Collective."""
        stored: Arrays = self.system.comm.bcast(whole)
        for place, points, number in self._points():
            state = copy(points.material.state(len(number)))
            known = stored[f"history/{place}/point"]
            _, here, there = np.intersect1d(number, known, assume_unique=True, return_indices=True)
            for name, values in vars(state).items():
                key = f"history/{place}/{name}"
                if key in stored or name not in _NEWER:
                    # own classes may give one array for all, of integers or read-only
                    own = values.astype(np.result_type(values, stored[key]))
                    own[here] = stored[key][there]
                    vars(state)[name] = own
            points.state = points.trial = state

    def _points(self) -> Iterator[tuple[str, Points, np.ndarray]]:
        """The places with history, this rank's points there, and their numbers ``(n q,)``."""
        places = {}
        for tag, (cells, points) in self.system.bulk.histories().items():
            places[f"bulk {tag}"] = self._cell_index[cells], points
        places |= self.system.contact.histories()
        for place, (entity, points) in places.items():
            if points.state is not None:
                q = points.n // max(len(entity), 1)
                number = entity.astype(np.int64)[:, None] * q + np.arange(q)
                yield place, points, number.ravel()
