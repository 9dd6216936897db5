"""Newton's linear system with one more unknown: the level of a rigid motion on which a given force acts.

``[A b; c d] (u, s) = (r, rho)`` is solved by one factorisation of A, the matrix at a given level, and two solves with
it: displacement control is regular wherever force control is, and beyond.
"""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.solver.linear.substructures import substructures

_FREE = 1e-9  # stiffness of the joint over ``stiffness`` below which nothing resists the force


def direct_solver(ksp: PETSc.KSP, A: PETSc.Mat, V: fem.FunctionSpace | None = None) -> None:
    """Let ``ksp`` factorise ``A`` by MUMPS; on several ranks, of the displacements ``V``, by `Substructures` where that
    goes. Collective."""
    ksp.setType("preonly")
    ksp.setOperators(A)
    pc = ksp.getPC()
    parts = None if V is None else substructures(A, V)
    if parts is not None:
        pc.setType("python")
        pc.setPythonContext(parts)
        return
    pc.setType("lu")
    pc.setFactorSolverType("mumps")
    pc.setFactorSetUpSolverType()
    factors = pc.getFactorMatrix()
    factors.setMumpsIcntl(14, 60)
    factors.setMumpsIcntl(8, 1)  # scale by the diagonal: what MUMPS does by itself takes a seventh of a factorisation


class Bordered:
    """Python context of the bordered matrix and of its preconditioner, which solves with the last one that was
    factorised.

    The level is the last entry of rank 0. ``stiffness`` scales what counts as resistance; ``V`` as for `direct_solver`.
    Collective.
    """

    def __init__(self, A: PETSc.Mat, stiffness: float, V: fem.FunctionSpace | None = None) -> None:
        self.comm, self._stiffness, self._V = A.comm.tompi4py(), stiffness, V
        self._n = A.getLocalSize()[0]
        self._extra = int(self.comm.rank == 0)
        self.b, self.c, self.d = np.zeros(self._n), np.zeros(self._n), 0.0
        self._factorised = self.c, self.d  # with the matrix that the preconditioner is of
        self._stale, self.came_free = True, False
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
        direct_solver(self._ksp, A, self._V)

    def vector(self) -> PETSc.Vec:
        """A vector with the level as its last entry."""
        return PETSc.Vec().createMPI((self._n + self._extra, None), comm=self.comm)

    def level(self, x: PETSc.Vec) -> float:
        """The level in ``x``, on every rank."""
        return float(self.comm.bcast(x.array_r[-1] if self._extra else None))

    def join(self, x: PETSc.Vec, u: Array, level: float) -> None:
        """Put ``u`` ``(n_owned dofs,)`` and ``level`` into ``x``."""
        x.array[: self._n] = u
        x.array[self._n :] = level

    def update(self, b: Array, c: Array, d: float, *, factorise: bool = True) -> None:
        """New border for a matrix with new values: ``b`` and ``c`` of this rank's dofs, ``d`` of all ranks.

        Without ``factorise`` the preconditioner stays that of the last matrix that was factorised.
        """
        self.b, self.c, self.d = b, c, d
        self._stale |= factorise
        self._ksp.getPC().setReusePreconditioner(not self._stale)

    def _solve(self, r: Array) -> Array:
        self._x.array[:] = r
        self._ksp.solve(self._x, self._y)
        return self._y.array_r.copy()

    def _dot(self, a: Array, b: Array) -> float:
        return self.comm.allreduce(float(a @ b))

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = [A b; c d] x``, called by PETSc."""
        s, u = self.level(x), x.array_r[: self._n]
        self._x.array[:] = u
        self._A.mult(self._x, self._y)
        self.join(y, self._y.array_r + s * self.b, self._dot(self.c, u) + self.d * s)

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x = [A b; c d]^-1 r``, called by PETSc; where nothing resists the level, it stays."""
        if self._stale:
            self._along_b, self._factorised = self._solve(self.b), (self.c, self.d)
            self._stale = False
        rho, u = self.level(r), self._solve(r.array_r[: self._n])
        c, d = self._factorised
        pivot = d - self._dot(c, self._along_b)
        self.came_free = abs(pivot) < _FREE * self._stiffness
        s = 0.0 if self.came_free else (rho - self._dot(c, u)) / pivot
        self.join(x, u - s * self._along_b, s)
