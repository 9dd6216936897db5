"""Rigid couplings of a plane at large strain: prescribed rotations are finite, free ones linear,
which is told with the moment that they lose."""

import numpy as np
import pytest

import archord
from archord import Body, Coupling, Elastic, Load, Problem, Support


def bent(folder, point, kind="rigid", **load):
    """A strip from (0, 0) to (10, 1), clamped at its left end and loaded at its right one."""
    problem = Problem(
        archord.rectangles({"strip": (0.0, 0.0, 10.0, 1.0)}, size=0.5),
        [Body("strip", Elastic(10.0, 0.3))],
        supports=[Support("strip left")],
        couplings=[Coupling("end", facets="strip right", point=point, kind=kind)],
        loads=[Load("bend", on="end", **load)],
        steps=4,
        strain="large",
    )
    return archord.solve(problem, folder, fields=False)


def test_a_block_turns_beyond_a_right_angle_without_a_strain(tmp_path):
    angle = 2.5
    point = np.array([1.0, -2.0])
    problem = Problem(
        archord.rectangles({"block": (3.0, 1.0, 2.0, 1.0)}, size=0.5),
        [Body("block", Elastic(10.0, 0.3))],
        supports=[Support("held", on="pin", fixed="xy")],
        couplings=[Coupling("pin", facets="block right", point=tuple(point))],
        loads=[Load("turn", on="pin", direction="rotation", displacement=[1.5, angle])],
        steps=2,
        strain="large",
    )
    run = archord.solve(problem, tmp_path / "run")
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    fields = run.fields()
    arm = fields.coordinates - point
    np.testing.assert_allclose(fields.displacement[:, :2], arm @ turn.T - arm, atol=1e-9)
    assert run.warnings == []


def test_a_strip_that_is_bent_by_an_angle_carries_the_moment_of_a_beam(tmp_path):
    """``E/(1 - nu^2) I angle/L``. Linear rotations stretched its end, which took 2.4 times as
    much."""
    run = bent(tmp_path / "run", (10.0, 0.5), direction="rotation", displacement=0.5)
    last = run.history.iloc[-1]
    beam = 10.0 / (1 - 0.3**2) / 12 * 0.5 / 10.0
    assert last["bend force"] == pytest.approx(beam, rel=5e-3)
    assert last["strip left moment"] == pytest.approx(-last["bend force"], rel=1e-7)
    assert run.warnings == []


@pytest.mark.parametrize(("kind", "is_told"), [("rigid", True), ("distributing", False)])
def test_the_moment_that_a_free_rotation_loses_is_told(kind, is_told, tmp_path):
    """Under a force beside the end: the clamp carries less than force times lever."""
    run = bent(tmp_path / "run", (15.0, 0.5), kind, direction="y", force=0.002)
    moment = abs(run.history["strip left moment"].iloc[-1])
    assert (moment < 0.9 * 15 * 0.002) == is_told
    assert any("carry a moment that is off" in said for said in run.warnings) == is_told
