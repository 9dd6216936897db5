"""The strategy that always goes: one sparse factorisation of the whole matrix, by MUMPS."""

from __future__ import annotations

from petsc4py import PETSc

from archord.solver.linear.strategy import Strategy

_WORKSPACE = 14  # number of MUMPS's setting
_SPARE = 60  # per cent of it
_SCALING = 8
_BY_DIAGONAL = 1  # MUMPS's own choice takes a seventh of a factorisation


class Direct(Strategy):
    """One sparse factorisation of the whole ``matrix``, by MUMPS, of the ``kind`` "lu" or
    "cholesky". Collective."""

    def __init__(self, matrix: PETSc.Mat, kind: str = "lu") -> None:
        self.matrix = matrix
        self._kind = kind

    def attach(self, ksp: PETSc.KSP) -> None:
        """Let ``ksp`` factorise the matrix."""
        ksp.setType("preonly")
        ksp.setOperators(self.matrix)
        pc = ksp.getPC()
        pc.setType(self._kind)
        pc.setFactorSolverType("mumps")
        pc.setFactorSetUpSolverType()
        factors = pc.getFactorMatrix()
        factors.setMumpsIcntl(_WORKSPACE, _SPARE)
        factors.setMumpsIcntl(_SCALING, _BY_DIAGONAL)
