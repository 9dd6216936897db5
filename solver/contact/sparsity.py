"""Which facets may meet, and so which matrix entries a contact may fill: kept ahead of the sliding pairs."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from archord.solver.contact.pair import Pair

_MARGIN = 2  # rings of opposite facets kept in the pattern around those that are paired
_WIDEST = 16  # the same where pairs are expected to slide further


class Reach:
    """Which opposite facets each facet of a ``pair`` may meet, where points are expected to slide by ``slide``.

    ``keys`` ``(n,)``, sorted and the same on every rank, number the facets that may meet: the own one times the number
    of opposite ones, plus the opposite one. Collective.
    """

    def __init__(self, pair: Pair, slide: float) -> None:
        self.pair, self._comm, self._n = pair, pair.surface.comm, pair.opposite.n_facets
        length = self._comm.allreduce(float(pair.surface.weight.sum())) / self._n
        self._rings = min(_MARGIN + int(slide / length), _WIDEST)
        self.keys = np.zeros(0, dtype=np.int64)
        self.extend()

    def extend(self) -> bool:
        """Make room for the pairs of the last evaluation and their neighbours; True if any rank had to. Collective."""
        keys = self.point_keys()
        new = keys[~self._known(keys)]
        if not self._comm.allreduce(len(new) > 0, op=MPI.LOR):
            return False
        facet, met = np.divmod(np.unique(new), self._n)
        which, near = self.pair.opposite.neighbours(met, self._rings)
        parts = self._comm.allgather(facet[which] * self._n + near)
        self.keys = np.unique(np.concatenate([self.keys, *parts]))
        return True

    def point_keys(self) -> np.ndarray:
        """The keys ``(m,)`` of this rank's points at the last evaluation."""
        facet, shape = self.pair.surface.facet, self.pair.surface.weight.shape
        return (facet[:, None] * self._n + self.pair.projection.facet.reshape(shape)).ravel()

    def _known(self, keys: np.ndarray) -> np.ndarray:
        if not len(self.keys):
            return np.zeros(len(keys), dtype=bool)
        at = np.searchsorted(self.keys, keys)
        return self.keys[np.minimum(at, len(self.keys) - 1)] == keys

    def facets(self) -> tuple[np.ndarray, np.ndarray]:
        """The facets ``(n,)`` that may meet: own and opposite."""
        return np.divmod(self.keys, self._n)
