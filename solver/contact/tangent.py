"""The consistent tangent of the contact forces as blocks of a matrix, each place once.

The kernels in C add up points in slots found once for facets that may meet. Their formulas are in
contact_tangent.c for curves in a plane, in space_tangent.c for surfaces in space.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.patches import PatchProjection
from archord.kernels.compiled import library, pointer, structure
from archord.solver.contact.pair import Answers, Pair
from archord.solver.contact.sparsity import Meetings, Reach
from archord.solver.contact.surface import Surface

_PLACES = Path(__file__).with_name("places.c")
_SOURCES = {  # by the dimension
    2: Path(__file__).with_name("contact_tangent.c"),
    3: Path(__file__).with_name("space_tangent.c"),
}


class Filled(NamedTuple):
    """Blocks that points fill, where others are zero."""

    at: np.ndarray  # (k,) numbers of their places
    values: Array  # (k, d, d)


class ContactTangent:
    """The blocks that this rank's points fill.

    A rigid opposite has a block dof behind the block dofs of the displacement. Arrays:

    rows, columns : (n,) places of the blocks in global block dofs, sorted
    """

    def __init__(self, reaches: list[Reach], block_size: int) -> None:
        self._reaches = reaches
        self._block_size = block_size
        self._kernels = library(_SOURCES[block_size])
        meetings = [reach.meetings() for reach in reaches]
        self.rows, self.columns, slots = _numbered(meetings)
        self._keys = [m.keys for m in meetings]
        self._slots = slots

    def blocks(self) -> Array:
        """Derivative ``(n, d, d)`` of the residual at the last evaluation."""
        values = np.zeros((len(self.rows), self._block_size, self._block_size))
        every = np.arange(len(self.rows), dtype=np.int32)
        for reach, keys, slots in zip(self._reaches, self._keys, self._slots, strict=True):
            place = np.searchsorted(keys, reach.point_keys()).astype(np.int32)
            self._add(reach.pair, reach.pair.answers(), place, slots, every, values)
        return values

    def filled(self, *, by_changes: bool = False) -> Filled:
        """The same where points carry something; or what the branches add to it to which points
        have gone over since the last evaluation."""
        is_filled = np.zeros(len(self.rows), dtype=bool)
        met = []
        for reach, keys, slots in zip(self._reaches, self._keys, self._slots, strict=True):
            answers = reach.pair.changes_of_answers() if by_changes else reach.pair.answers()
            # points that carry nothing may have any place
            place = np.searchsorted(keys, reach.point_keys()).astype(np.int32)
            used = np.unique(place[answers.active])
            if len(used):
                is_filled[slots.reshape(len(keys), -1)[used]] = True
            met.append((reach.pair, answers, place, slots))
        at = np.flatnonzero(is_filled)
        number = np.zeros(len(self.rows), dtype=np.int32)
        number[at] = np.arange(len(at))
        values = np.zeros((len(at), self._block_size, self._block_size))
        for pair, answers, place, slots in met:
            self._add(pair, answers, place, slots, number, values)
        return Filled(at, values)

    def _add(self, pair: Pair, answers: Answers, *arrays: np.ndarray) -> None:
        """Add the derivative at the points of a ``pair``: see the kernel for the ``arrays``."""
        self._kernels.contact_tangent(_side(pair, answers), *map(pointer, arrays))


def _numbered(
    meetings: Sequence[Meetings],
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Rows and columns ``(n,)`` of the different places that ``meetings`` fill, sorted, and for
    each of the meetings the numbers ``(p (k + o) (a + o),)`` of their places among them."""
    parts: list[list[np.ndarray]] = [[np.zeros(0, dtype=np.int64)] for _ in range(4)]
    rows, begins, widths, columns = parts
    before = 0
    for m in meetings:
        p, n_rows = m.rows.shape
        width = m.columns.shape[1]
        rows.append(m.rows.ravel())
        begins.append(before + np.repeat(width * np.arange(p), n_rows))
        widths.append(np.full(p * n_rows, width))
        columns.append(m.columns.ravel())
        before += m.columns.size
    row, begin, width_of, column = (
        np.concatenate(of_meetings).astype(np.int32) for of_meetings in parts
    )
    sizes = [m.rows.size * m.columns.shape[1] for m in meetings]
    slot, unique_rows, unique_columns = (np.empty(sum(sizes), dtype=np.int32) for _ in range(3))
    n = library(_PLACES).number_places(
        len(row),
        *map(pointer, (row, begin, width_of, column)),
        row.max(initial=-1) + 1,
        column.max(initial=-1) + 1,
        *map(pointer, (slot, unique_rows, unique_columns)),
    )
    if n < 0:
        raise MemoryError
    slots = np.split(slot, np.cumsum(sizes, dtype=int)[:-1]) if sizes else []
    return unique_rows[:n].astype(np.int64), unique_columns[:n].astype(np.int64), slots


def point_rates(pair: Pair, u: Array, levels: Array) -> tuple[Array, Array]:
    """What displacements ``u`` ``(n, d)``, and a rigid opposite moved by ``levels`` of the drives,
    add to the trial tractions and to the openings, ``(m, d)`` each.

    They are linearised at the last evaluation: points keep their partners. Collective.
    """
    opposite = pair.opposite
    if isinstance(opposite, Surface):
        motion = opposite.curve_displacement(u)
    else:
        motion = levels[None] @ opposite.rate
    own = u[pair.surface.cell_dofs]
    partner = motion[pair.projection.nodes]
    trial = np.empty_like(pair.trial)
    opening = np.empty_like(pair.trial)
    arrays = own, partner, trial, opening
    library(_SOURCES[u.shape[1]]).point_rates(_side(pair, pair.answers()), *map(pointer, arrays))
    return trial, opening


def _side(pair: Pair, answers: Answers) -> Any:
    """The structure ``Side`` for the kernels, of the ``answers`` and of arrays that the pair and
    its surface hold."""
    surface = pair.surface
    partners = pair.projection
    n, q, a = surface.shape.shape
    members = {
        "moves": int(pair.moves and pair.follows),
        "n": n,
        "q": q,
        "a": a,
        "k": surface.trace.shape[1],
        "o": partners.shape.shape[1],
        "m": surface.derivative.shape[3],
        "g": pair.moduli.shape[2],
        "shape": surface.shape,
        "derivative": surface.derivative,
        "terms": surface.terms,
        "trace": surface.trace,
        "weight": surface.weight,
        "share": pair.share,
        "gamma": pair.gamma,
        "active": answers.active,
        "traction": answers.traction,
        "by_trial": answers.by_trial,
        "has_by_opening": int(answers.by_opening is not None),
        "by_opening": answers.by_trial if answers.by_opening is None else answers.by_opening,
        "stress_vector": pair.stress_vector,
        "moduli": pair.moduli,
        "separation": pair.separation,
        "strayed": pair.strayed,
        "partner_shape": partners.shape,
        "partner_slope": partners.slope,
        "tangent": partners.tangent,
        "bend": partners.bend,
    }
    if isinstance(partners, PatchProjection):
        members |= {
            "frame": pair.frame,
            "spin": pair.spin,
            "opening": pair.opening,
            "along": partners.along,
        }
    else:
        members |= {"normal": partners.normal, "slides": partners.slides}
    return structure(_SOURCES[pair.trial.shape[1]], "Side", members)
