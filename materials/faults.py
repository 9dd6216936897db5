"""What is wrong with the numbers of a material."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import is_dataclass
from typing import Any, get_args

import numpy as np

from archord.materials.material import Material, Plane
from archord.report.errors import is_number, shown

_BOUNDS = {"E": (1e-30, 1e30), "nu": (-1.0, 0.5)}


def fault_of(material: Material) -> str:
    """What is wrong with the constants of a ``material`` that has them; empty if nothing is.

    A yield stress that is no number, or that decreases, would be taken for another material
    without a word.
    """
    for key, (low, high) in _BOUNDS.items():
        value = getattr(material, key, low)
        if hasattr(material, key) and not (is_number(value) and low < value < high):
            return f"{key} = {shown(value)} must be a number between {low:g} and {high:g}"
    plane = getattr(material, "plane", None)
    if not (plane is None or plane in get_args(Plane)):
        return f"plane = {shown(plane)} must be one of {', '.join(get_args(Plane))}"
    if not isinstance(material.elastic_tangent, np.ndarray):
        return f"elastic_tangent = {shown(material.elastic_tangent)} must be an array"
    hardening: Any = getattr(material, "hardening", None)
    if hardening is None:
        return ""
    if not hasattr(hardening, "stress"):
        return f"hardening = {shown(hardening)} must be a hardening law, such as LinearHardening"
    knots = np.array(hardening.knots(), dtype=float)
    given = knots.copy()
    stress = np.array(hardening.stress(given))
    slope = hardening.slope(given)
    if not np.array_equal(given, knots):
        return "hardening: stress and slope must not change the array of PEEQ that they get"
    if stress.shape != knots.shape or np.shape(slope) not in ((), knots.shape):
        return "hardening: stress and slope must give one number for each PEEQ"
    grows = (stress[1:] >= stress[:-1]).all()
    if not (grows and stress[0] > 0):
        return "hardening: yield stresses must be positive and must not decrease with PEEQ"
    if getattr(material, "back_stresses", ()) and np.isinf(stress[0]):
        return "back_stresses need a hardening, such as LinearHardening, as nothing yields without"
    return ""


def overwrites(answer: Callable[..., Any], *inputs: Sequence[Any]) -> bool:
    """Whether arrays of an ``answer`` to the first of the ``inputs`` change with later answers, as
    where all are written into one buffer."""
    first = answer(*inputs[0])
    kept = deepcopy(first)
    for others in inputs[1:]:
        answer(*others)
    return not _is_same(first, kept)


def _is_same(one: Any, other: Any) -> bool:
    """Whether two answers, of arrays and dataclasses of arrays, have the same numbers."""
    if is_dataclass(one):
        one, other = (tuple(vars(state).values()) for state in (one, other))
    if isinstance(one, tuple):
        return all(map(_is_same, one, other))
    return one is other or np.array_equal(one, other, equal_nan=True)
