"""The product of a block matrix and a vector, without the blocks that are zero.

In space half of the matrix is room for contact that there is not, at each moment: PETSc would read
and multiply it in every iteration of GMRES.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.blocks import Blocks, blocks_of
from archord.kernels.compiled import library, pointer

_SOURCE = Path(__file__).with_suffix(".c")
_D = 3  # displacements a node


class _Part:
    """The blocks of some columns that are not zero."""

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
        ghosts = blocks_of(A)[2]
        places = (_D * ghosts[:, None] + np.arange(_D)).astype(PETSc.IntType)
        wanted = PETSc.IS().createGeneral(places.ravel(), comm=PETSc.COMM_SELF)
        self._ghosts = PETSc.Vec().createSeq(_D * len(ghosts))
        self._exchange = PETSc.Scatter().create(A.createVecRight(), wanted, self._ghosts, None)

    def matrix(self) -> PETSc.Mat:
        """The matrix."""
        found = PETSc.Mat().createPython(self._A.getSizes(), context=self, comm=self._A.comm)
        found.setUp()
        return found

    def _update(self) -> None:
        """Find the blocks of the matrix as it is now."""
        own, others, _ = blocks_of(self._A)
        self._own = _Part(own)
        self._others = _Part(others)
        self._state = self._A.stateGet()

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = A x``, called by PETSc."""
        if self._A.stateGet() != self._state:
            self._update()
        self._exchange.begin(x, self._ghosts)
        product = np.zeros(y.getLocalSize())
        self._own.add(x.array_r, product)
        self._exchange.end(x, self._ghosts)
        self._others.add(self._ghosts.array_r, product)
        y.array[:] = product
