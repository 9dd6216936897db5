"""Which points touch and stick, asked again after each linear solve, of whatever strategy.

Those whose trial traction, linearised, would come to another branch of their law with the increment
found go over to it, and the system is solved again with their blocks changed: by FGMRES, which the
factorisation of the matrix before preconditions, as the change is of low rank. That is Newton's
method for generalised equations (Josephy 1979): what is left to its iterations is what is smooth,
so that their number does not grow with that of the points at the edges of contact and of stick.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.solver.linear.strategy import Facts

MOST_REVISIONS = 2  # of the points in one solve: more cost what the iterations cost that they save
_TOLERANCE = 1e-3  # residual of a system over its right-hand side
_MOST_SOLVES = (
    40  # with the factorisation, for one revision: nearly incompressible bodies need most
)
_MOST_SOLVES_YIELDING = (
    10  # where bodies yield: what the linearised system says holds less far there
)

Revise = Callable[[Array], tuple[PETSc.Mat, Array] | None]


def why_not(facts: Facts) -> str | None:
    """Why points are not asked again."""
    if facts.yields and not facts.friction:
        return (
            "bodies yield without friction: it would take as long as the iterations that it saves"
        )
    return (
        "there is no contact, or one with a law that never opens"
        if facts.gamma_factor is None
        else None
    )


class LookAhead:
    """``revise(increment)`` goes over to the points that touch and stick after an ``increment`` of
    this rank's unknowns ``(n,)``, and returns the matrix for them with what they add to the
    residual ``(n,)``; None for no change. Whether bodies may yield is ``yields``. Collective."""

    def __init__(self, revise: Revise, *, yields: bool) -> None:
        self._revise, self.given_up = revise, False
        self._most_solves = _MOST_SOLVES_YIELDING if yields else _MOST_SOLVES

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp`` precondition."""
        self._ksp = PETSc.KSP().create(ksp.comm)
        self._ksp.setType("fgmres")
        self._ksp.setGMRESRestart(self._most_solves)
        self._ksp.setPC(ksp.getPC())
        self._ksp.setInitialGuessNonzero(True)
        self._ksp.setTolerances(rtol=_TOLERANCE, max_it=self._most_solves)

    def improve(self, r: PETSc.Vec, x: PETSc.Vec, A: PETSc.Mat) -> None:
        """Replace ``x``, the solution of ``A x = r``, by that of the system revised, of Newton's
        step ``-x``."""
        if self.given_up or not np.isfinite(x.norm()):
            return
        r, better = r.copy(), x.copy()
        for _ in range(MOST_REVISIONS):
            revised = self._revise(-x.array_r)
            if revised is None:
                break
            r.array[:] += revised[1]
            self._ksp.setOperators(revised[0], A)
            self._ksp.solve(r, better)
            if np.isfinite(better.norm()):
                better.copy(x)
            self.given_up = self._ksp.getConvergedReason() < 0
            if self.given_up:
                break
