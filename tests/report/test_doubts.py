"""Warnings of steps: each kind once, at its worst."""

from archord.report.doubts import Doubt, Told, kind, tell


def test_a_kind_is_told_once_from_its_first_step_at_its_worst():
    told: dict[str, Told] = {}
    for step, peeq in enumerate([0.06, 0.31, 0.2], 3):
        tell(
            told,
            step,
            [Doubt(f"PEEQ reaches {peeq}", peeq), Doubt("the block 'b 1' is 0.1 off", 1.0)],
        )
    assert list(map(str, told.values())) == [
        "step 3: PEEQ reaches 0.31 (at its worst in step 4)",
        "step 3: the block 'b 1' is 0.1 off",
    ]


def test_names_with_numbers_are_other_kinds():
    assert (
        kind("step 3: 'sleeve 1' is 2e-3 off")
        == kind("'sleeve 1' is 4.0 off")
        != kind("'sleeve 2' is 4.0 off")
    )


def test_telling_a_step_twice_changes_nothing():
    """As a run that goes on tells its last step once more."""
    told: dict[str, Told] = {}
    for _ in range(2):
        tell(told, 7, [Doubt("off by 0.1", 0.1)])
    assert list(map(str, told.values())) == ["step 7: off by 0.1"]
