"""Load stepping: cutbacks, rollback, and what a failure leaves."""

import numpy as np
import pytest
from mpi4py import MPI

from archord.solver.path.stepping import StepFailure, StepRules, march
from tests.solver.solving import joint_system, scene, solve


def test_cutbacks_change_the_path_but_not_the_targets():
    """With too few iterations allowed, steps are cut, all targets are hit, and P agrees within the
    step error."""
    free = solve(scene(0.2, 4, yield_stress=0.002))
    bound = solve(scene(0.2, 4, yield_stress=0.002, analysis={"max_iterations": 5}))
    assert sum(m.cutbacks for m in free.steps) == 0
    assert sum(m.cutbacks for m in bound.steps) > 0
    assert [m["delta"] for m in bound.steps] == [m["delta"] for m in free.steps]
    assert pytest.approx(free.steps[-1]["P"], rel=2e-3) == bound.steps[-1]["P"]


def test_a_failed_step_leaves_no_trace():
    """Displacement and all history are what they were at the last accepted load."""
    solution = solve(scene(0.1, 2, yield_stress=0.002))
    joint = solution.joint
    equilibrium = joint.equilibrium
    points = joint.equilibrium.evaluation.plastic_points()
    states = [p.state for p in points]
    before = [s.peeq.copy() for s in states]
    load = equilibrium.load
    u = equilibrium.displacement()
    forces = solution.forces()
    joint.solver.newton.max_iterations = 1
    result = joint.solver.solve(1.2 * load, [(equilibrium.state(), False)])
    assert not result.converged
    equilibrium.restore(load, np.append(u, load))
    assert all(p.state is s for p, s in zip(points, states, strict=True))
    assert all(np.array_equal(p.state.peeq, b) for p, b in zip(points, before, strict=True))
    equilibrium.evaluate()
    assert solution.forces() == pytest.approx(forces, rel=1e-9)


def test_a_solve_that_cannot_go_on_says_where_and_why():
    """The message holds delta, the reason, the residual and its place; accepted steps were reported
    before, and the state is that of the last one."""
    problem = scene(0.08, 10, yield_stress=0.002, analysis={"max_iterations": 5})
    joint = joint_system(problem, MPI.COMM_SELF)
    accepted = []
    targets = problem.targets
    path = joint.load_path()
    with pytest.raises(
        StepFailure,
        match=r"no equilibrium at delta = 0\.005: no convergence .* residual at \(.*no smaller",
    ):
        march(
            path,
            targets,
            rules=StepRules(minimum=1.0),
            target_done=lambda step, position: accepted.append(step.load),
        )
    assert accepted == targets[:4]
    assert joint.equilibrium.load == targets[3]
    assert np.array_equal(joint.equilibrium.state(), path.state)


def test_one_large_step_finds_the_plastic_state():
    """Elastic first touch, then the plastic state at 2 dR at once: the force of 20 steps within 0.5
    %."""
    assert (
        pytest.approx(0.00669, rel=5e-3) == solve(scene(0.08, 1, yield_stress=0.002)).steps[-1]["P"]
    )


def test_a_short_step_is_no_equilibrium():
    """PETSc's criterion of short steps, by which a line search that fails far from equilibrium
    converges, is off."""
    solvers = solve(scene(0.1, 1)).joint.solver.newton._solvers
    assert [snes.getTolerances()[2] for snes in solvers.values()] == [0.0] * len(solvers)
