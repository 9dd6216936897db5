"""The product of a block matrix and a vector, without the blocks that are zero.

In space a large part of the matrix is room for contact, most of it empty at any moment: PETSc
would read and multiply it in every iteration of GMRES.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.blocks import Blocks, blocks_of, ghost_exchange
from archord.kernels.compiled import library, pointer

_SOURCE = Path(__file__).with_suffix(".c")
_COMPONENTS = 3  # of a displacement; in a plane hardly any room is empty


def quick_product(A: PETSc.Mat) -> PETSc.Mat:
    """What multiplies as the block matrix ``A`` does: itself in a plane. Collective."""
    return BlockProduct(A).matrix() if A.getBlockSize() == _COMPONENTS else A


class _Part:
    """The ``blocks`` of some columns that are not zero.

    start : (n + 1,) where the rows begin among the numbers of such blocks
    filled : (k,) their numbers
    """

    def __init__(self, blocks: Blocks) -> None:
        n = len(blocks.offsets) - 1
        start = np.empty(n + 1, dtype=np.int32)
        filled = np.empty(len(blocks.columns), dtype=np.int32)
        arrays: list[np.ndarray] = [blocks.offsets, blocks.values, start, filled]
        library(_SOURCE).find_filled(n, *map(pointer, arrays))
        self._n = n
        self._blocks = blocks
        self._start = start
        self._filled = filled[: start[-1]].copy()

    def add(self, x: Array, y: Array) -> None:
        """Add the blocks times ``x`` to ``y``."""
        _, columns, values = self._blocks
        arrays: list[np.ndarray] = [self._start, self._filled, columns, values, x, y]
        library(_SOURCE).add_products(self._n, *map(pointer, arrays))


class BlockProduct:
    """Python context of a matrix that multiplies as ``A`` does, a matrix in space, whatever its
    values are by then. Collective."""

    def __init__(self, A: PETSc.Mat) -> None:
        self._A = A
        self._state = -1  # of the matrix whose blocks are known
        self._parts: list[_Part] = []  # in the rank's own columns, and in those of ghosts
        self._exchange, self._ghosts = ghost_exchange(A, blocks_of(A)[2])

    def matrix(self) -> PETSc.Mat:
        """The matrix."""
        found = PETSc.Mat().createPython(self._A.getSizes(), context=self, comm=self._A.comm)
        found.setUp()
        return found

    def _update(self) -> None:
        """Find the blocks of the matrix as it is now."""
        self._parts = [_Part(blocks) for blocks in blocks_of(self._A)[:2]]
        self._state = self._A.stateGet()

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = A x``, called by PETSc."""
        if self._A.stateGet() != self._state:
            self._update()
        own, others = self._parts
        product = np.zeros(y.getLocalSize())
        self._exchange.begin(x, self._ghosts)
        own.add(x.array_r, product)
        self._exchange.end(x, self._ghosts)
        others.add(self._ghosts.array_r, product)
        y.array[:] = product
