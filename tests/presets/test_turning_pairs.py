"""What is said where bodies in space that are tied or rub turn far at large strain."""

from types import SimpleNamespace

import pytest

from archord.measures.doubts import distortion_doubts


@pytest.mark.parametrize(
    ("dimension", "slips", "angle", "warned"),
    [
        (3, True, 0.5, True),
        (3, True, 0.1, False),
        (3, False, 0.5, False),
        (2, True, 0.5, False),
    ],
)
def test_turning_pairs_are_warned_of(dimension, slips, angle, warned):
    system = SimpleNamespace(
        problem=SimpleNamespace(kinematics=SimpleNamespace(dimension=dimension)),
        contact=SimpleNamespace(pairs=[SimpleNamespace(counts_slip=slips)]),
        distortion=lambda: (0.3, 1, angle, 0),
    )
    said = distortion_doubts(system, 0.0, small=False)
    assert any("tied or rub" in sentence for sentence in said) == warned
