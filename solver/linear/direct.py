"""The strategy that always goes: one sparse factorisation of the whole matrix, by MUMPS."""

from __future__ import annotations

from petsc4py import PETSc

_SPARE = 60  # per cent of MUMPS's workspace


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
