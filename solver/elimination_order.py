"""In which order to eliminate the unknowns of a sparse matrix: METIS's nested dissection (Karypis and Kumar 1998)."""

from __future__ import annotations

from functools import cache
from typing import Any

import cffi
import numpy as np

_PROTOTYPES = """
int METIS_NodeND(int32_t *n, int32_t *offsets, int32_t *neighbours, int32_t *weights, int32_t *options, int32_t *order,
                 int32_t *place);
"""
_LIBRARY = "libmetis.so.5"  # gmsh's


@cache
def _metis() -> tuple[cffi.FFI, Any]:
    ffi = cffi.FFI()
    ffi.cdef(_PROTOTYPES)
    return ffi, ffi.dlopen(_LIBRARY)


def available() -> bool:
    """Whether METIS is installed."""
    try:
        _metis()
    except OSError:
        return False
    return True


def nested_dissection(n: int, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Places ``(n,)`` of ``n`` unknowns in an order with little fill-in; ``rows`` and ``columns`` ``(k,)`` are coupled, one
    way or the other. Raises MemoryError if METIS does not get what it needs."""
    apart = rows != columns
    rows, columns = rows[apart].astype(np.int64), columns[apart].astype(np.int64)
    row, column = np.divmod(np.unique(np.concatenate([rows * n + columns, columns * n + rows])), max(n, 1))
    place = np.arange(n, dtype=np.int32)
    if not len(row):
        return place
    offsets = np.searchsorted(row, np.arange(n + 1)).astype(np.int32)
    ffi, metis = _metis()
    arrays = np.array([n], dtype=np.int32), offsets, column.astype(np.int32), np.empty(n, dtype=np.int32), place
    size, at, neighbours, order, places = (ffi.from_buffer("int32_t[]", a) for a in arrays)
    if metis.METIS_NodeND(size, at, neighbours, ffi.NULL, ffi.NULL, order, places) != 1:
        raise MemoryError("METIS found no order of elimination")
    return place
