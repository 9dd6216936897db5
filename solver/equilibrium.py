"""Static equilibrium at a given load: the residual and the tangent of bulk and contact.

The load factor moves supports and rigid discs by their rates and multiplies the loads (see `control`).

The residual is internal minus contact forces and loads; rows of prescribed displacements are left out of it, and out of
the matrix with their columns, the contact's included. It is measured against the reaction of the supports, so that the
tolerance has no unit.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.la import InsertMode
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.meshes.fenicsx import create_vector
from archord.materials.material import Points
from archord.solver.bulk import Bulk
from archord.solver.contact.contact import Contact
from archord.solver.contact.law import Frictionless
from archord.solver.control import FactorControl, ForceControl
from archord.solver.interrupt import Interrupt, Interrupted
from archord.solver.linear.choose import choose
from archord.solver.linear.strategy import Facts
from archord.solver.problem import Body, Load, Problem
from archord.solver.tangent import TangentMatrix
from archord.solver.timer import BEFORE_SOLVING, Timer

_LOAD_DEGREE = 6  # of the quadrature of distributed forces
_MOVABLE = 1e-8  # stiffness of a rigid motion over the largest one, below which supports do not hold it


class Equilibrium:
    """Equilibrium of ``bulk`` and ``contact`` under the supports and loads of ``problem``. Collective.

    ``linear`` is the strategy that solves with the tangent of all unknowns. What the last evaluation left are the
    ``changes``, points that opened or closed, the ``reaction_norm`` and the ``noise``, a residual that is round-off,
    each over all ranks; ``largest_reaction`` is the largest norm of all accepted states.
    """

    def __init__(self, problem: Problem, bulk: Bulk, contact: Contact, timer: Timer) -> None:
        self.problem, self.bulk, self.contact, self.timer = problem, bulk, contact, timer
        self.V = V = bulk.V
        self.comm = V.mesh.comm
        self.interrupt = Interrupt()
        self.u = fem.Function(V, name="displacement")
        self.load = self.factor = 0.0
        index_map = V.dofmap.index_map
        self.n_owned = index_map.size_local
        self.n_local = index_map.size_local + index_map.num_ghosts
        self.fixed = np.zeros((self.n_local, 2), dtype=bool)
        self.rate = np.zeros((self.n_local, 2))
        self._supported: list[tuple[str, int, np.ndarray]] = []  # name, axis and nodes of every support
        x = V.tabulate_dof_coordinates()[:, :2]
        for s in problem.supports:
            nodes = problem.mesh.dofs_in(V, s.facets)
            self.fixed[nodes, s.axis] = True
            self.rate[nodes, s.axis] = s.rate(x[nodes]) if callable(s.rate) else s.rate
            self._supported.append((s.name, s.axis, nodes[nodes < self.n_owned]))
        self.applied = sum((self._nodal_forces(load) for load in problem.loads), np.zeros((self.n_owned, 2)))
        self._force = create_vector(index_map, 2)
        self._reaction = np.zeros((self.n_owned, 2))
        self.changes = 0
        self.reaction_norm = self.noise = self.largest_reaction = 0.0
        self._stiffest = max(float(body.material.elastic_tangent[0, 0]) for body in problem.bodies)
        frictionless = contact.pairs and all(isinstance(pair.law, Frictionless) for pair in contact.pairs)
        facts = Facts(
            self.comm,
            2 * index_map.size_global,
            bulk.plastic,
            problem.control == "force",
            contact.gamma_factor if frictionless else None,
            lambda: all(self._held(body) for body in problem.bodies),
        )
        self.choice = choose(facts)
        self._factoriser = partial(self.choice.factoriser, V)  # of tangents of all displacements
        condense = self.choice.uses("condensed")
        self.tangent = TangentMatrix(bulk, contact, self.fixed, self.rate, timer, condense=condense)
        self.control: FactorControl | ForceControl = FactorControl(V)
        with timer(BEFORE_SOLVING):
            if facts.by_force:
                rate = fem.Function(V)
                rate.x.array[:] = self.rate.ravel()
                self.control = ForceControl(self.tangent, rate, self._stiffest, self._factoriser)
            self._choose_linear()

    def _held(self, body: Body) -> bool:
        """Whether supports alone keep the ``body`` from moving rigidly. Collective."""
        nodes = np.unique(self.V.dofmap.list[self.problem.cells_of(body)])
        x = self.V.tabulate_dof_coordinates()[nodes, :2]
        x = x / self.comm.allreduce(np.abs(x).max(initial=0.0), op=MPI.MAX)
        one, none = np.ones(len(x)), np.zeros(len(x))
        along = np.stack([one, none, -x[:, 1]], axis=1), np.stack([none, one, x[:, 0]], axis=1)
        rows = np.concatenate([modes[self.fixed[nodes, axis]] for axis, modes in enumerate(along)])
        stiffness = np.linalg.eigvalsh(self.comm.allreduce(rows.T @ rows))
        return bool(stiffness[0] > _MOVABLE * stiffness[-1])

    def _nodal_forces(self, load: Load) -> Array:
        """Forces ``(n_owned, 2)`` on the modelled part per unit of the load factor."""
        V, mesh, problem = self.V, self.V.mesh, self.problem
        cells = problem.mesh.cells_in(load.cells)
        domain = [(1, cells[cells < mesh.topology.index_map(2).size_local])]
        dx = ufl.Measure("dx", mesh, subdomain_data=domain, metadata={"quadrature_degree": _LOAD_DEGREE})(1)
        force = fem.Constant(mesh, np.array(load.force))
        density = fem.Constant(mesh, 1.0) if load.density is None else load.density(ufl.SpatialCoordinate(mesh))
        total = self.comm.allreduce(fem.assemble_scalar(fem.form(density * dx)))
        vector = fem.assemble_vector(fem.form(density * ufl.inner(force, ufl.TestFunction(V)) * dx))
        vector.scatter_reverse(InsertMode.add)
        return vector.array[: 2 * self.n_owned].reshape(-1, 2) / (problem.symmetry * total)

    def pack(self, state: Array, x: PETSc.Vec) -> None:
        """Put ``state``, shaped like `state`, with its prescribed values replaced, into the unknowns ``x``."""
        self.factor = self.control.start(self.load, float(state[-1]))
        u = state[:-1].reshape(-1, 2).copy()
        u[self.fixed] = self.factor * self.rate[self.fixed]
        self.control.join(x, u[: self.n_owned].ravel(), self.factor)

    def _choose_linear(self) -> None:
        self.linear = self.control.border or self.tangent.condensed or self._factoriser(self.tangent.A)

    def update_tangent(self, *, factorise: bool = True) -> None:
        """Assemble the tangent of the last evaluation, to be factorised or not. Collective."""
        self.tangent.update(factorise=factorise)
        self.control.follow(self.tangent, factorise=factorise)

    def _follow_pattern(self) -> bool:
        """Replace the matrix where the pairs of the last evaluation slid out of its pattern; returns whether."""
        if self._pattern_grew:
            self.tangent.renew()
            self.control.replace(self.tangent.A)
            self._choose_linear()
        return self._pattern_grew

    def residual_of(self, x: PETSc.Vec, f: PETSc.Vec) -> bool:
        """The residual ``f`` at the unknowns ``x``; returns whether there is another tangent matrix now. Collective.
        Raises `ProjectionError` if a contact point finds no partner, and what `evaluate` raises."""
        self.u.x.array[: 2 * self.n_owned] = x.array_r[: 2 * self.n_owned]
        self.u.x.scatter_forward()
        self.factor = self.control.factor(x)
        self.u.x.array[self.fixed.ravel()] = self.factor * self.rate[self.fixed]
        self.evaluate()
        renewed = self._follow_pattern()
        missing = self.force_on_factor() - self.load / self.problem.symmetry if self.control.border else 0.0
        self.control.join(f, self._where_free().ravel(), missing)
        return renewed

    def evaluate(self) -> None:
        """Residual, reactions and trial history at the current displacement and load. Raises `Interrupted` on every
        rank if ``interrupt`` was received by any."""
        u = self.u.x.array.reshape(-1, 2)
        with self.timer("return mapping"):
            self.bulk.update(u)
        with self.timer("assemble force"):
            with self._force.localForm() as local:
                local.set(0.0)
            self.bulk.add_force(self.u.x.petsc_vec, self._force)
        with self.timer("contact"):
            self.contact.move(self.factor)
            self._pattern_grew = self.contact.evaluate(u)
            self.contact.add_force(self._force.array.reshape(-1, 2))
        self._force.array[:] -= self.factor * self.applied.ravel()
        self._reaction = np.where(self.fixed[: self.n_owned], self._force.array_r.reshape(-1, 2), 0.0)
        totals = np.array(
            [
                (self._reaction**2).sum(),
                self.contact.round_off() ** 2,
                self.interrupt.received > 0,
                self.contact.active_set_changes,
            ]
        )
        self.comm.Allreduce(MPI.IN_PLACE, totals)
        self.changes = int(totals[3])
        self.reaction_norm, contact_noise = np.sqrt(totals[:2])
        # the bulk's are forces that a rigid motion of the size of the displacement leaves
        largest = self.comm.allreduce(np.abs(self.u.x.array).max(initial=0.0), op=MPI.MAX)
        self.noise = 1e-13 * self._stiffest * min(largest, self.problem.travel) + contact_noise
        if totals[2]:
            raise Interrupted(self.comm.allreduce(self.interrupt.received, op=MPI.MAX))

    def _where_free(self) -> Array:
        """The forces of the last evaluation ``(n_owned, 2)`` where displacements are not prescribed, zero elsewhere."""
        return np.where(self.fixed[: self.n_owned], 0.0, self._force.array_r.reshape(-1, 2))

    def reaction(self, name: str) -> Array:
        """Force ``(2,)`` of the supports ``name`` on the modelled part at the last evaluation, over all ranks."""
        total = np.zeros(2)
        for support, axis, nodes in self._supported:
            if support == name:
                total[axis] += self._reaction[nodes, axis].sum()
        return self.comm.allreduce(total)

    def force_on_factor(self) -> float:
        """Force that works on the load factor: those of supports and rigid discs along their rates, over all ranks."""
        on_supports = self.comm.allreduce(float((self._reaction * self.rate[: self.n_owned]).sum()))
        return on_supports + self.contact.force_on_factor()

    def points(self) -> list[Points]:
        """The points of bulk and contact, of materials and of contact laws."""
        return [points for part in (self.bulk, self.contact) for _, points in part.histories().values()]

    def plastic_points(self) -> list[Points]:
        """Those that can yield."""
        return [points for points in self.points() if points.yields]

    def worst_place(self) -> tuple[float, float] | None:
        """Where the residual is largest, over all ranks."""
        size = np.nan_to_num(np.linalg.norm(self._where_free(), axis=1), nan=-1.0, posinf=-1.0)
        at = int(np.argmax(size)) if len(size) else 0
        x = self.V.tabulate_dof_coordinates()[at, :2] if len(size) else np.zeros(2)
        value, place = max(self.comm.allgather((size.max(initial=-1.0), tuple(x))))
        return place if value >= 0 else None

    def displacement(self) -> Array:
        """A copy of the nodal displacements ``(n_local, 2)``."""
        return self.u.x.array.reshape(-1, 2).copy()

    def state(self) -> Array:
        """All that is solved for: nodal displacements ``(2 n_local,)`` of this rank, then the load factor."""
        return np.append(self.u.x.array, self.factor)

    def restore(self, load: float, state: Array) -> None:
        """Go back to an accepted state; the history was never touched."""
        self.load, self.factor = load, float(state[-1])
        self.u.x.array[:] = state[:-1]

    def resume(self, load: float, state: Array, largest_reaction: float) -> None:
        """Take up an accepted state of an earlier process, whose history the points have already, and evaluate it."""
        self.restore(load, state)
        self.largest_reaction = largest_reaction
        self.contact.search()
        self.evaluate()
        self._follow_pattern()

    def commit(self) -> None:
        """Accept the last solve: bulk and contact keep their trial history."""
        self.largest_reaction = max(self.largest_reaction, self.reaction_norm)
        for points in self.points():
            points.commit()
