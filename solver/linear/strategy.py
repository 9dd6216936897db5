"""What a linear strategy is, what its choice depends on, and the one that always goes: MUMPS on the whole matrix."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from mpi4py import MPI
from petsc4py import PETSc

_SPARE = 60  # per cent of MUMPS's workspace


@dataclass(frozen=True)
class Facts:
    """Of a problem: its ``dofs`` on all ranks of ``comm``; whether bodies ``yields``; whether it is controlled
    ``by_force``; ``gamma_factor``, the largest of its frictionless interactions, None without one or with others; and
    ``held()``, whether supports alone keep every body from moving rigidly (collective)."""

    comm: MPI.Comm
    dofs: int
    yields: bool
    by_force: bool
    gamma_factor: float | None
    held: Callable[[], bool]


class Strategy(Protocol):
    """A way to solve with a matrix, as PETSc's linear solver ``ksp`` is told by `attach`; beside it a function
    ``why_not(facts)`` returns a reason not to use it, or None. Collective."""

    matrix: PETSc.Mat

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp`` solve so."""


class Inverse:
    """A strategy that is the Python context of a preconditioner, which solves with the ``matrix`` exactly."""

    matrix: PETSc.Mat

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp`` solve so."""
        ksp.setType("preonly")
        ksp.setOperators(self.matrix)
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(self)


class Direct:
    """One sparse factorisation of the whole ``matrix``, by MUMPS. Collective."""

    def __init__(self, matrix: PETSc.Mat) -> None:
        self.matrix = matrix

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp`` factorise the matrix."""
        ksp.setType("preonly")
        ksp.setOperators(self.matrix)
        pc = ksp.getPC()
        pc.setType("lu")
        pc.setFactorSolverType("mumps")
        pc.setFactorSetUpSolverType()
        factors = pc.getFactorMatrix()
        factors.setMumpsIcntl(14, _SPARE)
        factors.setMumpsIcntl(8, 1)  # scale by the diagonal: MUMPS's own choice takes a seventh of a factorisation
