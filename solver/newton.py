"""Newton's method for equilibrium: PETSc's SNES, with a linear strategy, and tests of its own for when to stop."""

from __future__ import annotations

from collections.abc import Callable
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

    def after(self, before: Newton | None) -> Newton:
        """This solve with the iterations and residuals of the one ``before`` it."""
        if before is None:
            return self
        iterations, residuals = before.iterations + self.iterations, before.residuals + self.residuals
        return replace(
            self,
            iterations=iterations,
            residuals=residuals,
            active_set_changes=before.active_set_changes + self.active_set_changes,
            held=before.held or self.held,
            factorisations=before.factorisations + self.factorisations,
            evaluations=before.evaluations + self.evaluations,
        )


class NewtonSolver:
    """Newton's method for ``equilibrium``, to a residual of ``tolerance`` over the reaction of the supports."""

    def __init__(self, equilibrium: Equilibrium, *, tolerance: float = 1e-10, max_iterations: int = 25) -> None:
        self.equilibrium, self.tolerance, self.max_iterations = equilibrium, tolerance, max_iterations
        self.comm = equilibrium.comm
        self._goal = tolerance
        self._raised: BaseException | None = None
        self._failure = ""
        self._renewed = True  # the last factorisation is of another matrix
        self._lagged = Lagged() if equilibrium.choice.uses("lagged") else None
        with equilibrium.timer(BEFORE_SOLVING):
            self._snes = self._make_snes()

    def _make_snes(self) -> PETSc.SNES:
        snes = PETSc.SNES().create(self.comm)
        snes.setOptionsPrefix("archord_")
        snes.setType("newtonls")
        self._x = self.equilibrium.control.vector()
        snes.setFunction(self._guarded(self._residual), self._x.duplicate())
        snes.setTolerances(max_it=self.max_iterations)
        snes.setConvergenceTest(self._test)
        self._attach(snes)
        options = PETSc.Options("archord_")
        options["snes_linesearch_type"] = "bt"
        options["snes_linesearch_max_it"] = 8
        snes.setFromOptions()
        return snes

    def _attach(self, snes: PETSc.SNES) -> None:
        """Let ``snes`` solve with the tangent as it is chosen."""
        linear = self.equilibrium.linear
        snes.setJacobian(self._guarded(self._jacobian), linear.matrix)
        linear.attach(snes.getKSP())
        if self._lagged is not None:
            self._lagged.attach(snes.getKSP())

    def _guarded(self, callback: Callable) -> Callable:
        """Keep what ``callback`` raises, which PETSc would turn into an error number."""

        def call(*arguments) -> None:
            try:
                callback(*arguments)
            except BaseException as error:
                self._raised = error
                raise

        return call

    def _residual(self, snes, x, f) -> None:
        self._evaluations += 1
        try:
            renewed = self.equilibrium.residual_of(x, f)
        except ProjectionError as error:
            self._failure = str(error)
            f.set(np.nan)
            return
        if renewed and self.equilibrium.control.border is None and self.equilibrium.tangent.condensed is None:
            self._attach(self._snes)
        self._renewed |= renewed

    def _jacobian(self, snes, x, A, P) -> None:
        if not self._close():
            before = self.equilibrium.tangent.factorisations
            lagged, changes = self._lagged, self._changes[-1]
            factorise = lagged is None or lagged.factorises(snes, changes, renewed=self._renewed)
            self.equilibrium.update_tangent(factorise=factorise)
            self._factorisations += self.equilibrium.tangent.factorisations - before
            self._renewed = False

    def _close(self) -> bool:
        """Whether one more step with the last factorisation will do: Newton's method converges, and the residual that
        such a step leaves, smaller by the last reduction, is below the tolerance."""
        if len(self._residuals) < 2 or self._changes[-1] or self._renewed:
            return False
        before, now = self._residuals[-2:]
        return now < _FAST * before and now * now / before < 0.1 * self._goal

    def _test(self, snes, iteration, norms):
        norm = norms[2]
        at = self.equilibrium
        reaction = max(at.reaction_norm, at.largest_reaction)
        scale = max(reaction, at.noise / self._goal)
        self._changes.append(at.changes)
        self._residuals.append(float(norm / reaction if reaction > 0 else norm))
        if self.equilibrium.control.singular:
            return PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE
        if not np.isfinite(norm):
            return PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN
        if norm <= self._goal * scale:
            return PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE
        if self._stagnates():
            self._failure = "the residual does not fall any further"
            return PETSc.SNES.ConvergedReason.DIVERGED_DTOL
        if iteration >= self.max_iterations:
            return PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT
        return PETSc.SNES.ConvergedReason.ITERATING

    def _stagnates(self) -> bool:
        patience = _PATIENCE if any(self._changes[-CIRCLING:]) else CIRCLING
        recent, before = self._residuals[-patience:], self._residuals[:-patience]
        return bool(before) and min(recent) > 0.5 * min(before)

    def solve(self, guess: Array, *, line_search: str = "bt", goal: float = 0.0, search: bool = True) -> Newton:
        """Newton's method at the equilibrium's load, to a residual of ``goal``, the own tolerance without.

        ``guess`` is shaped like the equilibrium's `state`; its prescribed values are replaced. ``line_search`` is
        PETSc's name of one, "basic" takes full steps. Contact points search their partners first, or start from those
        they have.
        """
        PETSc.Options("archord_")["snes_linesearch_type"] = line_search
        self._snes.setFromOptions()
        self._goal = goal or self.tolerance
        self._residuals: list[float] = []
        self._changes: list[int] = []
        self._failure = ""
        self._factorisations = self._evaluations = 0
        self._renewed = True
        at = self.equilibrium
        at.pack(guess, self._x)
        if search:
            at.contact.search()
        self._raised = None
        with at.timer("solve"):
            try:
                self._snes.solve(None, self._x)
            except PETSc.Error:
                if self._raised is not None:
                    raise self._raised from None
                raise
        code, iterations = self._snes.getConvergedReason(), self._snes.getIterationNumber()
        if self._snes.getKSP().getConvergedReason() < 0:
            self._forget_factorisation()
        result = Newton(
            code > 0,
            "converged",
            iterations,
            self._residuals,
            active_set_changes=self._changes,
            factorisations=self._factorisations,
            evaluations=self._evaluations,
        )
        return result if result.converged else self._explained(result, code)

    def last_iterate(self) -> Array:
        """The state that the last solve left. Collective."""
        self.equilibrium.unpack(self._x)
        return self.equilibrium.state()

    def _forget_factorisation(self) -> None:
        """Start with a new linear solver: after a singular matrix PETSc's interface to MUMPS may skip the factorisation
        of the next one, and fail."""
        at, x = self.equilibrium, self._x
        at.control.follow(at.tangent)
        self._snes.destroy()
        self._snes = self._make_snes()
        self._x.array[:] = x.array_r
        x.destroy()

    def _explained(self, result: Newton, code: int) -> Newton:
        """A ``result`` without success, with the reason and the place of the largest residual."""
        at = self.equilibrium
        reason = self._failure or _REASONS.get(code, f"SNES reason {code}")
        if self.equilibrium.control.singular:
            pressed = at.load > 0 and at.contact.n_active() > 0
            cause = "no stiffness is left" if pressed else "nothing resists the force"
            reason = f"{cause} (singular mode)"
        increment = max((float(p.increment.max(initial=0.0)) for p in at.plastic_points()), default=0.0)
        increment = self.comm.allreduce(increment, op=MPI.MAX)
        return replace(result, reason=reason, worst=at.worst_place(), plastic_increment=increment)


_R = PETSc.SNES.ConvergedReason
_REASONS = {
    _R.DIVERGED_MAX_IT: "no convergence within the allowed iterations",
    _R.DIVERGED_LINE_SEARCH: "the line search found no smaller residual",
    _R.DIVERGED_LINEAR_SOLVE: "the linear system could not be factorised",
    _R.DIVERGED_FNORM_NAN: "the residual is not a number",
    _R.DIVERGED_FUNCTION_DOMAIN: "the residual could not be evaluated",
}
