"""Fields and histories in the order of the mesh generator, whatever the number of ranks and their
cut of the mesh.

Rank 0 holds what is collected. The number of a point is that of its cell or facet times points per
cell, plus its own. Neither the order of a cell's nodes, and so of its points, nor that along a
contact edge depends on the ranks.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator

import basix
import numpy as np
from dolfinx.mesh import entities_to_geometry
from mpi4py import MPI

from archord.geometry.basis import Array, tabulate
from archord.kernels.compat import cell_degree, cell_nodes
from archord.materials.material import Points
from archord.solver.bulk import PointFields
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


class MeshOrder:
    """The generator's order of the nodes and cells of ``system``. Collective.

    ``coordinates`` ``(n, 3)`` and ``nodes_of_cell`` ``(n, a)`` are the mesh in that order, on rank
    0; cells are of one ``kind``. Nodes are the displacement's: where the geometry is of another order, they come as the cells
    first name them.
    """

    def __init__(self, system: System) -> None:
        self.system, V = system, system.V
        mesh, geometry, dofs = V.mesh, V.mesh.geometry, V.dofmap.list
        self.kind = mesh.basix_cell()
        self.n_cells = mesh.topology.index_map(2).size_local
        self._n_local, self._n_owned = system.equilibrium.n_local, V.dofmap.index_map.size_local
        self._cell_index = np.asarray(mesh.topology.original_cell_index)[: self.n_cells]
        self.cells = Gather(system.comm, self._cell_index)
        index, owned = np.asarray(geometry.input_global_indices), geometry.index_map().size_local
        nodes = Gather(system.comm, index[:owned])
        self.coordinates, cells = (
            nodes(geometry.x[:owned]),
            self.cells(index[cell_nodes(mesh)[: self.n_cells]]),
        )
        root = system.comm.rank == 0
        self.nodes_of_cell = np.searchsorted(nodes.unique, cells) if root else cells
        if V.element.basix_element.degree == cell_degree(
            mesh
        ):  # both number the nodes of a cell alike
            self._index = np.zeros(self._n_local, dtype=np.int64)
            self._index[dofs] = index[cell_nodes(mesh)]
        else:
            numbers = V.dofmap.index_map.local_to_global(np.arange(self._n_local, dtype=np.int32))
            of_cells, first = self.cells(numbers[dofs[: self.n_cells]]), None
            if root:
                at = tabulate(mesh.basix_cell(), cell_degree(mesh), V.element.basix_element.points)[
                    0
                ]
                places = np.einsum("qa,nai->nqi", at, self.coordinates[self.nodes_of_cell]).reshape(
                    -1, 3
                )
                first = np.unique(of_cells, return_index=True)[1]
                self.coordinates = places[np.sort(first)]
                self.nodes_of_cell = np.searchsorted(np.sort(first), first[of_cells])
            self._index = system.comm.bcast(first)[numbers]
        self._nodes = Gather(system.comm, self._index[: self._n_owned])
        corners = slice(len(basix.topology(mesh.basix_cell())[0]))  # come first in every cell
        self._dof_of_vertex = np.zeros(len(geometry.x), dtype=np.int64)
        self._dof_of_vertex[cell_nodes(mesh)[:, corners]] = dofs[:, corners]

    def mesh_digest(self) -> str:
        """SHA-256 of coordinates and cells, on rank 0."""
        return hashlib.sha256(
            self.coordinates.tobytes() + self.nodes_of_cell.astype("<i8").tobytes()
        ).hexdigest()

    def bodies(self) -> np.ndarray:
        """Tag of the body of every cell ``(n,)`` on rank 0, nothing elsewhere. Collective."""
        problem, of_cells = self.system.problem, np.zeros(self.n_cells, dtype=np.int32)
        for body in problem.bodies:
            cells = problem.cells_of(body)
            of_cells[cells[cells < self.n_cells]] = problem.tag(body)
        return self.cells(of_cells)

    def facet_sets(self) -> dict[str, np.ndarray]:
        """Both vertices ``(k, 2)`` of every facet of the named sets, as nodes of the mesh, on rank
        0. Collective."""
        tagged, comm = self.system.problem.mesh, self.system.comm
        mesh, found = tagged.mesh, {}
        for name in (name for name, tags in tagged.facet_sets.items() if tags):
            facets = tagged.facets_in(name)
            # dolfinx divides by their number
            ends = (
                entities_to_geometry(mesh, 1, facets)[:, :2]
                if len(facets)
                else np.zeros((0, 2), dtype=np.int32)
            )
            parts = comm.gather(np.sort(self._index[self._dof_of_vertex[ends]], axis=1))
            if parts is not None:
                found[name] = np.searchsorted(
                    self._nodes.unique, np.unique(np.concatenate(parts), axis=0)
                )
        return found

    def at_points(self, name: str, parts: Iterable[PointFields]) -> np.ndarray:
        """The attribute ``name`` of `PointFields` of all cells ``(n, q, ...)`` on rank 0.
        Collective."""
        cells, values = zip(*((part.cells, getattr(part, name)) for part in parts), strict=True)
        whole = np.zeros((self.n_cells, *values[0].shape[1:]))
        whole[np.concatenate(cells)] = np.concatenate(values)
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
            now, virgin = vars(points.state), vars(points.material.state(points.n))
            changed = [
                (v != virgin[name]).any(axis=tuple(range(1, v.ndim))) for name, v in now.items()
            ]
            used = np.logical_or.reduce(changed)
            gather = Gather(self.system.comm, number[used])
            for name, values in ({"point": number} | now).items():
                whole[f"history/{place}/{name}"] = gather(values[used])
        return whole

    def spread_history(self, whole: Arrays | None) -> None:
        """The inverse of `collect_history`: give every point its history. Collective."""
        stored: Arrays = self.system.comm.bcast(whole)
        for place, points, number in self._points():
            state, known = points.material.state(len(number)), stored[f"history/{place}/point"]
            _, here, there = np.intersect1d(number, known, assume_unique=True, return_indices=True)
            for name, values in vars(state).items():
                values[here] = stored[f"history/{place}/{name}"][there]
            points.state = points.trial = state

    def _points(self) -> Iterator[tuple[str, Points, np.ndarray]]:
        """The places with history, this rank's points there, and their numbers ``(n q,)``."""
        found = {
            f"bulk {tag}": (self._cell_index[c], p)
            for tag, (c, p) in self.system.bulk.histories().items()
        }
        for place, (entity, points) in (found | self.system.contact.histories()).items():
            if points.state is not None:
                q = points.n // max(len(entity), 1)
                yield place, points, (entity.astype(np.int64)[:, None] * q + np.arange(q)).ravel()
