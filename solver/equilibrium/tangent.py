"""The tangent of bulk and contact as one PETSc matrix, without rows and columns of prescribed
displacements."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.kernels.blocks import add_blocks
from archord.kernels.compat import ghosted_vector
from archord.materials.kinematics import Bools, Ints
from archord.report.timer import BEFORE_SOLVING, Timer
from archord.solver.bulk.assembly import assemble, matrix
from archord.solver.contact.tangent import Filled
from archord.solver.equilibrium.evaluation import Evaluation
from archord.solver.linear.block_product import BlockProduct, quick_product
from archord.solver.linear.condensed import Condensed
from archord.solver.linear.strategy import Sum

_SAME = PETSc.Mat.Structure.SAME_NONZERO_PATTERN
_SUBSET = PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN
Revise = Callable[[Array], Array | None]


class _Slots(NamedTuple):
    """Where the blocks of the contact's tangent go, ``(k,)`` of them.

    in_matrix : (k,) whether rows and columns are nodes of bodies, not rigid discs
    is_free : (k, d, d) whether both displacements of an entry are free
    row_rate : (k, d, m) prescribed displacements of the rows per unit of the unknown levels
    column_rate : (k, d, m) the same of the columns
    """

    in_matrix: np.ndarray
    is_free: Bools
    row_rate: Array
    column_rate: Array


class TangentMatrix:
    """The tangent of the last ``evaluation``, assembled by `update`. Collective.

    A : matrix of all displacements
    of_contact : the matrix of the contact where that is ``beside`` A, not in it; else None
    product : multiplies as the tangent does, quicker in space
    condensed : where ``revise`` is given (see `Condensed`), for elastic bodies which their
        supports hold: the contact, which ``A`` lacks then; else None
    factorisations : number of factorisations of sparse matrices that `update` asked for
    """

    def __init__(
        self,
        evaluation: Evaluation,
        timer: Timer,
        revise: Revise | None = None,
        *,
        beside: bool = False,
    ) -> None:
        unknowns = evaluation.unknowns
        index_map = unknowns.V.dofmap.index_map
        self.V = unknowns.V
        self.bulk = evaluation.bulk
        self.contact = evaluation.contact
        self.drives = unknowns.drives
        self.springs = evaluation.springs
        self.timer = timer
        self.dimension = unknowns.dimension
        self.factorisations = 0
        self._n_owned = unknowns.n_owned
        self._start = index_map.local_range[0]
        self._size = index_map.size_global
        self._fixed = unknowns.fixed[: self._n_owned]
        self._direction = fem.Function(self.V)
        self._bcs = [self._held(axis) for axis in range(self.dimension)]
        self._prescribed, self._rates = self._prescribed_rates()
        self.A = PETSc.Mat()
        self.of_contact: PETSc.Mat | None = None
        self.product = PETSc.Mat()
        self._elastic = PETSc.Mat()  # the constant part, where the matrix has more
        self.condensed: Condensed | None = None
        if revise is not None:
            with timer(BEFORE_SOLVING):
                self.condensed = self._condense(revise)
        self._both: BlockProduct | None = None
        if beside:
            self.A = self._allocated(self.bulk.elastic_forms)
            self.A.assemble()
            self._both = BlockProduct(self.A)
            self._keep_elastic()
            self.product = self._both.matrix()
        self.renew()

    def terms(self) -> list[PETSc.Mat]:
        """The matrices whose sum is the tangent."""
        return [self.A] if self.of_contact is None else [self.A, self.of_contact]

    def _held(self, axis: int) -> fem.DirichletBC:
        """The prescribed displacements along an ``axis``."""
        nodes = np.flatnonzero(self.drives.fixed[:, axis]).astype(np.int32)
        dofs = self.dimension * nodes + axis
        return fem.dirichletbc(0.0, dofs, self.V.sub(axis))

    def _prescribed_rates(self) -> tuple[Ints, Array]:
        """The prescribed dofs ``(p,)`` of all ranks, and then the dofs of rigid discs and one that
        is none; and their displacements ``(p, m)`` per unit of the unknown levels."""
        drives = self.drives
        m = len(drives.unknown)
        own = np.flatnonzero(self._fixed)
        of_nodes = drives.unknown_rate[:, : self._n_owned].reshape(m, self._fixed.size)
        first = self.dimension * self._start
        parts = self.V.mesh.comm.allgather((first + own, of_nodes.T[own]))
        discs = [drives.weight[:, None] * disc.rate[drives.unknown] for disc in self.contact.rigid]
        behind = np.hstack([*discs, np.zeros((m, 1))]).T
        numbers = self.dimension * self._size + np.arange(len(behind))
        parts.append((numbers, behind))
        dofs, rates = zip(*parts, strict=True)
        return np.concatenate(dofs), np.concatenate(rates)

    def _condense(self, revise: Revise) -> Condensed:
        self.A = self._allocated(self.bulk.elastic_forms)
        self.A.assemble()
        self.A.convert("aij")  # PETSc has no Cholesky factors of block matrices from MUMPS
        nodes = [surface.curve_dofs for surface in self.contact.surfaces]
        in_contact = np.unique(np.concatenate(nodes))
        return Condensed(self.A, in_contact, self.dimension, revise)

    def _allocated(self, forms: list[fem.Form], *slots: tuple[np.ndarray, np.ndarray]) -> PETSc.Mat:
        """The matrix of bilinear ``forms``, with room for block ``slots`` in rows of this rank."""
        A = matrix(self.V, forms, *slots)
        assemble(A, forms, self._bcs)
        return A

    def renew(self) -> None:
        """Allocate every slot that the contact may fill, in the matrix of the bulk or beside it; in
        a condensed matrix, slots of contact alone."""
        tangent = self.contact.tangent
        nothing: Array = np.zeros((0, self.dimension, self.dimension))
        self._filled = Filled(np.zeros(0, dtype=np.int64), nothing)
        self._slots = self._slots_of(tangent.rows, tangent.columns)
        if self.condensed is not None:
            inside = self._slots.in_matrix
            self.condensed.occupy(tangent.rows[inside], tangent.columns[inside])
            return
        if self._both is not None:
            self.of_contact = self._renewed(self.of_contact, [])
            self._both.replace(*self.terms())
            return
        self._elastic.destroy()
        self.A = self._renewed(self.A, self.bulk.elastic_forms)
        self._keep_elastic()
        self.product = quick_product(self.A)

    def _renewed(self, A: PETSc.Mat | None, forms: list[fem.Form]) -> PETSc.Mat:
        """In the place of ``A`` a matrix of the bilinear ``forms``, with room for the contact."""
        if A:
            # its entries go now: solvers keep the matrix itself until they get the next one
            A.setPreallocationNNZ(0)
            A.destroy()
        rows, columns = self.contact.pattern()
        A = self._allocated(forms, (rows, columns))
        # zeros into every other slot: what is not written before the first assembly is given back
        zeros = np.zeros((len(rows), self.dimension, self.dimension))
        add_blocks(A, rows, columns, zeros)
        A.assemble()
        A.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATION_ERR, True)
        return A

    def _keep_elastic(self) -> None:
        """Keep a copy of the constant part, where the matrix has more."""
        if self._both is None or self.bulk.plastic or self.bulk.finite or self.springs:
            self._elastic = self.A.copy()

    def _slots_of(self, rows: Ints, columns: Ints) -> _Slots:
        in_matrix = (rows < self._size) & (columns < self._size)
        is_met = np.zeros(1 + max(rows.max(initial=0), columns.max(initial=0)), dtype=bool)
        is_met[rows] = True
        is_met[columns] = True
        node_is_free, rate = self._at(np.flatnonzero(is_met))
        place = np.cumsum(is_met) - 1
        row = place[rows]
        column = place[columns]
        is_free = node_is_free[row][:, :, None] * node_is_free[column][:, None, :]
        return _Slots(in_matrix, is_free, rate[row], rate[column])

    def _at(self, nodes: Ints) -> tuple[Ints, Array]:
        """Which displacements of block dofs ``nodes`` ``(k,)`` are free ``(k, d)``; the others'
        rates ``(k, d, m)``."""
        dofs = self.dimension * nodes[:, None] + np.arange(self.dimension)
        at = np.searchsorted(self._prescribed, dofs)
        is_free = self._prescribed[at] != dofs
        return is_free, np.where(is_free[..., None], 0.0, self._rates[at])

    def _add_contact(self, A: PETSc.Mat, of_contact: Filled) -> None:
        """Add what the contact fills to ``A``. Its values are large, and change in place."""
        tangent = self.contact.tangent
        at, values = of_contact
        inside = self._slots.in_matrix[at]
        if not inside.all():
            at = at[inside]
            values = values[inside]
        values *= self._slots.is_free[at]
        add_blocks(A, tangent.rows[at], tangent.columns[at], values)
        A.assemble()

    def update(self, *, factorise: bool = True) -> None:
        """Assemble ``A``, to be factorised or not."""
        if self.condensed is not None:
            self._update_condensed(self.condensed)
            return
        self.factorisations += factorise
        with self.timer("assemble bulk"):
            if self._elastic:
                self._elastic.copy(self.A, _SAME)
            if self.springs:
                self.A.axpy(1.0, self.springs.of_free, _SUBSET)
            self.bulk.assemble_correction(self.A, self._bcs)
        with self.timer("assemble contact"):
            filled = self.contact.tangent.filled()
            self._filled = self._for_border(filled)
            if self.of_contact is None:
                self._add_contact(self.A, filled)
                return
            self.of_contact.zeroEntries()
            self._add_contact(self.of_contact, filled)
            self.A.assemble()
            self.A.stateIncrease()  # what solves with it has to be set up again

    def _for_border(self, filled: Filled) -> Filled:
        """What the `border` needs of what the contact has ``filled``: without unknown levels
        nothing."""
        n = len(filled.at) if len(self.drives.unknown) else 0
        return Filled(filled.at[:n], filled.values[:n].copy())

    def _update_condensed(self, condensed: Condensed) -> None:
        self.factorisations = 1
        with self.timer("assemble contact"):
            blocks = self.contact.tangent.blocks()
            inside = self._slots.in_matrix
            condensed.update(blocks[inside] * self._slots.is_free[inside])

    def revised(self) -> tuple[PETSc.Mat, list[Filled]]:
        """The tangent for the branches that contact points are on now, valid until the next
        `update`; and what the contact fills, in parts, for the `border`."""
        with self.timer("assemble contact"):
            changes = self.contact.tangent.filled(by_changes=True)
            parts = [self._filled, self._for_border(changes)]
            change = PETSc.Mat().create(self.A.comm)
            change.setSizes(self.A.getSizes(), bsize=self.dimension)
            change.setType("aij")
            change.setUp()
            self._add_contact(change, changes)
        return Sum(self.product, change).matrix(), parts

    def border(self, of_contact: list[Filled] | None = None) -> tuple[Array, Array, Array]:
        """The border of the matrix, of the ``m`` unknown levels: derivatives ``B`` ``(n_owned dofs,
        m)`` of the residual by the levels, ``C``, alike, of what the levels' equations prescribe by
        the displacements, and ``D`` ``(m, m)``, of all ranks, by the levels.

        With what the contact fills, in parts, without them as in the last `update`. The bulk's part
        of B and C is the same where its tangent is symmetric, as of all materials without recovery
        of back stresses.
        """
        parts = of_contact or [self._filled]
        at = np.concatenate([part.at for part in parts])
        blocks = np.concatenate([part.values for part in parts])
        tangent = self.contact.tangent
        drives = self.drives
        m = len(drives.unknown)
        load = drives.unknown_load.reshape(m, -1)
        rate = drives.unknown_rate[:, : self._n_owned].reshape(m, -1)
        row_rate = self._slots.row_rate[at]
        on_rows = np.einsum("nij,njm->nim", blocks, self._slots.column_rate[at])
        on_columns = np.einsum("nim,nij->njm", row_rate, blocks)
        by_contact = np.tensordot(row_rate, on_rows, ((0, 1), (0, 1)))
        D = by_contact - rate @ load.T + load @ rate.T
        B = -load.T
        C = load.T.copy()
        for level in range(m):
            of_bulk = self._bulk_along(level)
            D[:, level] += rate @ of_bulk
            B[:, level] += self._with_contact(of_bulk, tangent.rows[at], on_rows[..., level])
            C[:, level] += self._with_contact(of_bulk, tangent.columns[at], on_columns[..., level])
        D = self.V.mesh.comm.allreduce(D)
        if self.springs:
            D += np.diag(self.springs.of_levels[drives.unknown] * drives.weight**2)
        is_free = ~self._fixed.reshape(-1, 1)
        return B * is_free, C * is_free, D

    def _bulk_along(self, level: int) -> Array:
        """Forces ``(n_owned dofs,)`` of bulk and springs along the displacements of an unknown
        ``level``."""
        force = ghosted_vector(self.V.dofmap.index_map, self.dimension)
        drives = self.drives
        if drives.moving[drives.unknown[level]]:
            self._direction.x.array[:] = drives.unknown_rate[level].ravel()
            self.bulk.add_action(self._direction, force)
            if self.springs:
                own = self._direction.x.array[: self.dimension * self._n_owned]
                force.array[:] += self.springs.pull(own)
        found = force.array_r.copy()
        force.destroy()
        return found

    def _with_contact(self, of_bulk: Array, nodes: Ints, values: Array) -> Array:
        """The bulk's forces and the ``values`` ``(k, d)`` of the contact at block dofs
        ``nodes``."""
        inside = nodes < self._size
        total = ghosted_vector(self.V.dofmap.index_map, self.dimension)
        total.array[:] = of_bulk
        at = nodes[inside].astype(PETSc.IntType)
        total.setValuesBlocked(at, np.ascontiguousarray(values[inside]), PETSc.InsertMode.ADD)
        total.assemble()
        found = total.array_r.copy()
        total.destroy()
        return found
