"""Static equilibrium at a given load: the residual and the tangent of bulk and contact.

A load moves the supports and a rigid pin by its own value, or, as a force, by a level that is an unknown itself.

The residual is internal minus contact forces; rows of prescribed displacements are left out of it, and out of the
matrix with their columns, the contact's included. It is measured against the reaction of the supports, so that the
tolerance has no unit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.fenicsx import create_vector
from archord.materials.points import Points
from archord.solver.bulk import Bulk
from archord.solver.contact.contact import Contact
from archord.solver.interrupt import Interrupt, Interrupted
from archord.solver.linear.bordered import Bordered
from archord.solver.linear.tangent_matrix import TangentMatrix
from archord.solver.timer import Timer


@dataclass(frozen=True)
class Support:
    """A prescribed displacement: component ``axis`` of the block dofs ``dofs`` of this rank is ``rate * level``.

    ``rate`` is a number or one per node; ``name`` addresses its reaction.
    """

    name: str
    axis: int
    dofs: np.ndarray
    rate: float | Array = 0.0


class Equilibrium:
    """Equilibrium of ``bulk`` and, if given, ``contact`` under ``supports``.

    ``rigid_rate`` moves a rigid pin with the level; ``applied`` are nodal forces ``(n_owned, 2)`` per unit of load.
    The level is the load, or with ``by_force`` what makes the forces of supports and rigid pin, along their rates,
    sum up to ``by_force`` times the load. ``load_name`` is for messages, ``travel`` the displacement to be expected,
    which limits what counts as round-off: an iterate that flew away is none. ``condense`` as for `TangentMatrix`.
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        bulk: Bulk,
        supports: list[Support],
        contact: Contact | None = None,
        rigid_rate: Array | None = None,
        *,
        applied: Array | None = None,
        by_force: float | None = None,
        load_name: str = "delta",
        travel: float = np.inf,
        condense: bool = False,
        timer: Timer | None = None,
    ) -> None:
        self.V, self.bulk, self.contact = V, bulk, contact
        self.comm = V.mesh.comm
        self.supports = supports
        self.rigid_rate, self.applied, self.by_force, self.load_name = rigid_rate, applied, by_force, load_name
        self.timer = timer or Timer()
        self.interrupt = Interrupt()
        self.u = fem.Function(V, name="displacement")
        self.load = self.level = 0.0
        index_map = V.dofmap.index_map
        self.n_owned = index_map.size_local
        self.n_local = index_map.size_local + index_map.num_ghosts
        self.fixed = np.zeros((self.n_local, 2), dtype=bool)
        self.rate = np.zeros((self.n_local, 2))
        for s in supports:
            self.fixed[s.dofs, s.axis] = True
            self.rate[s.dofs, s.axis] = s.rate
        self._free_owned = ~self.fixed[: self.n_owned].ravel()
        self._force = create_vector(index_map, 2)
        self._reaction = np.zeros((self.n_owned, 2))
        self.flips = 0  # points that opened or closed at the last evaluation, over all ranks
        self.reaction_norm = self.noise = 0.0
        self.largest_reaction = 0.0  # norm, of all accepted states
        materials = [body.material for body in bulk.bodies]
        stiffness = max(float(m.elastic_tangent[0, 0]) for m in materials)
        self._stiffest, self._travel = stiffness, travel
        self.tangent = TangentMatrix(V, bulk, contact, self.fixed, self.rate, rigid_rate, self.timer, condense=condense)
        self.border: Bordered | None = None
        if by_force is not None:
            self.border = Bordered(self.tangent.A, stiffness, V)
            self._direction = fem.Function(V)
            self._direction.x.array[:] = self.rate.ravel()

    # ------------------------------------------------------------------ unknowns

    def vector(self) -> PETSc.Vec:
        """A vector of all unknowns of this rank: displacements, and the level where it is one."""
        return create_vector(self.V.dofmap.index_map, 2) if self.border is None else self.border.vector()

    def pack(self, state: Array, x: PETSc.Vec) -> None:
        """Put ``state``, shaped like `state`, with its prescribed values replaced, into the unknowns ``x``."""
        self.level = self.load if self.border is None else float(state[-1])
        u = state[:-1].reshape(-1, 2).copy()
        u[self.fixed] = self.level * self.rate[self.fixed]
        if self.border is None:
            x.array[:] = u[: self.n_owned].ravel()
        else:
            self.border.join(x, u[: self.n_owned].ravel(), self.level)

    def unpack(self, x: PETSc.Vec) -> None:
        """Take displacements and level from the unknowns ``x``. Collective."""
        self.u.x.array[: 2 * self.n_owned] = x.array_r[: 2 * self.n_owned]
        self.u.x.scatter_forward()
        if self.border is not None:
            self.level = self.border.level(x)
            self.u.x.array[self.fixed.ravel()] = self.level * self.rate[self.fixed]

    # ------------------------------------------------------------------ tangent

    def update_tangent(self, *, factorise: bool = True) -> None:
        """Assemble the tangent of the last evaluation, to be factorised or not. Collective."""
        self.tangent.update(factorise=factorise)
        if self.border is not None:
            with self.timer("assemble border"):
                self.tangent.update_border(self.border, self._direction, factorise=factorise)

    def _follow_pattern(self) -> bool:
        """Make the matrix anew where the pairs of the last evaluation slid out of its pattern; returns whether."""
        if self._pattern_grew:
            self.tangent.destroy()
            self.tangent.renew()
            if self.border is not None:
                self.border.replace(self.tangent.A)
        return self._pattern_grew

    # ------------------------------------------------------------------ residual

    def residual_of(self, x: PETSc.Vec, f: PETSc.Vec) -> bool:
        """The residual ``f`` at the unknowns ``x``; returns whether there is another tangent matrix now. Collective.

        Raises `ProjectionError` if a contact point finds no partner, and what `evaluate` raises.
        """
        self.unpack(x)
        self.evaluate()
        renewed = self._follow_pattern()
        free = np.where(self._free_owned, self._force.array_r, 0.0)
        if self.border is None or self.by_force is None:
            f.array[:] = free
        else:
            self.border.join(f, free, self.force_on_level() - self.by_force * self.load)
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
        self._pattern_grew = False
        with self.timer("contact"):
            if self.contact is not None:
                if self.rigid_rate is not None:
                    self.contact.rigid_motion = self.level * self.rigid_rate
                self._pattern_grew = self.contact.evaluate(u)
                self.contact.add_force(self._force.array.reshape(-1, 2))
        if self.applied is not None:
            self._force.array[:] -= self.load * self.applied.ravel()
        self._reaction = np.where(self._free_owned, 0.0, self._force.array_r).reshape(-1, 2)
        noise = 0.0 if self.contact is None else self.contact.round_off()
        flips = 0 if self.contact is None else self.contact.flips
        totals = np.array([(self._reaction**2).sum(), noise**2, self.interrupt.received > 0, flips])
        self.comm.Allreduce(MPI.IN_PLACE, totals)
        self.flips = int(totals[3])
        self.reaction_norm, contact_noise = np.sqrt(totals[:2])
        self.noise = self._bulk_noise() + contact_noise
        if totals[2]:
            raise Interrupted(self.comm.allreduce(self.interrupt.received, op=MPI.MAX))

    def _bulk_noise(self) -> float:
        """Round-off of the bulk's residual: forces that a rigid motion of the size of the displacement leaves."""
        largest = self.comm.allreduce(np.abs(self.u.x.array).max(initial=0.0), op=MPI.MAX)
        return 1e-13 * self._stiffest * min(largest, self._travel)

    def reaction(self, name: str) -> Array:
        """Force ``(2,)`` of the support ``name`` on the joint at the last evaluation, over all ranks."""
        total = np.zeros(2)
        for s in self.supports:
            if s.name == name:
                total[s.axis] += self._reaction[s.dofs[s.dofs < self.n_owned], s.axis].sum()
        return self.comm.allreduce(total)

    def force_on_level(self) -> float:
        """Force that works on the level: those of supports and rigid pin along their rates, over all ranks."""
        total = self.comm.allreduce(float((self._reaction * self.rate[: self.n_owned]).sum()))
        if self.rigid_rate is not None and self.contact is not None:
            total += float(self.rigid_rate @ self.contact.resultant())
        return total

    # ------------------------------------------------------------------ state

    def plastic_points(self) -> list[Points]:
        """The points with history of bulk and contact."""
        return self.bulk.plastic_points() + (self.contact.plastic_points() if self.contact is not None else [])

    def worst_place(self) -> tuple[float, float] | None:
        """Where the residual is largest, over all ranks."""
        size = np.linalg.norm(self.residual()[: self.n_owned], axis=1)
        at = int(np.argmax(size)) if len(size) else 0
        x = self.V.tabulate_dof_coordinates()[at, :2] if len(size) else np.zeros(2)
        found = [(s, p) for s, p in self.comm.allgather((size[at] if len(size) else -1.0, tuple(x))) if np.isfinite(s)]
        return max(found)[1] if found else None

    def residual(self) -> Array:
        """Residual forces ``(n_local, 2)`` at the last evaluation, zero at prescribed displacements and ghosts."""
        owned = np.where(self._free_owned, self._force.array_r, 0.0).reshape(-1, 2)
        return np.pad(owned, ((0, self.n_local - self.n_owned), (0, 0)))

    def displacement(self) -> Array:
        """A copy of the nodal displacements ``(n_local, 2)``."""
        return self.u.x.array.reshape(-1, 2).copy()

    def state(self) -> Array:
        """All that is solved for: nodal displacements ``(2 n_local,)`` of this rank and, behind them, the level."""
        return np.append(self.u.x.array, self.level)

    def restore(self, load: float, state: Array) -> None:
        """Go back to an accepted state; the history was never touched."""
        self.load, self.level = load, float(state[-1])
        self.u.x.array[:] = state[:-1]

    def resume(self, load: float, state: Array, largest_reaction: float) -> None:
        """Take up an accepted state of an earlier process, whose history the points have already, and evaluate it."""
        self.restore(load, state)
        self.largest_reaction = largest_reaction
        if self.contact is not None:
            self.contact.search()
        self.evaluate()
        self._follow_pattern()

    def commit(self) -> None:
        """Accept the last solve: bulk and contact keep their trial history."""
        self.largest_reaction = max(self.largest_reaction, self.reaction_norm)
        self.bulk.commit()
        if self.contact is not None:
            self.contact.commit()
