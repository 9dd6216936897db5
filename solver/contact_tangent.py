"""The consistent linearisation of the contact forces as blocks of a matrix, each place once.

The kernel in C (contact_tangent.c, which has the formulas) adds up the points of a pairing in slots that are found once
for every facet and each opposite facet that it may meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from archord.geometry.basis import Array
from archord.kernels.compiled import library, pointer
from archord.solver.contact_pairing import Kinematics, Pairing
from archord.solver.contact_side import ContactSide

_KINEMATICS: dict[Kinematics, int] = {"tied": 0, "reference": 1, "current": 2}
_PROTOTYPE = """void contact_tangent(int32_t kinematics, int32_t n, int32_t q, int32_t a, int32_t k, int32_t o,
    const double *own_shape, const double *gradient, const int32_t *trace, const double *outward,
    const double *weight, double share, const double *gamma, const uint8_t *active, const double *pressure,
    const double *traction, const double *separation, const double *gap, const double *moduli,
    const double *shape, const double *slope, const double *normal, const double *tangent, const double *bend,
    const uint8_t *slides, const int32_t *facet, const int32_t *base, const int32_t *low, const int32_t *slots,
    double *values);"""


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
        self.pairings = pairings
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
            _add(pair, slots, values)
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


def _add(pair: Pairing, slots: _Slots, values: Array) -> None:
    side, P = pair.side, pair.projection
    n, q, a = side.shape.shape
    sizes = n, q, a, side.trace.shape[1], P.shape.shape[1]
    active = np.ascontiguousarray(pair.active)
    at_points = (side.shape, side.gradient, side.trace, side.outward, side.weight)
    state = (pair.gamma, active, pair.pressure, pair.traction, pair.separation, pair.gap, pair.tangent)
    opposite = (P.shape, P.slope, P.normal, P.tangent, P.bend, P.slides, P.facet)
    places = (slots.base, slots.low, slots.slots, values)
    library("contact_tangent", _PROTOTYPE).contact_tangent(
        _KINEMATICS[pair.kinematics], *sizes, *map(pointer, at_points), pair.share,
        *map(pointer, state + opposite + places),
    )  # fmt: skip
