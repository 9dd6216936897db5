"""The consistent linearisation of the contact forces as blocks of a matrix, each place once, and the facets that may
meet, of which these places follow: kept ahead of the sliding pairs.

The kernel in C (contact_tangent.c, which has the formulas) adds up the points of a pair of surfaces in slots that are
found once for every two facets that may meet.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.kernels.compiled import library, pointer, structure
from archord.solver.contact.pair import Pair
from archord.solver.contact.surface import Surface, neighbours

_SOURCE = Path(__file__).with_name("contact_tangent.c")
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
        new = np.setdiff1d(self.point_keys(), self.keys)
        if not self._comm.allreduce(len(new) > 0, op=MPI.LOR):
            return False
        facet, met = np.divmod(new, self._n)
        which, near = neighbours(self._n, met, self._rings)
        parts = self._comm.allgather(facet[which] * self._n + near)
        self.keys = np.unique(np.concatenate([self.keys, *parts]))
        return True

    def point_keys(self) -> np.ndarray:
        """The keys ``(m,)`` of this rank's points at the last evaluation."""
        facet, shape = self.pair.surface.facet, self.pair.surface.weight.shape
        return (facet[:, None] * self._n + self.pair.projection.facet.reshape(shape)).ravel()

    def dofs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Keys ``(p,)`` of the facets of this rank and those that they may meet, dofs of rows ``(p, k + o)`` and of
        columns ``(p, a + o)``."""
        surface, opposite = self.pair.surface, self.pair.opposite
        facet, met = np.divmod(self.keys, self._n)
        here = np.isin(facet, surface.facet)
        own = np.searchsorted(surface.facet, facet[here])
        there = opposite.curve_dofs[opposite.curve.connectivity[met[here]]]
        rows = np.take_along_axis(surface.cell_global, surface.trace, axis=1)[own]
        columns = surface.cell_global[own]
        return self.keys[here], np.concatenate([rows, there], axis=1), np.concatenate([columns, there], axis=1)


class ContactTangent:
    """The blocks that this rank's points fill, at ``rows`` and ``columns`` ``(n,)`` in global block dofs, sorted.

    A rigid opposite has a block dof behind those of the displacement.
    """

    def __init__(self, reaches: list[Reach]) -> None:
        self._reaches, self._kernels = reaches, library(_SOURCE)
        parts = [reach.dofs() for reach in reaches]
        size = 1 + max((part[i].max(initial=0) for part in parts for i in (1, 2)), default=0)
        keys = [rows[:, :, None] * size + columns[:, None, :] for _, rows, columns in parts]
        unique = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(k.ravel() for k in keys)]))
        self.rows, self.columns = np.divmod(unique, size)
        self._keys = [part[0] for part in parts]  # of the facets that may meet
        self._slots = [np.searchsorted(unique, key).astype(np.int32) for key in keys]

    def blocks(self) -> Array:
        """Derivative ``(n, 2, 2)`` of the residual at the last evaluation."""
        values = np.zeros((len(self.rows), 2, 2))
        for reach, keys, slots in zip(self._reaches, self._keys, self._slots, strict=True):
            place = np.searchsorted(keys, reach.point_keys()).astype(np.int32)
            self._kernels.contact_tangent(_points(reach.pair), *map(pointer, (place, slots, values)))
        return values


def trial_rate(pair: Pair, u: Array) -> Array:
    """What displacements ``u`` ``(n, 2)`` add to the trial tractions ``(m, 2)``, linearised at the last evaluation:
    points keep their partners, and a rigid opposite stands still. Collective."""
    motion = pair.opposite.curve_displacement(u) if isinstance(pair.opposite, Surface) else np.zeros((1, 2))
    own, opposite = u[pair.surface.cell_dofs], motion[pair.projection.nodes]
    rate = np.empty_like(pair.trial)
    library(_SOURCE).trial_rate(_points(pair), *map(pointer, (own, opposite, rate)))
    return rate


def _points(pair: Pair) -> Any:
    """What the kernels know of a pair, of arrays that it and its surface hold."""
    own, P = pair.surface, pair.projection
    sizes = *own.shape.shape, own.trace.shape[1], P.shape.shape[1]
    at_points = own.shape, own.gradient, own.trace, own.outward, own.weight, pair.share, pair.gamma, pair.active
    state = pair.traction, pair.derivative, pair.stress_vector, pair.separation, pair.opening, pair.moduli
    opposite = P.shape, P.slope, P.normal, P.tangent, P.bend, P.slides
    return structure(_SOURCE, "Side", (int(pair.moves), *sizes, *at_points, *state, *opposite))
