"""The ways to solve for equilibrium: PETSc's SNES with MUMPS, and what is tried where it does not converge."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.solver.contact.interaction import GAMMA_FACTOR
from archord.solver.equilibrium import Equilibrium
from archord.solver.linear.lagged import Lagged
from archord.solver.timer import BEFORE_SOLVING

_STIFF_CONTACT = 5.0  # gamma factor above which it is raised in stages where a solve fails
_GAMMA_RATIO = 10.0  # and the largest ratio of one gamma to the next
_PATIENCE = 12  # Newton iterations in which the residual must halve
_CIRCLING = 4  # the same where the active set stands still
_ROUGH = 1e-3  # residual over reaction at which a solution is good enough for a guess


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
        self.continues_gamma = False  # a large gamma has to be raised in stages
        self._raised: BaseException | None = None
        self._failure = ""
        self._renewed = True  # the last factorisation is of another matrix
        self._lagged = Lagged() if equilibrium.choice.uses("lagged") else None
        with equilibrium.timer(BEFORE_SOLVING):
            self._snes = self._make_snes()

    @property
    def elastic(self) -> bool:
        """Whether no body can yield, so that nothing but the contact is nonlinear."""
        return not self.equilibrium.bulk.plastic

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
        return now < _ROUGH * before and now * now / before < 0.1 * self._goal

    def _test(self, snes, iteration, norms):
        norm = norms[2]
        at = self.equilibrium
        reaction = max(at.reaction_norm, at.largest_reaction)
        scale = max(reaction, at.noise / self._goal)
        self._changes.append(at.changes)
        self._residuals.append(float(norm / reaction if reaction > 0 else norm))
        if self._singular():
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
        patience = _PATIENCE if any(self._changes[-_CIRCLING:]) else _CIRCLING
        recent, before = self._residuals[-patience:], self._residuals[:-patience]
        return bool(before) and min(recent) > 0.5 * min(before)

    def solve(self, load: float, guess: Array, *, afar: bool = False) -> Newton:
        """Solve at ``load`` as `solve_at_once`; where a large gamma makes that fail, by continuation in gamma.

        The solution hardly depends on gamma, but points open and close for many iterations where it is large.
        """
        contact, result = self.equilibrium.contact, None
        wanted = 0.0 if contact is None else contact.gamma_factor
        if contact is None or wanted <= _STIFF_CONTACT:
            return self.solve_at_once(load, guess, afar=afar)
        if not self.continues_gamma:
            result = self.solve_at_once(load, guess, afar=afar)
            if result.converged:
                return result
        stages = math.ceil(math.log(wanted / GAMMA_FACTOR, _GAMMA_RATIO))
        for factor in np.geomspace(GAMMA_FACTOR, wanted, stages + 1):
            contact.use_gamma_factor(float(factor))
            result = self.solve_at_once(load, guess, afar=afar).after(result)
            guess, afar = self.equilibrium.state(), False
            if not result.converged:
                break
        contact.use_gamma_factor(wanted)
        assert result is not None
        self.continues_gamma |= result.converged
        return result

    def solve_at_once(self, load: float, guess: Array, *, afar: bool = False) -> Newton:
        """Solve at ``load`` from ``guess``, shaped like `state`, whose prescribed values are replaced.

        A guess from ``afar`` is too stiff for a line search, which creeps there, and may yield far too much: full steps
        come first, and a rough equilibrium of points that cannot yield (further) comes before the one asked for; if
        that fails, the solve starts from the guess.
        """
        self.equilibrium.load = load
        points = self.equilibrium.plastic_points()
        if not self.comm.allreduce(len(points)):
            return self._run_either_way(guess, full_steps=afar)
        before = None
        if afar:
            for p in points:
                p.elastic_only = True
            self._goal = max(_ROUGH, self.tolerance)
            before = self._run_either_way(guess, full_steps=True)
            self._goal = self.tolerance
            for p in points:
                p.elastic_only = False
            if before.converged:
                guess = self.equilibrium.state()
        return self._run_either_way(guess).after(before)

    def _run_either_way(self, guess: Array, *, full_steps: bool = False) -> Newton:
        """With a line search, then without, or the other way round with ``full_steps``.

        The problem is nearly linear by pieces, where it is smooth, and full steps find the right ones where the line
        search, which wants a smaller residual in every step, creeps: first touch, large gamma, nearly incompressible
        bodies.
        """
        result = None
        for kind in ("basic", "bt") if full_steps else ("bt", "basic"):
            self._line_search(kind)
            result = self._run(guess).after(result)
            if result.converged or self._singular():
                break
        assert result is not None
        return result

    def _line_search(self, kind: str) -> None:
        PETSc.Options("archord_")["snes_linesearch_type"] = kind
        self._snes.setFromOptions()

    def _run(self, guess: Array) -> Newton:
        """Newton's method from ``guess``.

        Where it circles though no point opens or closes, points jump between two facets that meet at an angle; they
        stay on theirs then, each facet continued beyond its ends.
        """
        result = self._newton(guess)
        contact = self.equilibrium.contact
        changes = result.active_set_changes
        circles = len(changes) > _CIRCLING and not any(changes[-_CIRCLING:])
        if result.converged or contact is None or not contact.pairs_move or not circles:
            return result
        self.equilibrium.unpack(self._x)
        contact.hold()
        return replace(self._newton(self.equilibrium.state(), search=False).after(result), held=True)

    def _newton(self, guess: Array, *, search: bool = True) -> Newton:
        self._residuals: list[float] = []
        self._changes: list[int] = []
        self._failure = ""
        self._factorisations = self._evaluations = 0
        self._renewed = True
        at = self.equilibrium
        at.pack(guess, self._x)
        if at.contact is not None and search:
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
        if self._singular():
            pressed = at.load > 0 and at.contact is not None and at.contact.n_active() > 0
            cause = "no stiffness is left" if pressed else "nothing resists the force"
            reason = f"{cause} (singular mode)"
        increment = max((float(np.max(p.increment, initial=0.0)) for p in at.plastic_points()), default=0.0)
        increment = self.comm.allreduce(increment, op=MPI.MAX)
        return replace(result, reason=reason, worst=at.worst_place(), plastic_increment=increment)

    def _singular(self) -> bool:
        return self.equilibrium.control.singular


_R = PETSc.SNES.ConvergedReason
_REASONS = {
    _R.DIVERGED_MAX_IT: "no convergence within the allowed iterations",
    _R.DIVERGED_LINE_SEARCH: "the line search found no smaller residual",
    _R.DIVERGED_LINEAR_SOLVE: "the linear system could not be factorised",
    _R.DIVERGED_FNORM_NAN: "the residual is not a number",
    _R.DIVERGED_FUNCTION_DOMAIN: "the residual could not be evaluated",
}
