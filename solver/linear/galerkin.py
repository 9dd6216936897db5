"""The matrix of a coarse level, the Galerkin product ``P^T A P``, from the blocks of ``A``.

PETSc would first turn them into scalar rows, and keep half-made products: more memory than the
matrix itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.blocks import Blocks, add_blocks, blocks_of
from archord.kernels.compiled import library, pointer, structure
from archord.materials.kinematics import Ints

_SOURCE = Path(__file__).with_suffix(".c")
_ROOM = 40  # for blocks in a row: cells about a node have fewer nodes, but for those in contact


class _Weights(NamedTuple):
    """What coarse nodes give to fine ones: ``q`` pairs of both, by fine nodes."""

    fine: Ints  # (q,)
    coarse: Ints  # (q,)
    weight: Array  # (q, d)


class Galerkin:
    """The ``matrix`` of the product with the interpolation ``P``, of a sum of ``terms``.
    Collective."""

    def __init__(self, P: PETSc.Mat, terms: Sequence[PETSc.Mat]) -> None:
        self._d = P.getBlockSizes()[0]
        self._P = P
        self._terms = terms
        own = self._by_nodes(P)
        ghosts = [blocks_of(A)[2] for A in terms]
        elsewhere = [self._by_nodes(self._rows_of(of_term)) for of_term in ghosts]
        self._nodes = np.unique(np.concatenate([part.coarse for part in (own, *elsewhere)]))
        coarse = np.searchsorted(self._nodes, own.coarse)
        order = np.argsort(coarse, kind="stable")
        self._left = {
            "n": len(self._nodes),
            "d": self._d,
            "from": _starts(coarse[order], len(self._nodes)),
            "row": own.fine[order].astype(np.int32),
            "row_weight": own.weight[order],
        }
        self._right = self._columns(own, P.getLocalSize()[0] // self._d)
        self._right_of_ghosts = [
            self._columns(weights, len(of_term))
            for weights, of_term in zip(elsewhere, ghosts, strict=True)
        ]
        size = P.getLocalSize()[1], None
        self.matrix = PETSc.Mat().create(P.comm)
        self.matrix.setSizes((size, size), bsize=self._d)
        self.matrix.setType("baij")
        self.matrix.setUp()

    def _rows_of(self, ghosts: Ints) -> PETSc.Mat:
        """The interpolation to ``ghosts``."""
        rows = (self._d * ghosts[:, None] + np.arange(self._d)).astype(PETSc.IntType)
        wanted = PETSc.IS().createGeneral(rows.ravel(), comm=PETSc.COMM_SELF)
        everything = PETSc.IS().createStride(self._P.getSize()[1], 0, 1, comm=PETSc.COMM_SELF)
        return self._P.createSubMatrices([wanted], [everything])[0]

    def _by_nodes(self, P: PETSc.Mat) -> _Weights:
        """The rows of ``P`` by nodes, where coarse ones have their numbers on all ranks."""
        d = self._d
        offsets, column, value = P.getValuesCSR()
        row = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        fine, axis = np.divmod(row, d)
        n_coarse = self._P.getSize()[1] // d
        coarse = column // d
        pairs, pair = np.unique(fine * n_coarse + coarse, return_inverse=True)
        weight = np.zeros((len(pairs), d))
        weight[pair, axis] = value
        fine, coarse = np.divmod(pairs, n_coarse)
        return _Weights(fine, coarse, weight)

    def _columns(self, weights: _Weights, n: int) -> dict[str, np.ndarray]:
        """The ``weights`` of ``n`` columns for the kernel."""
        return {
            "to": _starts(weights.fine, n),
            "node": np.searchsorted(self._nodes, weights.coarse).astype(np.int32),
            "weight": weights.weight,
        }

    def update(self) -> None:
        """Take the values of the terms."""
        is_first = not self.matrix.isAssembled()
        if not is_first:
            self.matrix.zeroEntries()
        for term, right_of_ghosts in zip(self._terms, self._right_of_ghosts, strict=True):
            own, others, _ = blocks_of(term)
            for A, right in ((own, self._right), (others, right_of_ghosts)):
                rows, columns, blocks = self._product(A, right, is_first)
                add_blocks(self.matrix, self._nodes[rows], self._nodes[columns], blocks)
        self.matrix.assemble()

    def _product(
        self, A: Blocks, right: dict[str, np.ndarray], with_zeros: bool
    ) -> tuple[Ints, Ints, Array]:
        """Rows and columns ``(k,)`` and blocks ``(k, d, d)`` of the product of some columns, also
        of blocks that are zero, ``with_zeros``, to make room for them."""
        of_A = {
            "offsets": A.offsets,
            "columns": A.columns,
            "values": A.values,
            "with_zeros": int(with_zeros),
        }
        product = structure(_SOURCE, "Product", self._left | right | of_A)
        most = 0
        needed = _ROOM * len(self._nodes)
        while needed > most:
            most = needed
            place = np.full(len(self._nodes), -1, dtype=np.int32)
            rows = np.empty(most, dtype=np.int32)
            columns = np.empty(most, dtype=np.int32)
            blocks = np.empty((most, self._d, self._d))
            needed = library(_SOURCE).galerkin(
                product, most, *map(pointer, (place, rows, columns, blocks))
            )
        return rows[:needed], columns[:needed], blocks[:needed]


def _starts(sorted_numbers: Ints, n: int) -> Ints:
    """Where each of the numbers below ``n`` begins, and where the last one ends ``(n + 1,)``."""
    return np.searchsorted(sorted_numbers, np.arange(n + 1)).astype(np.int32)
