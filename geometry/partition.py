"""Which rank gets which cells of a joint: sectors around the pin's centre.

Points in contact face each other along rays from there, so most pairs stay on one rank; and the cut is the same in
every run, unlike that of a graph partitioner whose input arrives in any order.
"""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array


def sectors(x: Array, cells: np.ndarray, n_parts: int) -> np.ndarray:
    """The part ``(n,)`` of each of the ``cells`` ``(n, k)`` with vertices ``x`` ``(m, 2)``: sectors around the origin,
    numbered from below, of as many cells each."""
    middle = x[cells].mean(axis=1)
    order = np.argsort(np.arctan2(middle[:, 1], middle[:, 0]), kind="stable")
    part = np.empty(len(cells), dtype=np.int32)
    part[order] = np.arange(len(cells)) * n_parts // max(len(cells), 1)
    return part
