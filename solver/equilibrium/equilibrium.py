"""Static equilibrium at a given load.

What is solved for, the forces, the linear systems and the diagnostics have a file each; here they
are one object, whose history is kept where a step is accepted.
"""

from __future__ import annotations

import math

from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.report.timer import Timer
from archord.solver.bulk.bulk import Bulk
from archord.solver.contact.contact import Contact
from archord.solver.drives import Drives
from archord.solver.equilibrium.diagnostics import Diagnostics
from archord.solver.equilibrium.evaluation import Evaluation
from archord.solver.equilibrium.linear_system import LinearSystem
from archord.solver.equilibrium.rigid_motions import RigidMotions
from archord.solver.equilibrium.springs import Springs
from archord.solver.equilibrium.unknowns import Unknowns
from archord.solver.problem import Problem


class Equilibrium:
    """Equilibrium of ``bulk`` and ``contact`` under the drives of ``problem`` at a ``load``.
    Collective.

    ``step_length`` is the length of the step from the last accepted load. ``largest_reaction`` is
    the largest norm of the reactions in all accepted states. ``springs`` hold loose bodies, None
    where the problem asks for none.
    """

    def __init__(self, problem: Problem, bulk: Bulk, contact: Contact, timer: Timer) -> None:
        self.problem = problem
        self.bulk = bulk
        self.contact = contact
        self.timer = timer
        self.comm = bulk.V.mesh.comm
        self.drives = Drives(problem, bulk.V, contact)
        self.springs = self._springs() if problem.stabilise else None
        self.unknowns = Unknowns(bulk.V, self.drives)
        self.evaluation = Evaluation(problem, bulk, contact, self.unknowns, self.springs, timer)
        self.linear = LinearSystem(self.evaluation, timer)
        self.diagnostics = Diagnostics(self.evaluation)
        self.load = 0.0
        self._accepted_load = 0.0
        self.largest_reaction = 0.0

    def _springs(self) -> Springs | None:
        rigid = RigidMotions(self.drives, self.contact)
        return Springs(rigid, self.drives.stiffness) if len(rigid.free) else None

    @property
    def step_length(self) -> float:
        """Length of the step from the last accepted load to the present one."""
        return abs(self.load - self._accepted_load)

    @property
    def lets_go(self) -> bool:
        """Whether the forces that pushed in the last accepted state are gone at the load."""
        pushes = self.drives.pushes
        return pushes(self._accepted_load) and not pushes(self.load)

    def pack(self, state: Array, x: PETSc.Vec) -> None:
        """Put a ``state`` into the unknowns ``x``, with the prescribed values at the load."""
        self.unknowns.pack(self.load, state, x)

    def residual_of(self, x: PETSc.Vec, f: PETSc.Vec) -> bool:
        """The residual ``f`` at the unknowns ``x``; returns whether there is another tangent matrix
        now. Raises `ProjectionError` if a contact point finds no partner, and what `evaluate`
        raises."""
        self.unknowns.take(x)
        self.evaluate()
        renewed = self.linear.follow()
        lacking = self.evaluation.lacking(self.load)
        self.unknowns.join(f, self.evaluation.free_forces(), lacking)
        return renewed

    def evaluate(self) -> None:
        """Forces and trial history at the current unknowns. Raises `Interrupted`, on every rank."""
        self.evaluation.evaluate(self.load, self.step_length)

    def displacement(self) -> Array:
        """A copy of the nodal displacements ``(n_local, d)``."""
        return self.unknowns.displacement()

    def state(self) -> Array:
        """All that is solved for, as an array (see `Unknowns`)."""
        return self.unknowns.state()

    def restore(self, load: float, state: Array) -> None:
        """Go back to an accepted state; the history was never touched."""
        self.load = load
        self._accepted_load = load
        self.unknowns.restore(state)
        if self.springs:
            self.springs.rest_at(state)

    def resume(self, load: float, state: Array, largest_reaction: float) -> None:
        """Take up an accepted state of an earlier process, whose history the points have already,
        and evaluate it."""
        self.restore(load, state)
        self.largest_reaction = largest_reaction
        # the slip of rigid discs counts from where they are
        self.contact.move(self.unknowns.levels, self.problem.fitted(load))
        self.contact.begin(self.displacement())
        self.evaluate()
        self.linear.follow()
        self.contact.begin(self.displacement())  # now that it is known which points touch

    def out_of_balance(self) -> float:
        """The norm of the residual of the last evaluation over the largest reaction; 0 of a norm
        that is round-off, and without reactions."""
        at = self.evaluation
        of_levels = at.lacking(self.load)
        squares = self.comm.allreduce((at.free_forces() ** 2).sum()) + of_levels @ of_levels
        reaction = max(at.reaction_norm, self.largest_reaction)
        if squares <= at.noise**2 or not reaction:
            return 0.0
        return math.sqrt(squares) / reaction

    def commit(self) -> None:
        """Accept the last solve: bulk and contact keep their trial history."""
        self._accepted_load = self.load
        self.largest_reaction = max(self.largest_reaction, self.evaluation.reaction_norm)
        if self.springs:
            self.springs.commit()
        for points in self.evaluation.points():
            points.commit()
        self.contact.begin(self.displacement())
