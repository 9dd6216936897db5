"""Forces of which the contact is smaller than a facet: force control answers as displacement
control does."""

import pytest

from archord.benchmarks.case import paper_joint
from archord.benchmarks.persson import persson_joint
from archord.scene.sections.loading import JointLoad
from tests.solver.solving import solve


@pytest.mark.parametrize("force", [1e-6, 1e-8, 1e-10])
def test_a_tiny_force_moves_the_pin_as_far_as_takes_it(force):
    """Down to P/(E* R) = 1e-10, whose delta is a 3e-9 of R: one attempt, and the displacement gives
    the force back."""
    load = {"displacement": None, "relative_force": force}
    (pressed,) = solve(paper_joint(0.1, 1, load=load)).steps
    assert pressed.cutbacks == 0
    assert pressed.iterations < 12
    assert abs(pressed["P"] / force - 1) < 1e-9
    (moved,) = solve(paper_joint(0.1, 1, load={"displacement": pressed["delta"] / 0.005})).steps
    assert 0 < pressed["delta"] < 1e-4
    assert abs(moved["P"] / force - 1) < 1e-3


@pytest.mark.parametrize("force", [1e-6, 1e-10])
def test_a_ring_answers_a_tiny_force(force):
    scene = persson_joint(0.5, 0.1, joint={"clearance": 1e-3})
    scene = scene.model_copy(update={"load": JointLoad(relative_force=force, steps=1)})
    (pressed,) = solve(scene).steps
    assert pressed.cutbacks == 0
    assert pressed.force_balance < 1e-3
    assert 0 < pressed["delta"] < 1e-5
