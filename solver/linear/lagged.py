"""FGMRES preconditioned by the factorisation of an earlier matrix of the same step.

With a good guess few contact points change from one iteration to the next: one to three products
and solves replace a factorisation. From step to step too many of them change. Where bodies yield
the matrix changes all over, until Newton's method is near its solution.
"""

from __future__ import annotations

from petsc4py import PETSc

from archord.solver.linear.strategy import Facts

_MANY_DOFS = 20_000  # for which a factorisation takes longer than some solves with an old one
_MANY_DOFS_YIELDING = 2_000  # the same where bodies yield
_MANY_SOLVES = 8  # that cost what a factorisation does
_NEAR = 2e-3  # residual over reaction below which the matrix of bodies that yield hardly changes


def why_not(facts: Facts) -> str | None:
    """Why factorisations are not kept."""
    many = _MANY_DOFS_YIELDING if facts.yields else _MANY_DOFS
    if facts.dofs < many:
        return f"fewer than {many} dofs"
    return None


class Lagged:
    """When to factorise, and how long to iterate with an old factorisation; ``yields`` tells
    whether bodies can yield."""

    def __init__(self, *, yields: bool) -> None:
        self._yields = yields
        self._right_side = 0.0

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp``, which has a direct preconditioner, iterate."""
        # one solve less than by GMRES: FGMRES keeps the preconditioned vectors
        ksp.setType("fgmres")
        ksp.setConvergenceTest(self._test)

    def _test(self, ksp: PETSc.KSP, iteration: int, norm: float) -> PETSc.KSP.ConvergedReason:
        """Done when the residual is small, or when a new factorisation would have been quicker."""
        if iteration == 0:
            self._right_side = norm
        if norm <= ksp.getTolerances()[0] * self._right_side or iteration >= 2 * _MANY_SOLVES:
            return PETSc.KSP.ConvergedReason.CONVERGED_ITS
        return PETSc.KSP.ConvergedReason.ITERATING

    def factorises(self, iterations: int, residual: float, *, renewed: bool) -> bool:
        """Whether to factorise the next matrix: the last system took so many ``iterations``,
        Newton's method is as far away as this ``residual``, or the matrix is ``renewed``."""
        is_far = self._yields and residual > _NEAR
        return renewed or is_far or iterations > _MANY_SOLVES
