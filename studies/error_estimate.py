"""Errors of curves estimated from curves that were computed twice: on meshes that get finer, in steps that get shorter.

A curve is one number for each output step: the forces on a pin that is displaced, its displacements under forces.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

Curve = Sequence[float]

_SLOWEST, _CAUTIOUS = 1.5, 2.0  # orders that estimates are made with
_USUAL = 3.0  # order of P on meshes that are refined everywhere (docs/accuracy.md)


def difference(one: Curve, other: Curve, largest: float) -> float:
    """The largest difference of two curves over ``largest``; where that is nothing, 0 if they agree and 1 if not."""
    apart = float(np.abs(np.subtract(one, other)).max())
    return apart / largest if largest else float(apart > 0)


def mesh_error(curves: Sequence[Curve], ratio: float) -> float | None:
    """Relative error of the last of ``curves``, from coarse to fine, the element size falling by ``ratio`` each time.

    Richardson's estimate: with an order p the difference d to the curve before is ``ratio^p - 1`` times the error. The
    order is 3 in the mean, but differences scatter by a factor of two or three, as the contact ends anywhere in an
    element. So p is that of the last two differences within 1.5 and 2, 2 if there is one; and where the last difference
    is small by luck, the one before, at order 3, says what the error is at least. None with one curve.
    """
    if len(curves) < 2:
        return None
    largest = float(np.abs(curves[-1]).max())
    d = [difference(a, b, largest) for a, b in pairwise(curves)]
    p = _CAUTIOUS
    if len(d) > 1 and d[-2] and d[-1]:
        p = min(_CAUTIOUS, max(_SLOWEST, math.log(d[-2] / d[-1]) / math.log(ratio)))
    last = d[-1] / (ratio**p - 1)
    return max([last, *(b / ratio**_USUAL / (ratio**_CAUTIOUS - 1) for b in d[-2:-1])])


def step_error(coarse: Curve, fine: Curve) -> float:
    """Relative error of ``fine``, whose steps are half as long as those of ``coarse``, by backward Euler, of first
    order: their difference. That of ``coarse`` is twice as much."""
    return difference(coarse, fine, float(np.abs(fine).max()))
