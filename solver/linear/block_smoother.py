"""Symmetric sweeps of block Gauss-Seidel, in single precision: the smoother of multigrid's finest
level.

Half as many bytes as in double precision pass through the memory, which such sweeps wait for. A
sweep there and back costs one and a half passes over the matrix, and what is left after it is known
by then. Ranks smooth their own nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cffi
import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.blocks import Blocks, blocks_of, ghost_exchange
from archord.kernels.compiled import library, pointer, structure
from archord.materials.kinematics import Ints

_SOURCE = Path(__file__).with_suffix(".c")


class BlockSmoother:
    """Smooths systems of a sum of block ``matrices`` with ``d`` displacements a node, as they are
    when `update` is called. Collective.

    ghosts : (m,) nodes of other ranks that this rank's rows refer to, those of each matrix
    x : (n + m, d) the solution, of this rank's nodes and of the ghosts
    """

    def __init__(self, *matrices: PETSc.Mat) -> None:
        self._matrices = matrices
        self._comm = matrices[0].comm
        self._d = matrices[0].getBlockSize()
        self._n = matrices[0].getLocalSize()[0] // self._d
        self.ghosts: Ints = np.zeros(0, dtype=np.int32)
        self.x: np.ndarray = np.zeros((0, self._d), dtype=np.float32)
        self._n_blocks = -1

    def update(self) -> None:
        """Take the values of the matrices."""
        terms = [blocks_of(A) for A in self._matrices]
        n_blocks = sum(len(own.columns) + len(others.columns) for own, others, _ in terms)
        if n_blocks != self._n_blocks:
            self._allocate(terms)
            self._n_blocks = n_blocks
        chain: list[Any] = []  # each refers to the one before
        first_ghost = self._n
        for own, others, ghosts in terms:
            members = {
                "before": chain[-1] if chain else cffi.FFI.NULL,
                "first_ghost": first_ghost,
                "offsets": own.offsets,
                "columns": own.columns,
                "values": own.values,
                "ghost_offsets": others.offsets,
                "ghost_columns": others.columns,
                "ghost_values": others.values,
            }
            chain.append(structure(_SOURCE, "BlockTerm", members))
            first_ghost += len(ghosts)
        library(_SOURCE).pack_blocks(self._rows, chain[-1])

    def _allocate(self, terms: Sequence[tuple[Blocks, Blocks, Ints]]) -> None:
        d = self._d
        n = self._n
        self.ghosts = np.concatenate([ghosts for _, _, ghosts in terms])
        self.x = np.zeros((n + len(self.ghosts), d), dtype=np.float32)
        self._work = np.zeros((n, d), dtype=np.float32)
        sizes = np.zeros(3, dtype=int)  # of the parts left and right of the diagonal, and of ghosts
        for own, others, _ in terms:
            row = np.repeat(np.arange(n, dtype=np.int32), np.diff(own.offsets))
            is_lower = own.columns < row
            is_upper = own.columns > row
            sizes += [is_lower.sum(), is_upper.sum(), len(others.columns)]
        self._parts = [self._part(int(k)) for k in sizes]
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
        first = self._matrices[0]
        self._whole = first.createVecRight()
        self._exchange, self._ghosted = ghost_exchange(first, self.ghosts)

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
        if self._comm.size > 1:
            self._take_ghosts(self.own.ravel())
            library(_SOURCE).subtract_ghosts(self._rows, pointer(self.x), pointer(residual))
        return residual

    def again(self, b: Array, correction: Array) -> Array:
        """Smooth on after a ``correction`` ``(n d,)`` of the solution; returns the solution."""
        if self._comm.size > 1:
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
        self._many = many
        self.replace(A)

    def replace(self, A: PETSc.Mat) -> None:
        """Smooth systems of another matrix."""
        self._smoother = BlockSmoother(A)

    def update(self) -> None:
        """Take the values of the matrix."""
        self._smoother.update()

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """``x`` is nearly the solution for ``b``, called by PETSc."""
        residual = b.array_r
        x.set(0.0)
        for _ in range(self._many):
            residual = self._smoother.from_zero(residual)
            x.array[:] += self._smoother.own.ravel()
