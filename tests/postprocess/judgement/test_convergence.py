"""Known orders are found, and errors are estimated with caution."""

import numpy as np
import pytest

from archord.postprocess.judgement.convergence import (
    mesh_error,
    observed_order,
    richardson,
    step_error,
)


@pytest.mark.parametrize("order", [0.3, 1.5, 2.0, 3.7])
@pytest.mark.parametrize("sizes", [(1.0, 1.5, 2.25), (0.03, 0.05, 0.1)])
def test_three_sizes_show_their_order(order, sizes):
    """And `richardson` with it is the error of the finest; orders that no three meshes show are
    infinite."""
    first, second, third = (7 * h**order for h in sizes)
    found = observed_order(sizes, second - first, third - second)
    assert found == pytest.approx(order, rel=1e-9)
    assert richardson(second - first, sizes[1] / sizes[0], found) == pytest.approx(first, rel=1e-8)
    assert observed_order(sizes, 1.0, 1e9) == -observed_order(sizes, 1.0, 1e-3) == np.inf


@pytest.mark.parametrize("order", [1.5, 2.0, 3.0, 4.0])
def test_estimates_of_a_known_order_are_cautious(order):
    """Never below the error from order 1.5 on if there are three meshes; at most 5 times as
    large."""
    h = 1.5 ** -np.arange(3.0)
    curves = [[0.5, 2.0 * (1 + 0.1 * size**order)] for size in h]
    error = 0.1 * h[-1] ** order
    assert error * 0.9 <= mesh_error(curves, 1.5) <= 5 * error
    assert mesh_error(curves[:1], 1.5) is None


@pytest.mark.parametrize("ratio", [1.5, 2.0])
def test_a_singular_corner_is_estimated_at_its_order(ratio):
    """A clamped corner has order 1.42: two meshes and three know the error within a tenth."""
    curves = [[1 + 0.1 * ratio ** (-1.42 * k)] for k in range(3)]
    for n in (2, 3):
        error = (curves[n - 1][0] - 1) / curves[n - 1][0]
        assert 0.9 * error <= mesh_error(curves[:n], ratio, 1.5) <= 1.1 * error


def test_errors_of_two_curves():
    """Two meshes that happen to agree say no more than the two before. Steps are of first order:
    the error of the finer curve is their difference, over the largest value."""
    assert mesh_error([[1.1], [1.0], [1.0]], 1.5) == pytest.approx(0.1 / 1.5**3 / 1.25)
    assert mesh_error([[0.0], [0.0]], 1.5) == 0
    assert step_error(*([1 + 0.2 / m, -4 - 0.4 / m] for m in (4, 8))) == pytest.approx(
        0.4 / 8 / 4.05
    )
