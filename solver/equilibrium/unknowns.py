"""The unknowns of equilibrium: displacements that are not prescribed, and levels of drives."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.compat import ghosted_vector
from archord.solver.drives import Drives


class Unknowns:
    """The displacements in the space ``V`` and the levels of its ``drives``. Collective.

    A vector of unknowns has the displacements of the rank's own nodes, prescribed ones included,
    and on rank 0 then the unknown levels, over their ``weight``. A *state* is an array of the
    displacements of all ``n_local`` nodes of the rank, then of all levels.

    u : displacements, ghosts included
    levels : (l,) levels of all drives
    fixed : (n_local, d) whether a displacement is prescribed
    """

    def __init__(self, V: fem.FunctionSpace, drives: Drives) -> None:
        index_map = V.dofmap.index_map
        self.V = V
        self.drives = drives
        self.comm = V.mesh.comm
        self.dimension = V.dofmap.index_map_bs
        self.n_owned = index_map.size_local
        self.n_local = index_map.size_local + index_map.num_ghosts
        self.n_dofs = self.dimension * self.n_owned  # displacements of the own nodes
        self.n_levels = len(drives.unknown)
        self._own_levels = self.n_levels if self.comm.rank == 0 else 0
        self.u = fem.Function(V, name="displacement")
        self.levels: Array = np.zeros(len(drives.rate))
        self.fixed = drives.fixed
        self._rate_of_fixed = drives.rate[:, drives.fixed]
        self._change = fem.Function(V)

    def vector(self) -> PETSc.Vec:
        """A vector of the unknowns."""
        if not self.n_levels:
            return ghosted_vector(self.V.dofmap.index_map, self.dimension)
        size = self.n_dofs + self._own_levels
        return PETSc.Vec().createMPI((size, None), comm=self.comm)

    def join(self, x: PETSc.Vec, u: Array, levels: Array) -> None:
        """Put displacements (or forces) ``u`` of the own nodes and unknown levels (or what their
        equations lack) into ``x``."""
        x.array[: self.n_dofs] = u.ravel()
        x.array[self.n_dofs :] = levels[: self._own_levels]

    def pack(self, load: float, state: Array, x: PETSc.Vec) -> None:
        """Put a ``state`` into ``x``, with the prescribed values at the ``load``."""
        drives = self.drives
        u, given = self.split(state)
        self.levels = drives.values(load)
        self.levels[drives.unknown] = given[drives.unknown]
        u = u.copy()
        u[self.fixed] = self.levels @ self._rate_of_fixed
        for turn in drives.turns:
            turn.displace(u, self.levels)
        self.join(x, u[: self.n_owned], self.levels[drives.unknown] / drives.weight)

    def take(self, x: PETSc.Vec) -> None:
        """Take displacements and levels from ``x``."""
        own = x.array_r
        if self.n_levels:
            self.levels[self.drives.unknown] = self._levels_in(own)
        self._displace(self.u, own, self.levels)

    def change(self, increment: Array) -> tuple[Array, Array]:
        """Displacements ``(n_local, d)`` and levels ``(l,)`` of an ``increment`` of this rank's
        unknowns."""
        levels = np.zeros_like(self.levels)
        if self.n_levels:
            levels[self.drives.unknown] = self._levels_in(increment)
        self._displace(self._change, increment, levels)
        return self._change.x.array.reshape(-1, self.dimension), levels

    def _levels_in(self, own: Array) -> Array:
        return self.drives.weight * self.comm.bcast(own[self.n_dofs :].copy())

    def _displace(self, u: fem.Function, own: Array, levels: Array) -> None:
        """Put the unknowns ``own`` of this rank into ``u``, with the prescribed displacements of
        the ``levels``."""
        u.x.array[: self.n_dofs] = own[: self.n_dofs]
        u.x.scatter_forward()
        u.x.array[self.fixed.ravel()] = levels @ self._rate_of_fixed
        for turn in self.drives.turns:
            turn.displace(u.x.array.reshape(-1, self.dimension), levels)

    def where_free(self, values: Array) -> Array:
        """The ``values`` ``(n_owned, d)`` with zeros where displacements are prescribed."""
        return np.where(self.fixed[: self.n_owned], 0.0, values)

    def displacement(self) -> Array:
        """A copy of the nodal displacements ``(n_local, d)``."""
        return self.u.x.array.reshape(-1, self.dimension).copy()

    def state(self) -> Array:
        """All that is solved for, as an array."""
        return np.append(self.u.x.array, self.levels)

    def split(self, state: Array) -> tuple[Array, Array]:
        """The displacements ``(n_local, d)`` and the levels ``(l,)`` of a ``state``."""
        n = self.dimension * self.n_local
        return state[:n].reshape(-1, self.dimension), state[n:]

    def restore(self, state: Array) -> None:
        """Go back to a ``state``."""
        u, levels = self.split(state)
        self.u.x.array[:] = u.ravel()
        self.levels = levels.copy()
