"""Newton's linear system with one more unknown: the load factor of a rigid motion on which a given force acts.

``[A b; c d] (u, s) = (r, rho)`` is solved by one factorisation of A, the matrix at a given load factor, and two solves
with it: displacement control is regular wherever force control is, and beyond.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.solver.linear.direct import Direct
from archord.solver.linear.strategy import Facts, Inverse, Strategy

_SINGULAR = 1e-9  # stiffness against the motion over ``stiffness`` below which nothing resists the force


def why_not(facts: Facts) -> str | None:
    """Why the system has no border."""
    return None if facts.by_force else "the load is no force"


class Bordered(Inverse):
    """Python context of the bordered matrix and of its preconditioner, which solves with the last one that was
    factorised.

    The load factor is the last entry of rank 0. ``stiffness`` scales what counts as resistance; ``factoriser``
    gives the strategy for ``A``. Collective.
    """

    def __init__(self, A: PETSc.Mat, stiffness: float, factoriser: Callable[[PETSc.Mat], Strategy] = Direct) -> None:
        self.comm, self._stiffness, self._factoriser = A.comm.tompi4py(), stiffness, factoriser
        self._n = A.getLocalSize()[0]
        self._extra = int(self.comm.rank == 0)
        self.b, self.c, self.d = np.zeros(self._n), np.zeros(self._n), 0.0
        self._factorised = self.c, self.d  # with the matrix that the preconditioner is of
        self._stale, self.singular = True, False
        self._x, self._y = A.createVecs()
        self._along_b = np.zeros(self._n)
        self._ksp = PETSc.KSP()
        size = (self._n + self._extra, None)
        self.matrix = PETSc.Mat().createPython((size, size), context=self, comm=self.comm)
        self.matrix.setUp()
        self.replace(A)

    def replace(self, A: PETSc.Mat) -> None:
        """Border another matrix ``A`` of the same size."""
        self._A, self._stale = A, True
        self._ksp.destroy()
        self._ksp = PETSc.KSP().create(self.comm)
        self._factoriser(A).attach(self._ksp)

    def vector(self) -> PETSc.Vec:
        """A vector with the load factor as its last entry."""
        return PETSc.Vec().createMPI((self._n + self._extra, None), comm=self.comm)

    def factor(self, x: PETSc.Vec) -> float:
        """The load factor in ``x``, on every rank."""
        return float(self.comm.bcast(x.array_r[-1] if self._extra else None))

    def join(self, x: PETSc.Vec, u: Array, factor: float) -> None:
        """Put ``u`` ``(n_owned dofs,)`` and ``factor`` into ``x``."""
        x.array[: self._n], x.array[self._n :] = u, factor

    def update(self, b: Array, c: Array, d: float, *, factorise: bool = True) -> None:
        """New border for a matrix with new values: ``b`` and ``c`` of this rank's dofs, ``d`` of all ranks. Without
        ``factorise`` the preconditioner stays that of the last matrix that was factorised."""
        self.b, self.c, self.d = b, c, d
        self._stale |= factorise
        self._ksp.getPC().setReusePreconditioner(not self._stale)

    def _solve(self, r: Array) -> Array:
        self._x.array[:] = r
        self._ksp.solve(self._x, self._y)
        return self._y.array_r.copy()

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = [A b; c d] x``, called by PETSc."""
        s, u = self.factor(x), x.array_r[: self._n]
        self._x.array[:] = u
        self._A.mult(self._x, self._y)
        self.join(y, self._y.array_r + s * self.b, self.comm.allreduce(float(self.c @ u)) + self.d * s)

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x = [A b; c d]^-1 r``, called by PETSc; where nothing resists the motion, the load factor stays."""
        if self._stale:
            self._along_b, self._factorised = self._solve(self.b), (self.c, self.d)
            self._stale = False
        rho, u = self.factor(r), self._solve(r.array_r[: self._n])
        c, d = self._factorised
        along_b, along_u = self.comm.allreduce(np.array([c @ self._along_b, c @ u]))
        self.singular = abs(d - along_b) < _SINGULAR * self._stiffness
        s = 0.0 if self.singular else (rho - along_u) / (d - along_b)
        self.join(x, u - s * self._along_b, s)
