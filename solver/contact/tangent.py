"""The consistent linearisation of the contact forces as blocks of a matrix, each place once.

The kernel in C (contact_tangent.c, which has the formulas) adds up the points of a pairing in slots that are found once
for every facet and each opposite facet that it may meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.basis import Array
from archord.kernels.compiled import library, pointer, structure
from archord.solver.contact.pair import Kinematics, Pairing
from archord.solver.contact.surface import ContactSide

_SOURCE = Path(__file__).with_name("contact_tangent.c")
_KINEMATICS: dict[Kinematics, int] = {"tied": 0, "reference": 1, "current": 2}


@dataclass(frozen=True)
class _Slots:
    """Of this rank's ``n`` facets: those of facet ``f`` and opposite facet ``o`` are ``slots[base[f] + o - low[f]]``,
    ``(rows, columns)`` of the nodes of both."""

    base: np.ndarray
    low: np.ndarray
    slots: np.ndarray


class ContactTangent:
    """The blocks that this rank's points of ``pairings`` fill, at ``rows`` and ``columns`` ``(n,)`` in global block
    dofs, sorted; ``reaches`` are the first and last opposite facets of each facet of their curves, ``(n_facets, 2)``.

    A rigid opposite is the block dof behind the last.
    """

    def __init__(self, pairings: list[Pairing], reaches: list[np.ndarray]) -> None:
        self.pairings, self._kernels = pairings, library(_SOURCE)
        parts = [_dofs(pair, reach) for pair, reach in zip(pairings, reaches, strict=True)]
        size = 1 + max((part[i].max(initial=0) for part in parts for i in (2, 3)), default=0)
        keys = [rows[:, :, None] * size + columns[:, None, :] for _, _, rows, columns in parts]
        unique = np.unique(np.concatenate([k.ravel() for k in keys]))
        self.rows, self.columns = np.divmod(unique, size)
        self._slots = [
            _Slots(base, low, np.searchsorted(unique, key).astype(np.int32))
            for (base, low, _, _), key in zip(parts, keys, strict=True)
        ]

    def blocks(self) -> Array:
        """Derivative ``(n, 2, 2)`` of the residual at the pairings' last evaluation."""
        values = np.zeros((len(self.rows), 2, 2))
        for pair, slots in zip(self.pairings, self._slots, strict=True):
            places = slots.base, slots.low, slots.slots, values
            self._kernels.contact_tangent(_points(pair), *map(pointer, places))
        return values


def _dofs(pair: Pairing, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """``base`` and ``low`` as in `_Slots`, and dofs of rows ``(pairs, k + o)`` and columns ``(pairs, a + o)``."""
    side = pair.side
    if isinstance(pair.opposite, ContactSide):
        low, high = reach[side.facet].T
        count = np.maximum(high - low + 1, 0)
        low = np.where(count > 0, low, 0)
    else:
        low, count = np.zeros(len(side.facet), dtype=np.int64), np.ones(len(side.facet), dtype=np.int64)
    base = np.cumsum(count) - count
    facet = np.repeat(np.arange(len(count)), count)
    met = np.arange(len(facet)) - base[facet] + low[facet]
    if isinstance(pair.opposite, ContactSide):
        there = pair.opposite.curve_dofs[pair.opposite.curve.connectivity[met]]
    else:
        there = np.full((len(facet), 1), side.V.dofmap.index_map.size_global)
    rows = np.take_along_axis(side.cell_global, side.trace, axis=1)[facet]
    columns = side.cell_global[facet]
    rows, columns = np.concatenate([rows, there], axis=1), np.concatenate([columns, there], axis=1)
    return base.astype(np.int32), low.astype(np.int32), rows, columns


def pressure_rate(pair: Pairing, u: Array, motion: Array) -> Array:
    """What displacements ``u`` ``(n, 2)``, with the opposite moved by ``motion``, add to the trial pressures ``(m,)``,
    linearised at the last evaluation, where points keep their partners."""
    own = u[pair.side.cell_dofs]
    opposite = motion[pair.projection.nodes] if isinstance(pair.opposite, ContactSide) else motion[None]
    opposite = np.ascontiguousarray(np.broadcast_to(opposite, (*pair.projection.shape.shape, 2)))
    rate = np.empty(len(pair.pressure))
    library(_SOURCE).contact_pressure_rate(_points(pair), *map(pointer, (own, opposite, rate)))
    return rate


def _points(pair: Pairing) -> Any:
    """What the kernels know of a pairing, of arrays that it and its side hold."""
    side, P = pair.side, pair.projection
    sizes = *side.shape.shape, side.trace.shape[1], P.shape.shape[1]
    at_points = side.shape, side.gradient, side.trace, side.outward, side.weight, pair.share
    state = pair.gamma, pair.active, pair.pressure, pair.traction, pair.separation, pair.gap, pair.tangent
    opposite = P.shape, P.slope, P.normal, P.tangent, P.bend, P.slides, P.facet
    members = _KINEMATICS[pair.kinematics], *sizes, *at_points, *state, *opposite
    return structure(_SOURCE, "Side", members)
