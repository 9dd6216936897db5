"""The active set, updated after each linear solve of whatever strategy.

Points whose linearised trial traction comes to another branch of their law with the increment found
go over to it, and the system is solved again with their blocks changed. That is Newton's method for
generalised equations (Josephy 1979): its iterations are left with what is smooth, so that their
number does not grow with the number of points at the edges of contact and of stick.

A condensed system solves its small system again. All other systems are solved again by FGMRES,
which the factorisation of the matrix before preconditions, as the change is of low rank; so does
multigrid where that solves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.solver.linear.strategy import Facts

MOST_REVISIONS = 2  # of the points in one solve: more cost as much as the iterations they save
_DIMENSION_OF_ONE_UPDATE = 3  # while any point yields: from which on
_TOLERANCE = 1e-3  # residual of a system over its right-hand side
# preconditioned solves for one revision, with a factorisation or with multigrid: nearly
# incompressible bodies need most
_MOST_SOLVES = 40
_MOST_SOLVES_OF_MULTIGRID = 200
# where bodies yield: what the linearised system says holds less far there
_MOST_SOLVES_YIELDING = 10

Change = TypeVar("Change")
Revise = Callable[[Array], tuple[PETSc.Mat, Array] | None]


def why_not(facts: Facts) -> str | None:
    """Why the active set waits for the next iteration."""
    if facts.gamma_factor is None:
        return "there is no contact, or one with a law that never opens"
    return None


def iterations_while_bodies_yield(facts: Facts) -> float:
    """After how many first iterations of a solve the active set is updated while any point yields.

    In space the first update brings nearly all points to their branches, and the later ones take
    more time than the iterations that they save. Without friction in a plane the first does, too.
    """
    if not facts.yields:
        return math.inf
    if facts.dimension >= _DIMENSION_OF_ONE_UPDATE:
        return 1
    return math.inf if facts.friction else 0


def look_ahead(
    increment: Array,
    revise: Callable[[Array], Change | None],
    solve_again: Callable[[Change], Array | None],
) -> None:
    """Update the active set after a linear solve, and solve again while it changes.

    ``revise(increment)`` lets points go over to the branches to which an increment brings them, and
    returns what this changes in the system, None for no change. ``solve_again(change)`` returns the
    increment of the changed system, None if it gives up. Collective.
    """
    for _ in range(MOST_REVISIONS):
        change = revise(increment)
        if change is None:
            return
        solved = solve_again(change)
        if solved is None:
            return
        increment = solved


class LookAhead:
    """The look-ahead by FGMRES. Collective.

    ``revise(increment)`` goes over to the points that touch and stick after an ``increment`` of
    this rank's unknowns ``(n,)``, and returns the matrix for them with what they add to the
    residual ``(n,)``; None for no change. Whether bodies may yield is ``yields``, and whether
    multigrid preconditions, not a factorisation, is ``by_multigrid``. It has ``given_up``, until
    that is set again, where a changed system could not be solved.
    """

    def __init__(self, revise: Revise, *, yields: bool, by_multigrid: bool) -> None:
        self._revise = revise
        self.given_up = False
        self._most_solves = _MOST_SOLVES_OF_MULTIGRID if by_multigrid else _MOST_SOLVES
        if yields:
            self._most_solves = _MOST_SOLVES_YIELDING

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp`` precondition."""
        self._ksp = PETSc.KSP().create(ksp.comm)
        self._ksp.setType("fgmres")
        self._ksp.setGMRESRestart(self._most_solves)
        self._ksp.setPC(ksp.getPC())
        self._ksp.setInitialGuessNonzero(True)
        self._ksp.setTolerances(rtol=_TOLERANCE, max_it=self._most_solves)

    def improve(self, r: PETSc.Vec, x: PETSc.Vec, A: PETSc.Mat, tolerance: float = 0.0) -> int:
        """Replace ``x``, the solution of ``A x = r`` to a ``tolerance``, by the solution of the
        revised system; Newton's step is ``-x``. Returns the number of Krylov iterations."""
        if self.given_up or not np.isfinite(x.norm()):
            return 0
        self._ksp.setTolerances(rtol=max(tolerance, _TOLERANCE))
        iterations = 0
        r = r.copy()
        better = x.copy()

        def solve_again(change: tuple[PETSc.Mat, Array]) -> Array | None:
            nonlocal iterations
            matrix, residual = change
            r.array[:] += residual
            self._ksp.setOperators(matrix, A)
            self._ksp.solve(r, better)
            iterations += self._ksp.getIterationNumber()
            if np.isfinite(better.norm()):
                better.copy(x)
            self.given_up = self._ksp.getConvergedReason() < 0
            return None if self.given_up else -x.array_r

        look_ahead(-x.array_r, self._revise, solve_again)
        return iterations
