"""Static equilibrium at a given load: the residual and the tangent of bulk and contact.

The residual is internal minus contact forces and loads; rows of prescribed displacements are left
out of it, and out of the matrix with their columns. It is measured against the reaction of the
supports: the tolerance has no unit.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.compat import ghosted_vector
from archord.kernels.interrupt import Interrupt, Interrupted
from archord.materials.material import Points
from archord.report.timer import BEFORE_SOLVING, Timer
from archord.solver.bulk import Bulk
from archord.solver.contact.contact import Contact
from archord.solver.drives import Drives
from archord.solver.linear.bordered import Border, Bordered
from archord.solver.linear.choose import choose
from archord.solver.linear.strategy import Facts
from archord.solver.problem import Problem
from archord.solver.stabilisation import RigidMotions, Springs
from archord.solver.tangent import TangentMatrix


class Equilibrium:
    """Equilibrium of ``bulk`` and ``contact`` under the drives of ``problem`` at their ``levels``
    ``(d,)``. Collective.

    ``linear`` is the strategy that solves with the tangent of all unknowns, ``border`` that of the
    unknown levels. What the last evaluation left are the ``changes``, points that opened or closed,
    the ``reaction_norm`` and the ``noise``, a residual that is round-off, each over all ranks;
    ``largest_reaction`` is the largest norm of all accepted states.
    """

    def __init__(self, problem: Problem, bulk: Bulk, contact: Contact, timer: Timer) -> None:
        self.problem, self.bulk, self.contact, self.timer = problem, bulk, contact, timer
        self.V, self.comm, V = bulk.V, bulk.V.mesh.comm, bulk.V
        self.interrupt, self.u, self._increment = (
            Interrupt(),
            fem.Function(V, name="displacement"),
            fem.Function(V),
        )
        self.load, index_map = 0.0, V.dofmap.index_map
        self.n_owned, self.n_local = (
            index_map.size_local,
            index_map.size_local + index_map.num_ghosts,
        )
        self._stiffest = max(float(body.material.elastic_tangent[0, 0]) for body in problem.bodies)
        self.drives = drives = Drives(problem, V, contact, self._stiffest)
        self.levels: Array = np.zeros(len(drives.rate))
        self._accepted_load = 0.0
        self.fixed, self._rate_of_fixed = drives.fixed, drives.rate[:, drives.fixed]
        self._force = ghosted_vector(index_map, 2)
        self._reaction = np.zeros((self.n_owned, 2))
        self.changes = 0
        self.reaction_norm = self.noise = self.largest_reaction = 0.0
        closing = contact.pairs and all(pair.law.unilateral for pair in contact.pairs)
        dofs, by_force = 2 * index_map.size_global, len(drives.unknown) > 0
        gamma = contact.gamma_factor if closing else None
        facts = Facts(
            self.comm, dofs, bulk.plastic, contact.has_friction, bulk.finite, by_force, gamma,
            lambda: all(map(drives.held, problem.bodies)),
        )  # fmt: skip
        self.choice = choose(facts)
        self._factoriser = partial(self.choice.factoriser, V)  # of tangents of all displacements
        condense = self.choice.uses("condensed")
        rigid = RigidMotions(drives, contact) if problem.stabilise else None
        self.springs = Springs(rigid, self._stiffest) if rigid and len(rigid.free) else None
        self.tangent = TangentMatrix(bulk, contact, drives, self.springs, timer, condense=condense)
        self.border: Bordered | None = None
        with timer(BEFORE_SOLVING):
            if by_force:
                self.border = Bordered(
                    self.tangent.A, len(drives.unknown), self._stiffest, self._factoriser
                )
            self._choose_linear()

    def pack(self, state: Array, x: PETSc.Vec) -> None:
        """Put ``state``, shaped like `state`, with its prescribed values replaced, into the
        unknowns ``x``."""
        drives, given = self.drives, state[2 * self.n_local :]
        self.levels = drives.values(self.load)
        self.levels[drives.unknown] = given[drives.unknown]
        u = state[: 2 * self.n_local].reshape(-1, 2).copy()
        u[self.fixed] = self.levels @ self._rate_of_fixed
        self._join(x, u[: self.n_owned], self.levels[drives.unknown] / drives.weight)

    def vector(self) -> PETSc.Vec:
        """A vector of all unknowns of this rank."""
        return self.border.vector() if self.border else ghosted_vector(self.V.dofmap.index_map, 2)

    def _join(self, x: PETSc.Vec, u: Array, levels: Array) -> None:
        """Put displacements (or forces) ``u`` and unknown levels (or what their equations lack)
        into ``x``."""
        n = 2 * self.n_owned
        x.array[:n], x.array[n:] = u.ravel(), levels[: x.local_size - n]

    def _choose_linear(self) -> None:
        self.linear = self.border or self.tangent.condensed or self._factoriser(self.tangent.A)

    def update_tangent(self, *, factorise: bool = True) -> None:
        """Assemble the tangent of the last evaluation, to be factorised or not. Collective."""
        self.tangent.update(factorise=factorise)
        if self.border:
            with self.timer("assemble border"):
                self.border.update(*self.tangent.border(), factorise=factorise)

    def _follow_pattern(self) -> bool:
        """Replace the matrix where the pairs of the last evaluation slid out of its pattern;
        returns whether."""
        if self._pattern_grew:
            self.tangent.renew()
            self.renew_factorisation()
            self._choose_linear()
        return self._pattern_grew

    def renew_factorisation(self) -> None:
        """Take note that the tangent is another matrix, or has to be factorised once more."""
        if self.border:
            self.border.replace(self.tangent.A)

    def residual_of(self, x: PETSc.Vec, f: PETSc.Vec) -> bool:
        """The residual ``f`` at the unknowns ``x``; returns whether there is another tangent matrix
        now. Collective. Raises `ProjectionError` if a contact point finds no partner, and what
        `evaluate` raises."""
        self.u.x.array[: 2 * self.n_owned] = x.array_r[: 2 * self.n_owned]
        self.u.x.scatter_forward()
        drives = self.drives
        lacking: Array = np.zeros(0)
        if self.border:
            self.levels[drives.unknown] = drives.weight * self.border.last.levels(x)
        self.u.x.array[self.fixed.ravel()] = self.levels @ self._rate_of_fixed
        self.evaluate()
        renewed = self._follow_pattern()
        if self.border:
            wanted = drives.values(self.load) / self.problem.symmetry
            lacking = drives.weight * (self.conjugates() - wanted)[drives.unknown]
        self._join(f, self._where_free(), lacking)
        return renewed

    def evaluate(self) -> None:
        """Residual, reactions and trial history at the current state. Raises `Interrupted`, on
        every rank."""
        u = self.u.x.array.reshape(-1, 2)
        with self.timer("return mapping"):
            self.bulk.update(u)
        with self.timer("assemble force"):
            with self._force.localForm() as local:
                local.set(0.0)
            self.bulk.add_force(self.u.x.petsc_vec, self._force)
        with self.timer("contact"):
            self.contact.move(self.levels, self.problem.fitted(self.load))
            dt = abs(self.load - self._accepted_load)
            self._pattern_grew = self.contact.evaluate(u, dt)
            self.contact.add_force(self._force.array.reshape(-1, 2))
        applied = np.tensordot(self.levels, self.drives.applied, 1)
        self._force.array[:] -= applied.ravel()
        if self.springs:
            self.springs.evaluate(self.u.x.array[: 2 * self.n_owned], self.levels)
            self._force.array[:] += self.springs.forces
        self._reaction = np.where(
            self.fixed[: self.n_owned], self._force.array_r.reshape(-1, 2), 0.0
        )
        squares = (self._reaction**2).sum() + (applied**2).sum(), self.contact.round_off() ** 2
        totals = np.array([*squares, self.interrupt.received > 0, self.contact.active_set_changes])
        self.comm.Allreduce(MPI.IN_PLACE, totals)
        self.changes = int(totals[3])
        self.reaction_norm, contact_noise = np.sqrt(totals[:2])
        # the bulk's are forces that a rigid motion of the size of the displacement leaves
        largest = self.comm.allreduce(np.abs(self.u.x.array).max(initial=0.0), op=MPI.MAX)
        self.noise = 1e-13 * self._stiffest * min(largest, self.problem.travel) + contact_noise
        if totals[2]:
            raise Interrupted(self.comm.allreduce(self.interrupt.received, op=MPI.MAX))

    def revised(self, increment: Array) -> tuple[PETSc.Mat, Array] | None:
        """Go over to the points that touch and stick after an ``increment`` of this rank's
        unknowns: another matrix for them, valid until the next one, and what they add to the
        residual; None if no point changes. Collective."""
        n, levels = 2 * self.n_owned, np.zeros_like(self.levels)
        if self.border:
            levels[self.drives.unknown] = self.drives.weight * self.comm.bcast(increment[n:])
        with self.timer("contact"):
            u = self._increment.x
            u.array[:n] = increment[:n]
            u.scatter_forward()
            u.array[self.fixed.ravel()] = levels @ self._rate_of_fixed
            before = self._contact_residual()
            if not self.contact.anticipate(u.array.reshape(-1, 2), levels):
                return None
            change = self._contact_residual() - before
        matrix, blocks = self.tangent.revised()
        if self.border:
            matrix = Border(matrix, *self.tangent.border(blocks)).matrix()
        return matrix, change

    def _contact_residual(self) -> Array:
        """The contact's part of the residual at this rank's unknowns."""
        force, drives = np.zeros((self.n_owned, 2)), self.drives
        self.contact.add_force(force)
        free = np.where(self.fixed[: self.n_owned], 0.0, force).ravel()
        if not self.border:
            return free
        rates = drives.unknown_rate[:, : self.n_owned].reshape(len(drives.weight), -1)
        on_rigid = np.broadcast_to(self.contact.force_on_drives(), self.levels.shape)[
            drives.unknown
        ]
        on_levels = self.comm.allreduce(rates @ (force.ravel() - free)) + drives.weight * on_rigid
        return np.append(free, on_levels[: self.border.last.extra])

    def _where_free(self) -> Array:
        """The forces of the last evaluation ``(n_owned, 2)`` where displacements are not
        prescribed, zero elsewhere."""
        return np.where(self.fixed[: self.n_owned], 0.0, self._force.array_r.reshape(-1, 2))

    def reaction(self, name: str) -> Array:
        """Forces ``(n_owned, 2)`` of the supports and means ``name`` on the nodes at the last
        evaluation."""
        drives, means = (
            self.drives,
            [mean.drive for mean in self.problem.means if mean.name == name],
        )
        levels = [drives.names.index(drive) for drive in means]
        spread = np.tensordot(self.levels[levels], drives.applied[levels], 1)
        return drives.share_of(name) * self._reaction + spread

    def conjugates(self) -> Array:
        """What is conjugate to the levels ``(d,)``, of the modelled part: forces on what moves,
        that of contact on rigid discs included, and displacements along applied forces; over all
        ranks."""
        u, drives = self.u.x.array[: 2 * self.n_owned], self.drives
        rates = drives.rate[:, : self.n_owned].reshape(len(self.levels), -1)
        own = rates @ self._reaction.ravel() + drives.applied.reshape(rates.shape) @ u
        on_levels = self.springs.on_levels if self.springs else 0.0
        return self.comm.allreduce(own) + self.contact.force_on_drives() + on_levels

    def points(self) -> list[Points]:
        """The points of bulk and contact, of materials and of contact laws."""
        return [
            points for part in (self.bulk, self.contact) for _, points in part.histories().values()
        ]

    def plastic_points(self) -> list[Points]:
        """Those that can yield."""
        return [points for points in self.points() if points.yields]

    def residual_on(self, nodes: np.ndarray) -> Array:
        """Sum ``(2,)`` of the residual over the owned ones of these ``nodes`` of all ranks."""
        return self.comm.allreduce(self._where_free()[nodes[nodes < self.n_owned]].sum(axis=0))

    def worst_place(self) -> tuple[float, float] | None:
        """Where the residual is largest, over all ranks."""
        size = np.nan_to_num(np.linalg.norm(self._where_free(), axis=1), nan=-1.0, posinf=-1.0)
        at = size.argmax() if len(size) else 0
        x = self.V.tabulate_dof_coordinates()[at, :2] if len(size) else np.zeros(2)
        value, place = max(self.comm.allgather((size.max(initial=-1.0), tuple(x))))
        return place if value >= 0 else None

    def displacement(self) -> Array:
        """A copy of the nodal displacements ``(n_local, 2)``."""
        return self.u.x.array.reshape(-1, 2).copy()

    def state(self) -> Array:
        """All that is solved for: nodal displacements ``(2 n_local,)`` of this rank, then the
        levels ``(d,)``."""
        return np.append(self.u.x.array, self.levels)

    def restore(self, load: float, state: Array) -> None:
        """Go back to an accepted state; the history was never touched."""
        self.load, self.levels = load, state[2 * self.n_local :].copy()
        self._accepted_load = load
        self.u.x.array[:] = state[: 2 * self.n_local]
        if self.springs:
            self.springs.last = state[: 2 * self.n_owned].copy(), self.levels.copy()

    def resume(self, load: float, state: Array, largest_reaction: float) -> None:
        """Take up an accepted state of an earlier process, whose history the points have already,
        and evaluate it."""
        self.restore(load, state)
        self.largest_reaction = largest_reaction
        self.contact.search()
        self.contact.begin(self.displacement())
        self.evaluate()
        self._follow_pattern()
        self.contact.begin(self.displacement())  # now that it is known which points touch
        if self.springs:
            self.springs.look()

    def commit(self) -> None:
        """Accept the last solve: bulk and contact keep their trial history."""
        self.largest_reaction = max(self.largest_reaction, self.reaction_norm)
        self._accepted_load = self.load
        if self.springs:
            self.springs.commit()
        for points in self.points():
            points.commit()
        self.contact.begin(self.displacement())
