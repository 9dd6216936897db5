"""What a load on the path prescribes: the load factor itself, or the force that works on it.

Under force control the load factor is one more unknown, with the equation that the force on it is the load's.
"""

from __future__ import annotations

from collections.abc import Callable

from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.meshes.fenicsx import create_vector
from archord.solver.linear.bordered import Bordered
from archord.solver.linear.strategy import Strategy
from archord.solver.tangent import TangentMatrix


class FactorControl:
    """The load is the load factor (displacement control, dead loads): no unknown is added.

    ``border`` is the linear system with the unknowns that a control adds; ``singular`` tells whether the last one
    solved found that nothing resists the force.
    """

    border: Bordered | None = None
    singular = False

    def __init__(self, V: fem.FunctionSpace) -> None:
        self._index_map, self._load = V.dofmap.index_map, 0.0

    def vector(self) -> PETSc.Vec:
        """A vector of all unknowns of this rank."""
        return create_vector(self._index_map, 2)

    def start(self, load: float, guess: float) -> float:
        """The load factor with which a solve at ``load`` starts that was to start with ``guess``."""
        self._load = load
        return load

    def factor(self, x: PETSc.Vec) -> float:
        """The load factor with the unknowns ``x``, on every rank."""
        return self._load

    def join(self, x: PETSc.Vec, u: Array, factor: float) -> None:
        """Put displacements (or forces) ``u`` and the load factor (or what the force on it lacks) into ``x``."""
        x.array[:] = u

    def replace(self, A: PETSc.Mat) -> None:
        """Take note that the tangent of all displacements is another matrix, or has to be factorised once more."""

    def follow(self, tangent: TangentMatrix, *, factorise: bool) -> None:
        """Assemble what the control adds to the ``tangent``, just updated, to be factorised or not. Collective."""


class ForceControl(Bordered):
    """The load is the force that works on the load factor, along the ``rate`` of prescribed displacements, and those of
    rigid discs. ``stiffness`` is that of the stiffest body, ``factoriser`` gives the strategy for a matrix."""

    def __init__(
        self, tangent: TangentMatrix, rate: fem.Function, stiffness: float, factoriser: Callable[[PETSc.Mat], Strategy]
    ) -> None:
        super().__init__(tangent.A, stiffness, factoriser)
        self.border, self._rate = self, rate

    def start(self, load: float, guess: float) -> float:
        """The guess itself."""
        return guess

    def follow(self, tangent: TangentMatrix, *, factorise: bool) -> None:
        """Assemble the derivatives with respect to the load factor, and those of the force on it. Collective."""
        with tangent.timer("assemble border"):
            self.update(*tangent.border(self._rate), factorise=factorise)
