"""What a load on the path prescribes: the load factor itself, or the force that works on it.

Under force control the load factor is one more unknown, with the equation that the force on it is the load's.
"""

from __future__ import annotations

from collections.abc import Callable

from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.fenicsx import create_vector
from archord.solver.linear.bordered import Bordered
from archord.solver.linear.facts import Strategy
from archord.solver.tangent import TangentMatrix


class FactorControl:
    """The load is the load factor (displacement control, dead loads): no unknown is added.

    ``border`` is the linear system with the unknowns that a control adds.
    """

    border: Bordered | None = None

    def __init__(self, V: fem.FunctionSpace) -> None:
        self.V, self._n = V, 2 * V.dofmap.index_map.size_local

    def vector(self) -> PETSc.Vec:
        """A vector of all unknowns of this rank."""
        return create_vector(self.V.dofmap.index_map, 2)

    def start(self, load: float, guess: float) -> float:
        """The load factor with which a solve at ``load`` starts that was to start with ``guess``."""
        return load

    def factor(self, load: float, x: PETSc.Vec) -> float:
        """The load factor at ``load`` with the unknowns ``x``, on every rank."""
        return load

    def join(self, x: PETSc.Vec, u: Array, factor: float) -> None:
        """Put displacements (or forces) ``u`` ``(n_owned dofs,)`` and the load factor (or what is missing to the force
        on it) into ``x``."""
        x.array[: self._n] = u

    def follow(self, tangent: TangentMatrix) -> None:
        """Take note that ``tangent`` has another matrix."""

    def update(self, tangent: TangentMatrix, *, factorise: bool) -> None:
        """Assemble what the control adds to the ``tangent``, just updated, to be factorised or not. Collective."""

    @property
    def singular(self) -> bool:
        """Whether the last linear solve found that nothing resists the force."""
        return self.border is not None and self.border.singular


class ForceControl(FactorControl):
    """The load is the force that works on the load factor, along the ``rate`` ``(n_local, 2)`` of prescribed
    displacements and those of rigid discs. ``stiffness`` is that of the stiffest body,
    ``factoriser`` gives the strategy for a matrix."""

    def __init__(
        self,
        V: fem.FunctionSpace,
        tangent: TangentMatrix,
        rate: Array,
        stiffness: float,
        factoriser: Callable[[PETSc.Mat], Strategy],
    ) -> None:
        super().__init__(V)
        self.border: Bordered = Bordered(tangent.A, stiffness, factoriser)
        self._direction = fem.Function(V)
        self._direction.x.array[:] = rate.ravel()

    def vector(self) -> PETSc.Vec:
        """A vector of displacements and, on rank 0, the load factor."""
        return self.border.vector()

    def start(self, load: float, guess: float) -> float:
        """The guess itself."""
        self.border.singular = False
        return guess

    def factor(self, load: float, x: PETSc.Vec) -> float:
        """The load factor in ``x``, on every rank."""
        return self.border.factor(x)

    def join(self, x: PETSc.Vec, u: Array, factor: float) -> None:
        """Put both into ``x``."""
        self.border.join(x, u, factor)

    def follow(self, tangent: TangentMatrix) -> None:
        """Border the new matrix."""
        self.border.replace(tangent.A)

    def update(self, tangent: TangentMatrix, *, factorise: bool) -> None:
        """Assemble the derivatives with respect to the load factor, and those of the force on it. Collective."""
        with tangent.timer("assemble border"):
            tangent.update_border(self.border, self._direction, factorise=factorise)
