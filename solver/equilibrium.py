"""Static equilibrium at a given load: residual and tangent of bulk and contact, solved by PETSc's SNES with MUMPS.

The residual is internal minus contact forces; rows of prescribed displacements are left out of it, and out of the
matrix with their columns, the contact's included. It is measured against the reaction of the supports, so that the
tolerance has no unit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.geometry.fenicsx import create_vector
from archord.materials.elasticity import elastic_tangent
from archord.solver.bulk import Bulk, assemble, matrix
from archord.solver.contact import Contact
from archord.solver.interrupt import Interrupt, Interrupted
from archord.solver.timer import Timer


@dataclass(frozen=True)
class Support:
    """A prescribed displacement: component ``axis`` of the nodes ``dofs`` (block dofs of this rank) is ``rate * load``.

    ``rate`` is a number or one per node; ``name`` addresses its reaction.
    """

    name: str
    axis: int
    dofs: np.ndarray
    rate: float | Array = 0.0


@dataclass
class Newton:
    """What a nonlinear solve did: whether it converged and why not, its iterations and residuals relative to reaction.

    ``worst`` is the place ``(2,)`` of the largest residual of a solve that did not converge.
    """

    converged: bool
    reason: str
    iterations: int
    residuals: list[float]
    worst: tuple[float, float] | None = None

    def after(self, before: Newton | None) -> Newton:
        """This solve with the iterations and residuals of the one ``before`` it."""
        if before is None:
            return self
        iterations, residuals = before.iterations + self.iterations, before.residuals + self.residuals
        return replace(self, iterations=iterations, residuals=residuals)


class Equilibrium:
    """Equilibrium of ``bulk`` and, if given, ``contact`` under ``supports``.

    ``rigid_rate`` moves a rigid pin with the load; ``applied`` are nodal forces ``(n_owned, 2)`` per unit of it.
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        bulk: Bulk,
        supports: list[Support],
        contact: Contact | None = None,
        rigid_rate: Array | None = None,
        *,
        applied: Array | None = None,
        tolerance: float = 1e-10,
        max_iterations: int = 25,
        timer: Timer | None = None,
    ) -> None:
        self.V, self.bulk, self.contact = V, bulk, contact
        self.comm = V.mesh.comm
        self.supports = supports
        self.rigid_rate, self.applied = rigid_rate, applied
        self.tolerance, self.max_iterations = tolerance, max_iterations
        self.timer = timer or Timer()
        self.interrupt = Interrupt()
        self.u = fem.Function(V, name="displacement")
        self.load = 0.0
        index_map = V.dofmap.index_map
        self.n_owned = index_map.size_local
        self.n_local = index_map.size_local + index_map.num_ghosts
        self._fixed = np.zeros((self.n_local, 2), dtype=bool)
        self._rate = np.zeros((self.n_local, 2))
        for s in supports:
            self._fixed[s.dofs, s.axis] = True
            self._rate[s.dofs, s.axis] = s.rate
        self._bcs = _scalar_bcs(V, self._fixed)
        self._free_owned = ~self._fixed[: self.n_owned].ravel()
        self._force = create_vector(index_map, 2)
        self._reaction = np.zeros((self.n_owned, 2))
        self._reaction_norm = self._noise = 0.0
        materials = [body.material for body in bulk.bodies]
        stiffness = max(float(elastic_tangent(m.E, m.nu, m.plane)[0, 0]) for m in materials)
        rate = max(float(np.max(np.abs(s.rate), initial=0.0)) for s in supports)
        rigid = 0.0 if rigid_rate is None else float(np.abs(rigid_rate).max())
        self._stiffest = stiffness * self.comm.allreduce(max(rate, rigid), op=MPI.MAX)
        self._make_matrix()
        self._raised: BaseException | None = None
        self._snes = self._make_snes()
        self._failure = ""

    # ------------------------------------------------------------------ matrix

    def _make_matrix(self) -> None:
        """Allocate the matrix with every slot that bulk and contact may fill, and assemble the constant part."""
        n, start = self.n_owned, self.V.dofmap.index_map.local_range[0]
        slots = None
        if self.contact is not None:
            rows, columns = self.contact.pattern()
            mine = (rows >= start) & (rows < start + n)
            slots = rows[mine], columns[mine]
        A = matrix(self.V, self.bulk.pattern_forms(), slots)
        # zeros into every slot first: what is not written before the first assembly is given back
        assemble(A, self.bulk.pattern_forms(), self._bcs)
        if slots is not None:
            offsets, columns = _csr(slots[0] - start, slots[1], n)
            rowmap = np.arange(start, start + n, dtype=PETSc.IntType)
            zeros = np.zeros(4 * len(columns))
            A.setValuesBlockedIJV(offsets, columns, zeros, PETSc.InsertMode.ADD, rowmap)
        A.assemble()
        A.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATION_ERR, True)
        A.zeroEntries()
        self.bulk.assemble_elastic(A, self._bcs)
        A.assemble()
        self._A = A
        self._elastic = A.copy()
        self._near, self._free_near = self._free_near_contact()

    def _free_near_contact(self) -> tuple[np.ndarray, Array]:
        """The contact's nodes on all ranks ``(n,)`` (sorted), and 1 for each of their free displacements ``(n, 2)``."""
        if self.contact is None:
            return np.zeros(0, dtype=np.int64), np.zeros((0, 2))
        near = np.unique(np.concatenate([s.curve_cell_dofs.ravel() for s in self.contact.sides]))
        free = np.zeros((len(near), 2))
        start = self.V.dofmap.index_map.local_range[0]
        mine = (near >= start) & (near < start + self.n_owned)
        free[mine] = ~self._fixed[near[mine] - start]
        self.comm.Allreduce(MPI.IN_PLACE, free)
        return near, free

    def _jacobian(self, snes, x, A, P) -> None:
        A = self._A
        with self.timer("assemble bulk"):
            self._elastic.copy(A, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            self.bulk.assemble_plastic(A, self._bcs)
        with self.timer("assemble contact"):
            if self.contact is not None:
                self._add_blocks(A, *self.contact.tangent())
            A.assemble()

    def _add_blocks(self, A: PETSc.Mat, rows: np.ndarray, columns: np.ndarray, values: Array) -> None:
        """Add blocks ``(n, 2, 2)`` in global block dofs to ``A``, nothing to those of prescribed displacements."""
        if not len(rows):
            return
        size = self.V.dofmap.index_map.size_global
        key, slot = np.unique(rows * size + columns, return_inverse=True)
        summed = np.stack([np.bincount(slot, v, len(key)) for v in values.reshape(-1, 4).T], axis=1).reshape(-1, 2, 2)
        row, column = np.divmod(key, size)
        summed *= self._free_near[np.searchsorted(self._near, row), :, None]
        summed *= self._free_near[np.searchsorted(self._near, column), None, :]
        rowmap, start = np.unique(row, return_index=True)
        offsets, column, rowmap = (i.astype(PETSc.IntType) for i in (np.append(start, len(key)), column, rowmap))
        A.setValuesBlockedIJV(offsets, column, summed, PETSc.InsertMode.ADD, rowmap)

    # ------------------------------------------------------------------ residual

    def _residual(self, snes, x, f) -> None:
        self._set_displacement(x)
        try:
            self.evaluate()
        except ProjectionError as error:
            self._failure = str(error)
            f.set(np.nan)
            return
        if self._pattern_grew:
            self._A.destroy()
            self._elastic.destroy()
            self._make_matrix()
            snes.setJacobian(self._guarded(self._jacobian), self._A)
        f.array[:] = np.where(self._free_owned, self._force.array_r, 0.0)

    def evaluate(self) -> None:
        """Residual, reactions and trial history at the current displacement and load. Raises `Interrupted` on every
        rank if ``interrupt`` was received by any."""
        u = self.u.x.array.reshape(-1, 2)
        with self.timer("return mapping"):
            self.bulk.update(u)
        with self.timer("assemble force"):
            with self._force.localForm() as local:
                local.set(0.0)
            self.bulk.add_force(self.u.x.petsc_vec, self._force)
        self._pattern_grew = False
        with self.timer("contact"):
            if self.contact is not None:
                if self.rigid_rate is not None:
                    self.contact.rigid_motion = self.load * self.rigid_rate
                self._pattern_grew = self.contact.evaluate(u)
                self.contact.add_force(self._force.array.reshape(-1, 2))
        if self.applied is not None:
            self._force.array[:] -= self.load * self.applied.ravel()
        self._reaction = np.where(self._free_owned, 0.0, self._force.array_r).reshape(-1, 2)
        noise = 0.0 if self.contact is None else self.contact.round_off()
        totals = np.array([(self._reaction**2).sum(), noise**2, self.interrupt.received > 0])
        self.comm.Allreduce(MPI.IN_PLACE, totals)
        self._reaction_norm, contact_noise = np.sqrt(totals[:2])
        self._noise = self._bulk_noise() + contact_noise
        if totals[2]:
            raise Interrupted(self.comm.allreduce(self.interrupt.received, op=MPI.MAX))

    def _set_displacement(self, x: PETSc.Vec) -> None:
        self.u.x.array[: 2 * self.n_owned] = x.array_r
        self.u.x.scatter_forward()

    def reaction(self, name: str) -> Array:
        """Force ``(2,)`` of the support ``name`` on the joint at the last evaluation, over all ranks."""
        total = np.zeros(2)
        for s in self.supports:
            if s.name == name:
                total[s.axis] += self._reaction[s.dofs[s.dofs < self.n_owned], s.axis].sum()
        return self.comm.allreduce(total)

    # ------------------------------------------------------------------ solve

    def _make_snes(self) -> PETSc.SNES:
        snes = PETSc.SNES().create(self.comm)
        snes.setOptionsPrefix("archord_")
        snes.setType("newtonls")
        x = create_vector(self.V.dofmap.index_map, 2)
        self._x = x
        snes.setFunction(self._guarded(self._residual), x.duplicate())
        snes.setJacobian(self._guarded(self._jacobian), self._A)
        snes.setTolerances(max_it=self.max_iterations)
        snes.setConvergenceTest(self._test)
        ksp = snes.getKSP()
        ksp.setType("preonly")
        ksp.setOperators(self._A)
        pc = ksp.getPC()
        pc.setType("lu")
        pc.setFactorSolverType("mumps")
        pc.setFactorSetUpSolverType()
        pc.getFactorMatrix().setMumpsIcntl(14, 60)
        options = PETSc.Options("archord_")
        options["snes_linesearch_type"] = "bt"
        options["snes_linesearch_max_it"] = 8
        snes.setFromOptions()
        return snes

    def _guarded(self, callback: Callable) -> Callable:
        """Keep what ``callback`` raises, which PETSc would turn into an error number."""

        def call(*arguments) -> None:
            try:
                callback(*arguments)
            except BaseException as error:
                self._raised = error
                raise

        return call

    def _bulk_noise(self) -> float:
        """Round-off of the bulk's residual: forces that a rigid motion of the size of the load leaves."""
        return 1e-13 * self._stiffest * abs(self.load)

    def _test(self, snes, iteration, norms):
        norm = norms[2]
        scale = max(self._reaction_norm, self._noise / self.tolerance)
        self._residuals.append(norm / self._reaction_norm if self._reaction_norm > 0 else norm)
        if not np.isfinite(norm):
            return PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN
        if norm <= self.tolerance * scale:
            return PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE
        if iteration >= self.max_iterations:
            return PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT
        return PETSc.SNES.ConvergedReason.ITERATING

    def solve(self, load: float, guess: Array, *, elastic_first: bool = False) -> Newton:
        """Solve at ``load`` from the nodal displacements ``guess`` ``(n_local, 2)``, whose prescribed values are
        replaced.

        ``elastic_first`` finds the equilibrium of points that cannot yield (further) before the one asked for; if that
        fails, the solve starts from the guess.
        """
        self.load = load
        points = self.bulk.plastic_points() + (self.contact.plastic_points() if self.contact is not None else [])
        yielding = self.comm.allreduce(len(points)) > 0
        if not yielding:
            return self._run_elastic(guess)
        before = None
        if elastic_first:
            for p in points:
                p.elastic_only = True
            before = self._run_elastic(guess)
            for p in points:
                p.elastic_only = False
            if before.converged:
                guess = self.displacement()
        return self._run(guess).after(before)

    def _run_elastic(self, guess: Array) -> Newton:
        """Without plasticity the problem is nearly linear by pieces, and full steps find the right ones where the line
        search, which wants a smaller residual in every step, creeps: large gamma, nearly incompressible bodies."""
        result = self._run(guess)
        if result.converged:
            return result
        self._line_search("basic")
        try:
            return self._run(guess).after(result)
        finally:
            self._line_search("bt")

    def _line_search(self, kind: str) -> None:
        PETSc.Options("archord_")["snes_linesearch_type"] = kind
        self._snes.setFromOptions()

    def _run(self, guess: Array) -> Newton:
        self._residuals: list[float] = []
        self._failure = ""
        x = guess.copy()
        x[self._fixed] = self.load * self._rate[self._fixed]
        self._x.array[:] = x[: self.n_owned].ravel()
        if self.contact is not None:
            self.contact.search()
        self._raised = None
        with self.timer("solve"):
            try:
                self._snes.solve(None, self._x)
            except PETSc.Error:
                if self._raised is not None:
                    raise self._raised from None
                raise
        code, iterations = self._snes.getConvergedReason(), self._snes.getIterationNumber()
        if code > 0:
            return Newton(True, "converged", iterations, self._residuals)
        reason = self._failure or _REASONS.get(code, f"SNES reason {code}")
        return Newton(False, reason, iterations, self._residuals, self._worst_place())

    def _worst_place(self) -> tuple[float, float] | None:
        """Where the residual is largest, over all ranks."""
        size = np.linalg.norm(self._snes.getFunction()[0].array_r.reshape(-1, 2), axis=1)
        at = int(np.argmax(size)) if len(size) else 0
        x = self.V.tabulate_dof_coordinates()[at, :2] if len(size) else np.zeros(2)
        found = [(s, p) for s, p in self.comm.allgather((size[at] if len(size) else -1.0, tuple(x))) if np.isfinite(s)]
        return max(found)[1] if found else None

    def displacement(self) -> Array:
        """A copy of the nodal displacements ``(n_local, 2)``."""
        return self.u.x.array.reshape(-1, 2).copy()

    def restore(self, load: float, u: Array) -> None:
        """Go back to an accepted state; the history was never touched."""
        self.load = load
        self.u.x.array[:] = u.ravel()

    def commit(self) -> None:
        """Accept the last solve: bulk and contact keep their trial history."""
        self.bulk.commit()
        if self.contact is not None:
            self.contact.commit()


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


_R = PETSc.SNES.ConvergedReason
_REASONS = {
    _R.DIVERGED_MAX_IT: "no convergence within the allowed iterations",
    _R.DIVERGED_LINE_SEARCH: "the line search found no smaller residual",
    _R.DIVERGED_LINEAR_SOLVE: "the linear system could not be factorised",
    _R.DIVERGED_FNORM_NAN: "the residual is not a number",
    _R.DIVERGED_FUNCTION_DOMAIN: "the residual could not be evaluated",
}
