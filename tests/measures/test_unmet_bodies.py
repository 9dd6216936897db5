"""Bodies that pass through each other where no interaction lets them touch are told of."""

import re

import pytest

import archord
from archord import Body, Elastic, Interaction, Load, Problem, Support

BOXES = {"spring": (0.0, 0.0, 0.3, 3.0), "stop": (0.35, 1.5, 1.0, 1.0)}
RIGHT = [Interaction("contact", ("spring right", "stop left"))]
WRONG = [Interaction("contact", ("spring left", "stop left"))]


@pytest.mark.parametrize(
    ("interactions", "pushed", "is_told"),
    [(RIGHT, 0.2, False), ([], 0.2, True), ([], 0.01, False), (WRONG, 0.2, True)],
)
def test_a_leaf_spring_that_is_pushed_through_its_stop_is_told(
    interactions, pushed, is_told, tmp_path
):
    """By how deep its side lies in the stop: no deeper than the corner of the stop is passed."""
    run = archord.solve(
        Problem(
            archord.rectangles(BOXES, size=0.1),
            [Body(name, Elastic(210e3, 0.3)) for name in BOXES],
            interactions,
            [Support("spring bottom"), Support("stop right")],
            [Load("push", on="spring top", direction="x", displacement=[pushed, 0.0])],
            steps=1,
            strain="large",
        ),
        tmp_path / "run",
    )
    found = [said for said in run.warnings if "pass through each other" in said]
    assert len(found) == is_told
    for said in found:
        assert "'spring' and 'stop'" in said
        fields = run.fields(1)
        x = fields.coordinates + fields.displacement
        is_side = (abs(fields.coordinates[:, 0] - 0.3) < 1e-9) & (abs(x[:, 1] - 2.0) < 0.5)
        (deep,) = map(float, re.findall(r"lies ([0-9.e-]+) deep", said))
        assert deep == pytest.approx(float(x[is_side, 0].max()) - 0.35, rel=0.1)
