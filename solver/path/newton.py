"""Newton's method for equilibrium: PETSc's SNES, with a linear strategy, and tests of its own for
when to stop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any
from weakref import WeakMethod

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.kernels.compat import RESIDUAL_NOT_FINITE
from archord.report.timer import BEFORE_SOLVING
from archord.solver.equilibrium import Equilibrium
from archord.solver.linear.lagged import Lagged
from archord.solver.linear.look_ahead import LookAhead

_PATIENCE = 12  # Newton iterations in which the residual must halve
CIRCLING = 4  # the same where the active set stands still
_FAST = 1e-3  # ratio of residuals by which Newton's method converges at once
_ADDED_UP = (
    "iterations",
    "residuals",
    "active_set_changes",
    "factorisations",
    "evaluations",
)  # of several solves


@dataclass
class Newton:
    """What a nonlinear solve did: whether it converged and why not, its iterations and residuals
    relative to reaction.

    Without convergence ``worst`` is the place ``(2,)`` of the largest residual,
    ``plastic_increment`` the largest of PEEQ. ``active_set_changes`` belong to each residual.
    ``held`` contact points had to stay on their facets.
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
        added = {
            name: sum((getattr(s, name) for s in solves[1:]), getattr(solves[0], name))
            for name in _ADDED_UP
        }
        return replace(solves[-1], **added, held=any(s.held for s in solves))


class NewtonSolver:
    """Newton's method for ``equilibrium``, to the tolerance and within the iterations that its
    problem allows.

    ``watch(load, result)`` is called on every rank after each residual, with what the solve did so
    far.
    """

    watch: Callable[[float, Newton], None] = staticmethod(lambda load, result: None)

    def __init__(self, equilibrium: Equilibrium) -> None:
        self.equilibrium, problem = equilibrium, equilibrium.problem
        self.tolerance, self.max_iterations = problem.tolerance, problem.max_iterations
        self._lagged = Lagged() if equilibrium.choice.uses("lagged") else None
        looks, yields = equilibrium.choice.uses("look_ahead"), equilibrium.bulk.plastic
        self._ahead = LookAhead(equilibrium.revised, yields=yields) if looks else None
        for sums in (
            "vec_mdot_use_gemv",
            "vec_maxpy_use_gemv",
        ):  # in an order that depends on where memory lies
            PETSc.Options()[sums] = False
        self._x = equilibrium.vector()
        self._raised: BaseException | None = None
        with equilibrium.timer(BEFORE_SOLVING):
            self._solvers = {
                searches: self._solver("bt" if searches else "basic") for searches in (True, False)
            }
            self._start_linear()

    def _solver(self, line_search: str) -> PETSc.SNES:
        snes = PETSc.SNES().create(self.equilibrium.comm)
        snes.setOptionsPrefix("archord_")
        options = PETSc.Options("archord_")
        options["snes_linesearch_type"], options["snes_linesearch_max_it"] = line_search, 8
        snes.setType("newtonls")
        snes.setFunction(self._guarded(self._residual), self._x.duplicate())
        snes.setConvergenceTest(self._guarded(self._test))
        snes.setTolerances(
            stol=0.0
        )  # else a line search that ends in a short step counts as convergence
        snes.setFromOptions()
        return snes

    def _start_linear(self) -> None:
        """Start with a new linear solver: after a singular matrix PETSc's MUMPS may skip the next
        factorisation."""
        self._ksp = PETSc.KSP().create(self.equilibrium.comm)
        self._ksp.setPreSolve(self._guarded(self._before_solve))
        self._ksp.setPostSolve(self._guarded(self._after_solve))
        for snes in self._solvers.values():
            snes.setKSP(self._ksp)
        self._attach()

    def _attach(self) -> None:
        """Solve with the tangent as it is chosen."""
        self._linear = self.equilibrium.linear
        for snes in self._solvers.values():
            snes.setJacobian(self._guarded(self._jacobian), self._linear.matrix)
        self._linear.attach(self._ksp)
        if self._lagged is not None:
            self._lagged.attach(self._ksp)
        if self._ahead is not None:
            self._ahead.attach(self._ksp)

    def _before_solve(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        ksp.getPC().setReusePreconditioner(self._reuse)

    def _after_solve(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        border = self.equilibrium.border
        if (
            self._ahead is None
            or ksp.getConvergedReason() < 0
            or (border and border.singular is not None)
        ):
            return
        self._ahead.improve(b, x, self._linear.matrix)
        if border:
            border.singular = None  # vectors that FGMRES tries say nothing of it

    def _guarded(self, callback: Callable) -> Callable:
        """Keep what ``callback``, a method, raises, which PETSc would turn into an error number. It
        does not keep this object alive, which holds PETSc's: not every petsc4py lets Python collect
        such cycles."""
        method = WeakMethod(callback)

        def call(*arguments) -> Any:
            own: Any = method()
            assert own is not None
            try:
                return own(*arguments)
            except BaseException as error:
                own.__self__._raised = error
                raise

        return call

    def solve(self, guess: Array | None, *, line_search: bool = True, goal: float = 0.0) -> Newton:
        """Newton's method at the equilibrium's load, to a residual of ``goal``, the own tolerance
        without.

        ``guess`` is shaped like the equilibrium's `state`; contact points search their partners
        there. Without one the solve goes on from the last iterate and its partners. Steps are full
        ones without ``line_search``.
        """
        at, snes = self.equilibrium, self._solvers[line_search]
        self._goal = goal or self.tolerance
        self._result = result = Newton(False, "", 0, [])
        self._failure, self._raised = "", None
        self._renewed, self._reuse = True, False  # the last factorisation is of another matrix
        if at.border:
            at.border.singular = None
        if self._ahead is not None:
            self._ahead.given_up = False
        if guess is not None:
            at.pack(guess, self._x)
            at.contact.search()
        snes.setTolerances(max_it=self.max_iterations)
        with at.timer("solve"):
            try:
                snes.solve(None, self._x)
            except PETSc.Error:
                if self._raised is not None:
                    raise self._raised from None
                raise
        code, result.iterations = snes.getConvergedReason(), snes.getIterationNumber()
        if self._ksp.getConvergedReason() < 0:
            at.renew_factorisation()
            self._start_linear()
        result.converged = code > 0
        result.reason = (
            "converged"
            if result.converged
            else self._failure or _REASONS.get(code, f"SNES reason {code}")
        )
        if not result.converged:
            grown = [
                (p.peeq - p.material.peeq(p.state)).max(initial=0.0) for p in at.plastic_points()
            ]
            result.plastic_increment = at.comm.allreduce(float(max(grown, default=0.0)), op=MPI.MAX)
            result.worst = at.worst_place()
        return result

    def residual_norm(self, guess: Array) -> float:
        """The norm of the residual at a ``guess`` for `solve`; infinite where a contact point finds
        no partner."""
        at, f = self.equilibrium, self._x.duplicate()
        at.pack(guess, self._x)
        at.contact.search()
        try:
            at.residual_of(self._x, f)
        except ProjectionError:
            return np.inf
        return float(f.norm())

    def _residual(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        """The residual ``f`` at the unknowns ``x``, not a number where a contact point finds no
        partner."""
        self._result.evaluations += 1
        try:
            self._renewed |= self.equilibrium.residual_of(x, f)
        except ProjectionError as error:
            self._failure = str(error)
            f.set(np.nan)
            return
        if self.equilibrium.linear is not self._linear:
            self._attach()

    def _jacobian(self, snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
        """Assemble the tangent unless the last one will do, and factorise it unless a lagged
        factorisation will."""
        at, result = self.equilibrium, self._result
        if self._close():
            return
        lagged, changes = self._lagged, result.active_set_changes[-1]
        factorise = lagged is None or lagged.factorises(
            self._ksp.getIterationNumber(), changes, renewed=self._renewed
        )
        self._reuse = not factorise
        before = at.tangent.factorisations
        at.update_tangent(factorise=factorise)
        result.factorisations += at.tangent.factorisations - before
        self._renewed = False

    def _close(self) -> bool:
        """Whether one more step with the last factorisation will do: Newton's method converges, and
        the residual that such a step leaves, smaller by the last reduction, is below the
        tolerance."""
        residuals = self._result.residuals
        if len(residuals) < 2 or self._result.active_set_changes[-1] or self._renewed:
            return False
        before, now = residuals[-2:]
        return now < _FAST * before and now * now / before < 0.1 * self._goal

    def _test(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        """Note the residual and tell SNES whether to go on."""
        at, result, norm, reasons = (
            self.equilibrium,
            self._result,
            norms[2],
            PETSc.SNES.ConvergedReason,
        )
        reaction = max(at.reaction_norm, at.largest_reaction)
        result.active_set_changes.append(at.changes)
        result.residuals.append(float(norm / reaction if reaction > 0 else norm))
        self.watch(at.load, result)
        if at.border and at.border.singular is not None:
            pressed = at.load > 0 and at.contact.n_active() > 0
            level = at.drives.unknown[at.border.singular]
            of = "".join(
                f" of the drive {name!r}" for name in at.drives.names[level : level + 1] if name
            )
            self._failure = f"{'no stiffness is left' if pressed else 'nothing resists the force'}{of} (singular mode)"
            return reasons.DIVERGED_LINEAR_SOLVE
        if not np.isfinite(norm):
            return RESIDUAL_NOT_FINITE
        if norm <= max(self._goal * reaction, at.noise):
            return reasons.CONVERGED_FNORM_RELATIVE
        patience = _PATIENCE if any(result.active_set_changes[-CIRCLING:]) else CIRCLING
        recent, earlier = result.residuals[-patience:], result.residuals[:-patience]
        if earlier and min(recent) > 0.5 * min(earlier):
            self._failure = "the residual does not fall any further"
            return reasons.DIVERGED_DTOL
        return reasons.DIVERGED_MAX_IT if iteration >= self.max_iterations else reasons.ITERATING


_R = PETSc.SNES.ConvergedReason
_REASONS = {
    _R.DIVERGED_MAX_IT: "no convergence within the allowed iterations",
    _R.DIVERGED_LINE_SEARCH: "the line search found no smaller residual",
    _R.DIVERGED_LINEAR_SOLVE: "the linear system could not be factorised",
    RESIDUAL_NOT_FINITE: "the residual is not a number",
}
