"""One factorisation for all linear systems of an elastic joint."""

from weakref import ref

import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

from archord.benchmarks.case import paper_joint
from archord.solver.linear import choose, look_ahead
from archord.solver.linear.condensed import Condensed
from tests.solver.solving import joint_system, small_scene, solve


def stiffness(n, rng):
    """A sparse symmetric positive definite matrix, dense and as PETSc's."""
    dense = np.diag(rng.uniform(5, 6, n)) - np.diag(np.ones(n - 2), 2) - np.diag(np.ones(n - 2), -2)
    A = PETSc.Mat().createAIJ((n, n), nnz=5, comm=MPI.COMM_SELF)
    for i, j in np.argwhere(dense):
        A[i, j] = dense[i, j]
    A.assemble()
    return dense, A


def as_it_is(increment):
    """No point opens or closes."""
    return None


def test_solves_are_those_with_the_whole_matrix():
    """Rows that come, go and come again, in any order: product and solution as of the dense
    matrix."""
    rng = np.random.default_rng(5)
    nodes = 20
    dense, A = stiffness(2 * nodes, rng)
    condensed = Condensed(A, np.array([3, 4, 9, 17]), 2, as_it_is)
    r, x = A.createVecs()
    for places in ([], [(3, 4), (3, 5), (9, 9)], [(9, 2), (17, 0)], [(3, 3), (4, 3), (17, 17)]):
        blocks = rng.normal(size=(len(places), 2, 2))
        whole = dense.copy()
        for (i, j), block in zip(places, blocks, strict=True):
            whole[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] += block
        rows, columns = np.array(places, dtype=np.int64).reshape(-1, 2).T
        condensed.occupy(rows, columns)
        condensed.update(rng.normal(size=blocks.shape))
        condensed.update(np.where(rng.random(len(blocks))[:, None, None] < 0.5, 0.0, blocks))
        condensed.update(blocks)
        r.array[:] = rng.normal(size=2 * nodes)
        condensed.apply(None, r, x)
        assert whole @ x.array_r == pytest.approx(r.array_r, abs=1e-11)
        condensed.mult(None, x, r)
        assert r.array_r == pytest.approx(whole @ x.array_r, abs=1e-12)


def test_a_singular_system_has_no_number_for_an_answer():
    dense, A = stiffness(4, np.random.default_rng(1))
    condensed = Condensed(A, np.array([0]), 2, as_it_is)
    condensed.occupy(np.array([0, 0]), np.array([0, 1]))
    condensed.update(-np.array([dense[:2, :2], dense[:2, 2:]]))
    r, x = A.createVecs()
    r.array[:] = 1.0
    condensed.apply(None, r, x)
    assert not np.isfinite(x.array_r).all()


def test_nothing_keeps_a_system_that_is_used_no_more():
    """Its responses are most of the memory of a run; sweeps solve thousands of runs in one
    process."""
    _, A = stiffness(8, np.random.default_rng(1))
    condensed = Condensed(A, np.array([0, 2]), 2, as_it_is)
    ksp = PETSc.KSP().create(MPI.COMM_SELF)
    condensed.attach(ksp)
    ksp.setUp()
    still = ref(condensed)
    del condensed
    ksp.destroy()
    assert still() is None


@pytest.mark.parametrize("kinematics", ["current", "reference"])
@pytest.mark.parametrize("pin", [{}, {"rigid": True}], ids=["deformable", "rigid"])
def test_the_joint_ends_in_the_same_state_with_one_factorisation(kinematics, pin, monkeypatch):
    """As with the whole matrix factorised each time, in far fewer iterations: each finds the points
    that open or close. With fixed partners nothing else is nonlinear: where all of them are found,
    the first iteration is the last."""
    scene = small_scene(0.08, 3, pin=pin, analysis={"kinematics": kinematics})
    short = solve(scene)
    monkeypatch.setattr(look_ahead, "MOST_REVISIONS", 20)
    patient = solve(scene)
    monkeypatch.setattr(choose, "LEFT_OUT", {"condensed", "look_ahead"})
    long = solve(scene)
    assert (
        short.joint.equilibrium.linear.tangent.factorisations
        == 1
        < long.joint.equilibrium.linear.tangent.factorisations
    )
    counts = [[m.iterations for m in run.steps] for run in (short, long)]
    assert max(counts[0]) <= 4
    assert sum(counts[0]) < 0.8 * sum(counts[1])
    assert max(m.iterations for m in patient.steps) <= (4 if kinematics == "current" else 1)
    for a, b in zip(short.steps, long.steps, strict=True):
        assert (a["P"], a["p0"], a["eps"]) == pytest.approx((b["P"], b["p0"], b["eps"]), rel=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("pin", [{}, {"rigid": True}], ids=["deformable", "rigid"])
def test_the_ranks_take_the_same_way(comm, pin):
    """Iterations, factorisations and points, on ranks without facets or cells, too."""
    scene = small_scene(0.1, 3, pin=pin)
    many = solve(scene, comm)
    one = solve(scene, MPI.COMM_SELF)
    assert many.joint.equilibrium.linear.tangent.condensed is not None
    for a, b in zip(many.steps, one.steps, strict=True):
        assert a.iterations == b.iterations
        assert (a["P"], a["p0"], a["eps"]) == pytest.approx((b["P"], b["p0"], b["eps"]), rel=1e-10)
    assert (
        many.joint.equilibrium.linear.tangent.factorisations
        == one.joint.equilibrium.linear.tangent.factorisations
        == 1
    )


@pytest.mark.mpi
def test_joints_that_yield_are_condensed_until_then(comm, monkeypatch):
    """The first steps take one factorisation, the next ones as many as without, on every rank."""
    scene = small_scene(0.08, 8, 0.002)
    condensed = solve(scene, comm)
    linear = condensed.joint.equilibrium.linear
    assert linear.choice.uses("look_ahead")
    assert linear.tangent.condensed is None
    monkeypatch.setattr(choose, "LEFT_OUT", {"condensed"})
    whole = solve(scene, comm)
    factorisations = [
        solved.joint.equilibrium.linear.tangent.factorisations for solved in (condensed, whole)
    ]
    yielding = [m["block peeq_max"] > 0 for m in whole.steps]
    assert 0 < sum(yielding) < len(yielding)
    assert factorisations[0] < factorisations[1]
    for a, b in zip(condensed.steps, whole.steps, strict=True):
        assert (a["P"], a["p0"], a["eps"]) == pytest.approx((b["P"], b["p0"], b["eps"]), rel=1e-9)


def test_a_joint_that_goes_on_after_it_has_yielded_is_not_condensed():
    """So that its last digits are the digits of a run without a halt, also where it unloads."""
    scene = small_scene(0.1, 1, 0.002, load={"displacement": [1.0, 0.8]})
    yielded = solve(scene, MPI.COMM_SELF).joint
    for points in yielded.equilibrium.evaluation.plastic_points():
        points.commit()
    system = joint_system(scene, MPI.COMM_SELF)
    at = system.equilibrium
    assert at.linear.tangent.condensed is not None
    old = yielded.equilibrium.evaluation.plastic_points()
    for points, before in zip(at.evaluation.plastic_points(), old, strict=True):
        points.state = before.state
    at.resume(yielded.equilibrium.load, yielded.equilibrium.state(), 1.0)
    assert at.linear.tangent.condensed is None


def test_a_joint_that_never_yields_takes_one_factorisation():
    strong = solve(small_scene(0.1, 3, 1.0), MPI.COMM_SELF)
    linear = strong.joint.equilibrium.linear
    assert linear.tangent.condensed is not None
    assert linear.tangent.factorisations == 1


def test_only_joints_that_stay_elastic_and_held_are_condensed():
    """Nothing that floats, acts by force, or is large."""
    relative_force = {"displacement": None, "relative_force": 0.005}
    for scene in (
        paper_joint(0.2, 1, load=relative_force),
        paper_joint(0.02, 1),
        paper_joint(0.2, 1, analysis={"gamma_factor": 10.0}),
    ):
        assert joint_system(scene, MPI.COMM_SELF).equilibrium.linear.tangent.condensed is None
    coarse = joint_system(paper_joint(0.2, 1), MPI.COMM_SELF)
    assert coarse.equilibrium.linear.tangent.condensed is not None
