"""What rounding leaves of the residual, and where Newton's method may stop for it."""

import pytest

import archord
from archord.solver.path.stepping import march


@pytest.mark.parametrize("radius", [5.0, 5e3])
def test_a_disc_that_is_far_larger_than_the_body_needs_no_cutback(radius):
    """Gaps are differences of numbers as large as the radius."""
    mesh = archord.rectangles({"block": (-4, -2, 8, 2)}, size=0.5)
    disc = archord.RigidCircle((0, radius), radius)
    rub = archord.Interaction("rub", (disc, "block top"))
    press = archord.Load("press", on="rub", direction="y", force=-500.0)
    aside = archord.Load("aside", on="rub", direction="x", displacement=0.0)
    block = archord.Body("block", archord.Elastic(210e3, 0.3))
    held = [archord.Support("block bottom")]
    system = archord.System(archord.Problem(mesh, [block], [rub], held, [press, aside], steps=2))
    taken = []
    march(system.load_path(), [0.5, 1.0], target_done=lambda step, at: taken.append(step))
    assert [step.cutbacks for step in taken] == [0, 0]
    assert abs(system.drive_force("press")) == pytest.approx(500.0)
