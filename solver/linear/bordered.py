"""Newton's linear system with a few more unknowns: levels of drives, such as rigid motions on which
given forces act.

``[A B; C D] (u, s) = (r, rho)`` with ``m`` of them is solved by one factorisation of A, the matrix
at given levels, and ``m + 1`` solves with it, through the Schur complement ``D - C A^-1 B``:
displacement control is regular wherever force control is, and beyond.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.solver.linear.direct import Direct
from archord.solver.linear.strategy import Facts, Strategy

_SINGULAR = (
    1e-9  # stiffness against a motion over ``stiffness`` below which nothing resists the force
)
_FORCED = (
    1e-3  # part of a right-hand side along such a motion above which the system has no solution
)


def why_not(facts: Facts) -> str | None:
    """Why the system has no border."""
    return None if facts.by_force else "no load is the force on a motion, or a mean displacement"


class Border:
    """Python context of a matrix ``A`` with the border ``B`` and the transpose of ``C`` ``(n_owned
    dofs, m)``, ``D`` ``(m, m)`` of all ranks; ``extra`` of its unknowns, the levels, are this
    rank's. Collective."""

    def __init__(self, A: PETSc.Mat, B: Array, C: Array, D: Array) -> None:
        self.comm, self.A, self.B, self.C, self.D = A.comm.tompi4py(), A, B, C, D
        self.n, self.extra = len(B), len(D) if self.comm.rank == 0 else 0
        self._x, self._y = A.createVecs()

    def matrix(self) -> PETSc.Mat:
        """The matrix."""
        size = (self.n + self.extra, None)
        matrix = PETSc.Mat().createPython((size, size), context=self, comm=self.comm)
        matrix.setUp()
        return matrix

    def levels(self, x: PETSc.Vec) -> Array:
        """The levels ``(m,)`` in ``x``, on every rank."""
        return self.comm.bcast(x.array_r[self.n :].copy())

    def join(self, x: PETSc.Vec, u: Array, levels: Array) -> None:
        """Put ``u`` ``(n_owned dofs,)`` and ``levels`` ``(m,)`` into ``x``."""
        x.array[: self.n], x.array[self.n :] = u, levels[: self.extra]

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = [A B; C D] x``, called by PETSc."""
        s, u = self.levels(x), x.array_r[: self.n]
        self._x.array[:] = u
        self.A.mult(self._x, self._y)
        self.join(y, self._y.array_r + self.B @ s, self.comm.allreduce(u @ self.C) + self.D @ s)


class Bordered(Strategy):
    """Python context of the preconditioner of the bordered matrix, which solves with the last one
    that was factorised. Collective.

    The ``m`` levels are the last entries of rank 0. ``stiffness`` scales what counts as resistance;
    ``factoriser`` gives the strategy for ``A``. ``singular`` numbers the level that a force moves
    most which nothing resists, or None.
    """

    def __init__(
        self,
        A: PETSc.Mat,
        m: int,
        stiffness: float,
        factoriser: Callable[[PETSc.Mat], Strategy] = Direct,
    ) -> None:
        self.comm, self._stiffness, self._factoriser = A.comm.tompi4py(), stiffness, factoriser
        zero: Array = np.zeros((A.getLocalSize()[0], m))
        self.last = Border(A, zero, zero, np.zeros((m, m)))
        self._factorised = self.last.C, self.last.D  # with the matrix that the preconditioner is of
        self._along_B = zero
        self.singular: int | None = None
        self._x, self._y = A.createVecs()
        self._ksp = PETSc.KSP()
        self.matrix = self.last.matrix()
        self.replace(A)

    def replace(self, A: PETSc.Mat) -> None:
        """Border another matrix ``A`` of the same size."""
        self.last.A, self._stale = A, True
        self._ksp.destroy()
        self._ksp = PETSc.KSP().create(self.comm)
        self._factoriser(A).attach(self._ksp)

    def update(self, B: Array, C: Array, D: Array, *, factorise: bool = True) -> None:
        """New border for a matrix with new values (see `Border`). Without ``factorise`` the
        preconditioner stays that of the last matrix that was factorised."""
        self.last.B, self.last.C, self.last.D = B, C, D
        self._stale |= factorise
        self._ksp.getPC().setReusePreconditioner(not self._stale)

    def _solve(self, r: Array) -> Array:
        self._x.array[:] = r
        self._ksp.solve(self._x, self._y)
        return self._y.array_r.copy()

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x = [A B; C D]^-1 r``, called by PETSc; levels stay along motions that nothing
        resists."""
        last = self.last
        if self._stale:
            self._along_B = np.stack([self._solve(b) for b in last.B.T], axis=1)
            self._factorised, self._stale = (last.C, last.D), False
        rho, u = last.levels(r), self._solve(r.array_r[: last.n])
        C, D = self._factorised
        along_B, along_u = self.comm.allreduce(C.T @ self._along_B), self.comm.allreduce(u @ C)
        if not np.isfinite(
            along_B
        ).all():  # the matrix could not be factorised: Newton's method sees the step fail
            self.replace(last.A)
            last.join(x, np.full_like(u, np.nan), np.full(len(rho), np.nan))
            return
        left, resistance, right = np.linalg.svd(D - along_B)
        forced, resisted = left.T @ (rho - along_u), resistance >= _SINGULAR * self._stiffness
        s = right.T @ np.divide(forced, resistance, where=resisted, out=np.zeros_like(forced))
        free = np.where(resisted, 0.0, np.abs(forced))
        loose = free.max() > _FORCED * r.norm()
        self.singular = int(np.argmax(np.abs(right[np.argmax(free)]))) if loose else None
        last.join(x, u - self._along_B @ s, s)
