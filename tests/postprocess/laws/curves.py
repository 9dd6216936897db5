"""A law of a joint that yields, made from formulas: what tests of tables and exports use."""

from __future__ import annotations

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.joint_curve import JointCurve, first_touch

TOUCH = np.array([2.39, -0.15, 0.05])


def yielding_curve(onset: float = 0.4, nodes: int = 61) -> JointCurve:
    """A joint whose force falls behind its elastic one from ``onset`` dR on."""
    x = np.concatenate([[0.0], np.geomspace(0.02, 3.0, nodes - 1)])

    def elastic(x: Array) -> Array:
        return np.where(x > 0, first_touch(TOUCH, np.where(x > 0, x, 1.0))[0], 0.0)

    def loss(x: Array) -> Array:
        return 0.3 * np.log(np.maximum(x, onset) / onset) ** 1.5

    def loading(x: Array) -> Array:
        return elastic(x) * np.exp(-loss(x))

    def ratio(x: Array) -> Array:
        return np.exp(-1.8 * loss(x))

    def slope(f, x: Array) -> Array:
        h = 1e-6
        return np.where(x > 0, (f(x + h) - f(np.maximum(x - h, 0.0))) / (2 * h), 0.0)

    one = np.ones_like(x)
    none = np.zeros_like(x)
    table = [values for f in (loading, elastic, ratio) for values in (f(x), slope(f, x))]
    return JointCurve(
        x,
        *table,
        0.2 * loss(x),
        TOUCH,
        1.2 * one,
        none,
        0.8 * one,
        none,
        0.003 * one,
        0.02 * one,
        about={"title": "a joint of formulas"},
    )
