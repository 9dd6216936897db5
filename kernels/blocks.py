"""The arrays of a block matrix as PETSc holds them, which petsc4py would copy as scalar rows."""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

_INT = ctypes.POINTER(np.ctypeslib.as_ctypes_type(PETSc.IntType))
_REAL = ctypes.POINTER(ctypes.c_double)
_petsc = ctypes.PyDLL(PETSc.__file__)  # finds the functions of the libraries that it is linked to


class Blocks(NamedTuple):
    """Rows of blocks of a matrix, valid until that changes."""

    offsets: npt.NDArray[np.int32]  # (n + 1,) where each row begins
    columns: npt.NDArray[np.int32]  # (k,) sorted in each row
    values: npt.NDArray[np.float64]  # (k d d,) each block by columns


def blocks_of(A: PETSc.Mat) -> tuple[Blocks, Blocks, npt.NDArray[np.int32]]:
    """The blocks of this rank's rows: in its own columns, which count from its first one, and in
    columns of other ranks, ``m`` of them, whose numbers on all ranks ``(m,)`` are given, too."""
    matrix = ctypes.c_void_p(A.handle)
    nothing = np.zeros(0, dtype=np.int32)
    if A.comm.size == 1:
        own = _arrays(matrix)
        of_others = Blocks(np.zeros_like(own.offsets), nothing, np.zeros(0))
        return own, of_others, nothing
    here = ctypes.c_void_p()
    elsewhere = ctypes.c_void_p()
    number = _INT()
    _call("MatMPIBAIJGetSeqBAIJ", matrix, *map(ctypes.byref, (here, elsewhere, number)))
    others = _arrays(elsewhere)
    n_others = 1 + others.columns.max(initial=-1)
    return _arrays(here), others, _array(number, n_others)


def ghost_exchange(A: PETSc.Mat, ghosts: np.ndarray) -> tuple[PETSc.Scatter, PETSc.Vec]:
    """What takes the values of a vector of the block matrix ``A`` at the nodes ``ghosts`` ``(m,)``
    of other ranks to the vector behind it. Collective."""
    d = A.getBlockSize()
    places = (d * ghosts[:, None] + np.arange(d)).astype(PETSc.IntType)
    wanted = PETSc.IS().createGeneral(places.ravel(), comm=PETSc.COMM_SELF)
    values = PETSc.Vec().createSeq(d * len(ghosts))
    return PETSc.Scatter().create(A.createVecRight(), wanted, values, None), values


def add_blocks(
    A: PETSc.Mat, rows: np.ndarray, columns: np.ndarray, values: npt.NDArray[np.floating]
) -> None:
    """Add blocks ``(k, d, d)`` at ``rows``, sorted, and ``columns`` of all ranks to ``A``."""
    if not len(rows):
        return
    start = np.flatnonzero(np.diff(rows, prepend=-1))
    offsets = np.append(start, len(rows)).astype(PETSc.IntType)
    A.setValuesBlockedIJV(
        offsets,
        columns.astype(PETSc.IntType),
        values,
        PETSc.InsertMode.ADD,
        rows[start].astype(PETSc.IntType),
    )


def without_zeros(A: PETSc.Mat) -> PETSc.Mat:
    """A matrix of scalar rows, of the blocks of ``A`` that are not zero. Collective."""
    d = A.getBlockSize()
    first = A.getOwnershipRange()[0] // d
    own, others, ghosts = blocks_of(A)
    n = len(own.offsets) - 1
    nodes = np.arange(first, first + n)
    found = PETSc.Mat().create(A.comm)
    found.setSizes(A.getSizes(), bsize=d)
    found.setType("aij")
    found.setUp()
    for blocks, node in ((own, nodes), (others, ghosts)):
        by_columns = blocks.values.reshape(-1, d, d)
        filled = by_columns.any(axis=(1, 2))
        rows = np.repeat(nodes, np.diff(blocks.offsets))
        columns = node[blocks.columns]
        values = by_columns[filled].transpose(0, 2, 1)
        add_blocks(found, rows[filled], columns[filled], values)
    found.assemble()
    return found


def _arrays(matrix: ctypes.c_void_p) -> Blocks:
    n = ctypes.c_int64()
    offsets = _INT()
    columns = _INT()
    values = _REAL()
    done = ctypes.c_int()
    found = map(ctypes.byref, (n, offsets, columns, done))
    _call("MatGetRowIJ", matrix, *map(ctypes.c_int, (0, False, True)), *found)
    _call("MatSeqBAIJGetArray", matrix, ctypes.byref(values))
    size = ctypes.c_int()
    _call("MatGetBlockSize", matrix, ctypes.byref(size))
    starts = _array(offsets, n.value + 1)
    k = int(starts[-1])
    blocks = np.ctypeslib.as_array(values, (k * size.value**2,)) if k else np.zeros(0)
    return Blocks(starts, _array(columns, k), blocks)


def _array(found: Any, length: int) -> npt.NDArray[np.int32]:
    if not length:
        return np.zeros(0, dtype=np.int32)
    return np.ctypeslib.as_array(found, (length,)).astype(np.int32, copy=False)


def _call(name: str, *arguments: Any) -> None:
    """Call a function of PETSc. Raises `PETSc.Error`."""
    code = getattr(_petsc, name)(*arguments)
    if code:
        raise PETSc.Error(code)
