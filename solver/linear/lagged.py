"""FGMRES preconditioned by a factorisation of an earlier matrix, for large elastic problems.

With a good guess few contact points change from one iteration to the next: one to three products
and solves replace a factorisation. From step to step too many of them change, and plastic bodies
change all over.
"""

from __future__ import annotations

from petsc4py import PETSc

from archord.solver.linear.strategy import Facts

_MANY_DOFS = 20_000  # for which a factorisation takes longer than some solves with an old one
_TOLERANCE = 1e-3  # residual of a linear system over its right-hand side
_MANY_SOLVES = 12  # that cost what a factorisation does
_MANY_CHANGES = 100  # of the active set, which make so many solves


def why_not(facts: Facts) -> str | None:
    """Why factorisations are not kept."""
    if facts.yields:
        return "bodies can yield, the matrix changes all over"
    if facts.dofs < _MANY_DOFS:
        return f"fewer than {_MANY_DOFS} dofs"
    return None


class Lagged:
    """When to factorise, and how long to iterate with an old factorisation."""

    def __init__(self) -> None:
        self._changes = 0  # of the active set since the last factorisation
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
        if norm <= _TOLERANCE * self._right_side or iteration >= 2 * _MANY_SOLVES:
            return PETSc.KSP.ConvergedReason.CONVERGED_ITS
        return PETSc.KSP.ConvergedReason.ITERATING

    def factorises(self, iterations: int, changes: int, *, renewed: bool) -> bool:
        """Whether to factorise the next matrix: the last system took so many ``iterations``, there
        were ``changes`` of the active set since the last matrix, or it is ``renewed``."""
        self._changes += changes
        factorise = renewed or iterations > _MANY_SOLVES or self._changes > _MANY_CHANGES
        if factorise:
            self._changes = 0
        return factorise
