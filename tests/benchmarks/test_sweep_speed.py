"""The time of a sweep on one rank and on several."""

import os

import pytest

from archord.benchmarks.cost.sweep_speed import Pair, measure, table, timed
from tests.studies.parts import written

TWO = "[grid]\npin.E = [1.0, 1.82]\n"


def test_a_pair_is_two_sweeps_that_were_solved(tmp_path):
    """Both ranks work: no less processor time than alone for the same cases."""
    pair = measure(written(tmp_path, TWO), 2)
    assert 0.5 < pair.alone_cpu < 2 * pair.together_cpu
    cores = os.cpu_count() or 1
    assert pair.alone * cores >= pair.alone_cpu
    assert pair.together * cores >= pair.together_cpu


def test_a_sweep_that_fails_is_no_measurement(tmp_path):
    (tmp_path / "bad.sweep.toml").write_text("nonsense = 1\n")
    with pytest.raises(RuntimeError, match=r"(?s)ended with code 2: .*nonsense"):
        timed(tmp_path / "bad.sweep.toml", 1)


def test_the_table_ends_with_the_medians():
    pairs = [Pair(20.0, 10.0, 19.0, 21.0), Pair(30.0, 20.0, 20.0, 22.0), Pair(22.0, 11.5, 18.0, 20.0)]
    rows = table(pairs, 2)
    assert rows[0].split(" | ")[2] == "2 ranks [s]"
    assert rows[-1] == "| median | 22.0 | 11.5 | 1.91 | 19.0 | 21.0 |"
