"""The consistent linearisation of the contact forces as blocks of a matrix, each place once.

The kernel in C (contact_tangent.c has the formulas) adds up points in slots found once for facets
that may meet.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.basis import Array
from archord.kernels.compiled import library, pointer, structure
from archord.solver.contact.pair import Pair
from archord.solver.contact.sparsity import Reach
from archord.solver.contact.surface import Surface

_SOURCE = Path(__file__).with_name("contact_tangent.c")


class ContactTangent:
    """The blocks that this rank's points fill, at ``rows`` and ``columns`` ``(n,)`` in global block
    dofs, sorted.

    A rigid opposite has a block dof behind those of the displacement.
    """

    def __init__(self, reaches: list[Reach]) -> None:
        self._reaches, self._kernels = reaches, library(_SOURCE)
        parts = [reach.dofs() for reach in reaches]
        size = 1 + max((part[i].max(initial=0) for part in parts for i in (1, 2)), default=0)
        keys = [rows[:, :, None] * size + columns[:, None, :] for _, rows, columns in parts]
        unique = np.unique(
            np.concatenate([np.zeros(0, dtype=np.int64), *(k.ravel() for k in keys)])
        )
        self.rows, self.columns = np.divmod(unique, size)
        self._keys = [part[0] for part in parts]  # of the facets that may meet
        self._slots = [np.searchsorted(unique, key).astype(np.int32) for key in keys]

    def blocks(self) -> Array:
        """Derivative ``(n, 2, 2)`` of the residual at the last evaluation."""
        values = np.zeros((len(self.rows), 2, 2))
        for reach, keys, slots in zip(self._reaches, self._keys, self._slots, strict=True):
            place = np.searchsorted(keys, reach.point_keys()).astype(np.int32)
            self._kernels.contact_tangent(
                _points(reach.pair), *map(pointer, (place, slots, values))
            )
        return values


def trial_rate(pair: Pair, u: Array, levels: Array) -> Array:
    """What displacements ``u`` ``(n, 2)``, and a rigid opposite moved by ``levels`` ``(d,)`` of the
    drives, add to the trial tractions ``(m, 2)``, linearised at the last evaluation: points keep
    their partners. Collective."""
    opposite = pair.opposite
    motion = (
        opposite.curve_displacement(u)
        if isinstance(opposite, Surface)
        else levels[None] @ opposite.rate
    )
    own, partner = u[pair.surface.cell_dofs], motion[pair.projection.nodes]
    rate = np.empty_like(pair.trial)
    library(_SOURCE).trial_rate(_points(pair), *map(pointer, (own, partner, rate)))
    return rate


def _points(pair: Pair) -> Any:
    """What the kernels know of a pair, of arrays that it and its surface hold."""
    own, P = pair.surface, pair.projection
    sizes = *own.shape.shape, own.trace.shape[1], P.shape.shape[1]
    at_points = own.shape, own.gradient, own.trace, own.weight, pair.share, pair.gamma, pair.active
    state = pair.traction, pair.derivative, pair.stress_vector, pair.separation, pair.moduli
    opposite = P.shape, P.slope, P.normal, P.tangent, P.bend, pair.strayed, P.slides
    return structure(_SOURCE, "Side", (int(pair.moves), *sizes, *at_points, *state, *opposite))
