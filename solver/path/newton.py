"""Newton's method for equilibrium: PETSc's SNES, with or without a line search, with a linear
strategy, and tests of its own for when to stop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any
from weakref import WeakMethod

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.kernels.compat import RESIDUAL_NOT_FINITE
from archord.report.timer import BEFORE_SOLVING
from archord.solver.equilibrium.equilibrium import Equilibrium
from archord.solver.linear.forcing import AS_NEWTON, BELOW_NEWTON, forcing_term
from archord.solver.linear.lagged import Lagged
from archord.solver.linear.look_ahead import LookAhead, iterations_while_bodies_yield
from archord.solver.linear.strategy import krylov_iterations

_PATIENCE = 12  # Newton iterations in which the residual must halve
CIRCLING = 4  # the same where the active set stands still, but for a few points
_FEW = 1e-4  # part of all points, which open and close as they jump between two facets
_FAST = 1e-3  # ratio of residuals by which Newton's method converges at once
_NOT_CARRIED = 1.0  # residual over reaction, beyond which reactions do not carry the load yet
_CONVERGES = 0.2  # the same by which levels of multigrid are kept
_ITERATIONS_WITH_LEVELS = 2  # of a solve, which make the levels of multigrid
_R = PETSc.SNES.ConvergedReason
_REASONS = {
    _R.DIVERGED_MAX_IT: "no convergence within the allowed iterations",
    _R.DIVERGED_LINE_SEARCH: "the line search found no smaller residual",
    _R.DIVERGED_LINEAR_SOLVE: "the linear system could not be factorised",
    RESIDUAL_NOT_FINITE: "the residual is not a number",
}
# sums in an order that depends on where memory lies
_RANDOM_SUMS = ("vec_mdot_use_gemv", "vec_maxpy_use_gemv")


@dataclass
class Newton:
    """What a nonlinear solve did: whether it converged and why not, its iterations and residuals
    relative to reaction.

    Without convergence ``worst`` is the place ``(d,)`` of the largest residual,
    ``plastic_increment`` the largest of PEEQ. ``active_set_changes`` belong to each residual.
    ``held`` contact points had to stay on their facets. ``floating`` is the body that nothing but
    weak springs would hold in the state that was found, and "" where contact carries it.
    ``krylov_iterations`` are of all linear systems that were solved by iterations.
    """

    converged: bool
    reason: str
    iterations: int
    residuals: list[float]
    worst: tuple[float, ...] | None = None
    active_set_changes: list[int] = field(default_factory=list)
    plastic_increment: float = 0.0
    held: bool = False
    floating: str = ""
    factorisations: int = 0
    evaluations: int = 0
    krylov_iterations: int = 0

    @staticmethod
    def together(solves: Sequence[Newton]) -> Newton:
        """Several ``solves`` as one, which ended as the last of them did."""
        last = solves[-1]
        return replace(
            last,
            iterations=sum(s.iterations for s in solves),
            residuals=[residual for s in solves for residual in s.residuals],
            active_set_changes=[changes for s in solves for changes in s.active_set_changes],
            factorisations=sum(s.factorisations for s in solves),
            evaluations=sum(s.evaluations for s in solves),
            krylov_iterations=sum(s.krylov_iterations for s in solves),
            held=any(s.held for s in solves),
        )


class NewtonSolver:
    """Newton's method for ``equilibrium``, to the tolerance and within the iterations that its
    problem allows.

    ``watch(load, result)`` is called on every rank after each residual, with what the solve did so
    far. ``few`` contact points may jump between two facets in every iteration.
    """

    watch: Callable[[float, Newton], None] = staticmethod(lambda load, result: None)

    def __init__(self, equilibrium: Equilibrium) -> None:
        self.equilibrium = equilibrium
        self.tolerance = equilibrium.problem.tolerance
        self.max_iterations = equilibrium.problem.max_iterations
        self._system = equilibrium.linear
        bulk = equilibrium.bulk
        self._has_linear_bulk = not (bulk.plastic or bulk.finite)
        self._may_touch = any(pair.law.slides for pair in equilibrium.contact.pairs)
        self._updates_while_yielding = iterations_while_bodies_yield(self._system.facts)
        self._take_choice()
        for sums in _RANDOM_SUMS:
            PETSc.Options()[sums] = False
        n_points = sum(len(pair.active) for pair in equilibrium.contact.pairs)
        self.few = int(_FEW * equilibrium.comm.allreduce(n_points))
        self._x = equilibrium.unknowns.vector()
        self._raised: BaseException | None = None
        with equilibrium.timer(BEFORE_SOLVING):
            # by whether they search along the line
            self._solvers = {True: self._solver("bt"), False: self._solver("basic")}
            self._start_linear()

    def _take_choice(self) -> None:
        """Make what the chosen strategies need."""
        self._choice = choice = self._system.choice
        self._iterates = choice.uses("multigrid")
        self._lagged: Lagged | None = None
        if choice.uses("lagged"):
            self._lagged = Lagged(yields=self.equilibrium.bulk.plastic)
        self._ahead: LookAhead | None = None
        if choice.uses("look_ahead"):
            self._ahead = LookAhead(
                self._system.revise,
                yields=self.equilibrium.bulk.plastic,
                by_multigrid=choice.uses("multigrid"),
            )

    def _solver(self, line_search: str) -> PETSc.SNES:
        snes = PETSc.SNES().create(self.equilibrium.comm)
        snes.setOptionsPrefix("archord_")
        options = PETSc.Options("archord_")
        options["snes_linesearch_type"] = line_search
        options["snes_linesearch_max_it"] = 8
        snes.setType("newtonls")
        snes.setFunction(self._guarded(self._residual), self._x.duplicate())
        snes.setConvergenceTest(self._guarded(self._test))
        # else a line search that ends in a short step counts as convergence
        snes.setTolerances(stol=0.0)
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
        if self._system.choice is not self._choice:
            self._take_choice()
        self._strategy = self._system.strategy
        for snes in self._solvers.values():
            snes.setJacobian(self._guarded(self._jacobian), *self._strategy.operators())
        self._strategy.attach(self._ksp)
        if self._lagged is not None:
            self._lagged.attach(self._ksp)
        if self._ahead is not None:
            self._ahead.attach(self._ksp)

    def _before_solve(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        ksp.getPC().setReusePreconditioner(self._reuse)
        if self._iterates or self._lagged is not None:
            ksp.setTolerances(rtol=self._forcing_term())

    def _forcing_term(self) -> float:
        result = self._result
        is_linear = self._has_linear_bulk and not result.active_set_changes[-1]
        if self._may_touch and result.residuals[-1] > _NOT_CARRIED:
            is_linear = False  # points will come to touch
        power = AS_NEWTON if self._lagged is None else BELOW_NEWTON
        # not over the reactions, which grow from one iterate to the next
        goal = self._goal * self._reaction
        return forcing_term(self._norms, goal, is_linear=is_linear, power=power)

    def _after_solve(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        self._result.krylov_iterations += krylov_iterations(ksp)
        if self._ahead is None or ksp.getConvergedReason() < 0 or self._is_singular():
            return
        rests = len(self._result.residuals) > self._updates_while_yielding
        if rests and self.equilibrium.evaluation.yields():
            return
        tolerance = ksp.getTolerances()[0] if self._iterates else 0.0
        iterations = self._ahead.improve(b, x, self._strategy.matrix, tolerance)
        self._result.krylov_iterations += iterations
        if self._system.border:
            self._system.border.singular = None  # vectors that FGMRES tries say nothing of it

    def _is_singular(self) -> bool:
        border = self._system.border
        return border is not None and border.singular is not None

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
        self._begin(goal)
        self._from_afar = guess is not None and not line_search
        if guess is not None:
            self._start_from(guess)
        snes = self._solvers[line_search]
        snes.setTolerances(max_it=self.max_iterations)
        with self.equilibrium.timer("solve"):
            try:
                snes.solve(None, self._x)
            except PETSc.Error:
                if self._raised is not None:
                    raise self._raised from None
                raise
        if self._ksp.getConvergedReason() < 0:
            self._system.renew_factorisation()
            self._start_linear()
        return self._ended(snes)

    def _begin(self, goal: float) -> None:
        self._goal = goal or self.tolerance
        self._result = Newton(False, "", 0, [])
        self._norms: list[float] = []
        self._reaction = 1.0
        self._failure = ""
        self._raised = None
        self._renewed = True  # the last factorisation is of another matrix
        self._from_afar = False
        self._reuse = False
        if self._system.border:
            self._system.border.singular = None
            self._system.border.krylov_iterations = 0
        if self._ahead is not None:
            self._ahead.given_up = False

    def _start_from(self, guess: Array) -> None:
        self.equilibrium.pack(guess, self._x)
        self.equilibrium.contact.search()

    def _ended(self, snes: PETSc.SNES) -> Newton:
        """The result of a solve, with diagnostics where it failed."""
        result = self._result
        if self._system.border:
            result.krylov_iterations += self._system.border.krylov_iterations
        code = snes.getConvergedReason()
        result.iterations = snes.getIterationNumber()
        result.converged = code > 0
        if result.converged:
            result.reason = "converged"
            return result
        result.reason = self._failure or _REASONS.get(code, f"SNES reason {code}")
        result.plastic_increment = self.equilibrium.diagnostics.plastic_increment()
        result.worst = self.equilibrium.diagnostics.worst_place()
        return result

    def residual_norm(self, guess: Array) -> float:
        """The norm of the residual at a ``guess`` for `solve`; infinite where a contact point finds
        no partner."""
        f = self._x.duplicate()
        self._start_from(guess)
        try:
            self.equilibrium.residual_of(self._x, f)
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
        if self._system.strategy is not self._strategy:
            self._attach()

    def _jacobian(self, snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
        """Assemble the tangent unless the last one will do, and factorise it unless a lagged
        factorisation will."""
        result = self._result
        if self._is_close():
            return
        factorise = self._lagged is None or self._lagged.factorises(
            self._ksp.getIterationNumber(), result.residuals[-1], renewed=self._renewed
        )
        self._reuse = not factorise or self._keeps_levels()
        is_afar = self._from_afar and len(result.residuals) == 1
        self.equilibrium.contact.follow(not is_afar)
        before = self._system.tangent.factorisations
        self._system.update(factorise=factorise)
        result.factorisations += self._system.tangent.factorisations - before
        self._renewed = False

    def _keeps_levels(self) -> bool:
        """Whether multigrid solves with the levels of an earlier matrix: after two iterations in
        which Newton's method converges the matrix hardly changes."""
        residuals = self._result.residuals
        if not self._iterates or self._system.border or self._renewed:
            return False
        if len(residuals) <= _ITERATIONS_WITH_LEVELS:
            return False
        return residuals[-1] < _CONVERGES * residuals[-2]

    def _is_close(self) -> bool:
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
        evaluation = self.equilibrium.evaluation
        result = self._result
        norm = norms[2]
        reaction = max(evaluation.reaction_norm, self.equilibrium.largest_reaction)
        result.active_set_changes.append(evaluation.changes)
        self._reaction = reaction if reaction > 0 else 1.0
        self._norms.append(norm)
        result.residuals.append(float(norm / self._reaction))
        self.watch(self.equilibrium.load, result)
        if self._is_singular():
            self._failure = self._singular_mode()
            return _R.DIVERGED_LINEAR_SOLVE
        if not np.isfinite(norm):
            return RESIDUAL_NOT_FINITE
        if norm <= max(self._goal * reaction, evaluation.noise):
            return _R.CONVERGED_FNORM_RELATIVE
        if self._stagnates():
            self._failure = "the residual does not fall any further"
            return _R.DIVERGED_DTOL
        return _R.DIVERGED_MAX_IT if iteration >= self.max_iterations else _R.ITERATING

    def _stagnates(self) -> bool:
        """Whether the residual has not halved in as many iterations as it is given, neither itself
        nor over the reaction, which falls with it where a body only turns."""
        has_changes = max(self._result.active_set_changes[-CIRCLING:]) > self.few
        patience = _PATIENCE if has_changes else CIRCLING
        for residuals in (self._result.residuals, self._norms):
            earlier = residuals[:-patience]
            if not earlier or min(residuals[-patience:]) <= 0.5 * min(earlier):
                return False
        return True

    def _singular_mode(self) -> str:
        """What is singular, in words."""
        at = self.equilibrium
        border = self._system.border
        assert border is not None
        assert border.singular is not None
        level = at.drives.unknown[border.singular]
        name = at.drives.names[level] if level < len(at.drives.names) else ""
        of_drive = f" of the drive {name!r}" if name else ""
        is_pressed = at.load > 0 and at.contact.n_active() > 0
        what = "no stiffness is left" if is_pressed else "nothing resists the force"
        return f"{what}{of_drive} (singular mode)"
