"""Where the slip of a step is counted from."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import Projection
from archord.geometry.patches import PatchProjection


class SlipOrigin:
    """The displacements from which a pair of surfaces counts slip: the displacements of the
    last accepted state.

    Points that did not touch then may count from where loose bodies touch down: bodies came there
    without load. Arrays:

    own : (m, d) displacement of the points
    opposite : (nodes, d) displacement of the opposite's nodes
    touched : (m,) whether points touched in the accepted state
    own_down, opposite_down : as ``own`` and ``opposite``, of points that did not touch
    """

    def __init__(self, own: Array, opposite: Array, touched: np.ndarray) -> None:
        self.own = self.own_down = own
        self.opposite = self.opposite_down = opposite
        self.touched = touched.copy()

    def touch_down(self, own: Array, opposite: Array) -> None:
        """Count the slip of points that did not touch from these displacements on."""
        self.own_down = own
        self.opposite_down = opposite

    def moved(
        self, own: Array, opposite: Array, partners: Projection | PatchProjection
    ) -> tuple[Array, Array]:
        """How far points ``(m, d)`` and the nodes of their partners ``(m, k, d)`` have moved since
        slip counts."""
        nodes = partners.nodes
        was_open = ~self.touched[:, None]
        own_before = np.where(was_open, self.own_down, self.own)
        nodes_before = np.where(
            was_open[..., None], self.opposite_down[nodes], self.opposite[nodes]
        )
        return own - own_before, opposite[nodes] - nodes_before
