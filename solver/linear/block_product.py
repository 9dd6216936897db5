"""The product of a sum of block matrices and a vector, without the blocks that are zero.

In space the contact has a matrix of its own. A part of it is room that is empty at any moment:
PETSc would read and multiply it in every iteration of GMRES.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.blocks import Blocks, blocks_of, ghost_exchange
from archord.kernels.compiled import library, pointer

_SOURCE = Path(__file__).with_suffix(".c")
COMPONENTS = 3  # of a displacement in space; in a plane hardly any room is empty


def quick_product(A: PETSc.Mat) -> PETSc.Mat:
    """What multiplies as the block matrix ``A`` does: itself in a plane. Collective."""
    return BlockProduct(A).matrix() if A.getBlockSize() == COMPONENTS else A


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


class _Term:
    """A ``matrix`` in space as a term of the product."""

    def __init__(self, matrix: PETSc.Mat) -> None:
        self.matrix = matrix
        self._state = -1  # of the matrix whose blocks are known
        self._parts: list[_Part] = []

    def parts(self) -> list[_Part]:
        """The blocks of the matrix as it is now: in the rank's own columns, and in those of
        ghosts."""
        if self.matrix.stateGet() != self._state:
            self._parts = [_Part(blocks) for blocks in blocks_of(self.matrix)[:2]]
            self._state = self.matrix.stateGet()
        return self._parts


class BlockProduct:
    """Python context of a matrix that multiplies as the sum of ``matrices`` in space does, whatever
    their values are by then. Collective."""

    def __init__(self, *matrices: PETSc.Mat) -> None:
        self.replace(*matrices)

    def replace(self, *matrices: PETSc.Mat) -> None:
        """Multiply as the sum of these ``matrices``, whose patterns may be other ones."""
        self._terms = [_Term(A) for A in matrices]
        ghosts = [blocks_of(A)[2] for A in matrices]
        self._exchange, self._ghosts = ghost_exchange(matrices[0], np.concatenate(ghosts))
        self._ends = COMPONENTS * np.cumsum([len(of_term) for of_term in ghosts])

    def matrix(self) -> PETSc.Mat:
        """The matrix."""
        A = self._terms[0].matrix
        found = PETSc.Mat().createPython(A.getSizes(), context=self, comm=A.comm)
        found.setUp()
        return found

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y`` is the sum times ``x``, called by PETSc."""
        parts = [term.parts() for term in self._terms]
        product = np.zeros(y.getLocalSize())
        self._exchange.begin(x, self._ghosts)
        for own, _ in parts:
            own.add(x.array_r, product)
        self._exchange.end(x, self._ghosts)
        of_ghosts = np.split(self._ghosts.array_r, self._ends[:-1])
        for (_, others), values in zip(parts, of_ghosts, strict=True):
            others.add(values, product)
        y.array[:] = product
