"""Parts with symmetry are told of where they are not held as in a mirror: a half punch on a half
foot."""

import pytest

import archord
from archord import Body, Elastic, Interaction, Load, Problem, Support

BOXES = {"foot": (0.0, -1.0, 2.0, 1.0), "punch": (0.0, 0.0, 1.0, 1.0)}
HELD = [Support("foot bottom"), Support("punch top", fixed="x")]
PUNCH = Support("punch left", fixed="x")
FOOT = Support("foot left", fixed="x")
LACKS = "the symmetry is"
FREE = "sides of 'foot' lie in the mirror x = 0 of the part"


def half(supports, symmetry, folder):
    return archord.solve(
        Problem(
            archord.rectangles(BOXES, size=0.25),
            [Body(name, Elastic(210e3, 0.3)) for name in BOXES],
            [Interaction("contact", ("punch bottom", "foot top"))],
            [*HELD, *supports],
            [Load("press", on="punch top", direction="y", displacement=-0.01)],
            steps=1,
            symmetry=symmetry,
        ),
        folder,
        fields=False,
    )


@pytest.mark.parametrize(
    ("supports", "symmetry", "told"),
    [
        ([PUNCH, FOOT], 2, []),
        ([PUNCH], 2, [FREE]),
        ([], 2, [LACKS]),
        ([PUNCH, FOOT], 4, [LACKS]),
        ([PUNCH], 1, []),
        ([], 1, []),
    ],
)
def test_what_a_part_lacks_to_be_mirrored_is_told(supports, symmetry, told, tmp_path):
    said = half(supports, symmetry, tmp_path / "run").warnings
    assert [text for text in (LACKS, FREE) if any(text in s for s in said)] == told


def test_a_half_that_can_leave_its_mirror_is_too_soft(tmp_path):
    """By 6 % of the force."""
    free = half([PUNCH], 2, tmp_path / "free").history["press force"].iloc[-1]
    held = half([PUNCH, FOOT], 2, tmp_path / "held").history["press force"].iloc[-1]
    assert free / held == pytest.approx(0.944, abs=0.005)
