"""Forces at the unknowns of equilibrium: internal forces less contact forces and loads.

The residual is these forces where displacements are free, and what the equations of unknown levels
lack. It is measured against the reaction of the supports, so that its tolerance has no unit.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.kernels.compat import ghosted_vector
from archord.kernels.interrupt import Interrupt, Interrupted
from archord.materials.material import Points
from archord.report.timer import Timer
from archord.solver.bulk.bulk import Bulk
from archord.solver.contact.contact import Contact
from archord.solver.equilibrium.springs import Springs
from archord.solver.equilibrium.unknowns import Unknowns
from archord.solver.problem import Problem

_ROUND_OFF = 1e-13  # of a force: what rigid motions leave of it


class Evaluation:
    """The forces of ``bulk``, ``contact``, loads and ``springs`` at the ``unknowns``. Collective.

    Arrays and numbers, of the last evaluation, in the order in which they come to be:

    forces : (n_owned, d) internal forces less contact forces and loads
    reaction : (n_owned, d) forces of the supports
    pattern_grew : whether pairs slid out of the pattern of the matrix
    changes : contact points that went over to another branch of their law, on all ranks
    reaction_norm : norm of reactions and loads, on all ranks
    noise : norm of a residual that is round-off
    """

    def __init__(
        self,
        problem: Problem,
        bulk: Bulk,
        contact: Contact,
        unknowns: Unknowns,
        springs: Springs | None,
        timer: Timer,
    ) -> None:
        self.problem = problem
        self.bulk = bulk
        self.contact = contact
        self.unknowns = unknowns
        self.springs = springs
        self.timer = timer
        self.interrupt = Interrupt()
        self._vector = ghosted_vector(unknowns.V.dofmap.index_map, unknowns.dimension)
        self.forces: Array = np.zeros((unknowns.n_owned, unknowns.dimension))
        self.reaction: Array = np.zeros_like(self.forces)
        self.pattern_grew = False
        self.changes = 0
        self.reaction_norm = 0.0
        self.noise = 0.0

    def evaluate(self, load: float, step_length: float) -> None:
        """Forces, reactions and trial history at the ``load``. Raises `Interrupted` and
        `ProjectionError`, on every rank."""
        unknowns = self.unknowns
        applied = np.tensordot(unknowns.levels, unknowns.drives.applied, 1)
        self.forces = self._of_bulk()
        self._add_contact(load, step_length)
        self.forces -= applied
        if self.springs:
            self.springs.evaluate(unknowns.u.x.array[: unknowns.n_dofs], unknowns.levels)
            self.forces += self.springs.forces.reshape(self.forces.shape)
        is_fixed = unknowns.fixed[: unknowns.n_owned]
        self.reaction = np.where(is_fixed, self.forces, 0.0)
        self._measure(applied)

    def _of_bulk(self) -> Array:
        """Internal forces ``(n_owned, d)``."""
        u = self.unknowns.u.x
        with self.timer("return mapping"):
            self.bulk.update(u.array.reshape(-1, self.unknowns.dimension))
        with self.timer("assemble force"):
            with self._vector.localForm() as local:
                local.set(0.0)
            self.bulk.add_force(u.petsc_vec, self._vector)
        return self._vector.array_r.reshape(self.forces.shape).copy()

    def _add_contact(self, load: float, step_length: float) -> None:
        u = self.unknowns.u.x.array.reshape(-1, self.unknowns.dimension)
        with self.timer("contact"):
            self.contact.move(self.unknowns.levels, self.problem.fitted(load))
            self.pattern_grew = self.contact.evaluate(u, step_length)
            self.contact.add_force(self.forces)

    def _measure(self, applied: Array) -> None:
        """The size of reactions and of round-off over all ranks. Raises `Interrupted`."""
        comm = self.unknowns.comm
        totals = np.array(
            [
                (self.reaction**2).sum() + (applied**2).sum(),
                self.contact.round_off() ** 2,
                self.interrupt.received > 0,
                self.contact.active_set_changes,
            ]
        )
        comm.Allreduce(MPI.IN_PLACE, totals)
        squared_reaction, squared_noise, interrupts, changes = totals
        self.changes = int(changes)
        self.reaction_norm = np.sqrt(squared_reaction)
        # the bulk's are forces that a rigid motion of the size of the displacement leaves
        farthest = comm.allreduce(np.abs(self.unknowns.u.x.array).max(initial=0.0), op=MPI.MAX)
        travel = min(farthest, self.problem.travel)
        of_bulk = _ROUND_OFF * self.unknowns.drives.stiffness * travel
        self.noise = of_bulk + np.sqrt(squared_noise)
        if interrupts:
            raise Interrupted(comm.allreduce(self.interrupt.received, op=MPI.MAX))

    def points(self) -> list[Points]:
        """The points of materials and of contact laws, in bulk and contact."""
        parts = self.bulk, self.contact
        return [points for part in parts for _, points in part.histories().values()]

    def plastic_points(self) -> list[Points]:
        """The points that can yield."""
        return [points for points in self.points() if points.yields]

    def yields(self) -> bool:
        """Whether any point has left its elastic tangent, on any rank."""
        here = any(points.flows.any() for points in self.plastic_points())
        return self.unknowns.comm.allreduce(here, op=MPI.LOR)

    def has_yielded(self) -> bool:
        """Whether any point yields, or has yielded, on any rank."""
        here = any(points.flows.any() or points.peeq.any() for points in self.plastic_points())
        return self.unknowns.comm.allreduce(bool(here), op=MPI.LOR)

    def lacking(self, load: float) -> Array:
        """What the conjugates of the unknown levels lack of their values at the ``load``."""
        drives = self.unknowns.drives
        if not self.unknowns.n_levels:
            return np.zeros(0)
        wanted = drives.values(load) / self.problem.whole
        return drives.weight * (self.conjugates() - wanted)[drives.unknown]

    def free_forces(self) -> Array:
        """The forces ``(n_owned, d)`` where displacements are free, zero elsewhere."""
        return self.unknowns.where_free(self.forces)

    def conjugates(self) -> Array:
        """What is conjugate to the levels ``(l,)``, of the modelled part over all ranks: forces on
        what moves, contact forces on rigid discs included, and displacements along loads."""
        unknowns = self.unknowns
        drives = unknowns.drives
        rates = drives.rate[:, : unknowns.n_owned].reshape(len(unknowns.levels), -1)
        applied = drives.applied.reshape(rates.shape)
        u = unknowns.u.x.array[: unknowns.n_dofs]
        own = rates @ self.reaction.ravel() + applied @ u
        for turn in drives.turns:
            turn.add_moments(own, unknowns.levels, self.reaction)
        of_springs = self.springs.on_levels if self.springs else 0.0
        return unknowns.comm.allreduce(own) + self.contact.force_on_drives() + of_springs

    def contact_residual(self) -> Array:
        """The contact's part of the residual at this rank's unknowns."""
        unknowns = self.unknowns
        drives = unknowns.drives
        force = np.zeros((unknowns.n_owned, unknowns.dimension))
        self.contact.add_force(force)
        free = unknowns.where_free(force)
        if not unknowns.n_levels:
            return free.ravel()
        rates = drives.unknown_rate[:, : unknowns.n_owned]
        on_supports = np.tensordot(rates, force - free, 2)
        on_discs = np.broadcast_to(self.contact.force_on_drives(), unknowns.levels.shape)
        on_levels = unknowns.comm.allreduce(on_supports)
        on_levels = on_levels + drives.weight * on_discs[drives.unknown]
        own = on_levels if unknowns.comm.rank == 0 else on_levels[:0]
        return np.append(free, own)
