"""Joints in space against other codes, on coarse meshes."""

from dataclasses import replace

import pytest

from archord.benchmarks.space.case import solved
from archord.benchmarks.space.joints import CASES

COARSE = 3.0
# what coarse meshes leave, as found
WITHIN = {"elastic": 0.004, "longer": 0.004, "C": 0.004, "A": 0.012, "D": 0.006}


@pytest.mark.parametrize("name", WITHIN)
def test_forces_of_coarse_meshes_come_near_the_references(name):
    result = solved(CASES[name], COARSE)
    assert result.cutbacks == 0
    for reference, value in result.compared:
        if reference.quantity == "P":
            assert value == pytest.approx(reference.value, rel=WITHIN[name])


def test_the_whole_load_of_a_block_that_yields_is_one_step():
    case = replace(CASES["A"], steps=1)
    result = solved(case, COARSE)
    assert result.cutbacks == 0
    assert result.newton <= 15


def test_a_pin_that_goes_far_through_a_fine_edge_takes_few_iterations():
    """At first it is where it would be without the block, with tractions as large as its moduli."""
    result = solved(CASES["longer"])
    assert result.newton <= 10
    assert result.krylov <= 20 * result.newton
