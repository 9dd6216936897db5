"""The product of a block matrix in space, without its zeros, is PETSc's, whatever has changed."""

import numpy as np
import pytest
from petsc4py import PETSc

from archord.kernels.blocks import blocks_of, without_zeros
from archord.solver.linear.block_product import BlockProduct
from tests.solver.linear.test_multigrid import elastic_cube


def products(A, B):
    """``A x`` and ``B x`` of this rank."""
    x, by_A = A.createVecs()
    by_B = by_A.duplicate()
    x.array[:] = np.sin(np.arange(*x.getOwnershipRange()))
    A.mult(x, by_A)
    B.mult(x, by_B)
    return by_A.array_r, by_B.array_r


@pytest.mark.mpi
def test_the_product_is_that_of_the_matrix_after_its_values_have_changed():
    _V, _, A = elastic_cube(4, skew=0.1)  # A refers to what V holds
    B = BlockProduct(A).matrix()
    by_A, by_B = products(A, B)
    np.testing.assert_allclose(by_B, by_A, rtol=0, atol=1e-14 * abs(by_A).max())

    first = A.getOwnershipRange()[0] // 3
    A.setValuesBlocked([first], [first], np.eye(3), PETSc.InsertMode.ADD)
    A.assemble()
    changed, by_B = products(A, B)
    assert not np.array_equal(changed, by_A)
    np.testing.assert_allclose(by_B, changed, rtol=0, atol=1e-14 * abs(by_A).max())


@pytest.mark.mpi
def test_blocks_that_become_filled_count_and_zeros_do_not():
    _V, _, A = elastic_cube(3)
    B = BlockProduct(A).matrix()
    own, others, _ = blocks_of(A)
    values = [part.values.copy() for part in (own, others)]
    for part in (own, others):
        part.values[:] = 0.0
    A.stateIncrease()
    _, nothing = products(A, B)
    assert not nothing.any()
    for part, value in zip((own, others), values, strict=True):
        part.values[:] = value
    A.stateIncrease()
    by_A, by_B = products(A, B)
    np.testing.assert_allclose(by_B, by_A, rtol=0, atol=1e-14 * abs(by_A).max())


@pytest.mark.mpi
def test_a_matrix_without_zeros_multiplies_in_the_same_way_with_fewer_entries():
    _V, _, A = elastic_cube(4, skew=0.1)
    filled = 0
    for part in blocks_of(A)[:2]:
        blocks = part.values.reshape(-1, 9)
        blocks[::3] = 0.0
        filled += blocks.any(axis=1).sum()
    A.stateIncrease()
    B = without_zeros(A)
    by_A, by_B = products(A, B)
    np.testing.assert_allclose(by_B, by_A, rtol=0, atol=1e-14 * abs(by_A).max())
    used = B.getInfo(PETSc.Mat.InfoType.GLOBAL_SUM)["nz_used"]
    assert used == 9 * A.comm.tompi4py().allreduce(filled)
