"""What is said where bodies in space that are tied or rub turn far at large strain."""

from types import SimpleNamespace

import pytest

from archord.measures.doubts import distortion_doubts
from archord.solver.contact.laws.named import Tied


@pytest.mark.parametrize(
    ("dimension", "slips", "law", "angle", "warned"),
    [
        (3, True, None, 0.5, True),
        (3, False, Tied(), 0.5, True),
        (3, True, None, 0.1, False),
        (3, False, None, 0.5, False),
        (2, True, None, 0.5, False),
    ],
)
def test_turning_pairs_are_warned_of(dimension, slips, law, angle, warned):
    pair = SimpleNamespace(counts_slip=slips, law=law)
    system = SimpleNamespace(
        problem=SimpleNamespace(kinematics=SimpleNamespace(dimension=dimension)),
        contact=SimpleNamespace(pairs=[pair], interfaces=[]),
        distortion=lambda: (0.3, 1, angle, 0),
    )
    said = distortion_doubts(system, 0.0, small=False)
    assert any("tied or rub" in sentence for sentence in said) == warned
