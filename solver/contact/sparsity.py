"""Which facets may meet, and so which matrix entries a contact may fill: kept ahead of the sliding
pairs."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from archord.solver.contact.pair import Pair
from archord.solver.contact.surface import neighbours

_MARGIN = 2  # rings of opposite facets kept in the pattern around those that are paired
_WIDEST = 16  # the same where pairs are expected to slide further


class Reach:
    """Which opposite facets each facet of a ``pair`` may meet, where points slide by about
    ``slide``. Collective.

    ``keys`` ``(n,)``, sorted and alike on all ranks, are own facets times the number of opposite
    ones, plus opposite.
    """

    def __init__(self, pair: Pair, slide: float) -> None:
        self.pair, self._comm, self._n = pair, pair.surface.comm, pair.opposite.n_facets
        length = self._comm.allreduce(float(pair.surface.weight.sum())) / self._n
        self._rings = min(_MARGIN + int(slide / length), _WIDEST)
        self.keys = np.zeros(0, dtype=np.int64)
        self.extend()

    def extend(self) -> bool:
        """Make room for the pairs of the last evaluation and their neighbours; True if any rank had
        to. Collective."""
        new = np.setdiff1d(self.point_keys(), self.keys)
        if not self._comm.allreduce(len(new) > 0, op=MPI.LOR):
            return False
        facet, met = np.divmod(new, self._n)
        which, near = neighbours(self.pair.opposite.curve, met, self._rings)
        parts = self._comm.allgather(facet[which] * self._n + near)
        self.keys = np.unique(np.concatenate([self.keys, *parts]))
        return True

    def point_keys(self) -> np.ndarray:
        """The keys ``(m,)`` of this rank's points at the last evaluation."""
        facet, shape = self.pair.surface.facet, self.pair.surface.weight.shape
        return (facet[:, None] * self._n + self.pair.projection.facet.reshape(shape)).ravel()

    def dofs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The keys ``(p,)`` of this rank's facets, their dofs of rows ``(p, k + o)`` and of columns
        ``(p, a + o)``."""
        surface, opposite = self.pair.surface, self.pair.opposite
        facet, met = np.divmod(self.keys, self._n)
        here = np.isin(facet, surface.facet)
        own = np.searchsorted(surface.facet, facet[here])
        there = opposite.curve_dofs[opposite.curve.connectivity[met[here]]]
        rows = np.take_along_axis(surface.cell_global, surface.trace, axis=1)[own]
        columns = surface.cell_global[own]
        return (
            self.keys[here],
            np.concatenate([rows, there], axis=1),
            np.concatenate([columns, there], axis=1),
        )
