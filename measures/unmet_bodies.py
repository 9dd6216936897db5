"""Bodies that pass through each other, where no interaction lets them touch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array, displacement_element, lagrange_element, table_of
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.kernels.compat import cell_degree, cell_nodes
from archord.report.doubts import Doubt
from archord.solver.contact.laws.named import NAMES

if TYPE_CHECKING:
    from archord.solver.path.system import System
    from archord.solver.problem import Body

_DEEP = 0.02  # of the largest displacement: how deep bodies may lie in each other by round-off


class UnmetBodies:
    """The ``pairs`` of bodies of a ``system`` that must not lie in each other: all but those whose
    contact is soft, wears, or is a press fit. Collective."""

    def __init__(self, system: System) -> None:
        self.system = system
        problem = system.problem
        allowed = []
        for part in problem.interactions:
            surfaces = [name for name in part.surfaces if isinstance(name, str)]
            bodies = {problem.body_of(name).name for name in surfaces}
            if part.law not in NAMES or part.overlap or part.interference:
                allowed.append(bodies)
        pairs = combinations(problem.bodies, 2)
        self.pairs = [pair for pair in pairs if {body.name for body in pair} not in allowed]

    def doubts(self) -> Iterator[str]:
        """A warning of each pair that lies in each other at the last displacements, at the ends of
        the stages of the path."""
        if self.system.equilibrium.load % 1:
            return
        u = self.system.equilibrium.displacement()
        near = self._near(u)
        if not near:
            return
        largest = self.system.comm.allreduce(np.abs(u).max(initial=0.0), op=MPI.MAX)
        mesh = self._deformed(u)
        found: list[tuple[str, str, float]] = []
        if mesh is not None:
            found = [at for pair in near for at in _passing(mesh, pair, _DEEP * largest)]
        for a, b, deep in self.system.comm.bcast(found):
            text = f"{a!r} and {b!r} pass through each other, where no interaction lets them touch"
            yield Doubt(f"{text}: one lies {deep:.3g} deep in the other", deep)

    def _near(self, u: Array) -> list[tuple[Body, Body]]:
        """The pairs whose boxes around the deformed bodies have a part in common."""
        x = self.system.V.tabulate_dof_coordinates()[:, : u.shape[1]] + u
        bodies = self.system.problem.bodies
        nodes = [self.system.nodes_of(body) for body in bodies]
        low = np.array([x[of_body].min(axis=0, initial=np.inf) for of_body in nodes])
        high = np.array([x[of_body].max(axis=0, initial=-np.inf) for of_body in nodes])
        self.system.comm.Allreduce(MPI.IN_PLACE, low, op=MPI.MIN)
        self.system.comm.Allreduce(MPI.IN_PLACE, high, op=MPI.MAX)
        near = []
        for pair in self.pairs:
            both = [bodies.index(body) for body in pair]
            if (low[both].max(axis=0) < high[both].min(axis=0)).all():
                near.append(pair)
        return near

    @cached_property
    def _drawn(self) -> MeshArrays | None:
        from archord.geometry.meshes.fenicsx import gathered

        return gathered(self.system.problem.mesh)

    def _deformed(self, u: Array) -> MeshArrays | None:
        """The mesh on rank 0, its nodes moved by the displacements ``u`` ``(n_nodes, d)``."""
        drawn = self._drawn
        mesh = self.system.problem.mesh.mesh
        cell = mesh.basix_cell()
        nodes = lagrange_element(cell, cell_degree(mesh)).points
        shape = table_of(displacement_element(cell, self.system.problem.degree), nodes)[0]
        x = mesh.geometry.x[:, : u.shape[1]].copy()
        cells = cell_nodes(mesh)
        x[cells] += np.einsum("ab,nbi->nai", shape, u[self.system.V.dofmap.list])
        parts = self.system.comm.gather((mesh.geometry.input_global_indices, x))
        if drawn is None or parts is None:
            return None
        number, x = map(np.concatenate, zip(*parts, strict=True))
        _, first = np.unique(number, return_index=True)
        return replace(drawn, x=x[first])


def _passing(
    mesh: MeshArrays, pair: tuple[Body, Body], allowed: float
) -> list[tuple[str, str, float]]:
    """The names of a ``pair`` of bodies and how deep one lies in the other, deeper than is
    ``allowed``; empty where none does."""
    from archord.geometry.meshes.overlap import depths

    inside = {body.name: np.isin(mesh.bodies, mesh.cell_sets[body.cells]) for body in pair}
    found = [deep for _, _, deep, _ in depths(mesh, inside, allowed)]
    a, b = inside
    return [(a, b, max(found))] if found else []
