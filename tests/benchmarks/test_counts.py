"""What a solve costs, in counts that do not depend on the clock, does not grow unnoticed."""

import pytest

from archord.benchmarks.cost.counts import CASES, KEPT, count, grown


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_no_count_grows_by_more_than_a_tenth(case):
    now = count(case)
    before = KEPT[case.name]
    assert set(now) == set(before)
    assert not grown(case.name, now, before), (
        f"{now}, kept {before}: python3 -m archord.benchmarks.cost.counts"
    )


def test_more_than_a_tenth_is_noticed_and_less_is_not():
    before = {"dofs": 1000, "iterations": 100, "factorisations": 90, "evaluations": 120}
    assert not grown("case", {name: 11 * value // 10 for name, value in before.items()}, before)
    assert grown("case", before | {"iterations": 111}, before) == [
        "case: iterations grew from 100 to 111"
    ]
    assert len(grown("case", {name: 2 * value for name, value in before.items()}, before)) == 4
