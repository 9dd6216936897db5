"""Large elastic joints, and joints that yield: GMRES with a factorisation of an earlier matrix."""

import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

from archord.benchmarks.case import paper_joint
from archord.solver.linear import choose, lagged
from archord.solver.linear.bordered import Bordered
from archord.solver.linear.direct import Direct
from tests.solver.solving import small_scene, solve

FORCE = {"load": {"displacement": None, "relative_force": 0.012}}
RING = {"joint": {"model": "ring"}, "load": {"displacement": None, "relative_force": 0.05}}


@pytest.fixture
def small_is_large(monkeypatch):
    monkeypatch.setattr(choose, "LEFT_OUT", {"condensed"})
    monkeypatch.setattr(lagged, "_MANY_DOFS", 0)


@pytest.mark.mpi
@pytest.mark.parametrize(
    "kind", [{}, {"pin": {"rigid": True}}, FORCE, RING], ids=["moved", "rigid", "pressed", "ring"]
)
def test_the_state_is_that_of_direct_solves(kind, small_is_large, monkeypatch):
    """To the tolerance of the residual, with fewer factorisations than iterations; on two ranks as
    on one."""
    scene = small_scene(0.15, 2, **kind)
    iterative = solve(scene, MPI.COMM_WORLD)
    monkeypatch.setattr(lagged, "_MANY_DOFS", 10**9)
    direct = solve(scene)
    for a, b in zip(iterative.steps, direct.steps, strict=True):
        assert (a["P"], a["delta"], a["p0"], a["eps"]) == pytest.approx(
            (b["P"], b["delta"], b["p0"], b["eps"]), rel=1e-8
        )
    iterations = sum(m.iterations for m in iterative.steps)
    assert iterative.joint.equilibrium.linear.tangent.factorisations < 0.75 * iterations
    assert iterations <= 2 * sum(m.iterations for m in direct.steps)


def test_many_solves_bring_a_new_factorisation(small_is_large, monkeypatch):
    scene = small_scene(0.15, 2)
    usual = solve(scene)
    monkeypatch.setattr(lagged, "_MANY_SOLVES", 1)
    often = solve(scene)
    assert _factorisations(often) > _factorisations(usual)
    assert pytest.approx(usual.steps[-1]["P"], rel=1e-9) == often.steps[-1]["P"]


def _factorisations(solved):
    return solved.joint.equilibrium.linear.tangent.factorisations


@pytest.mark.mpi
@pytest.mark.parametrize(
    "kind",
    [{}, {"analysis": {"friction": 0.2}}, {"analysis": {"strain": "large"}}, FORCE],
    ids=["moved", "friction", "large strain", "pressed"],
)
def test_joints_that_yield_factorise_until_newtons_method_is_near(kind, monkeypatch):
    """In fewer factorisations than where every matrix is factorised, and to the same state."""
    scene = paper_joint(0.1, 5, 0.002, **kind)
    usual = solve(scene, MPI.COMM_WORLD)
    monkeypatch.setattr(choose, "LEFT_OUT", {"lagged"})
    every = solve(scene, MPI.COMM_WORLD)
    for name in ("P", "delta", "p0", "peeq_max"):
        assert usual.steps[-1][name] == pytest.approx(every.steps[-1][name], rel=1e-7)
    assert _factorisations(usual) < 0.9 * _factorisations(every)
    iterations = [sum(m.iterations for m in solved.steps) for solved in (usual, every)]
    assert iterations[0] <= 1.1 * iterations[1]


def test_a_border_kept_solves_with_the_last_one_that_was_factorised():
    """The preconditioner stays the inverse of the old bordered matrix, while the product is of the
    new one."""
    rng = np.random.default_rng(3)
    n = 6
    old, new = (rng.normal(size=(n, n)) + 5 * np.eye(n) for _ in range(2))
    m = 2
    borders = [
        (rng.normal(size=(n, m)), rng.normal(size=(n, m)), 3 * k * np.eye(m)) for k in (1, 2)
    ]
    A = PETSc.Mat().createAIJ((n, n), nnz=n, comm=MPI.COMM_SELF)

    def fill(values):
        for i, j in np.ndindex(n, n):
            A[i, j] = values[i, j]
        A.assemble()

    def whole(values, border):
        B, C, D = border
        return np.block([[values, B], [C.T, D]])

    fill(old)
    system = Bordered(A, m, 1.0, lambda: Direct(A))
    x, r = system.matrix.createVecs()
    r.array[:] = rng.normal(size=n + m)
    system.update(*borders[0])
    system.apply(None, r, x)
    assert whole(old, borders[0]) @ x.array_r == pytest.approx(r.array_r, abs=1e-12)
    fill(new)
    system.update(*borders[1], factorise=False)
    system.apply(None, r, x)
    assert whole(old, borders[0]) @ x.array_r == pytest.approx(r.array_r, abs=1e-12)
    system.last.mult(None, r, x)
    assert x.array_r == pytest.approx(whole(new, borders[1]) @ r.array_r, abs=1e-12)
    system.update(*borders[1])
    system.apply(None, r, x)
    assert whole(new, borders[1]) @ x.array_r == pytest.approx(r.array_r, abs=1e-12)
