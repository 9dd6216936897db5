"""Which facets may meet, and so which matrix entries a contact may fill: kept ahead of the sliding
pairs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from archord.solver.contact.pair import Pair

# rings of opposite facets kept in the pattern around those that are paired, by the components of a
# displacement: in space rings are large, and the matrix of the contact is quickly made again
_MARGIN = {2: 2, 3: 0}
_WIDEST = 16  # the same where pairs are expected to slide further


class Meetings(NamedTuple):
    """The facets of this rank with the opposite facets that each may meet, ``p`` of them."""

    keys: np.ndarray  # (p,) see Reach
    rows: np.ndarray  # (p, k + o) block dofs that get forces
    columns: np.ndarray  # (p, a + o) block dofs on which the forces depend


class Reach:
    """Which opposite facets each facet of a ``pair`` may meet, where points slide by about
    ``slide``. Collective.

    keys : (p,) own facet times the number of opposite facets, plus opposite facet; sorted and alike
        on all ranks
    """

    def __init__(self, pair: Pair, slide: float) -> None:
        self.pair = pair
        self._comm = pair.surface.comm
        self._n_opposite = pair.opposite.n_facets
        length = pair.surface.facet_lengths().sum() / self._n_opposite
        margin = _MARGIN[pair.opposite.curve.X.shape[1]]
        self._rings = min(margin + int(slide / length), _WIDEST)
        self.keys = np.zeros(0, dtype=np.int64)
        self._last = self.keys  # of the points at the last call
        self.extend()

    def extend(self) -> bool:
        """Make room for the pairs of the last evaluation and their neighbours; True if any rank had
        to. Collective."""
        keys = self.point_keys()
        new = keys[:0] if np.array_equal(keys, self._last) else np.setdiff1d(keys, self.keys)
        self._last = keys
        if not self._comm.allreduce(len(new) > 0, op=MPI.LOR):
            return False
        own, met = np.divmod(new, self._n_opposite)
        place, near = self.pair.opposite.curve.neighbours(met, self._rings)
        keys_of_ranks = self._comm.allgather(own[place] * self._n_opposite + near)
        self.keys = np.unique(np.concatenate([self.keys, *keys_of_ranks]))
        return True

    def point_keys(self) -> np.ndarray:
        """The keys ``(m,)`` of this rank's points at the last evaluation."""
        surface = self.pair.surface
        met = self.pair.projection.facet.reshape(surface.weight.shape)
        return (surface.facet[:, None] * self._n_opposite + met).ravel()

    def meetings(self) -> Meetings:
        """The meetings of this rank's facets."""
        surface = self.pair.surface
        opposite = self.pair.opposite
        facet, met = np.divmod(self.keys, self._n_opposite)
        here = np.isin(facet, surface.facet)
        own = np.searchsorted(surface.facet, facet[here])
        of_opposite = opposite.curve_dofs[opposite.curve.connectivity[met[here]]]
        of_cell = surface.cell_global[own]
        on_facet = np.take_along_axis(surface.cell_global, surface.trace, axis=1)[own]
        rows = np.concatenate([on_facet, of_opposite], axis=1)
        columns = np.concatenate([of_cell, of_opposite], axis=1)
        return Meetings(self.keys[here], rows, columns)
