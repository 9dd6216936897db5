"""Which matrix entries a contact may fill, kept ahead of the sliding pairs and the same on every rank."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from archord.solver.contact.pair import Pairing
from archord.solver.contact.surface import ContactSide

_MARGIN = 2  # opposite facets kept in the pattern on either side of those that are paired
_WIDEST = 16  # the same where pairs are expected to slide further


class ContactPattern:
    """Ranges of opposite facets that each facet of each pairing may meet, where pairs are expected to slide by a length
    ``slide``. Collective over ``comm``."""

    def __init__(self, comm: MPI.Comm, pairings: list[Pairing], slide: float = 0.0) -> None:
        self.comm, self.pairings = comm, pairings
        self._margins = [self._margin(pair, slide) for pair in pairings]
        # per pairing, first and last opposite facet of every facet of the curve; empty: first > last
        self.reach = [np.tile([np.iinfo(np.int64).max, -1], (p.side.curve.n_facets, 1)) for p in pairings]
        self.extend()

    def extend(self) -> bool:
        """Widen the ranges to hold the pairs of the last evaluation; True if any rank had to."""
        grew = False
        for pair, margin, reach in zip(self.pairings, self._margins, self.reach, strict=True):
            if isinstance(pair.opposite, ContactSide):
                grew |= self._widen(pair, margin, pair.opposite.curve.n_facets - 1, reach)
        return grew

    def _margin(self, pair: Pairing, slide: float) -> int:
        """Opposite facets kept on either side of those that are paired: more where facets are short."""
        if not isinstance(pair.opposite, ContactSide):
            return 0
        length = self.comm.allreduce(float(pair.side.weight.sum())) / pair.opposite.curve.n_facets
        return min(_MARGIN + int(slide / length), _WIDEST)

    def _widen(self, pair: Pairing, margin: int, last: int, reach: np.ndarray) -> bool:
        facet, met = pair.side.facet, pair.projection.facet.reshape(pair.side.weight.shape)
        low, high = met.min(axis=1, initial=last), met.max(axis=1, initial=0)
        outside = (low < reach[facet, 0]) | (high > reach[facet, 1])
        if not self.comm.allreduce(bool(outside.any()), op=MPI.LOR):
            return False
        wanted = np.stack([reach[:, 0], -reach[:, 1]])  # both as minima, for one reduction
        at = facet[outside]
        wanted[0, at] = np.minimum(wanted[0, at], np.maximum(low[outside] - margin, 0))
        wanted[1, at] = np.minimum(wanted[1, at], -np.minimum(high[outside] + margin, last))
        self.comm.Allreduce(MPI.IN_PLACE, wanted, op=MPI.MIN)
        reach[:] = np.stack([wanted[0], -wanted[1]], axis=1)
        return True

    def entries(self) -> tuple[np.ndarray, np.ndarray]:
        """Block ``(rows, columns)`` in global dofs, each pair once, over all ranks."""
        rows, columns = [], []

        def all_pairs(r: np.ndarray, c: np.ndarray) -> None:
            rows.append(np.repeat(r, c.shape[1], axis=1).ravel())
            columns.append(np.tile(c, (1, r.shape[1])).ravel())

        for pair, reach in zip(self.pairings, self.reach, strict=True):
            own = pair.side.curve_cell_dofs
            trace = pair.side.curve_dofs[pair.side.curve.connectivity]
            all_pairs(trace, own)
            if isinstance(pair.opposite, ContactSide):
                count = np.maximum(reach[:, 1] - reach[:, 0] + 1, 0)
                facet = np.repeat(np.arange(len(count)), count)
                within = np.arange(len(facet)) - np.repeat(np.cumsum(count) - count, count)
                there = pair.opposite.curve_dofs[pair.opposite.curve.connectivity[reach[facet, 0] + within]]
                all_pairs(trace[facet], there)
                all_pairs(there, own[facet])
                all_pairs(there, there)
        row, column = np.concatenate(rows), np.concatenate(columns)
        size = 1 + max(row.max(), column.max())
        return np.divmod(np.unique(row * size + column), size)
