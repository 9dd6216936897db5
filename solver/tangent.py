"""The tangent of bulk and contact as one PETSc matrix, without rows and columns of prescribed
displacements."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.compat import ghosted_vector
from archord.report.timer import BEFORE_SOLVING, Timer
from archord.solver.bulk import Bulk, assemble, matrix
from archord.solver.contact.contact import Contact
from archord.solver.drives import Drives
from archord.solver.linear.condensed import Condensed, filled
from archord.solver.stabilisation import Springs


class TangentMatrix:
    """``A``, of the last evaluation of ``bulk`` and ``contact``, assembled by `update`. Collective.

    ``drives`` tell the prescribed displacements, and what they are per unit of the unknown levels.
    With ``condense``, for elastic bodies which their supports hold, ``A`` is that of the bulk, and
    the contact is in ``condensed``. ``factorisations`` counts those of sparse matrices that
    `update` asked for.
    """

    def __init__(
        self,
        bulk: Bulk,
        contact: Contact,
        drives: Drives,
        springs: Springs | None,
        timer: Timer,
        *,
        condense: bool,
    ) -> None:
        self.V, self.bulk, self.contact, self.timer = bulk.V, bulk, contact, timer
        self.comm, index_map = self.V.mesh.comm, self.V.dofmap.index_map
        self._size, self._start, self._n = (
            index_map.size_global,
            index_map.local_range[0],
            index_map.size_local,
        )
        self.drives, self.springs, fixed, m = drives, springs, drives.fixed, len(drives.unknown)
        self._fixed, rate = (
            fixed[: self._n],
            drives.unknown_rate[:, : self._n].reshape(m, 2 * self._n).T,
        )
        self._direction = fem.Function(self.V)
        dofs = [2 * np.flatnonzero(fixed[:, axis]).astype(np.int32) + axis for axis in range(2)]
        self._bcs = [fem.dirichletbc(0.0, dofs[axis], self.V.sub(axis)) for axis in range(2)]
        # prescribed dofs of all ranks and their rates, with those of rigid surfaces and one that is
        # none behind
        own = np.flatnonzero(self._fixed)
        discs = [drives.weight[:, None] * surface.rate[drives.unknown] for surface in contact.rigid]
        rigid = np.hstack([*discs, np.zeros((m, 1))]).T
        parts = [*self.comm.allgather((2 * self._start + own, rate[own]))]
        parts.append((2 * self._size + np.arange(len(rigid)), rigid))
        self._prescribed, self._rates = (
            np.concatenate(column) for column in zip(*parts, strict=True)
        )
        self.factorisations = 0
        self.A = self._elastic = self._revised = PETSc.Mat()
        self.condensed: Condensed | None = None
        if condense:
            self.A = self._allocated()
            self.A.assemble()
            with self.timer(BEFORE_SOLVING):
                self.A.convert("aij")  # PETSc has no Cholesky factors of block matrices from MUMPS
                nodes = np.unique(
                    np.concatenate([surface.curve_dofs for surface in contact.surfaces])
                )
                self.condensed = Condensed(self.A, nodes, self._revise_condensed)
        self.renew()

    def _allocated(self, *slots: tuple[np.ndarray, np.ndarray]) -> PETSc.Mat:
        """The matrix of the bulk's constant part, with room for block ``slots`` in rows of this
        rank."""
        A = matrix(self.V, self.bulk.elastic_forms, *slots)
        assemble(A, self.bulk.elastic_forms, self._bcs)
        return A

    def renew(self) -> None:
        """Allocate every slot that bulk and contact may fill, a condensed matrix those of contact
        alone."""
        tangent = self.contact.tangent
        self._in_matrix = (tangent.rows < self._size) & (tangent.columns < self._size)
        (row_free, self._row_rate), (free, self._column_rate) = map(
            self._at, (tangent.rows, tangent.columns)
        )
        self._free = row_free[:, :, None] * free[:, None, :]
        self._contact_blocks: Array = np.zeros((len(tangent.rows), 2, 2))
        if self.condensed is not None:
            self.condensed.occupy(tangent.rows[self._in_matrix], tangent.columns[self._in_matrix])
            return
        self.A.destroy()
        self._elastic.destroy()
        self._revised.destroy()
        rows, columns = self.contact.pattern()
        mine = (rows >= self._start) & (rows < self._start + self._n)
        rows, columns = rows[mine], columns[mine]
        self.A = self._allocated((rows, columns))
        # zeros into every other slot: what is not written before the first assembly is given back
        self._add(self.A, rows, columns, np.zeros((len(rows), 2, 2)))
        self.A.assemble()
        self.A.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATION_ERR, True)
        self._elastic = self.A.copy()

    def _at(self, nodes: np.ndarray) -> tuple[Array, Array]:
        """Which displacements of block dofs ``nodes`` ``(k,)`` are free ``(k, 2)``; others' rates
        ``(k, 2, m)``."""
        dofs = 2 * nodes[:, None] + np.arange(2)
        at = np.searchsorted(self._prescribed, dofs)
        free = self._prescribed[at] != dofs
        return free, np.where(free[..., None], 0.0, self._rates[at])

    @staticmethod
    def _add(A: PETSc.Mat, rows: np.ndarray, columns: np.ndarray, values: Array) -> None:
        """Add blocks ``(k, 2, 2)`` at ``rows``, sorted, and ``columns`` to ``A``."""
        if len(rows):
            start = np.flatnonzero(np.diff(rows, prepend=-1))
            parts = np.append(start, len(rows)), columns, rows[start]
            offsets, columns, rowmap = (part.astype(PETSc.IntType) for part in parts)
            A.setValuesBlockedIJV(offsets, columns, values, PETSc.InsertMode.ADD, rowmap)

    def _add_contact(self, A: PETSc.Mat, blocks: Array) -> None:
        """Add ``blocks`` ``(k, 2, 2)`` in the slots of the contact to ``A``."""
        tangent, kept = self.contact.tangent, filled(blocks)
        kept = kept[self._in_matrix[kept]]
        self._add(A, tangent.rows[kept], tangent.columns[kept], blocks[kept] * self._free[kept])
        A.assemble()

    def update(self, *, factorise: bool = True) -> None:
        """Assemble ``A``, to be factorised or not."""
        if self.condensed is None:
            self.factorisations += factorise
            with self.timer("assemble bulk"):
                self._elastic.copy(self.A, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
                if self.springs:
                    self.A.axpy(
                        1.0, self.springs.of_free, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN
                    )
                self.bulk.assemble_correction(self.A, self._bcs)
        with self.timer("assemble contact"):
            self._contact_blocks = self.contact.tangent.blocks()
            if self.condensed is None:
                self._add_contact(self.A, self._contact_blocks)
            else:
                self.factorisations = 1
                self.condensed.update(
                    self._contact_blocks[self._in_matrix] * self._free[self._in_matrix]
                )

    def _revise_condensed(self, increment: Array) -> Array | None:
        """Go over to the points that ``increment`` ``(k, 2)`` of the nodes near the contact would
        close: the change of the residual ``(m, 2)`` at those of the contact, with the matrix up to
        date; None if no point changes."""
        assert self.condensed is not None
        with self.timer("contact"):
            index_map = self.V.dofmap.index_map
            u = np.zeros((self._n + index_map.num_ghosts, 2))
            here = index_map.global_to_local(self.condensed.near)
            u[here[here >= 0]] = increment[here >= 0]
            before = self._contact_force()
            if not self.contact.anticipate(u, np.zeros(len(self.drives.rate))):
                return None
            change = self._contact_force() - before
        self.update()
        return self.condensed.at_nodes(change)

    def _contact_force(self) -> Array:
        """The contact's part of the residual ``(n_owned, 2)``."""
        force = np.zeros((self._n, 2))
        self.contact.add_force(force)
        return np.where(self._fixed, 0.0, force)

    def revised(self) -> tuple[PETSc.Mat, Array]:
        """``A`` for the points that touch and stick now, beside that of the last `update` and valid
        until the next call; and the contact's blocks."""
        with self.timer("assemble contact"):
            blocks = self.contact.tangent.blocks()
            if not self._revised:
                self._revised = self.A.duplicate()
            self.A.copy(self._revised, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            self._add_contact(self._revised, blocks - self._contact_blocks)
        return self._revised, blocks

    def border(self, blocks: Array | None = None) -> tuple[Array, Array, Array]:
        """Derivatives of the residual with respect to the unknown levels ``(n_owned dofs, m)``, of
        what these prescribe with respect to the displacements, alike, and with respect to the
        levels ``(m, m)``, of all ranks; with the contact's ``blocks``, else those of the last
        `update`. The bulk's of the first two are the same where its tangent is symmetric, as of all
        materials without recovery of back stresses."""
        drives, tangent = self.drives, self.contact.tangent
        blocks = self._contact_blocks if blocks is None else blocks
        m, free = len(drives.unknown), ~self._fixed.ravel()
        load, rate = (
            drives.unknown_load.reshape(m, -1),
            drives.unknown_rate[:, : self._n].reshape(m, -1),
        )
        on_rows = np.einsum("nij,njm->nim", blocks, self._column_rate)
        on_columns = np.einsum("nim,nij->njm", self._row_rate, blocks)
        D = np.tensordot(self._row_rate, on_rows, ((0, 1), (0, 1))) - rate @ load.T + load @ rate.T
        B, C = -load.T, load.T.copy()
        for level in range(m):
            b = ghosted_vector(self.V.dofmap.index_map, 2)
            if drives.moving[drives.unknown[level]]:
                self._direction.x.array[:] = drives.unknown_rate[level].ravel()
                self.bulk.add_action(self._direction, b)
                if self.springs:
                    b.array[:] += self.springs.pull(self._direction.x.array[: 2 * self._n])
                D[:, level] += rate @ b.array_r
            c = b.copy()
            for vector, nodes, values, whole in (
                (b, tangent.rows, on_rows, B),
                (c, tangent.columns, on_columns, C),
            ):
                inside = nodes < self._size
                at = nodes[inside].astype(PETSc.IntType)
                vector.setValuesBlocked(
                    at, np.ascontiguousarray(values[inside, :, level]), PETSc.InsertMode.ADD
                )
                vector.assemble()
                whole[:, level] += vector.array_r
                vector.destroy()
        D = self.comm.allreduce(D)
        if self.springs:
            D += np.diag(self.springs.of_levels[drives.unknown] * drives.weight**2)
        return B * free[:, None], C * free[:, None], D
