"""Gaussian processes, factored and solved block by block: what matrices as a whole give."""

from __future__ import annotations

import numpy as np
import pytest

from archord.postprocess.laws.general.gaussian_process import Kernel, Process

KERNEL = Kernel(np.array([0.7, 1.5, 3.0]), 1e-3)


@pytest.mark.parametrize("n", [1, 20, 32, 33, 150])
def test_means_and_deviations_are_those_of_the_whole_matrix(n: int) -> None:
    """Of outputs that are known of all points, of some and of none; from less than one block up."""
    random = np.random.default_rng(n)
    points = random.uniform(-1, 1, (n, 3))
    values = np.column_stack([np.sin(points.sum(1)), np.cos(points[:, 0]), points[:, 1]])
    count = (n, (n + 1) // 2, 0)
    for column, known in zip(values.T, count, strict=True):
        column[known:] = np.nan
    asked = random.uniform(-1, 1, (7, 3))
    process = Process(KERNEL, points, values)
    means, deviations = process.predict(asked)
    for j, known in enumerate(count):
        covariance = KERNEL.between(points[:known], points[:known]) + 1e-3 * np.eye(known)
        between = KERNEL.between(points[:known], asked)
        solved = np.linalg.solve(covariance, np.column_stack([values[:known, j], between]))
        size = values[:known, j] @ solved[:, 0] / max(known, 1)
        told = (between * solved[:, 1:]).sum(0)
        np.testing.assert_allclose(means[:, j], between.T @ solved[:, 0], atol=1e-10)
        expected = np.sqrt(size * (KERNEL.at(asked) - told + 1e-3))
        np.testing.assert_allclose(deviations[:, j], expected, rtol=1e-7, atol=1e-12)
    np.testing.assert_array_equal(process.means(asked), means)


def test_points_left_out_are_predicted_by_the_others() -> None:
    """As a process without the point predicts it, but for the size."""
    random = np.random.default_rng(1)
    points = random.uniform(-1, 1, (40, 3))
    values = np.sin(points).sum(1)[:, None]
    off, _ = Process(KERNEL, points, values).left_out()
    for i in (0, 17, 39):
        others = np.arange(40) != i
        without = Process(KERNEL, points[others], values[others])
        assert off[i] == pytest.approx(without.means(points[i : i + 1])[0] - values[i], rel=1e-6)


def test_the_kernel_is_materns() -> None:
    """Beside the linear mean: at 0 it is 1, and it falls with the distance over the lengths."""
    one = np.array([[0.2, -0.3, 0.5]])
    other = one + np.array([[0.7, 0.0, 0.0]])
    r = np.sqrt(7)
    matern = (1 + r + 0.4 * r**2 + r**3 / 15) * np.exp(-r)
    linear = 1 + float((one * other).sum())
    assert KERNEL.between(one, other).item() == pytest.approx(matern + linear, rel=1e-12)
    assert KERNEL.between(one, one).item() == pytest.approx(KERNEL.at(one).item(), rel=1e-12)
