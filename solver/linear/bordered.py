"""Newton's linear system with a few more unknowns: levels of drives, such as rigid motions on which
given forces act.

``[A B; C D] (u, s) = (r, rho)`` with ``m`` of them is solved by one factorisation of A, the matrix
at given levels, and ``m + 1`` solves with it, through the Schur complement ``D - C A^-1 B``:
displacement control is regular wherever force control is, and beyond.

Where multigrid solves with A, FGMRES solves the whole system. One cycle stands for A^-1 in its
preconditioner, but for A^-1 B, which is solved.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.solver.linear.multigrid import Multigrid, iterate
from archord.solver.linear.strategy import Facts, Strategy, krylov_iterations

# stiffness against a motion over ``stiffness`` below which nothing resists the force
_SINGULAR = 1e-9
# the same ratio, below which A^-1 B is solved accurately, to tell whether anything resists
_DOUBTFUL = 1e-3
# part of a right-hand side along a motion that nothing resists, above which there is no solution
_FORCED = 1e-3
# residuals over right-hand sides of A^-1 B by multigrid: where it is doubtful, and elsewhere
_ACCURATE = 1e-10
_ROUGH = 1e-4


def why_not(facts: Facts) -> str | None:
    """Why the system has no border."""
    return None if facts.by_force else "no load is the force on a motion, or a mean displacement"


class Border:
    """Python context of the matrix ``[A B; C D]``. Collective.

    B : (n_owned dofs, m)
    C : (n_owned dofs, m) its transpose
    D : (m, m) of all ranks
    n, extra : numbers of this rank's displacements and levels
    """

    def __init__(self, A: PETSc.Mat, B: Array, C: Array, D: Array) -> None:
        self.comm = A.comm.tompi4py()
        self.A = A
        self.B = B
        self.C = C
        self.D = D
        self.n = len(B)
        self.extra = len(D) if self.comm.rank == 0 else 0
        self._x, self._y = A.createVecs()

    def matrix(self) -> PETSc.Mat:
        """The matrix."""
        size = self.n + self.extra, None
        matrix = PETSc.Mat().createPython((size, size), context=self, comm=self.comm)
        matrix.setUp()
        return matrix

    def levels(self, x: PETSc.Vec) -> Array:
        """The levels ``(m,)`` in ``x``, on every rank."""
        return self.comm.bcast(x.array_r[self.n :].copy())

    def join(self, x: PETSc.Vec, u: Array, levels: Array) -> None:
        """Put ``u`` ``(n_owned dofs,)`` and ``levels`` ``(m,)`` into ``x``."""
        x.array[: self.n] = u
        x.array[self.n :] = levels[: self.extra]

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = [A B; C D] x``, called by PETSc."""
        s = self.levels(x)
        u = x.array_r[: self.n]
        self._x.array[:] = u
        self.A.mult(self._x, self._y)
        along = self.comm.allreduce(u @ self.C)
        self.join(y, self._y.array_r + self.B @ s, along + self.D @ s)


class Bordered(Strategy):
    """Python context of the preconditioner of the bordered matrix, which solves with the last one
    that was factorised. Collective.

    The ``m`` levels are the last entries of rank 0. ``stiffness`` scales what counts as resistance;
    ``give_strategy`` gives the strategy for ``A``. ``last`` is the border as it was updated last.
    ``singular`` numbers the level that a force moves most which nothing resists, or None.
    ``krylov_iterations`` are of all solves with ``A`` alone, 0 of factorisations.
    """

    def __init__(
        self,
        A: PETSc.Mat,
        m: int,
        stiffness: float,
        give_strategy: Callable[[], Strategy],
    ) -> None:
        self.comm = A.comm.tompi4py()
        self.singular: int | None = None
        self.krylov_iterations = 0
        self._stiffness = stiffness
        self._give_strategy = give_strategy
        zero: Array = np.zeros((A.getLocalSize()[0], m))
        self.last = Border(A, zero, zero, np.zeros((m, m)))
        self.matrix = self.last.matrix()
        # of the matrix that the preconditioner is of
        self._C = zero
        self._along_B = zero  # A^-1 B
        self._complement = self.last.D  # D - C A^-1 B
        self._x, self._y = A.createVecs()
        self._ksp = PETSc.KSP()
        self.replace(A)

    def replace(self, A: PETSc.Mat) -> None:
        """Border another matrix ``A`` of the same size."""
        self.last.A = A
        self._stale = True
        self._ksp.destroy()
        self._ksp = PETSc.KSP().create(self.comm)
        strategy = self._give_strategy()
        strategy.attach(self._ksp)
        self._iterates = isinstance(strategy, Multigrid)
        self._along_B = np.zeros_like(self._along_B)  # a guess, and the last one may be no number

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp`` solve so."""
        super().attach(ksp)
        if self._iterates:
            iterate(ksp, lambda: self.singular is not None)

    def update(self, B: Array, C: Array, D: Array, *, factorise: bool = True) -> None:
        """New border for a matrix with new values (see `Border`). Without ``factorise`` the
        preconditioner stays the last matrix that was factorised."""
        self.last.B = B
        self.last.C = C
        self.last.D = D
        self._stale |= factorise
        self._ksp.getPC().setReusePreconditioner(not self._stale)

    def _solve(self, r: Array, guess: Array | None = None) -> Array:
        self._x.array[:] = r
        self._ksp.setInitialGuessNonzero(guess is not None)
        if guess is not None:
            self._y.array[:] = guess
        self._ksp.solve(self._x, self._y)
        self.krylov_iterations += krylov_iterations(self._ksp)
        return self._y.array_r.copy()

    def _cycle(self, r: Array) -> Array:
        self._x.array[:] = r
        self._ksp.getPC().apply(self._x, self._y)
        return self._y.array_r.copy()

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x = [A B; C D]^-1 r``, called by PETSc; levels stay along motions that nothing
        resists."""
        last = self.last
        if self._stale:
            self._renew()
        rho = last.levels(r)
        of_displacements = r.array_r[: last.n]
        u = self._cycle(of_displacements) if self._iterates else self._solve(of_displacements)
        lacking = rho - self.comm.allreduce(u @ self._C)
        if not np.isfinite(self._complement).all():
            # the matrix could not be factorised: Newton's method sees the step fail
            self.replace(last.A)
            last.join(x, np.full_like(u, np.nan), np.full_like(rho, np.nan))
            return
        s = self._levels(lacking, r.norm())
        last.join(x, u - self._along_B @ s, s)

    def _renew(self) -> None:
        """Solve for A^-1 B."""
        self._stale = False
        self._C = self.last.C
        for tolerance in (_ROUGH, _ACCURATE):
            self._ksp.setTolerances(rtol=tolerance)
            found = []
            for k in range(len(self.last.D)):
                before = self._along_B[:, k] if self._iterates else None
                found.append(self._solve(self.last.B[:, k], before))
            self._along_B = np.stack(found, axis=1)
            self._complement = self.last.D - self.comm.allreduce(self._C.T @ self._along_B)
            if not self._iterates or not np.isfinite(self._complement).all():
                return
            resistance = np.linalg.svd(self._complement, compute_uv=False)
            if resistance.min() >= _DOUBTFUL * self._stiffness:
                return

    def _levels(self, lacking: Array, size: float) -> Array:
        """The levels ``(m,)`` that give what is ``lacking`` ``(m,)``, for a right-hand side of this
        ``size``; notes what is singular."""
        left, resistance, right = np.linalg.svd(self._complement)
        forced = left.T @ lacking
        is_resisted = resistance >= _SINGULAR * self._stiffness
        moved = np.divide(forced, resistance, where=is_resisted, out=np.zeros_like(forced))
        unresisted = np.where(is_resisted, 0.0, np.abs(forced))
        self.singular = None
        if unresisted.max() > _FORCED * size:
            mode = right[np.argmax(unresisted)]
            self.singular = int(np.argmax(np.abs(mode)))
        return right.T @ moved
