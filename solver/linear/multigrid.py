"""GMRES preconditioned by multigrid, for problems in space, whose factors fill up.

The first level below the displacements are the linear displacements on the same mesh (p-multigrid).
Its matrix is the Galerkin product ``P^T A P`` with the interpolation ``P``. Aggregates of its nodes
make the levels below, with the rigid motions as near null space (smoothed aggregation; Vanek,
Mandel and Brezina 1996). Sweeps of Gauss-Seidel smooth both kinds of displacements, Chebyshev
polynomials the levels below, so that the number of iterations grows slowly with the mesh, and
hardly with the ranks. Neither reads the room for contact where it is empty.

Prescribed displacements are rows and columns of the unit matrix. The interpolation leaves them out,
but for the linear displacement at the same node. So the product has unit rows there, too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from locale import localeconv
from typing import Any

import basix.ufl
import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array, lagrange_element
from archord.kernels.blocks import without_zeros
from archord.materials.kinematics import Bools, Ints, kinematics
from archord.solver.linear.block_product import COMPONENTS, quick_product
from archord.solver.linear.block_smoother import BlockSmoother, Sweeps
from archord.solver.linear.forcing import LOOSEST
from archord.solver.linear.galerkin import Galerkin
from archord.solver.linear.strategy import Facts, Strategy

FEWEST_DOFS = 5_000  # below, a factorisation is quicker
LEAST_DIMENSION = 3  # factors of plane problems hardly fill up
_RESTART = 50  # vectors that GMRES keeps
_MOST_ITERATIONS = 200  # after which Newton's method tries what has been found
_SMOOTHING = 3  # degree of the polynomials
_SWEEPS = 6  # there and back, of the linear displacements
_GROWN = 2.0  # entry of the diagonal over what it was, above which levels below may mislead
_SOFTENED = 0.05  # part of the diagonal that may have shrunk as much
_FEWEST_COARSE = 100  # equations that are factorised on the last level
_WEAK = 0.05  # of the diagonal: couplings that aggregates do not follow
_ROUND_OFF = 1e-12
_COARSE = "archord_coarse_"
_Reason = PETSc.KSP.ConvergedReason


def why_not(facts: Facts) -> str | None:
    """Why the systems are factorised."""
    if facts.dimension < LEAST_DIMENSION:
        return "the problem is not in space, where factors fill up"
    if facts.dofs < FEWEST_DOFS:
        return f"fewer than {FEWEST_DOFS} dofs"
    return None


def takes_a_sum(V: fem.FunctionSpace) -> bool:
    """Whether `Multigrid` takes more than one term: in space, unless displacements are linear,
    whose only level is the matrix itself."""
    return V.dofmap.bs == COMPONENTS and V.element.basix_element.degree > 1


class _Test:
    """PETSc's test of iterations: they are done when the residual is small, where ``ends`` says so,
    or after many, as a line search can use what they have found."""

    def __init__(self, ends: Callable[[], bool]) -> None:
        self._ends = ends
        self._right_side = 0.0

    def __call__(self, ksp: PETSc.KSP, iteration: int, norm: float) -> PETSc.KSP.ConvergedReason:
        if iteration == 0:
            self._right_side = ksp.getRhs().norm()
        if not np.isfinite(norm):
            return _Reason.DIVERGED_NANORINF
        if norm <= ksp.getTolerances()[0] * self._right_side:
            return _Reason.CONVERGED_RTOL
        if iteration >= _MOST_ITERATIONS or (iteration > 0 and self._ends()):
            return _Reason.CONVERGED_ITS
        return _Reason.ITERATING


def iterate(ksp: PETSc.KSP, ends: Callable[[], bool] = lambda: False) -> None:
    """Let ``ksp`` iterate with its preconditioner, loosely until it is told otherwise, and after
    the first iteration only until ``ends`` says so."""
    ksp.setType("fgmres")  # as the smoother rounds to single precision
    ksp.setGMRESRestart(_RESTART)
    ksp.setTolerances(rtol=LOOSEST)
    ksp.setConvergenceTest(_Test(ends))


class Multigrid(Strategy):
    """Python context of the preconditioner of a sum of ``terms``, matrices of the displacements
    ``V``, of which those that are ``fixed`` ``(n_local, d)`` have rows of the unit matrix.
    Collective.

    interpolation : matrix that takes linear displacements to the own ones; None where those are
        linear
    linear : matrix of the linear displacements
    entries : those of it that were not zero when the levels below were made
    """

    def __init__(self, terms: Sequence[PETSc.Mat], V: fem.FunctionSpace, fixed: Bools) -> None:
        A = terms[0]
        self.matrix = A
        self._terms = terms
        self.interpolation: PETSc.Mat | None = None
        self.linear = A
        self.entries = A
        if V.element.basix_element.degree > 1:
            V_linear, fixed_linear = _linear(V, fixed)
            self.interpolation = _interpolation(V, V_linear, fixed, fixed_linear)
            V = V_linear
            fixed = fixed_linear
        self._motions = _free_rigid_motions(V, fixed)
        self._product: Galerkin | None = None
        self._diagonal: Array = np.zeros(1)  # of `linear` when the levels below were made
        self._below = PETSc.PC().create(A.comm)
        self._smoother = BlockSmoother(*terms)
        self._is_ready = False

    def renew(self, terms: Sequence[PETSc.Mat]) -> None:
        """Solve with ``terms`` of other patterns from the next update on, in space."""
        self._terms = terms
        self._smoother = BlockSmoother(*terms)
        self._product = None

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp`` iterate."""
        super().attach(ksp)
        iterate(ksp)

    def setUp(self, pc: PETSc.PC) -> None:
        """Make the levels of the matrix as it is now, called by PETSc."""
        if self.interpolation is not None:
            self._update(self.interpolation)
        if not self._is_ready:
            self._sweeps = Sweeps(self.linear, _SWEEPS)
            self._product_of_linear = quick_product(self.linear)
            self._right, self._found = self.linear.createVecs()
            self._is_ready = True
        self._sweeps.update()
        self._set_up_below()

    def _set_up_below(self) -> None:
        """Make the levels below the linear displacements, unless those that are there will do: that
        takes more time than the iterations which it saves."""
        diagonal = self.linear.getDiagonal().array
        grown = (diagonal > _GROWN * self._diagonal).sum()
        softened = (_GROWN * diagonal < self._diagonal).sum()
        comm = self.matrix.comm.tompi4py()
        n_grown, n_softened = comm.allreduce(np.array([grown, softened]))
        if n_grown == 0 and n_softened <= _SOFTENED * self.linear.getSize()[0]:
            return
        self._diagonal = diagonal
        self._below.destroy()
        self.entries = without_zeros(self.linear)
        self.entries.setNearNullSpace(_near_null_space(self.entries, self._motions))
        self._below = _aggregates(self._product_of_linear, self.entries, self._sweeps)

    def level_sizes(self) -> list[int]:
        """Equations of the levels below the displacements, finest first, once they are made."""
        levels = range(self._below.getMGLevels())
        smoothers = [self._below.getMGSmoother(level) for level in levels]
        return [smoother.getOperators()[0].getSize()[0] for smoother in reversed(smoothers)]

    def _update(self, interpolation: PETSc.Mat) -> None:
        """Take the values of the matrix to the smoother and to the level below."""
        is_other = self._product is None
        if self._product is None:
            self._product = Galerkin(interpolation, self._terms)
            self.linear = self._product.matrix
            self._residual = interpolation.createVecLeft()
            self._correction = self._residual.duplicate()
        self._product.update()
        self._smoother.update()
        if is_other and self._is_ready:
            self._sweeps.replace(self.linear)
            self._product_of_linear.getPythonContext().replace(self.linear)

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, x: PETSc.Vec) -> None:
        """One cycle, called by PETSc."""
        if not self._is_ready:  # put in the place of another one
            self.setUp(pc)
        if self.interpolation is None:
            self._below.apply(r, x)
            return
        self._residual.array[:] = self._smoother.from_zero(r.array_r)
        self.interpolation.multTranspose(self._residual, self._right)
        self._below.apply(self._right, self._found)
        self.interpolation.mult(self._found, self._correction)
        x.array[:] = self._smoother.again(r.array_r, self._correction.array_r)


def _aggregates(A: PETSc.Mat, entries: PETSc.Mat, sweeps: Sweeps) -> PETSc.PC:
    """Multigrid by smoothed aggregation for ``A``, a matrix with these ``entries``, which
    ``sweeps`` smooth."""
    # an aggregate with fewer dofs than rigid motions leaves zeros on the diagonal: no blocks, and
    # no sweeps but on the finest level
    options = {
        "pc_type": "gamg",
        "pc_use_amat": True,
        "pc_gamg_threshold": _WEAK,
        "pc_gamg_coarse_eq_limit": _FEWEST_COARSE,
        "mg_levels_ksp_type": "chebyshev",
        "mg_levels_ksp_max_it": _SMOOTHING,
        "mg_levels_pc_type": "jacobi",
    }
    levels = PETSc.PC().create(A.comm)
    levels.setOperators(A, entries)
    _use_options(levels, _COARSE, options)
    levels.setUp()
    finest = levels.getMGLevels() - 1
    if finest > 0:
        smoother = levels.getMGSmoother(finest)
        smoother.setType("richardson")
        smoother.setTolerances(max_it=1)
        smoother.getPC().setType("python")
        smoother.getPC().setPythonContext(sweeps)
        smoother.setUp()
    return levels


def _use_options(solver: PETSc.PC, prefix: str, wanted: Mapping[str, Any]) -> None:
    options = PETSc.Options(prefix)
    point = localeconv()["decimal_point"]  # PETSc reads numbers as the program's locale has them
    for name, value in wanted.items():
        options[name] = str(value).replace(".", point) if isinstance(value, float) else value
    solver.setOptionsPrefix(prefix)
    solver.setFromOptions()


def _linear(V: fem.FunctionSpace, fixed: Bools) -> tuple[fem.FunctionSpace, np.ndarray]:
    """The linear displacements on the mesh of ``V``, and which of them are fixed ``(n_local,
    d)``."""
    d = V.dofmap.index_map_bs
    element = basix.ufl.element("P", V.mesh.basix_cell(), 1, shape=(d,))
    linear = fem.functionspace(V.mesh, element)
    at_vertex = _weights(V).argmax(axis=0)
    index_map = linear.dofmap.index_map
    found = np.zeros((index_map.size_local + index_map.num_ghosts, d), dtype=bool)
    found[linear.dofmap.list] = fixed[V.dofmap.list[:, at_vertex]]
    return linear, found


def _weights(V: fem.FunctionSpace) -> Array:
    """What each node of a cell has of the values at the vertices ``(a, v)``."""
    element = V.element.basix_element
    linear = lagrange_element(element.cell_type, 1)
    weights = linear.tabulate(0, element.points)[0, ..., 0]
    return np.where(np.abs(weights) > _ROUND_OFF, weights, 0.0)


def _interpolation(
    V: fem.FunctionSpace, linear: fem.FunctionSpace, fixed: Bools, fixed_linear: Bools
) -> PETSc.Mat:
    """The matrix of the values of ``linear`` displacements at the nodes of ``V``, without
    displacements that are fixed, but for themselves at the same node."""
    d = V.dofmap.index_map_bs
    n = V.dofmap.index_map.size_local
    cell, place = _a_cell_of_each_node(V)
    weight = _weights(V)[place]
    vertex = linear.dofmap.list[cell]
    is_same = weight > 1 - _ROUND_OFF
    either_fixed = fixed[:n, None] | fixed_linear[vertex]
    is_kept = (weight != 0)[..., None] & (is_same[..., None] | ~either_fixed)
    # entries in the order of the rows: nodes, then axes
    node, axis, k = np.nonzero(is_kept.transpose(0, 2, 1))
    global_vertex = linear.dofmap.index_map.local_to_global(vertex[node, k])
    offsets = np.searchsorted(d * node + axis, np.arange(d * n + 1)).astype(PETSc.IntType)
    columns = (d * global_vertex + axis).astype(PETSc.IntType)
    sizes = (d * n, None), (d * linear.dofmap.index_map.size_local, None)
    P = PETSc.Mat().createAIJ(sizes, csr=(offsets, columns, weight[node, k]), comm=V.mesh.comm)
    P.setBlockSizes(d, d)
    return P


def _a_cell_of_each_node(V: fem.FunctionSpace) -> tuple[Ints, Ints]:
    """A cell ``(n_owned,)`` on which each node of ``V`` lies, and its place among the nodes of that
    cell."""
    nodes, first = np.unique(V.dofmap.list, return_index=True)
    cell, place = np.divmod(first, V.dofmap.list.shape[1])
    n = V.dofmap.index_map.size_local
    assert np.array_equal(nodes[:n], np.arange(n))
    return cell[:n], place[:n]


def _free_rigid_motions(V: fem.FunctionSpace, fixed: Bools) -> Array:
    """The rigid motions ``(k, n_owned, d)`` of the nodes, zero where displacements are fixed."""
    d = V.dofmap.index_map_bs
    n = V.dofmap.index_map.size_local
    x = V.tabulate_dof_coordinates()[:n, :d]
    motions = kinematics("space" if d == 3 else "strain").rigid_motions(x)
    return np.where(fixed[:n], 0.0, motions)


def _near_null_space(A: PETSc.Mat, motions: Array) -> PETSc.NullSpace:
    """The ``motions`` ``(k, n_owned, d)`` as the near null space of ``A``."""
    basis: list[PETSc.Vec] = []
    for motion in motions:
        vector = A.createVecRight()
        vector.array[:] = motion.ravel()
        length = vector.norm()
        for other in basis:
            vector.axpy(-vector.dot(other), other)
        if vector.norm() > _ROUND_OFF * length:
            vector.normalize()
            basis.append(vector)
    return PETSc.NullSpace().create(vectors=basis, comm=A.comm)
