"""What a linear strategy is, and what its choice depends on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from weakref import ref

from mpi4py import MPI
from petsc4py import PETSc


@dataclass(frozen=True)
class Facts:
    """What the choice of strategies for a problem depends on.

    comm : its ranks
    dofs : degrees of freedom on all ranks
    dimension : components of a displacement
    yields : whether bodies can yield
    friction : whether surfaces have friction
    finite : whether strains are large
    by_force : whether levels of drives are unknown
    gamma_factor : the largest of its unilateral interactions; None without one or with others
    held : tells whether supports alone keep every body from moving rigidly; collective
    """

    comm: MPI.Comm
    dofs: int
    dimension: int
    yields: bool
    friction: bool
    finite: bool
    by_force: bool
    gamma_factor: float | None
    held: Callable[[], bool]


class Strategy:
    """A way to solve with a ``matrix``, as PETSc's linear solver ``ksp`` is told by `attach`:
    unless a strategy says otherwise it is the Python context of a preconditioner, which solves
    exactly. Beside it a function ``why_not(facts)`` returns a reason not to use it, or None.
    Collective."""

    matrix: PETSc.Mat
    product: PETSc.Mat | None = None  # multiplies as the matrix does, where another is quicker

    def operators(self) -> tuple[PETSc.Mat, PETSc.Mat]:
        """What multiplies in iterations, and the matrix."""
        return self.product or self.matrix, self.matrix

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp`` solve so."""
        ksp.setType("preonly")
        ksp.setOperators(*self.operators())
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(self)


def krylov_iterations(ksp: PETSc.KSP) -> int:
    """Iterations of the last solve by ``ksp``; 0 if that only preconditions."""
    return 0 if ksp.getType() == PETSc.KSP.Type.PREONLY else ksp.getIterationNumber()


class Product:
    """Python context of the matrix that a ``strategy`` with a method `mult` makes. It does not keep
    the strategy alive, which holds the matrix: what PETSc refers to Python cannot collect."""

    def __init__(self, strategy: Any) -> None:
        self._strategy = ref(strategy)

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = matrix x``, called by PETSc."""
        strategy = self._strategy()
        assert strategy is not None  # it holds the matrix
        strategy.mult(matrix, x, y)


class Sum:
    """Python context of the matrix ``A`` and a ``change`` of it. Collective."""

    def __init__(self, A: PETSc.Mat, change: PETSc.Mat) -> None:
        self.A = A
        self.change = change

    def matrix(self) -> PETSc.Mat:
        """The matrix."""
        found = PETSc.Mat().createPython(self.A.getSizes(), context=self, comm=self.A.comm)
        found.setUp()
        return found

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = (A + change) x``, called by PETSc."""
        self.A.mult(x, y)
        self.change.multAdd(x, y, y)
