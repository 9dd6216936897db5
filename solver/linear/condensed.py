"""Newton's linear systems of elastic bodies, solved with one sparse factorisation for all.

Nothing changes but the contact: the tangent is ``K + E D`` with the constant stiffness ``K``, the
rows ``D`` of the contact forces, and ``E`` that puts them in their places. By the formula of
Woodbury (Golub and Van Loan 2013, 2.1.4)

    (K + E D)^-1 r = y - Z (1 + D Z)^-1 D y,    y = K^-1 r,    Z = K^-1 E,

a system as small as the contact. ``Z`` is found once, for all places that may get a force.

The active set is updated after each solve, as look_ahead.py says, and the small system is solved
again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.materials.kinematics import Ints
from archord.solver.linear.direct import Direct
from archord.solver.linear.look_ahead import look_ahead
from archord.solver.linear.strategy import Facts, Product, Strategy

_MOST_DOFS = 8_000  # beyond, the work on contact dofs takes longer than factorisations
_LARGE_GAMMA = 5.0  # beyond, the small system is close to singular


def why_not(facts: Facts) -> str | None:
    """Why the systems do not shrink to the contact."""
    if facts.dimension > 2:
        return "in space the contact has too many dofs"
    if facts.yields:
        return "bodies can yield"
    if facts.finite:
        return "strains are large, the matrix changes all over"
    if facts.by_force:
        return "displacements of drives are unknown"
    if facts.dofs >= _MOST_DOFS:
        return f"{_MOST_DOFS} dofs or more"
    if facts.gamma_factor is None:
        return "there is no contact, or one with a law that never opens"
    if facts.gamma_factor > _LARGE_GAMMA:
        return f"gamma_factor is above {_LARGE_GAMMA:g}"
    return None if facts.held() else "supports alone do not hold every body"


class Condensed(Strategy):
    """Python context of the matrix ``K + E D`` and of its preconditioner, which solves with it.
    Collective.

    ``K`` ``(n, n)`` is symmetric and positive definite, in blocks of ``dimension``; ``nodes``
    ``(m,)``, sorted, are the block dofs that may get forces, the same on every rank.
    ``revise(increment)`` goes over to the points that are closed after an increment ``(k, d)`` of
    the solution at ``near``, calls `update`, and returns what that adds to the residual at the
    nodes ``(m, d)``; None for no change.

    Arrays, ``d`` times as long as the nodes, the same on every rank but the first:

    _Z : (n of this rank, d m) displacements under unit forces at the nodes
    near : (k,) block dofs on which the forces depend
    _near_Z : (d k, d m) the rows of Z at these
    _blocks : (b, d, d) blocks of D that this rank gave
    _own_D, _D : (d m, d k) D of this rank and of all ranks
    _DZ : (d m, d m) their product with Z
    """

    def __init__(
        self,
        K: PETSc.Mat,
        nodes: Ints,
        dimension: int,
        revise: Callable[[Array], Array | None],
    ) -> None:
        self.comm = K.comm.tompi4py()
        self.dimension = dimension
        self._K = K
        self._nodes = nodes
        self._revise = revise
        self._start, self._end = K.getOwnershipRange()
        K.setOption(PETSc.Mat.Option.SPD, True)
        self._ksp = PETSc.KSP().create(K.comm)
        Direct(K, "cholesky").attach(self._ksp)
        self._y = K.createVecLeft()
        self._Z = self._responses(self._dofs(nodes))
        nothing = np.zeros(0, dtype=np.int64)
        self.occupy(nothing, nothing)
        self.matrix = PETSc.Mat().createPython(K.getSizes(), context=Product(self), comm=K.comm)
        self.matrix.setUp()

    def _dofs(self, nodes: Ints) -> Ints:
        """All dofs of each of ``nodes``."""
        dofs = self.dimension * nodes[:, None] + np.arange(self.dimension)
        return dofs.ravel()

    def _responses(self, dofs: Ints) -> Array:
        """Displacements ``(n of this rank, d m)`` under unit forces at ``dofs`` ``(d m,)``, one
        after the other."""
        self._found = self._dense(len(dofs))
        unit = self._unit_forces(dofs)
        self._ksp.setUp()
        self._ksp.getPC().getFactorMatrix().matSolve(unit, self._found)
        unit.destroy()
        return self._found.getDenseArray()

    def _dense(self, columns: int) -> PETSc.Mat:
        sizes = self._K.getSizes()[0], (None, columns)
        matrix = PETSc.Mat().createDense(sizes, comm=self._K.comm)
        matrix.setUp()
        return matrix

    def _unit_forces(self, dofs: Ints) -> PETSc.Mat:
        m = len(dofs)
        if self.comm.size > 1:  # PETSc spoils sparse ones of several ranks
            unit = self._dense(m)
            mine, at = self._own(dofs)
            unit.getDenseArray()[at, mine] = 1.0
            unit.assemble()
            return unit
        # sparse: MUMPS skips what they leave zero
        offsets = np.arange(m + 1, dtype=PETSc.IntType)
        csr = offsets, dofs.astype(PETSc.IntType), np.ones(m)
        size = self._K.getSize()[0]
        rows = PETSc.Mat().createAIJ((m, size), csr=csr, comm=self._K.comm)
        return PETSc.Mat().createTranspose(rows)

    def _own(self, dofs: Ints) -> tuple[Ints, Ints]:
        """Which of ``dofs`` this rank owns, and where they are among its own."""
        mine = np.flatnonzero((dofs >= self._start) & (dofs < self._end))
        return mine, dofs[mine] - self._start

    def _on_all(self, dofs: Ints, own: Array) -> Array:
        """The entries of ``own``, of the dofs of each rank, at ``dofs`` on every rank."""
        mine, at = self._own(dofs)
        values = np.zeros((len(dofs), *own.shape[1:]))
        values[mine] = own[at]
        return self._sum(values)

    def at_nodes(self, own: Array) -> Array:
        """What this rank has for its block dofs, ``own`` ``(n, d)``, for the nodes ``(m, d)`` on
        every rank."""
        values = self._on_all(self._dofs(self._nodes), own.ravel())
        return values.reshape(-1, self.dimension)

    def _sum(self, values: Array) -> Array:
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, values)
        return values

    def occupy(self, rows: Ints, columns: Ints) -> None:
        """Let this rank's blocks of `update` be at block dofs ``rows``, among the nodes, and
        ``columns`` ``(b,)``, each place once; all are zero."""
        d = self.dimension
        of_ranks = self.comm.allgather(np.unique(columns))
        self.near = np.unique(np.concatenate(of_ranks))
        self._columns = self._dofs(self.near)
        self._row = np.searchsorted(self._nodes, rows)
        column = np.searchsorted(self.near, columns)
        axis = np.arange(d)
        self._row_at = d * self._row[:, None, None] + axis[:, None]
        self._column_at = d * column[:, None, None] + axis
        self._near_Z = self._on_all(self._columns, self._Z)
        m = self._Z.shape[1]
        self._blocks: Array = np.zeros((len(rows), d, d))
        self._own_D = np.zeros((m, len(self._columns)))
        self._DZ = np.zeros((m, m))
        self._D = self._own_D if self.comm.size == 1 else self._own_D.copy()

    def update(self, blocks: Array) -> None:
        """Make ``E D`` the sum of all ranks' ``blocks`` ``(b, d, d)``; what has not changed costs
        nothing."""
        changed = filled(blocks != self._blocks)
        self._own_D[self._row_at[changed], self._column_at[changed]] = blocks[changed]
        self._blocks = blocks
        touched = np.zeros(len(self._nodes))
        touched[self._row[changed]] = 1.0
        row = self._dofs(np.flatnonzero(self._sum(touched)))
        D = self._sum(self._own_D[row])
        self._D[row] = D
        used = np.flatnonzero(D.any(axis=0))
        self._DZ[row] = D[:, used] @ self._near_Z[used]

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = (K + E D) x``, called by PETSc."""
        self._K.mult(x, y)
        mine, at = self._own(self._dofs(self._nodes))
        y.array[at] += (self._D @ self._on_all(self._columns, x.array_r))[mine]

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x = (K + E D)^-1 r`` with the points that are closed after ``-x``, called by PETSc; not
        a number if that is singular."""
        self._ksp.solve(r, self._y)
        forces = np.zeros(self._Z.shape[1])
        near = self._on_all(self._columns, self._y.array_r)
        drawn = self._drawn(near)

        def increment() -> Array:
            return (self._near_Z @ drawn - near).reshape(-1, self.dimension)

        def solve_again(change: Array) -> Array:
            nonlocal drawn
            forces[:] += change.ravel()
            near[:] += self._near_Z @ change.ravel()
            drawn = self._drawn(near)
            return increment()

        look_ahead(increment(), self._revise, solve_again)
        x.array[:] = self._y.array_r + self._Z @ (forces - drawn)

    def _drawn(self, y: Array) -> Array:
        """``(1 + D Z)^-1 D y`` of ``y`` ``(d k,)`` at ``near``, a force on each dof of the nodes
        ``(d m,)``."""
        force = np.zeros(len(self._DZ))
        rows = np.flatnonzero(self._D.any(axis=1))
        small = self._DZ[np.ix_(rows, rows)]
        small[np.diag_indices(len(rows))] += 1
        try:
            force[rows] = np.linalg.solve(small, (self._D @ y)[rows])
        except np.linalg.LinAlgError:
            force[:] = np.nan
        return force


def filled(blocks: np.ndarray) -> Ints:
    """Which of ``blocks`` ``(n, d, d)`` are not all zero; numpy's `any` is several times slower on
    so short axes."""
    found = np.zeros(len(blocks), dtype=bool)
    for i, j in np.ndindex(blocks.shape[1:]):
        found |= blocks[:, i, j] != 0
    return np.flatnonzero(found)
