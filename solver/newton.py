"""Newton's method for equilibrium: a linear strategy for each step, a line search, and tests for when to stop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.solver.equilibrium import Equilibrium
from archord.solver.linear.lagged import Lagged
from archord.solver.timer import BEFORE_SOLVING

_PATIENCE = 12  # Newton iterations in which the residual must halve
CIRCLING = 4  # the same where the active set stands still
_FAST = 1e-3  # ratio of residuals by which Newton's method converges at once
_DECREASE = 1e-4  # part of the decrease by the slope alone that the line search is content with
_SHORTENED = 9  # times that it shortens a step, to between a tenth and half of what it was
_LEAST = 1e-12  # of a step, below which nothing is a number
_STANDSTILL = 1e-8  # step over solution below which nothing but round-off keeps the residual from falling
_CONVERGED = "converged"
_ADDED_UP = ("iterations", "residuals", "active_set_changes", "factorisations", "evaluations")  # of several solves


@dataclass
class Newton:
    """What a nonlinear solve did: whether it converged and why not, its iterations and residuals relative to reaction.

    Of a solve that did not converge, ``worst`` is the place ``(2,)`` of the largest residual, ``active_set_changes``
    the contact points that opened or closed at each residual, ``plastic_increment`` the largest increment of PEEQ.
    ``held``: contact points had to stay on their facets. ``evaluations`` are those of the residual.
    """

    converged: bool
    reason: str
    iterations: int
    residuals: list[float]
    worst: tuple[float, float] | None = None
    active_set_changes: list[int] = field(default_factory=list)
    plastic_increment: float = 0.0
    held: bool = False
    factorisations: int = 0
    evaluations: int = 0

    @staticmethod
    def together(solves: Sequence[Newton]) -> Newton:
        """Several ``solves`` as one, which ended as the last of them did."""
        added = {name: sum((getattr(s, name) for s in solves[1:]), getattr(solves[0], name)) for name in _ADDED_UP}
        return replace(solves[-1], **added, held=any(s.held for s in solves))


class NewtonSolver:
    """Newton's method for ``equilibrium``, to a residual of ``tolerance`` over the reaction of the supports."""

    def __init__(self, equilibrium: Equilibrium, *, tolerance: float = 1e-10, max_iterations: int = 25) -> None:
        self.equilibrium, self.tolerance, self.max_iterations = equilibrium, tolerance, max_iterations
        self._goal = tolerance
        self._lagged = Lagged() if equilibrium.choice.uses("lagged") else None
        self._x, self._tried, self._f, self._f_tried, self._step = (equilibrium.control.vector() for _ in range(5))
        self._ksp = PETSc.KSP()
        with equilibrium.timer(BEFORE_SOLVING):
            self._attach()

    def _attach(self) -> None:
        """Start with a new linear solver, for the tangent as it is chosen."""
        self._ksp.destroy()
        self._ksp = PETSc.KSP().create(self.equilibrium.comm)
        self._linear = self.equilibrium.linear
        self._linear.attach(self._ksp)
        if self._lagged is not None:
            self._lagged.attach(self._ksp)

    def solve(self, guess: Array | None, *, line_search: bool = True, goal: float = 0.0) -> Newton:
        """Newton's method at the equilibrium's load, to a residual of ``goal``, the own tolerance without.

        ``guess`` is shaped like the equilibrium's `state`; its prescribed values are replaced, and contact points
        search their partners. Without one the solve goes on from the last iterate and the partners of its points. Steps
        are full ones without ``line_search``.
        """
        at = self.equilibrium
        self._goal = goal or self.tolerance
        self._result = Newton(False, "", 0, [])
        self._no_partner = ""
        self._renewed = True  # the last factorisation is of another matrix
        at.control.singular = False
        if guess is not None:
            at.pack(guess, self._x)
            at.contact.search()
        with at.timer("solve"):
            self._result.reason = self._iterate(line_search)
        if self._result.reason == _CONVERGED:
            self._result.converged = True
        else:
            points = at.plastic_points()
            increment = max((float(p.increment.max(initial=0.0)) for p in points), default=0.0)
            self._result.plastic_increment = at.comm.allreduce(increment, op=MPI.MAX)
            self._result.worst = at.worst_place()
        return self._result

    def _iterate(self, line_search: bool) -> str:
        """Iterate from the present unknowns; returns why it ended."""
        norm = self._residual(self._x, self._f)
        while not (ended := self._verdict(norm)):
            self._update_tangent()
            self._ksp.solve(self._f, self._step)
            size = self._step.norm()
            if self._ksp.getConvergedReason() < 0 or not np.isfinite(size):
                # after a singular matrix PETSc's interface to MUMPS may skip the next factorisation, and fail
                self.equilibrium.control.replace(self.equilibrium.tangent.A)
                self._attach()
                return "the linear system could not be factorised"
            standstill = size < _STANDSTILL * self._x.norm()
            reached = self._search(norm, standstill) if line_search else self._try(1.0)
            if reached is None:
                return _CONVERGED if standstill else self._no_partner or "the line search found no smaller residual"
            norm = reached
            self._x, self._tried, self._f, self._f_tried = self._tried, self._x, self._f_tried, self._f
            self._result.iterations += 1
        return ended

    def _residual(self, x: PETSc.Vec, f: PETSc.Vec) -> float:
        """Norm of the residual ``f`` at the unknowns ``x``, not a number where a contact point finds no partner."""
        self._result.evaluations += 1
        try:
            self._renewed |= self.equilibrium.residual_of(x, f)
        except ProjectionError as error:
            self._no_partner = str(error)
            return np.nan
        if self.equilibrium.linear is not self._linear:
            self._attach()
        return f.norm()

    def _try(self, length: float) -> float:
        """Norm of the residual after the part ``length`` of the step."""
        self._tried.waxpy(-length, self._step, self._x)
        return self._residual(self._tried, self._f_tried)

    def _search(self, before: float, standstill: bool) -> float | None:
        """Norm of the residual after a step of a length that makes it fall from ``before``; None where none does.

        Halves of the square of the norm are fitted by a parabola, then by cubics, from the slope at the beginning
        (Dennis and Schnabel 1983, A6.3.1).
        """
        length, value, slope = 1.0, before**2 / 2, -(before**2)
        reached = self._try(length)
        while not np.isfinite(reached) and length > _LEAST:
            length /= 2
            reached = self._try(length)
        longer, bend_before = np.inf, 0.0  # a parabola first
        for count in range(_SHORTENED + 1):
            left = reached**2 / 2
            if left <= value + _DECREASE * length * slope or count == _SHORTENED:
                break
            if standstill or not np.isfinite(reached):
                return None
            bend = (left - value - length * slope) / length**2
            a = (bend - bend_before) / (length - longer)
            b = bend - a * length
            longer, bend_before = length, bend
            best = (np.sqrt(max(b * b - 3 * a * slope, 0.0)) - b) / (3 * a) if a else -slope / (2 * b)
            length = min(max(best, 0.1 * length), 0.5 * length)
            reached = self._try(length)
        return reached

    def _update_tangent(self) -> None:
        """Assemble the tangent where the last factorisation does not serve once more, and factorise it where a lagged
        one does not."""
        at, result = self.equilibrium, self._result
        if self._close():
            return
        lagged, changes = self._lagged, result.active_set_changes[-1]
        factorise = lagged is None or lagged.factorises(self._ksp.getIterationNumber(), changes, renewed=self._renewed)
        self._ksp.getPC().setReusePreconditioner(not factorise)
        before = at.tangent.factorisations
        at.update_tangent(factorise=factorise)
        result.factorisations += at.tangent.factorisations - before
        self._renewed = False

    def _close(self) -> bool:
        """Whether one more step with the last factorisation will do: Newton's method converges, and the residual that
        such a step leaves, smaller by the last reduction, is below the tolerance."""
        residuals = self._result.residuals
        if len(residuals) < 2 or self._result.active_set_changes[-1] or self._renewed:
            return False
        before, now = residuals[-2:]
        return now < _FAST * before and now * now / before < 0.1 * self._goal

    def _verdict(self, norm: float) -> str:
        """Why to end with a residual of this ``norm``, which is noted; nothing if there is no reason to."""
        at, result = self.equilibrium, self._result
        if not np.isfinite(norm):
            return self._no_partner or "the residual is not a number"
        reaction = max(at.reaction_norm, at.largest_reaction)
        result.active_set_changes.append(at.changes)
        result.residuals.append(float(norm / reaction if reaction > 0 else norm))
        if at.control.singular:
            pressed = at.load > 0 and at.contact.n_active() > 0
            return f"{'no stiffness is left' if pressed else 'nothing resists the force'} (singular mode)"
        if norm <= max(self._goal * reaction, at.noise):
            return _CONVERGED
        patience = _PATIENCE if any(result.active_set_changes[-CIRCLING:]) else CIRCLING
        recent, earlier = result.residuals[-patience:], result.residuals[:-patience]
        if earlier and min(recent) > 0.5 * min(earlier):
            return "the residual does not fall any further"
        return "no convergence within the allowed iterations" if result.iterations >= self.max_iterations else ""
