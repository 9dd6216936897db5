"""A problem, assembled: displacement space, bulk, contact, equilibrium, Newton's method, and the path of its loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import basix.ufl
import numpy as np
from dolfinx import fem
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.solver.bulk import Bulk
from archord.solver.contact.contact import Contact
from archord.solver.contact.interaction import Interface, Rigid
from archord.solver.contact.surface import RigidSurface, Surface
from archord.solver.equilibrium import Equilibrium
from archord.solver.load_path import LoadPath, Position
from archord.solver.newton import NewtonSolver
from archord.solver.problem import Body, Problem
from archord.solver.recovery import Recovery
from archord.solver.stepping import StepRules, march
from archord.solver.timer import Timer

if TYPE_CHECKING:
    from archord.solver.coarse_start import CoarseStart


class System:
    """``problem`` ready to be solved; forces and energies are those of the whole, its symmetric parts included.

    ``sides`` holds the surfaces of bodies in contact by the name of their facet set. Collective; raises ValueError for
    a problem that contradicts itself and `ProjectionError` if a surface does not find its opposite.
    """

    def __init__(self, problem: Problem, *, timer: Timer | None = None) -> None:
        self.problem, self.timer = problem, timer or Timer()
        self.comm = problem.mesh.mesh.comm
        with self.timer("setup"):
            variant = basix.LagrangeVariant.equispaced
            mesh, degree = problem.mesh.mesh, problem.degree
            element = basix.ufl.element("P", mesh.basix_cell(), degree, shape=(2,), lagrange_variant=variant)
            self.V = fem.functionspace(mesh, element)
            materials = {problem.tag(body): body.material for body in problem.bodies}
            cells = {problem.tag(body): problem.cells_of(body) for body in problem.bodies}
            self.bulk = Bulk(self.V, cells, materials)
            self.sides: dict[str, Surface] = {}
            surfaces = [[self._surface(given, i.name) for given in i.surfaces] for i in problem.interactions]
            self.contact = Contact(self.V, list(map(Interface, problem.interactions, surfaces)))
            self.equilibrium = Equilibrium(problem, self.bulk, self.contact, self.timer)
            self.solver = Recovery(NewtonSolver(self.equilibrium))
        self._path: LoadPath | None = None

    def _surface(self, given: str | Rigid, interaction: str) -> Surface | RigidSurface:
        if isinstance(given, Rigid):
            return RigidSurface(given.circle, given.rate)
        name = given if given not in self.sides else f"{given} ({interaction})"
        mesh, material = self.problem.mesh, self.problem.body_of(given).material
        self.sides[name] = Surface(self.V, mesh.facets_in(given), material, name)
        return self.sides[name]

    def nodes_of(self, body: Body) -> np.ndarray:
        """Nodes ``(n,)`` of the ``body`` on this rank, ghosts included."""
        return np.unique(self.V.dofmap.list[self.problem.cells_of(body)])

    def solve(self, loads: Sequence[float], rules: StepRules | None = None) -> None:
        """Follow the path of the ``loads``, from where the last call has ended. Raises `StepFailure`."""
        self._path = self._path or self.load_path()
        self._path.at.targets_done, self._path.at.size = 0, None
        march(self._path, loads, rules=rules)

    def load_path(self, at: Position | None = None, coarse: CoarseStart | None = None) -> LoadPath:
        """The path of the problem's loads, from the position ``at`` or the beginning."""
        return LoadPath(self.solver, self.first_guess, at, coarse)

    def first_guess(self, load: float) -> Array:
        """A state of the equilibrium, with every body moved rigidly as the problem's guess says."""
        guess = self.problem.guess(load)
        u = np.zeros((self.equilibrium.n_local, 2))
        for body in self.problem.bodies:
            u[self.nodes_of(body)] = guess.moved.get(body.name, 0.0)
        return np.append(u, guess.factor)

    def reaction(self, name: str) -> Array:
        """Force ``(2,)`` of the supports ``name`` on the whole."""
        return self.problem.symmetry * self.equilibrium.reaction(name)

    def contact_force(self) -> Array:
        """Force ``(2,)`` of the contact on its second surface."""
        return self.problem.symmetry * self.contact.resultant()

    def driving_force(self) -> float:
        """The force whose work is that of the load: on the load factor, or the load where there are ``loads``."""
        if self.problem.loads:
            return self.equilibrium.load
        return self.problem.symmetry * self.equilibrium.force_on_factor()

    def driven(self) -> float:
        """The displacement on which that force works: the load factor, or the mean one along the ``loads``."""
        if not self.problem.loads:
            return self.equilibrium.factor
        u = self.equilibrium.displacement()[: self.equilibrium.n_owned]
        return self.problem.symmetry * self.comm.allreduce(float((self.equilibrium.applied * u).sum()))

    def energies(self) -> tuple[float, float]:
        """Elastic energy and plastic dissipation of the whole."""
        parts = np.array(self.bulk.energies(self.equilibrium.displacement()))
        stored, dissipated = self.problem.symmetry * self.comm.allreduce(parts)
        return float(stored), float(dissipated)

    def peeq(self) -> tuple[float, float]:
        """Largest PEEQ at a quadrature point, and the integral of PEEQ over the whole."""
        largest, integral = self.bulk.peeq()
        return self.comm.allreduce(largest, op=MPI.MAX), self.problem.symmetry * self.comm.allreduce(integral)

    @property
    def factorisations(self) -> int:
        """Number of sparse factorisations so far."""
        return self.equilibrium.tangent.factorisations

    @property
    def n_dofs(self) -> int:
        """Number of displacement dofs, prescribed ones included."""
        return 2 * self.V.dofmap.index_map.size_global

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self.problem.mesh.mesh.topology.index_map(2).size_global
