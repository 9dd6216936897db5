"""Points that are asked again within a linear solve: the same states, in fewer iterations."""

import numpy as np
import pytest
from mpi4py import MPI

from archord.presets.problem import general_problem
from archord.scene.file import parse_any
from archord.solver.linear import choose, lagged, look_ahead
from archord.solver.path.stepping import march
from archord.solver.path.system import System
from tests.solver.solving import SEVERAL, small_scene, solve

FORCE = {"displacement": None, "relative_force": 0.01}
SCENES = {
    "friction": small_scene(0.08, 4, 0.002, analysis={"friction": 0.3}),
    "late yield": small_scene(0.08, 4, 0.004),
    "large strain": small_scene(0.08, 4, analysis={"strain": "large"}),
    "rigid pin": small_scene(0.08, 4, 0.002, pin={"rigid": True}, analysis={"friction": 0.3}),
    "by force": small_scene(0.08, 4, load=FORCE),
    "rigid pin by force": small_scene(0.08, 4, pin={"rigid": True}, load=FORCE),
    "released": small_scene(
        0.1, 1, 0.002, load={"displacement": [1.5, 1.0, 0.2]}, analysis={"friction": 0.3}
    ),
}


@pytest.mark.mpi
@pytest.mark.parametrize("name", SCENES)
def test_the_states_are_those_without_it_in_fewer_iterations(name, comm, monkeypatch):
    """To the tolerance of Newton's method, on one rank or several, which take as many
    iterations."""
    monkeypatch.setattr(choose, "LEFT_OUT", {"condensed"})  # which looks ahead itself
    short = solve(SCENES[name], comm)
    alone = solve(SCENES[name]) if SEVERAL else short
    monkeypatch.setattr(choose, "LEFT_OUT", {"condensed", "look_ahead"})
    long = solve(SCENES[name])
    for a, b, c in zip(short.steps, alone.steps, long.steps, strict=True):
        assert (a["P"], a["p0"], a["eps"]) == pytest.approx((c["P"], c["p0"], c["eps"]), rel=1e-8)
        assert (a["P"], a.iterations) == pytest.approx((b["P"], b.iterations), rel=1e-9)
    assert sum(m.iterations for m in short.steps) < 0.9 * sum(m.iterations for m in long.steps)


@pytest.mark.parametrize("load", [{}, FORCE], ids=["moved", "pressed"])
@pytest.mark.parametrize("pin", [{}, {"rigid": True}], ids=["deformable", "rigid"])
def test_what_is_linear_but_for_the_contact_takes_one_iteration(pin, load, monkeypatch):
    """Elastic bodies and fixed partners, where all points that change are found and systems are
    solved to the end."""
    monkeypatch.setattr(choose, "LEFT_OUT", {"condensed"})
    monkeypatch.setattr(look_ahead, "MOST_REVISIONS", 20)
    monkeypatch.setattr(look_ahead, "_TOLERANCE", 1e-12)
    monkeypatch.setattr(look_ahead, "_MOST_SOLVES", 200)
    steps = solve(
        small_scene(0.08, 3, pin=pin, load=load, analysis={"kinematics": "reference"})
    ).steps
    assert [m.iterations for m in steps] == [1, 1, 1]


@pytest.mark.parametrize("nu", [0.3, 0.499])
def test_large_strain_takes_few_more_iterations_than_small(nu):
    """Nearly incompressible bodies, too, whose pressure an iteration changes that is off in the
    second order."""
    body = {"nu": nu}
    small, large = (
        sum(
            m.iterations
            for m in solve(
                small_scene(0.06, 4, pin=body, block=body, analysis={"strain": strain})
            ).steps
        )
        for strain in ("small", "large")
    )
    assert large <= small + 1.5 * 4


def test_nearly_incompressible_joints_in_space_take_few_iterations():
    """Multigrid needs many iterations there, but the points that touch are found within the linear
    solves; without, Newton's method takes 15 iterations, and more on finer meshes."""
    body = {"E": 1.0, "nu": 0.499}
    scene = parse_any(
        {
            "joint": {"radius": 10.0, "clearance": 0.05, "block_size": 30.0}
            | {"relative_element_size": 0.16},
            "pin": body,
            "block": body,
            "space": {"thickness": 6.66, "rim_ratio": 1.0},
            "load": {"displacement": 0.5, "steps": 1},
        }
    )
    system = System(general_problem(scene, MPI.COMM_SELF))
    taken = []
    march(system.load_path(), [1.0], target_done=lambda step, at: taken.append(step.iterations))
    assert taken[0] <= 9


def test_an_old_factorisation_preconditions_as_well(monkeypatch):
    """Large elastic joints keep the first factorisation of a step."""
    monkeypatch.setattr(choose, "LEFT_OUT", {"condensed"})
    scene = small_scene(0.1, 3)
    usual = solve(scene)
    monkeypatch.setattr(lagged, "_MANY_DOFS", 0)
    kept = solve(scene)
    assert (
        kept.joint.equilibrium.linear.tangent.factorisations
        < usual.joint.equilibrium.linear.tangent.factorisations
    )
    for a, b in zip(kept.steps, usual.steps, strict=True):
        assert (a["P"], a["p0"], a["eps"]) == pytest.approx((b["P"], b["p0"], b["eps"]), rel=1e-8)


def test_a_scene_gives_the_same_digits_wherever_memory_lies():
    """FGMRES adds up in an order of its own."""
    scene = small_scene(0.1, 2, 0.002, analysis={"friction": 0.3})
    last = []
    held = []
    for size in (1, 1001, 17, 4099):
        held.append(np.zeros(size))
        last.append(solve(scene).steps[-1])
    assert len({(m["P"], m["p0"], m["eps"]) for m in last}) == 1


@pytest.mark.parametrize(
    ("dimension", "yields", "friction", "iterations"),
    [
        (2, False, False, np.inf),
        (3, False, True, np.inf),
        (2, True, False, 0),
        (2, True, True, np.inf),
        (3, True, False, 1),
        (3, True, True, 1),
    ],
)
def test_how_long_the_active_set_is_updated_while_bodies_yield(
    dimension, yields, friction, iterations
):
    facts = choose.Facts(MPI.COMM_SELF, 5000, dimension, yields, friction, False, False, 0.5, bool)
    assert look_ahead.iterations_while_bodies_yield(facts) == iterations
