"""The tangent of bulk and contact as one PETSc matrix, without rows and columns of prescribed displacements."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.fenicsx import create_vector
from archord.solver.bulk import Bulk, matrix
from archord.solver.contact.contact import Contact
from archord.solver.linear.bordered import Bordered
from archord.solver.linear.condensed import Condensed, filled
from archord.solver.timer import BEFORE_SOLVING, Timer


class TangentMatrix:
    """``A``, of the last evaluation of ``bulk`` and ``contact``, assembled by `update`. Collective.

    ``fixed`` ``(n_local, 2)`` are the prescribed displacements, ``rate`` what they are per unit of the load factor.
    With ``condense``, for elastic bodies which their supports hold, ``A`` is that of the bulk, and the contact is in
    ``condensed``.
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        bulk: Bulk,
        contact: Contact,
        fixed: np.ndarray,
        rate: Array,
        timer: Timer,
        *,
        condense: bool = False,
    ) -> None:
        self.V, self.bulk, self.contact, self.timer = V, bulk, contact, timer
        self.comm, self._index_map = V.mesh.comm, V.dofmap.index_map
        self._fixed, self._rate = fixed, rate
        self._bcs = _scalar_bcs(V, fixed)
        self._contact_blocks: Array = np.zeros((0, 2, 2))
        self.factorisations = 0  # of sparse matrices, asked for by `update`
        self.condensed: Condensed | None = None
        self._condense = condense
        self.renew()

    def renew(self) -> None:
        """Allocate the matrix with every slot that bulk and contact may fill, and assemble the constant part."""
        if self.condensed is not None:
            self._find_contact()
            return
        n, start = self._index_map.size_local, self._index_map.local_range[0]
        slots = None
        if not self._condense:
            rows, columns = self.contact.pattern()
            mine = (rows >= start) & (rows < start + n)
            slots = rows[mine], columns[mine]
        A = matrix(self.V, self.bulk.pattern_forms(), slots)
        self.bulk.assemble_elastic(A, self._bcs)
        # zeros into every other slot: what is not written before the first assembly is given back
        if slots is not None:
            offsets, columns = _csr(slots[0] - start, slots[1], n)
            rowmap = np.arange(start, start + n, dtype=PETSc.IntType)
            zeros = np.zeros(4 * len(columns))
            A.setValuesBlockedIJV(offsets, columns, zeros, PETSc.InsertMode.ADD, rowmap)
        A.assemble()
        A.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATION_ERR, True)
        self.A = A
        if self._condense:
            self._touching = np.unique(np.concatenate([surface.curve_dofs for surface in self.contact.surfaces]))
            with self.timer(BEFORE_SOLVING):
                A.convert("aij")  # PETSc has no Cholesky factors of block matrices from MUMPS
                self.condensed = Condensed(A, self._touching, self._revise)
        else:
            self._elastic = A.copy()
        self._find_contact()

    def destroy(self) -> None:
        """Free the matrices, before `renew`."""
        if self.condensed is None:
            self.A.destroy()
            self._elastic.destroy()

    def _find_contact(self) -> None:
        """Which contact slots are free ``(n, 2, 2)``, and the rates of their rows and columns ``(n, 2)``; rigid
        surfaces are the block dofs behind the last."""
        tangent, size = self.contact.tangent, self._index_map.size_global
        places = np.concatenate([tangent.rows, tangent.columns])
        near = np.unique(places)
        whole = np.unique(np.concatenate(self.comm.allgather(near)))
        values = np.zeros((2, len(whole), 2))
        start, n = self._index_map.local_range[0], self._index_map.size_local
        mine = (whole >= start) & (whole < start + n)
        values[0, mine] = ~self._fixed[whole[mine] - start]
        values[1, mine] = self._rate[whole[mine] - start]
        self.comm.Allreduce(MPI.IN_PLACE, values)
        rigid = whole >= size
        values[1, rigid] = self.contact.rigid_rates[whole[rigid] - size]
        self._near, (free, self._rate_near) = whole, values
        row, column = np.split(np.searchsorted(whole, places), 2)
        self._row, self._column = row, column
        self._in_matrix = (tangent.rows < size) & (tangent.columns < size)
        self._free = free[row, :, None] * free[column, None, :]
        if self.condensed is not None:
            self.condensed.occupy(tangent.rows[self._in_matrix], tangent.columns[self._in_matrix])

    def update(self, *, factorise: bool = True) -> None:
        """Assemble ``A``, to be factorised or not."""
        if self.condensed is not None:
            self._update_condensed(self.condensed)
            return
        self.factorisations += factorise
        with self.timer("assemble bulk"):
            self._elastic.copy(self.A, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            self.bulk.assemble_correction(self.A, self._bcs)
        with self.timer("assemble contact"):
            self._contact_blocks = self.contact.tangent.blocks()
            self._add_contact(self.contact.tangent.rows, self.contact.tangent.columns)
            self.A.assemble()

    def _update_condensed(self, condensed: Condensed) -> None:
        self.factorisations = 1
        with self.timer("assemble contact"):
            self._contact_blocks = self.contact.tangent.blocks()
            blocks = self._contact_blocks[self._in_matrix] * self._free[self._in_matrix]
        condensed.update(blocks)

    def _revise(self, increment: Array) -> Array | None:
        """Go over to the contact points that would be closed after ``increment`` ``(k, 2)`` of the nodes near the
        contact: the change of the residual ``(m, 2)`` at those of the contact, with the matrix up to date; None if they
        are closed already."""
        assert self.condensed is not None
        with self.timer("contact"):
            u = np.zeros((len(self._fixed), 2))
            here = self._index_map.global_to_local(self.condensed.near)
            u[here[here >= 0]] = increment[here >= 0]
            change = -self._contact_force()
            if not self.contact.anticipate(u):
                return None
            change += self._contact_force()
        self._update_condensed(self.condensed)
        return change

    def _contact_force(self) -> Array:
        """The contact's part of the residual at its nodes ``(m, 2)``, on every rank."""
        n, start = self._index_map.size_local, self._index_map.local_range[0]
        force = np.zeros((n, 2))
        self.contact.add_force(force)
        force[self._fixed[:n]] = 0.0
        mine = (self._touching >= start) & (self._touching < start + n)
        found = np.zeros((len(self._touching), 2))
        found[mine] = force[self._touching[mine] - start]
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, found)
        return found

    def _add_contact(self, rows: np.ndarray, columns: np.ndarray) -> None:
        """Add the contact's blocks to ``A``, nothing to those of prescribed displacements and of a rigid disc."""
        kept = filled(self._contact_blocks)
        kept = kept[self._in_matrix[kept]]
        if not len(kept):
            return
        start = np.flatnonzero(np.diff(rows[kept], prepend=-1))  # rows are sorted
        rowmap = rows[kept[start]]
        offsets = np.append(start, len(kept))
        offsets, column, rowmap = (i.astype(PETSc.IntType) for i in (offsets, columns[kept], rowmap))
        values = self._contact_blocks[kept] * self._free[kept]
        self.A.setValuesBlockedIJV(offsets, column, values, PETSc.InsertMode.ADD, rowmap)

    def update_border(self, border: Bordered, direction: fem.Function, *, factorise: bool = True) -> None:
        """Derivatives with respect to the load factor, which moves the bodies along ``direction``, and of the force on
        it; the bulk's are the same, for its tangent is symmetric."""
        action = create_vector(self._index_map, 2)
        self.bulk.add_action(direction, action)
        bulk = action.array_r.reshape(-1, 2).copy()
        action.destroy()
        n, start = self._index_map.size_local, self._index_map.local_range[0]
        d = self.comm.allreduce(float((bulk * self._rate[:n]).sum()))
        b, c = bulk.copy(), bulk.copy()
        near = np.zeros((2, len(self._near), 2))
        values, row, column = self._contact_blocks, self._row, self._column
        np.add.at(near[0], row, np.einsum("nij,nj->ni", values, self._rate_near[column]))
        np.add.at(near[1], column, np.einsum("ni,nij->nj", self._rate_near[row], values))
        self.comm.Allreduce(MPI.IN_PLACE, near)
        d += float((near[0] * self._rate_near).sum())
        mine = (self._near >= start) & (self._near < start + n)
        b[self._near[mine] - start] += near[0, mine]
        c[self._near[mine] - start] += near[1, mine]
        free = ~self._fixed[:n].ravel()
        border.update(b.ravel() * free, c.ravel() * free, d, factorise=factorise)


def _scalar_bcs(V: fem.FunctionSpace, fixed: np.ndarray) -> list[fem.DirichletBC]:
    bcs = []
    for axis in range(2):
        dofs = np.flatnonzero(fixed[:, axis]).astype(np.int32)
        bcs.append(fem.dirichletbc(0.0, 2 * dofs + axis, V.sub(axis)))
    return bcs


def _csr(rows: np.ndarray, columns: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    order = np.lexsort((columns, rows))
    offsets = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=n))])
    return offsets.astype(PETSc.IntType), columns[order].astype(PETSc.IntType)
