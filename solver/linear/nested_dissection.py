"""In which order to eliminate the unknowns of a sparse matrix: METIS's nested dissection (Karypis
and Kumar 1998)."""

from __future__ import annotations

from functools import cache
from typing import Any

import cffi
import numpy as np
from dolfinx import fem

from archord.geometry.basis import lagrange_element
from archord.kernels.compat import METIS
from archord.materials.kinematics import Ints

_PROTOTYPES = """
int METIS_NodeND(int32_t *n, int32_t *offsets, int32_t *neighbours, int32_t *weights,
                 int32_t *options, int32_t *order, int32_t *place);
"""


@cache
def metis() -> tuple[cffi.FFI, Any]:
    """METIS's library, and what makes its arguments. Raises OSError if it is not installed."""
    ffi = cffi.FFI()
    ffi.cdef(_PROTOTYPES)
    for path in METIS:
        try:
            return ffi, ffi.dlopen(path)
        except OSError:
            continue
    raise OSError("METIS is not installed")


def corners(V: fem.FunctionSpace) -> Ints:
    """The nodes ``(n_owned, k)``, in global numbers, at the corners of the edge or the cell that
    each of this rank's nodes of ``V`` lies on; those at corners are their own."""
    element = V.element.basix_element
    weight = lagrange_element(element.cell_type, 1).tabulate(0, element.points)[0, ..., 0]
    k = weight.shape[1]
    ends = np.where(weight > 1e-9, np.arange(k), weight.argmax(axis=1)[:, None])
    index_map = V.dofmap.index_map
    found = np.zeros((index_map.size_local + index_map.num_ghosts, k), dtype=np.int32)
    found[V.dofmap.list] = V.dofmap.list[:, ends]
    owned = found[: index_map.size_local]
    return index_map.local_to_global(owned.ravel()).reshape(-1, k)


def before_corners(n: int, rows: Ints, columns: Ints, corner: Ints) -> Ints:
    """As `nested_dissection`, quicker: only unknowns at corners are ordered by METIS, the others
    come right before the first one of their corners ``(n, k)``, -1 where that is none of the
    unknowns. That keeps what separates parts: of the nodes of an edge or a cell none is in a part
    without its corners."""
    alone = corner[:, 0] == np.arange(n)
    number = np.cumsum(alone) - 1
    both = alone[rows] & alone[columns]
    order = nested_dissection(int(alone.sum()), number[rows[both]], number[columns[both]])
    place = np.full(n + 1, n)  # the last is of no corner
    place[:-1][alone] = order
    first = np.where(alone, place[:n], place[corner].min(axis=1, initial=n))
    found = np.empty(n, dtype=np.int32)
    found[np.lexsort((alone, first))] = np.arange(n)
    return found


def nested_dissection(n: int, rows: Ints, columns: Ints) -> Ints:
    """Places ``(n,)`` of ``n`` unknowns in an order with little fill-in; ``rows`` and ``columns``
    ``(k,)`` are coupled, one way or the other. Raises MemoryError if METIS does not get what it
    needs."""
    place = np.arange(n, dtype=np.int32)
    apart = rows != columns
    row = rows[apart].astype(np.int64)
    column = columns[apart].astype(np.int64)
    pairs = np.unique(np.concatenate([row * n + column, column * n + row]))
    if not len(pairs):
        return place
    row, column = np.divmod(pairs, n)
    offsets = np.searchsorted(row, np.arange(n + 1)).astype(np.int32)
    order = np.empty(n, dtype=np.int32)
    ffi, library = metis()
    status = library.METIS_NodeND(
        ffi.from_buffer("int32_t[]", np.array([n], dtype=np.int32)),
        ffi.from_buffer("int32_t[]", offsets),
        ffi.from_buffer("int32_t[]", column.astype(np.int32)),
        ffi.NULL,
        ffi.NULL,
        ffi.from_buffer("int32_t[]", order),
        ffi.from_buffer("int32_t[]", place),
    )
    if status != 1:
        raise MemoryError("METIS found no order of elimination")
    return place
