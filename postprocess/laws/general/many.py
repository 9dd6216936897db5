"""Many joints at once: tables of joints in, forces out; a joint outside the range costs its own row
alone."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from archord.materials.material import Array
from archord.postprocess.laws.general.general_law import law_of_joint
from archord.postprocess.laws.general.joint import LawJoint, LawRangeWarning
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.report.by_name import ByName, Words
from archord.report.doubts import kind

Given = tuple[tuple[str, Any], ...]  # names and values

KNOWN = tuple(field.name for field in fields(LawJoint))
_IDLE = ("k", "c", "length")  # parameters of other laws
# parameters by which forces are others than the law's, and which the law does not know
_OTHERS = ("block_size", "whole", "fixed_pairs")


class Loads(NamedTuple):
    """What the law says of ``n`` joints; a row with a reason is nan, or has a nan where a
    displacement is missing.

    - ``load``, ``error`` ``(n,)`` or ``(n, k)``: forces, and errors that 9 in 10 joints keep
    - ``reason`` ``(n,)``: why a joint lacks forces, empty if it has all
    """

    load: Array
    error: Array
    reason: npt.NDArray[np.object_]


def loads(joints: Mapping[str, Any], delta: npt.ArrayLike, deepest: npt.ArrayLike = 0.0) -> Loads:
    """The forces of many joints by the general law.

    Parameters
    ----------
    joints : DataFrame or dict of arrays
        Columns ``(n,)`` named as the parameters of `LawJoint`, and numbers or words that hold for
        all rows. A missing value (nan, None) is the default of the parameter.
    delta : array (n,) or (n, k), or float
        Displacements of each joint, in the unit of its clearance.
    deepest : array (n,) or (n, k), or float
        The largest displacements before.

    Returns
    -------
    Loads
        Forces per unit length, their expected errors, and a reason for each row without.

    Raises
    ------
    ValueError
        For columns that no joint has or that change nothing, for arrays of different lengths, for
        displacements that are not of as many joints, and for tables of pandas whose indexes differ.

    Warns
    -----
    LawRangeWarning
        Once of each kind of joints that are softer or stiffer than the law's, as those in a small
        block or with a whole pin: their rows have forces.

    Examples
    --------
    >>> from archord.postprocess.laws.general.many import loads
    >>> joints = {"radius": 10.0, "E_star": 115e3, "plane": "strain", "nu": 0.3}
    >>> found = loads(joints | {"clearance": [0.05, 0.1, 1.0]}, delta=0.05)
    >>> found.load.round()
    array([6342., 5245.,   nan])
    >>> found.reason[2]
    'archord: dR/R = 0.1 is outside 0.001 to 0.02'
    """
    _require_one_index(joints, delta, deepest)
    rows = _rows(joints)
    n = len(rows)
    deltas, deepests = _of_joints(n, delta, deepest)
    shape = deltas.shape
    load = np.full(shape, np.nan)
    error = np.full(shape, np.nan)
    reason = np.full(n, "", dtype=object)
    _warn_of(rows)
    for row, given in enumerate(rows):
        try:
            law = _law(given)
        except (TypeError, ValueError) as fault:
            reason[row] = str(fault).removesuffix(".")
            continue
        farthest = max(np.max(deltas[row], initial=0.0), np.max(deepests[row], initial=0.0))
        if farthest > law.limit * law.reach / law.x[-1]:
            reason[row] = f"archord: delta = {farthest:g} is beyond {law.limit:g}, 3 dR"
            continue
        if np.isnan(deltas[row] + deepests[row]).any():
            reason[row] = "archord: a displacement is missing"
        state = law.at(deltas[row], deepests[row])
        load[row] = state.load
        error[row] = state.error
    return Loads(load, error, reason)


def _require_one_index(
    joints: Mapping[str, Any], delta: npt.ArrayLike, deepest: npt.ArrayLike
) -> None:
    """Raise ValueError for tables of pandas of which one has its rows in another order: rows are
    taken one after the other, whatever their labels."""
    given: ByName = {"joints": joints, "delta": delta, "deepest": deepest}
    if not hasattr(joints, "iloc"):
        given |= joints
    tables = {name: table for name, table in given.items() if hasattr(table, "iloc")}
    first = next(iter(tables), "")
    for name, table in tables.items():
        if not table.index.equals(tables[first].index):
            said = f"{name}: has another index than {first}"
            raise ValueError(f"{said}, and rows count by their order; reindex one of them.")


def _of_joints(n: int, delta: npt.ArrayLike, deepest: npt.ArrayLike) -> tuple[Array, Array]:
    """Both as arrays of ``n`` joints, ``(n,)`` or, if one of them is, ``(n, k)``."""
    given = [np.asarray(delta, float), np.asarray(deepest, float)]
    rank = max(1, *(values.ndim for values in given))
    each = [values[:, None] if values.ndim == 1 < rank else values for values in given]
    try:
        shape = np.broadcast_shapes((n, 1)[:rank], *(values.shape for values in each))
    except ValueError:
        shape = ()
    if shape[:1] != (n,) or rank > 2:
        shapes = " and ".join(str(values.shape) for values in given)
        raise ValueError(f"delta and deepest: shapes {shapes} are not of {n} joints.")
    deltas, deepests = (np.broadcast_to(values, shape) for values in each)
    return deltas, deepests


def _warn_of(rows: list[Given]) -> None:
    """Warn of each kind of joints, at the first of the ``rows``, whose forces are others than the
    law's."""
    first: Words = {}
    for row, given in enumerate(rows):
        is_thin = ("plane", "stress") in given
        if not (is_thin or any(name in _OTHERS and value for name, value in given)):
            continue
        with suppress(TypeError, ValueError):  # its row tells why it is no joint
            for what in LawJoint(**dict(given)).unlike_solved:
                first.setdefault(kind(what), f"joint {row}: archord: is a law {what}")
    for text in first.values():
        warnings.warn(LawRangeWarning(text), stacklevel=3)


def _rows(joints: Mapping[str, Any]) -> list[Given]:
    """The parameters of each joint that are given."""
    columns = {str(name): np.asarray(joints[name]) for name in joints}
    unknown = [name for name in columns if name not in KNOWN]
    if unknown:
        raise ValueError(f"{', '.join(unknown)}: no parameter of a joint; {', '.join(KNOWN)} are.")
    for name in _IDLE:
        usual = getattr(LawJoint, name)
        if any(_is_given(value) and value != usual for value in np.ravel(columns.get(name, usual))):
            said = "changes nothing here: forces are the general law's, per unit length"
            raise ValueError(f"{name}: {said}.")
    try:
        every = np.broadcast_arrays(*map(np.atleast_1d, columns.values()))
    except ValueError:
        lengths = ", ".join(f"{name} {column.shape}" for name, column in columns.items())
        raise ValueError(f"joints: columns of different lengths: {lengths}.") from None
    values = zip(*(column.tolist() for column in every), strict=True)
    return [
        tuple(pair for pair in zip(columns, row, strict=True) if _is_given(pair[1]))
        for row in values
    ]


def _is_given(value: Any) -> bool:
    return value is not None and value == value


@lru_cache(maxsize=4096)
def _law(given: Given) -> JointCurve:
    """The law of the joint with the parameters ``given``. Raises ValueError, TypeError."""
    return law_of_joint(LawJoint(**dict(given)))
