"""A tangent with the contact beside the matrix of the bulk is the one with the contact in it."""

import numpy as np
import pytest
from petsc4py import PETSc

from archord.benchmarks.space.joints import CASES
from archord.kernels.blocks import add_blocks, blocks_of
from archord.solver.equilibrium.tangent import TangentMatrix
from archord.solver.linear import choose, multigrid
from archord.solver.linear.block_product import BlockProduct
from archord.solver.linear.multigrid import Multigrid
from archord.solver.path.stepping import march
from archord.solver.path.system import System
from tests.solver.linear.test_block_product import products
from tests.solver.linear.test_multigrid import elastic_cube, error


def split(A, share):
    """``A`` as a sum: a ``share`` of its blocks off the diagonal, drawn by chance, and the rest,
    whose matrix has no room for these."""
    rng = np.random.default_rng(3)
    first = A.getOwnershipRange()[0] // 3
    own, others, ghosts = blocks_of(A)
    nodes = first + np.arange(len(own.offsets) - 1)
    terms = []
    for _ in range(2):
        term = PETSc.Mat().create(A.comm)
        term.setSizes(A.getSizes(), bsize=3)
        term.setType("baij")
        term.setUp()
        terms.append(term)
    for part, numbers in ((own, nodes), (others, ghosts)):
        rows = np.repeat(nodes, np.diff(part.offsets))
        columns = numbers[part.columns]
        values = part.values.reshape(-1, 3, 3).transpose(0, 2, 1)
        is_beside = (rng.random(len(rows)) < share) & (rows != columns)
        for term, chosen in zip(terms, (~is_beside, is_beside), strict=True):
            add_blocks(term, rows[chosen], columns[chosen], values[chosen])
    for term in terms:
        term.assemble()
    return terms


@pytest.mark.mpi
def test_a_sum_multiplies_and_is_solved_as_the_matrix():
    """In as many iterations; and so is another sum, with another pattern, in its place."""
    V, fixed, A = elastic_cube(4, skew=0.5)
    counts = []
    ksp = PETSc.KSP().create(A.comm)
    terms = [A]
    strategy = Multigrid(terms, V, fixed)
    product = BlockProduct(A)
    strategy.product = product.matrix()
    strategy.attach(ksp)
    ksp.setTolerances(rtol=1e-10)
    for share in (0.0, 0.1, 0.3):
        if share:
            terms = split(A, share)
            strategy.renew(terms)
            product.replace(*terms)
            A.stateIncrease()
        by_A, by_sum = products(A, strategy.product)
        np.testing.assert_allclose(by_sum, by_A, rtol=0, atol=1e-14 * abs(by_A).max())
        assert error(ksp, A) < 1e-7
        counts.append(ksp.getIterationNumber())
    assert counts == [counts[0]] * 3


@pytest.mark.parametrize("name", ["elastic", "A"])
def test_a_joint_is_solved_as_with_a_factorised_matrix(name, monkeypatch):
    """While its contact grows out of its matrix."""
    case = CASES[name]
    renewals = []
    renew = TangentMatrix.renew

    def noted(tangent):
        renewals.append(tangent.of_contact is not None)
        renew(tangent)

    def solved():
        system = System(case.problem(4.0))
        march(system.load_path(), [1 / case.steps, 2 / case.steps])
        return system

    monkeypatch.setattr(choose, "LEFT_OUT", {"multigrid"})
    usual = solved()
    monkeypatch.setattr(choose, "LEFT_OUT", set())
    monkeypatch.setattr(multigrid, "FEWEST_DOFS", 0)
    monkeypatch.setattr(TangentMatrix, "renew", noted)
    beside = solved()
    assert any(renewals)
    force = case.references[0].computed
    assert force(beside) == pytest.approx(force(usual), rel=1e-8)
