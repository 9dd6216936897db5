"""Newton's linear systems of an elastic joint, solved with one sparse factorisation for all.

Nothing changes but the contact: the tangent is ``K + E D`` with the constant stiffness ``K``, the rows ``D`` of the
contact forces, and ``E`` that puts them in their places. By the formula of Woodbury (Golub and Van Loan 2013, 2.1.4)

    (K + E D)^-1 r = y - Z (1 + D Z)^-1 D y,    y = K^-1 r,    Z = K^-1 E,

a system as small as the contact. ``Z`` is found once, for all places that may get a force.

Which points are closed is asked again after each solve: those whose pressure, linearised, would change its sign with
the increment found open or close, and the small system is solved anew. That is Newton's method for generalised
equations (Josephy 1979): what is left to its iterations is what is smooth, so that their number does not grow with that
of the points at the contact's edge.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array

_MOST_REVISIONS = 2  # of the closed points in one solve: more cost what the iterations cost that they save


class Condensed:
    """Python context of the matrix ``K + E D`` and of its preconditioner, which solves with it. Of one rank.

    ``K`` ``(n, n)`` is symmetric and positive definite; ``nodes`` ``(m,)`` are the block dofs that may get forces.
    ``revise(increment)`` goes over to the points that are closed after an increment ``(n,)`` of the solution, calls
    `update`, and returns what that adds to the residual ``(m, 2)``, or None where nothing changes.
    """

    def __init__(self, K: PETSc.Mat, nodes: np.ndarray, revise: Callable[[Array], Array | None]) -> None:
        self._K, n = K, K.getSize()[0]
        self._revise = revise
        K.setOption(PETSc.Mat.Option.SPD, True)
        self._ksp = PETSc.KSP().create(K.comm)
        self._ksp.setType("preonly")
        self._ksp.setOperators(K)
        pc = self._ksp.getPC()
        pc.setType("cholesky")
        pc.setFactorSolverType("mumps")
        self._y = K.createVecLeft()
        self._dofs = (2 * nodes[:, None] + np.arange(2)).ravel()
        self._place = np.full(n, -1)  # column of Z that belongs to a dof
        self._place[self._dofs] = np.arange(len(self._dofs))
        self._Z = self._responses(self._dofs)
        none = np.zeros(0, dtype=np.int64)
        self.occupy(none, none)
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

    def occupy(self, rows: np.ndarray, columns: np.ndarray) -> None:
        """Let the blocks of `update` be at block dofs ``rows``, among the nodes, and ``columns`` ``(k,)``, each place
        once; all are zero."""
        axis = np.arange(2)
        near, column = np.unique(columns, return_inverse=True)
        self._columns = (2 * near[:, None] + axis).ravel()
        self._row = self._place[2 * rows] // 2
        self._at = 2 * self._row[:, None, None] + axis[:, None], 2 * column[:, None, None] + axis
        self._near_Z = np.ascontiguousarray(self._Z[self._columns])
        m = self._Z.shape[1]
        self._blocks = np.zeros((len(rows), 2, 2))
        self._D, self._DZ = np.zeros((m, len(self._columns))), np.zeros((m, m))
        self._filled = np.zeros(m, dtype=bool)  # rows of D

    def update(self, blocks: Array) -> None:
        """Make ``E D`` of ``blocks`` ``(k, 2, 2)``; what has not changed costs nothing."""
        changed = np.flatnonzero((blocks != self._blocks).any(axis=(1, 2)))
        self._D[self._at[0][changed], self._at[1][changed]] = blocks[changed]
        self._blocks = blocks
        row = (2 * np.unique(self._row[changed])[:, None] + np.arange(2)).ravel()
        D = self._D[row]
        self._filled[row] = D.any(axis=1)
        used = np.flatnonzero(D.any(axis=0))
        self._DZ[row] = D[:, used] @ self._near_Z[used]

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = (K + E D) x``, called by PETSc."""
        self._K.mult(x, y)
        y.array[self._dofs] += self._D @ x.array_r[self._columns]

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x = (K + E D)^-1 r`` with the points that are closed after ``-x``, called by PETSc; not a number if that is
        singular."""
        self._ksp.solve(r, self._y)
        forces, near = np.zeros(self._Z.shape[1]), self._y.array_r[self._columns]
        for _ in range(_MOST_REVISIONS):
            drawn = self._drawn(near)
            increment = np.zeros(len(self._place))
            increment[self._columns] = self._near_Z @ drawn - near
            change = self._revise(increment)
            if change is None:
                break
            forces += change.ravel()
            near += self._near_Z @ change.ravel()
        else:
            drawn = self._drawn(near)
        x.array[:] = self._y.array_r + self._Z @ (forces - drawn)

    def _drawn(self, y: Array) -> Array:
        """``(1 + D Z)^-1 D y`` of ``y`` ``(columns,)``, a force on each dof of the nodes ``(2 m,)``."""
        force = np.zeros(len(self._DZ))
        rows = np.flatnonzero(self._filled)
        small = self._DZ[np.ix_(rows, rows)]
        small[np.diag_indices(len(rows))] += 1
        try:
            force[rows] = np.linalg.solve(small, (self._D @ y)[rows])
        except np.linalg.LinAlgError:
            force[:] = np.nan
        return force
