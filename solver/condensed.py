"""Newton's linear systems of an elastic joint, solved with one sparse factorisation for all.

Nothing changes but the contact: the tangent is ``K + E D`` with the constant stiffness ``K``, the rows ``D`` of the
contact forces, and ``E`` that puts them in their places. By the formula of Woodbury (Golub and Van Loan 2013, 2.1.4)

    (K + E D)^-1 r = y - Z (1 + D Z)^-1 D y,    y = K^-1 r,    Z = K^-1 E,

a system as small as the contact. ``Z`` is found once, for all places that may get a force.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array


class Condensed:
    """Python context of the matrix ``K + E D`` and of its preconditioner, which solves with it. Of one rank.

    ``K`` ``(n, n)`` is symmetric and positive definite; ``nodes`` are the block dofs that may get forces.
    """

    def __init__(self, K: PETSc.Mat, nodes: np.ndarray) -> None:
        self._K, n = K, K.getSize()[0]
        K.setOption(PETSc.Mat.Option.SPD, True)
        self._ksp = PETSc.KSP().create(K.comm)
        self._ksp.setType("preonly")
        self._ksp.setOperators(K)
        pc = self._ksp.getPC()
        pc.setType("cholesky")
        pc.setFactorSolverType("mumps")
        self._y = K.createVecLeft()
        dofs = (2 * nodes[:, None] + np.arange(2)).ravel()
        self._place = np.full(n, -1)  # column of Z that belongs to a dof
        self._place[dofs] = np.arange(len(dofs))
        self._Z = self._responses(dofs)
        self._rows = self._columns = np.zeros(0, dtype=np.int64)
        self._D, self._small = np.zeros((0, 0)), np.zeros((0, 0))
        self.matrix = PETSc.Mat().createPython(((n, None), (n, None)), context=self, comm=K.comm)
        self.matrix.setUp()

    def _responses(self, dofs: np.ndarray) -> Array:
        """Displacements ``(n, m)`` under unit forces at ``dofs`` ``(m,)``, one after the other."""
        n, m = len(self._place), len(dofs)
        unit = PETSc.Mat().createDense(((n, None), (m, None)), comm=self._K.comm)
        unit.setUp()
        unit.getDenseArray()[dofs, np.arange(m)] = 1.0
        unit.assemble()
        found = unit.duplicate()
        self._ksp.setUp()
        self._ksp.getPC().getFactorMatrix().matSolve(unit, found)
        responses = found.getDenseArray().copy(order="F")
        unit.destroy()
        found.destroy()
        return responses

    def update(self, rows: np.ndarray, columns: np.ndarray, blocks: Array) -> None:
        """Make ``E D`` of ``blocks`` ``(m, 2, 2)``, each place once, at block dofs ``rows``, ``columns`` ``(m,)``."""
        axis = np.arange(2)
        self._rows, row = np.unique(2 * rows[:, None, None] + axis[:, None], return_inverse=True)
        self._columns, column = np.unique(2 * columns[:, None, None] + axis, return_inverse=True)
        self._D = np.zeros((len(self._rows), len(self._columns)))
        self._D[row.reshape(-1, 2, 1), column.reshape(-1, 1, 2)] = blocks
        self._small = self._D @ self._Z[np.ix_(self._columns, self._place[self._rows])]
        self._small[np.diag_indices(len(self._rows))] += 1

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = (K + E D) x``, called by PETSc."""
        self._K.mult(x, y)
        y.array[self._rows] += self._D @ x.array_r[self._columns]

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x = (K + E D)^-1 r``, called by PETSc; not a number if that is singular."""
        self._ksp.solve(r, self._y)
        forces = np.zeros(self._Z.shape[1])
        try:
            forces[self._place[self._rows]] = np.linalg.solve(self._small, self._D @ self._y.array_r[self._columns])
        except np.linalg.LinAlgError:
            forces[:] = np.nan
        x.array[:] = self._y.array_r - self._Z @ forces
