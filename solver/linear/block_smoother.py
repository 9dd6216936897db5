"""Symmetric sweeps of block Gauss-Seidel, in single precision: the smoother of multigrid's finest
level.

Half as many bytes as in double precision pass through the memory, which such sweeps wait for. A
sweep there and back costs one and a half passes over the matrix, and what is left after it is known
by then. Ranks smooth their own nodes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.blocks import Blocks, blocks_of, ghost_exchange
from archord.kernels.compiled import library, pointer, structure

_SOURCE = Path(__file__).with_suffix(".c")


class BlockSmoother:
    """Smooths systems of the matrix ``A`` with ``d`` displacements a node, as it is when `update`
    is called. Collective.

    ghosts : (m,) nodes of other ranks that this rank's rows refer to
    x : (n + m, d) the solution, of this rank's nodes and of the ghosts
    """

    def __init__(self, A: PETSc.Mat) -> None:
        self.matrix = A
        self._d = A.getBlockSize()
        self._n = A.getLocalSize()[0] // self._d
        self.ghosts: np.ndarray = np.zeros(0, dtype=np.int32)
        self.x: np.ndarray = np.zeros((0, self._d), dtype=np.float32)
        self._n_blocks = -1

    def update(self, own: Blocks, others: Blocks, ghosts: np.ndarray) -> None:
        """Take the values of the matrix, in the rank's ``own`` columns and those of ``ghosts``."""
        n_blocks = len(own.columns) + len(others.columns)
        if n_blocks != self._n_blocks:
            self._allocate(own, others, ghosts)
            self._n_blocks = n_blocks
        arrays = [pointer(array) for part in (own, others) for array in part]
        library(_SOURCE).pack_blocks(self._rows, *arrays)

    def _allocate(self, own: Blocks, others: Blocks, ghosts: np.ndarray) -> None:
        d = self._d
        n = self._n
        self.ghosts = ghosts
        self.x = np.zeros((n + len(self.ghosts), d), dtype=np.float32)
        self._work = np.zeros((n, d), dtype=np.float32)
        row = np.repeat(np.arange(n, dtype=np.int32), np.diff(own.offsets))
        n_lower = int((own.columns < row).sum())
        n_upper = int((own.columns > row).sum())
        self._parts = [self._part(k) for k in (n_lower, n_upper, len(others.columns))]
        lower, upper, beyond = (structure(_SOURCE, "BlockPart", part) for part in self._parts)
        self._members = {
            "n": n,
            "d": d,
            "lower": lower,
            "upper": upper,
            "ghosts": beyond,
            "added": np.zeros((n, d), dtype=np.float32),
            "inverse": np.zeros(n * d**2 + 1, dtype=np.float32),
        }
        self._rows = structure(_SOURCE, "BlockRows", self._members)
        self._whole = self.matrix.createVecRight()
        self._exchange, self._ghosted = ghost_exchange(self.matrix, ghosts)

    def _part(self, k: int) -> dict[str, np.ndarray]:
        """Room for ``k`` blocks."""
        return {
            "start": np.zeros(self._n + 1, dtype=np.int32),
            "column": np.zeros(k, dtype=np.int32),
            "block": np.zeros(k * self._d**2 + 1, dtype=np.float32),
        }

    @property
    def own(self) -> np.ndarray:
        """The solution of this rank's nodes ``(n, d)``."""
        return self.x[: self._n]

    def from_zero(self, b: Array) -> Array:
        """Smooth from zero for a right-hand side ``b`` ``(n d,)``; returns the residual."""
        residual = np.empty_like(b)
        arrays = np.ascontiguousarray(b), self.x, self._work, residual
        library(_SOURCE).smooth_from_zero(self._rows, *map(pointer, arrays))
        if self.matrix.comm.size > 1:
            self._take_ghosts(self.own.ravel())
            library(_SOURCE).subtract_ghosts(self._rows, pointer(self.x), pointer(residual))
        return residual

    def again(self, b: Array, correction: Array) -> Array:
        """Smooth on after a ``correction`` ``(n d,)`` of the solution; returns the solution."""
        if self.matrix.comm.size > 1:
            self._take_ghosts(self.own.ravel() + correction)
        arrays = np.ascontiguousarray(b), np.ascontiguousarray(correction), self.x, self._work
        library(_SOURCE).smooth(self._rows, *map(pointer, arrays))
        return self.own.ravel()

    def _take_ghosts(self, own: Array) -> None:
        self._whole.array[:] = own
        self._exchange.scatter(self._whole, self._ghosted)
        self.x[self._n :] = self._ghosted.array_r.reshape(-1, self._d)


class Sweeps:
    """Python context of a preconditioner: so ``many`` sweeps there and back with the block matrix
    ``A``, as it is when `update` is called. Collective."""

    def __init__(self, A: PETSc.Mat, many: int) -> None:
        self._A = A
        self._many = many
        self._smoother = BlockSmoother(A)

    def update(self) -> None:
        """Take the values of the matrix."""
        self._smoother.update(*blocks_of(self._A))

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x`` is nearly the solution for ``b``, called by PETSc."""
        residual = b.array_r
        x.set(0.0)
        for _ in range(self._many):
            residual = self._smoother.from_zero(residual)
            x.array[:] += self._smoother.own.ravel()
