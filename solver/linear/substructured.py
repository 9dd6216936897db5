"""Sparse systems on several ranks: each rank eliminates its own unknowns (direct
substructuring).

The interface are the unknowns on cells of several ranks, and few more where pairs in contact lie on
two. Without it the ranks' blocks do not know of each other: every rank orders and factorises its
own by itself, and what is left of the interface is the sum of the Schur complements (Smith,
Bjorstad and Gropp 1996, 4.2)

    S = sum over ranks of A_GG - A_GI A_II^-1 A_IG,

a dense matrix on all ranks. Bodies that are cut in sectors have short interfaces. MUMPS does the
same within one tree, but orders the whole matrix on one rank, and waits where fronts span the
ranks.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from archord.kernels.compiled import CompilerError, library, pointer
from archord.materials.kinematics import Array, Ints
from archord.solver.linear.nested_dissection import before_corners, corners, metis
from archord.solver.linear.strategy import Facts, Strategy

_LARGEST_INTERFACE = 4000  # unknowns: every rank factorises a dense matrix of that size


def why_not(facts: Facts) -> str | None:
    """Why the ranks do not eliminate unknowns of their own, as far as that is known before there is
    a matrix."""
    if facts.comm.size == 1:
        return "one rank"
    missing = None
    try:
        metis()
        schur_kernels()
    except (CompilerError, OSError) as error:
        missing = f"METIS or MUMPS's C interface is missing: {error}"
    return next((said for said in facts.comm.allgather(missing) if said), None)


def substructures(A: PETSc.Mat, V: fem.FunctionSpace) -> Substructures | str:
    """Substructures for matrices with the pattern of ``A``, of the displacements ``V``; a reason
    where they do not go. Collective."""
    comm = A.comm.tompi4py()
    interface = _interface(A, comm)
    if len(interface) > _LARGEST_INTERFACE:
        return f"the interface has {len(interface)} unknowns, more than {_LARGEST_INTERFACE}"
    start, end = A.getOwnershipRange()
    n_shared = ((interface >= start) & (interface < end)).sum()
    has_own = bool(end - start > n_shared)
    if not len(interface) or not comm.allreduce(has_own, op=MPI.LAND):
        return "a rank has no unknowns of its own"
    return Substructures(A, interface, corners(V))


def _interface(A: PETSc.Mat, comm: MPI.Comm) -> Ints:
    """Dofs without which the ranks' blocks of ``A`` are not coupled: those on cells of several
    ranks, and of any others that are, as the contact's, the ones of the higher rank."""
    start, end = A.getOwnershipRange()
    local = np.asarray(A.getLGMap()[0].indices)
    is_ghost = (local < start) | (local >= end)
    shared = _union(comm, local[is_ghost])
    offsets, columns, _ = A.getValuesCSR()
    across = np.flatnonzero((columns < start) | (columns >= end))
    row = start - 1 + np.searchsorted(offsets, across, side="right")
    column = columns[across]
    is_coupled = ~np.isin(row, shared) & ~np.isin(column, shared)
    higher = _union(comm, np.maximum(row, column)[is_coupled])
    size = A.getBlockSize()
    blocks = np.unique(np.union1d(shared, higher) // size)
    return (size * blocks[:, None] + np.arange(size)).ravel()


def _union(comm: MPI.Comm, dofs: Ints) -> Ints:
    """The ``dofs`` of all ranks."""
    return np.unique(np.concatenate(comm.allgather(np.unique(dofs))))


def schur_kernels() -> Any:
    """The functions of schur.c. Raises `CompilerError` where MUMPS's headers are not installed."""
    return library(Path(__file__).with_name("schur.c"), libraries=("dmumps",))


class Substructures(Strategy):
    """Python context of a preconditioner that solves with matrices of the pattern of ``A``, whose
    dofs ``interface`` ``(m,)``, sorted, separate the ranks, and whose nodes have ``corner`` as in
    `corners`. Collective.

    The local dofs of a rank are its own ones and the interface. Its arrays are

    _own : places of the own dofs among the local ones
    _mine : places of the own dofs of the interface, among these and among the own ones
    _block : the matrix of the local dofs
    _shared : its entries that are of the interface alone, which all ranks have
    _arrays : rows, columns, interface and order of elimination for MUMPS, which counts from 1
    _b : (local dofs,) right-hand side, then solution
    _reduced : (m,) right-hand side, then solution of the interface
    _complement : (m, m) the Schur complement of this rank, then of all
    """

    def __init__(self, A: PETSc.Mat, interface: Ints, corner: Ints) -> None:
        self.matrix = A
        self.comm = A.comm.tompi4py()
        self.singular = False
        self._kernels = schur_kernels()
        start, end = A.getOwnershipRange()
        local = np.union1d(np.arange(start, end), interface)
        first = int(np.searchsorted(local, start))
        self._own = slice(first, first + end - start)
        is_mine = (interface >= start) & (interface < end)
        self._mine = np.flatnonzero(is_mine), interface[is_mine] - start
        self._set = PETSc.IS().createGeneral(local.astype(PETSc.IntType), comm=PETSc.COMM_SELF)
        self._block = A.createSubMatrices(self._set)[0]
        offsets, columns, _ = self._block.getValuesCSR()
        rows = np.repeat(np.arange(len(local), dtype=np.int32), np.diff(offsets))
        last = np.isin(local, interface)
        self._shared = np.flatnonzero(last[rows] & last[columns])
        size = A.getBlockSize()
        corner = np.searchsorted(local[::size] // size, corner)  # all are on cells of this rank
        place = _places(rows, columns, last, corner, first // size, size)
        kept = np.flatnonzero(last)
        arrays = (rows, columns, kept, place)
        self._arrays = tuple(array.astype(np.int32, copy=False) + 1 for array in arrays)
        m = len(interface)
        self._b = np.zeros(len(local))
        self._reduced = np.zeros(m)
        self._complement = np.zeros((m, m))
        self._x = PETSc.Vec().createSeq(m, comm=PETSc.COMM_SELF)
        self._y = self._x.duplicate()
        self._mumps: Any = None
        self._dense = PETSc.KSP().create(PETSc.COMM_SELF)
        self._dense.setType("preonly")
        self._dense.getPC().setType("lu")

    def setUp(self, pc: PETSc.PC) -> None:
        """Factorise the matrix as it is now, called by PETSc."""
        A = pc.getOperators()[1]
        A.createSubMatrices(self._set, submats=[self._block])
        values = self._block.getValuesCSR()[2]
        values[self._shared] /= self.comm.size
        status = self._factorise(values)
        self.singular = self.comm.allreduce(status, op=MPI.MIN) < 0
        if self.singular:
            return
        self.comm.Allreduce(MPI.IN_PLACE, self._complement)
        S = PETSc.Mat().createDense(self._complement.shape, comm=PETSc.COMM_SELF)
        S.getDenseArray()[:] = self._complement
        S.assemble()
        self._dense.setOperators(S)
        self._dense.setUp()

    def _factorise(self, values: Array) -> int:
        """Eliminate the own dofs of the block of these ``values``; MUMPS's status, below 0 if that
        fails."""
        status = np.zeros(1, dtype=np.int32)
        if self._mumps is None:
            rows, columns, kept, place = self._arrays
            self._mumps = self._kernels.schur_create(
                MPI.COMM_SELF.py2f(),
                len(self._b),
                len(rows),
                pointer(rows),
                pointer(columns),
                len(kept),
                pointer(kept),
                pointer(place),
                pointer(status),
            )
        if status[0] < 0:
            return int(status[0])
        given = pointer(values), pointer(self._complement)
        return int(self._kernels.schur_factorise(self._mumps, *given))

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x = A^-1 r``, called by PETSc; not a number if a block is singular."""
        if self._mumps is None:  # put in the place of another one
            self.setUp(pc)
        if self.singular:
            x.set(np.nan)
            return
        self._b[:] = 0.0
        self._b[self._own] = r.array_r
        self._kernels.schur_condense(self._mumps, pointer(self._b), pointer(self._reduced))
        self.comm.Allreduce(MPI.IN_PLACE, self._reduced)
        self._x.array[:] = self._reduced
        self._dense.solve(self._x, self._y)
        self._reduced[:] = self._y.array_r
        self._kernels.schur_expand(self._mumps, pointer(self._reduced), pointer(self._b))
        x.array[:] = self._b[self._own]
        among, own = self._mine
        x.array[own] = self._y.array_r[among]

    def destroy(self, pc: PETSc.PC) -> None:
        """Free MUMPS's memory, called by PETSc."""
        if self._mumps is not None:
            self._kernels.schur_destroy(self._mumps)
            self._mumps = None


def _places(
    rows: Ints,
    columns: Ints,
    last: np.ndarray,
    corner: Ints,
    start: int,
    size: int,
) -> Ints:
    """Places ``(n,)`` of the dofs in the order of elimination, those that come ``last`` ``(n,)``
    behind the others. Entries are at ``rows`` and ``columns``, in blocks of ``size``. Block ``start
    + i`` has the blocks ``corner[i]`` at its corners; all that are not last have some."""
    inner = np.flatnonzero(~last[::size])
    number = np.full(len(last) // size, -1)
    number[inner] = np.arange(len(inner))
    is_first = (rows % size == 0) & (columns % size == 0)  # of the entries of a block
    one = is_first & ~last[rows] & ~last[columns]
    row = number[rows[one] // size]
    column = number[columns[one] // size]
    place = np.empty(len(number), dtype=np.int32)
    place[inner] = before_corners(len(inner), row, column, number[corner[inner - start]])
    place[number < 0] = np.arange(len(inner), len(number))
    return (size * place[:, None] + np.arange(size, dtype=np.int32)).ravel()
