"""Static equilibrium at a given load: residual and tangent of bulk and contact, solved by PETSc's SNES with MUMPS.

A load moves the supports and a rigid pin by its own value, or, as a force, by a level that is an unknown itself.

The residual is internal minus contact forces; rows of prescribed displacements are left out of it, and out of the
matrix with their columns, the contact's included. It is measured against the reaction of the supports, so that the
tolerance has no unit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.geometry.fenicsx import create_vector
from archord.materials.elasticity import elastic_tangent
from archord.solver.bordered import Bordered, direct_solver
from archord.solver.bulk import Bulk, assemble, matrix
from archord.solver.contact import GAMMA_FACTOR, Contact
from archord.solver.interrupt import Interrupt, Interrupted
from archord.solver.points import PlasticPoints
from archord.solver.timer import Timer

_STIFF_CONTACT = 5.0  # gamma factor above which it is raised by and by where a solve fails
_GAMMA_RATIO = 10.0  # and the largest ratio of one gamma to the next
_PATIENCE = 12  # Newton iterations in which the residual must halve
_CIRCLING = 4  # the same where no contact point opens or closes


@dataclass(frozen=True)
class Support:
    """A prescribed displacement: component ``axis`` of the block dofs ``dofs`` of this rank is ``rate * level``.

    ``rate`` is a number or one per node; ``name`` addresses its reaction.
    """

    name: str
    axis: int
    dofs: np.ndarray
    rate: float | Array = 0.0


@dataclass
class Newton:
    """What a nonlinear solve did: whether it converged and why not, its iterations and residuals relative to reaction.

    Of a solve that did not converge, ``worst`` is the place ``(2,)`` of the largest residual, ``flips`` the number of
    contact points that changed between open and closed at each residual, ``plastic_increment`` the largest of PEEQ.
    ``held``: contact points had to stay on their facets.
    """

    converged: bool
    reason: str
    iterations: int
    residuals: list[float]
    worst: tuple[float, float] | None = None
    flips: list[int] = field(default_factory=list)
    plastic_increment: float = 0.0
    held: bool = False

    def after(self, before: Newton | None) -> Newton:
        """This solve with the iterations and residuals of the one ``before`` it."""
        if before is None:
            return self
        iterations, residuals = before.iterations + self.iterations, before.residuals + self.residuals
        flips, held = before.flips + self.flips, before.held or self.held
        return replace(self, iterations=iterations, residuals=residuals, flips=flips, held=held)


class Equilibrium:
    """Equilibrium of ``bulk`` and, if given, ``contact`` under ``supports``.

    ``rigid_rate`` moves a rigid pin with the level; ``applied`` are nodal forces ``(n_owned, 2)`` per unit of load.
    The level is the load, or with ``by_force`` what makes the forces of supports and rigid pin, along their rates,
    sum up to ``by_force`` times the load. ``load_name`` is for messages, ``travel`` the displacement to be expected,
    which limits what counts as round-off: an iterate that flew away is none.
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
        by_force: float | None = None,
        load_name: str = "delta",
        travel: float = np.inf,
        tolerance: float = 1e-10,
        max_iterations: int = 25,
        timer: Timer | None = None,
    ) -> None:
        self.V, self.bulk, self.contact = V, bulk, contact
        self.comm = V.mesh.comm
        self.supports = supports
        self.rigid_rate, self.applied, self.by_force, self.load_name = rigid_rate, applied, by_force, load_name
        self.tolerance, self.max_iterations = tolerance, max_iterations
        self.timer = timer or Timer()
        self.interrupt = Interrupt()
        self._by_and_by = False
        self.u = fem.Function(V, name="displacement")
        self.load = self.level = 0.0
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
        self.largest_reaction = 0.0  # norm, of all accepted states
        materials = [body.material for body in bulk.bodies]
        stiffness = max(float(elastic_tangent(m.E, m.nu, m.plane)[0, 0]) for m in materials)
        self._stiffest, self.travel = stiffness, travel
        self._border: Bordered | None = None
        self._make_matrix()
        if by_force is not None:
            self._border = Bordered(self.comm, self._A, stiffness)
            self._direction = fem.Function(V)
            self._direction.x.array[:] = self._rate.ravel()
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
        self._find_near_contact()

    def _find_near_contact(self) -> None:
        """The contact's nodes on all ranks ``(n,)``, sorted, 1 for each of their free displacements and the rates of
        the others ``(n, 2)``; a rigid pin is the last of them."""
        if self.contact is None:
            return
        index_map = self.V.dofmap.index_map
        nodes = np.unique(np.concatenate([s.curve_cell_dofs.ravel() for s in self.contact.sides]))
        near = np.append(nodes, index_map.size_global)
        values = np.zeros((2, len(near), 2))
        start = index_map.local_range[0]
        mine = (near >= start) & (near < start + self.n_owned)
        values[0, mine] = ~self._fixed[near[mine] - start]
        values[1, mine] = self._rate[near[mine] - start]
        self.comm.Allreduce(MPI.IN_PLACE, values)
        self._near, (self._free_near, self._rate_near) = near, values
        if self.rigid_rate is not None:
            self._rate_near[-1] = self.rigid_rate

    def _jacobian(self, snes, x, A, P) -> None:
        A = self._A
        with self.timer("assemble bulk"):
            self._elastic.copy(A, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            self.bulk.assemble_plastic(A, self._bcs)
        with self.timer("assemble contact"):
            blocks = None
            if self.contact is not None:
                blocks = self._summed(*self.contact.tangent())
                self._add_blocks(A, *blocks)
            A.assemble()
        if self._border is not None:
            with self.timer("assemble border"):
                self._update_border(self._border, blocks)

    def _summed(self, rows: np.ndarray, columns: np.ndarray, values: Array) -> tuple[np.ndarray, np.ndarray, Array]:
        """Blocks ``(n, 2, 2)`` with those of one place summed up, and their places as indices into ``_near``."""
        size = self.V.dofmap.index_map.size_global + 1
        key, slot = np.unique(rows * size + columns, return_inverse=True)
        summed: Array = np.stack([np.bincount(slot, v, len(key)) for v in values.reshape(-1, 4).T], axis=1)
        row, column = np.divmod(key, size)
        row, column = np.searchsorted(self._near, row), np.searchsorted(self._near, column)
        return np.asarray(row), np.asarray(column), summed.reshape(-1, 2, 2)

    def _add_blocks(self, A: PETSc.Mat, row: np.ndarray, column: np.ndarray, blocks: Array) -> None:
        """Add blocks ``(n, 2, 2)`` to ``A``, nothing to those of prescribed displacements and of a rigid pin."""
        last = len(self._near) - 1
        kept = (row < last) & (column < last)
        if not kept.any():
            return
        row, column = row[kept], column[kept]
        summed = blocks[kept] * self._free_near[row, :, None] * self._free_near[column, None, :]
        row, column = self._near[row], self._near[column]
        rowmap, start = np.unique(row, return_index=True)
        offsets, column, rowmap = (i.astype(PETSc.IntType) for i in (np.append(start, len(row)), column, rowmap))
        A.setValuesBlockedIJV(offsets, column, summed, PETSc.InsertMode.ADD, rowmap)

    def _update_border(self, border: Bordered, blocks: tuple[np.ndarray, np.ndarray, Array] | None) -> None:
        """Derivatives with respect to the level, and of the force on it; the bulk's are the same, for its tangent is
        symmetric."""
        action = create_vector(self.V.dofmap.index_map, 2)
        self.bulk.add_action(self._direction, action)
        bulk = action.array_r.reshape(-1, 2).copy()
        action.destroy()
        d = self.comm.allreduce(float((bulk * self._rate[: self.n_owned]).sum()))
        b, c = bulk.copy(), bulk.copy()
        if blocks is not None:
            row, column, values = blocks
            near = np.zeros((2, len(self._near), 2))
            np.add.at(near[0], row, np.einsum("nij,nj->ni", values, self._rate_near[column]))
            np.add.at(near[1], column, np.einsum("ni,nij->nj", self._rate_near[row], values))
            self.comm.Allreduce(MPI.IN_PLACE, near)
            d += float((near[0] * self._rate_near).sum())
            start = self.V.dofmap.index_map.local_range[0]
            mine = (self._near >= start) & (self._near < start + self.n_owned)
            b[self._near[mine] - start] += near[0, mine]
            c[self._near[mine] - start] += near[1, mine]
        border.update(b.ravel() * self._free_owned, c.ravel() * self._free_owned, d)

    # ------------------------------------------------------------------ residual

    def _residual(self, snes, x, f) -> None:
        self._set_displacement(x)
        try:
            self.evaluate()
        except ProjectionError as error:
            self._failure = str(error)
            f.set(np.nan)
            return
        self._follow_pattern()
        free = np.where(self._free_owned, self._force.array_r, 0.0)
        if self._border is None or self.by_force is None:
            f.array[:] = free
        else:
            self._border.join(f, free, self.force_on_level() - self.by_force * self.load)

    def _follow_pattern(self) -> None:
        """Make the matrix anew where the pairs of the last evaluation slid out of its pattern."""
        if not self._pattern_grew:
            return
        self._A.destroy()
        self._elastic.destroy()
        self._make_matrix()
        if self._border is None:
            self._snes.setJacobian(self._guarded(self._jacobian), self._A)
        else:
            self._border.replace(self._A)

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
                    self.contact.rigid_motion = self.level * self.rigid_rate
                self._pattern_grew = self.contact.evaluate(u)
                self.contact.add_force(self._force.array.reshape(-1, 2))
        if self.applied is not None:
            self._force.array[:] -= self.load * self.applied.ravel()
        self._reaction = np.where(self._free_owned, 0.0, self._force.array_r).reshape(-1, 2)
        noise = 0.0 if self.contact is None else self.contact.round_off()
        flips = 0 if self.contact is None else self.contact.flips
        totals = np.array([(self._reaction**2).sum(), noise**2, self.interrupt.received > 0, flips])
        self.comm.Allreduce(MPI.IN_PLACE, totals)
        self.flips = int(totals[3])
        self._reaction_norm, contact_noise = np.sqrt(totals[:2])
        self._noise = self._bulk_noise() + contact_noise
        if totals[2]:
            raise Interrupted(self.comm.allreduce(self.interrupt.received, op=MPI.MAX))

    def _set_displacement(self, x: PETSc.Vec) -> None:
        self.u.x.array[: 2 * self.n_owned] = x.array_r[: 2 * self.n_owned]
        self.u.x.scatter_forward()
        if self._border is not None:
            self.level = self._border.level(x)
            self.u.x.array[self._fixed.ravel()] = self.level * self._rate[self._fixed]

    def reaction(self, name: str) -> Array:
        """Force ``(2,)`` of the support ``name`` on the joint at the last evaluation, over all ranks."""
        total = np.zeros(2)
        for s in self.supports:
            if s.name == name:
                total[s.axis] += self._reaction[s.dofs[s.dofs < self.n_owned], s.axis].sum()
        return self.comm.allreduce(total)

    def force_on_level(self) -> float:
        """Force that works on the level: those of supports and rigid pin along their rates, over all ranks."""
        total = self.comm.allreduce(float((self._reaction * self._rate[: self.n_owned]).sum()))
        if self.rigid_rate is not None and self.contact is not None:
            total += float(self.rigid_rate @ self.contact.resultant())
        return total

    # ------------------------------------------------------------------ solve

    def _make_snes(self) -> PETSc.SNES:
        snes = PETSc.SNES().create(self.comm)
        snes.setOptionsPrefix("archord_")
        snes.setType("newtonls")
        self._x = create_vector(self.V.dofmap.index_map, 2) if self._border is None else self._border.vector()
        snes.setFunction(self._guarded(self._residual), self._x.duplicate())
        snes.setJacobian(self._guarded(self._jacobian), self._A if self._border is None else self._border.matrix)
        snes.setTolerances(max_it=self.max_iterations)
        snes.setConvergenceTest(self._test)
        ksp = snes.getKSP()
        if self._border is None:
            direct_solver(ksp, self._A)
        else:
            ksp.setType("preonly")
            ksp.setOperators(self._border.matrix)
            ksp.getPC().setType("python")
            ksp.getPC().setPythonContext(self._border)
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
        """Round-off of the bulk's residual: forces that a rigid motion of the size of the displacement leaves."""
        largest = self.comm.allreduce(np.abs(self.u.x.array).max(initial=0.0), op=MPI.MAX)
        return 1e-13 * self._stiffest * min(largest, self.travel)

    def _test(self, snes, iteration, norms):
        norm = norms[2]
        reaction = max(self._reaction_norm, self.largest_reaction)
        scale = max(reaction, self._noise / self.tolerance)
        self._flips.append(self.flips)
        self._residuals.append(float(norm / reaction if reaction > 0 else norm))
        if self._border is not None and self._border.came_free:
            return PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE
        if not np.isfinite(norm):
            return PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN
        if norm <= self.tolerance * scale:
            return PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE
        if self._stagnates():
            self._failure = "the residual does not fall any further"
            return PETSc.SNES.ConvergedReason.DIVERGED_DTOL
        if iteration >= self.max_iterations:
            return PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT
        return PETSc.SNES.ConvergedReason.ITERATING

    def _stagnates(self) -> bool:
        patience = _PATIENCE if any(self._flips[-_CIRCLING:]) else _CIRCLING
        recent, before = self._residuals[-patience:], self._residuals[:-patience]
        return bool(before) and min(recent) > 0.5 * min(before)

    def solve(self, load: float, guess: Array, *, elastic_first: bool = False) -> Newton:
        """Solve at ``load`` as `solve_at_once`; where a large gamma makes that fail, raise gamma to it by and by.

        The limit hardly depends on gamma, but points open and close for many iterations where it is large.
        """
        contact, result = self.contact, None
        wanted = 0.0 if contact is None else contact.gamma_factor
        if contact is None or wanted <= _STIFF_CONTACT:
            return self.solve_at_once(load, guess, elastic_first=elastic_first)
        if not self._by_and_by:
            result = self.solve_at_once(load, guess, elastic_first=elastic_first)
            if result.converged:
                return result
        stages = math.ceil(math.log(wanted / GAMMA_FACTOR, _GAMMA_RATIO))
        for factor in np.geomspace(GAMMA_FACTOR, wanted, stages + 1):
            contact.use_gamma_factor(float(factor))
            result = self.solve_at_once(load, guess, elastic_first=elastic_first).after(result)
            guess, elastic_first = self.state(), False
            if not result.converged:
                break
        contact.use_gamma_factor(wanted)
        assert result is not None
        self._by_and_by |= result.converged
        return result

    def solve_at_once(self, load: float, guess: Array, *, elastic_first: bool = False) -> Newton:
        """Solve at ``load`` from ``guess``, shaped like `state`, whose prescribed values are replaced.

        ``elastic_first`` finds the equilibrium of points that cannot yield (further) before the one asked for; if that
        fails, the solve starts from the guess.
        """
        self.load = load
        points = self._plastic_points()
        yielding = self.comm.allreduce(len(points)) > 0
        if not yielding:
            return self._run_either_way(guess)
        before = None
        if elastic_first:
            for p in points:
                p.elastic_only = True
            before = self._run_either_way(guess)
            for p in points:
                p.elastic_only = False
            if before.converged:
                guess = self.state()
        return self._run_either_way(guess).after(before)

    def _run_either_way(self, guess: Array) -> Newton:
        """The problem is nearly linear by pieces, where it is smooth, and full steps find the right ones where the line
        search, which wants a smaller residual in every step, creeps: large gamma, nearly incompressible bodies."""
        result = self._run(guess)
        if result.converged or (self._border is not None and self._border.came_free):
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
        """Newton's method from ``guess``.

        Where it circles though no point opens or closes, points jump between two facets that meet at an angle; they
        stay on theirs then, each facet continued beyond its ends.
        """
        result = self._newton(guess)
        contact = self.contact
        circles = len(result.flips) > _CIRCLING and not any(result.flips[-_CIRCLING:])
        if result.converged or contact is None or contact.kinematics != "current" or not circles:
            return result
        x = guess.copy()
        x[: 2 * self.n_owned] = self._x.array_r[: 2 * self.n_owned]
        self.u.x.array[:] = x[:-1]
        self.u.x.scatter_forward()
        x[:-1], x[-1] = self.u.x.array, self.level
        contact.hold()
        return replace(self._newton(x, search=False).after(result), held=True)

    def _newton(self, guess: Array, *, search: bool = True) -> Newton:
        self._residuals: list[float] = []
        self._flips: list[int] = []
        self._failure = ""
        self.level = self.load if self._border is None else float(guess[-1])
        if self._border is not None:
            self._border.came_free = False
        x = guess[:-1].reshape(-1, 2).copy()
        x[self._fixed] = self.level * self._rate[self._fixed]
        if self._border is None:
            self._x.array[:] = x[: self.n_owned].ravel()
        else:
            self._border.join(self._x, x[: self.n_owned].ravel(), self.level)
        if self.contact is not None and search:
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
            return Newton(True, "converged", iterations, self._residuals, None, self._flips)
        reason = self._failure or _REASONS.get(code, f"SNES reason {code}")
        if self._border is not None and self._border.came_free:
            pressed = self.load > 0 and self.contact is not None and self.contact.n_active() > 0
            reason = (
                "the joint has no stiffness left" if pressed else "nothing resists the force, the pin has come free"
            )
        increment = max((p.increment() for p in self._plastic_points()), default=0.0)
        increment = self.comm.allreduce(increment, op=MPI.MAX)
        return Newton(False, reason, iterations, self._residuals, self._worst_place(), self._flips, increment)

    def _plastic_points(self) -> list[PlasticPoints]:
        return self.bulk.plastic_points() + (self.contact.plastic_points() if self.contact is not None else [])

    def _worst_place(self) -> tuple[float, float] | None:
        """Where the residual is largest, over all ranks."""
        size = np.linalg.norm(self.residual()[: self.n_owned], axis=1)
        at = int(np.argmax(size)) if len(size) else 0
        x = self.V.tabulate_dof_coordinates()[at, :2] if len(size) else np.zeros(2)
        found = [(s, p) for s, p in self.comm.allgather((size[at] if len(size) else -1.0, tuple(x))) if np.isfinite(s)]
        return max(found)[1] if found else None

    def residual(self) -> Array:
        """Residual forces ``(n_local, 2)`` at the last evaluation, zero at prescribed displacements and ghosts."""
        owned = np.where(self._free_owned, self._force.array_r, 0.0).reshape(-1, 2)
        return np.pad(owned, ((0, self.n_local - self.n_owned), (0, 0)))

    def displacement(self) -> Array:
        """A copy of the nodal displacements ``(n_local, 2)``."""
        return self.u.x.array.reshape(-1, 2).copy()

    def state(self) -> Array:
        """All that is solved for: nodal displacements ``(2 n_local,)`` of this rank and, behind them, the level."""
        return np.append(self.u.x.array, self.level)

    def restore(self, load: float, state: Array) -> None:
        """Go back to an accepted state; the history was never touched."""
        self.load, self.level = load, float(state[-1])
        self.u.x.array[:] = state[:-1]

    def resume(self, load: float, state: Array, largest_reaction: float) -> None:
        """Take up an accepted state of an earlier process, whose history the points have already, and evaluate it."""
        self.restore(load, state)
        self.largest_reaction = largest_reaction
        if self.contact is not None:
            self.contact.search()
        self.evaluate()
        self._follow_pattern()

    def commit(self) -> None:
        """Accept the last solve: bulk and contact keep their trial history."""
        self.largest_reaction = max(self.largest_reaction, self._reaction_norm)
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
