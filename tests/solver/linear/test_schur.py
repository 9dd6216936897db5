"""MUMPS's Schur complements, and its solves in two halves."""

import numpy as np
import pytest
from mpi4py import MPI

from archord.kernels.compiled import CompilerError, pointer
from archord.solver.linear.substructured import schur_kernels

try:
    schur_kernels()
except CompilerError as error:  # PyPI's dolfinx has no headers
    pytest.skip(f"MUMPS cannot be called from C here: {error}", allow_module_level=True)


def created(matrix, kept):
    rows, columns = (part.astype(np.int32) + 1 for part in np.nonzero(matrix))
    last = np.isin(np.arange(len(matrix)), kept)
    place = np.empty(len(matrix), dtype=np.int32)
    place[np.argsort(last, kind="stable")] = np.arange(1, len(matrix) + 1)
    arrays = rows, columns, kept.astype(np.int32) + 1, place, np.zeros(1, dtype=np.int32)
    at = [pointer(a) for a in arrays]
    made = schur_kernels().schur_create(
        MPI.COMM_SELF.py2f(), len(matrix), len(rows), *at[:2], len(kept), *at[2:]
    )
    assert arrays[-1][0] == 0
    return made, arrays


def test_complement_and_solution_are_those_of_the_dense_matrix():
    """Unsymmetric, factorised twice with other values, many unknowns kept and few."""
    rng = np.random.default_rng(2)
    kernels = schur_kernels()
    for kept in (np.array([3, 7, 11]), np.arange(0, 40, 2), np.array([39])):
        n = 40
        m = len(kept)
        others = np.setdiff1d(np.arange(n), kept)
        pattern = (rng.random((n, n)) < 0.2) | np.eye(n, dtype=bool)
        made, arrays = created(pattern, kept)
        for _ in range(2):
            A = np.where(pattern, rng.normal(size=(n, n)), 0.0) + 10 * np.eye(n)
            values = A[pattern]
            S = np.zeros((m, m))
            assert kernels.schur_factorise(made, pointer(values), pointer(S)) == 0
            inverse = np.linalg.inv(A[np.ix_(others, others)])
            expected = (
                A[np.ix_(kept, kept)] - A[np.ix_(kept, others)] @ inverse @ A[np.ix_(others, kept)]
            )
            assert pytest.approx(expected, abs=1e-12) == S
            b = rng.normal(size=n)
            reduced = np.zeros(m)
            x = np.linalg.solve(A, b)
            assert kernels.schur_condense(made, pointer(b), pointer(reduced)) == 0
            assert S @ x[kept] == pytest.approx(reduced, abs=1e-11)
            given = x[kept].copy()
            assert kernels.schur_expand(made, pointer(given), pointer(b)) == 0
            assert b[others] == pytest.approx(x[others], abs=1e-12)
        kernels.schur_destroy(made)
        del arrays
