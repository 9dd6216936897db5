"""The measures of the parts of a general problem: loads, supports, interactions and bodies."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from archord.measures.edge import SurfaceProfile
from archord.measures.measure import Accepted, Measure
from archord.scene.columns import part_columns
from archord.scene.problem import ProblemScene

Value = Callable[[Accepted, str], float]  # of a part by its name

_AXES = {"x": 0, "y": 1, "r": 0, "z": 1}  # in a plane, and of a body of revolution


def _component(k: int, vector: Callable[[Accepted, str], Any]) -> Value:
    return lambda state, part: vector(state, part)[k]


def _along(prefix: str, vector: Callable[[Accepted, str], Any], first: int = 0) -> dict[str, Value]:
    """The components of a ``vector`` by the names of their axes after a ``prefix``."""
    return {f"{prefix}{axis}": _component(first + k, vector) for axis, k in _AXES.items()}


def _contact_length(state: Accepted, contact: str) -> float:
    return float(np.mean([profile.contact_length for profile in state.met[contact]]))


_LOAD: dict[str, Value] = {
    "displacement": lambda state, load: state.driven[load][0],
    "force": lambda state, load: state.driven[load][1],
}
_SUPPORT: dict[str, Value] = {
    **_along("", lambda state, support: state.reaction(support)),
    "moment": lambda state, support: state.reaction_moment(support),
}
_INTERACTION: dict[str, Value] = {
    **_along("force ", lambda state, contact: state.contact_force(contact)),
    "moment": lambda state, contact: state.contact_moment(contact),
    "largest pressure": lambda state, contact: _most_pressed(state, contact).largest[0],
    **_along("at ", lambda state, contact: _most_pressed(state, contact).largest[1]),
    "contact length": _contact_length,
    "contact area": _contact_length,  # of a ring, whose measure has 2 pi r
    "largest slip": lambda state, contact: max(p.largest_slip for p in state.met[contact]),
    "arcs": lambda state, contact: state.met[contact][-1].n_arcs,
    "largest shear": lambda state, contact: max(p.largest_shear for p in state.met[contact]),
}
_BODY: dict[str, Value] = {
    "peeq_max": lambda state, body: state.largest_peeq(body)[0],
    **_along("at ", lambda state, body: state.largest_peeq(body), first=1),
}
_VALUES = {
    "load": _LOAD,
    "support": _SUPPORT,
    "coupling": _SUPPORT,
    "interaction": _INTERACTION,
    "body": _BODY,
}


def part_measures(scene: ProblemScene) -> list[Measure]:
    """The measures of the parts of ``scene``, in the order of the columns."""
    measures = []
    for section, part, what, unit in part_columns(scene):
        value = partial(_value, _VALUES[section].get(what) or _of_law(what), part)
        measures.append(Measure(f"{part} {what}", unit, value))
    return measures


def _value(value: Value, part: str, state: Accepted) -> float:
    return value(state, part)


def _of_law(quantity: str) -> Value:
    """What the law of an interaction tells by this name."""
    return lambda state, contact: state.quantities(contact)[quantity][0]


def _most_pressed(state: Accepted, contact: str) -> SurfaceProfile:
    """The surface of an interaction with the largest pressure."""
    return max(state.met[contact], key=lambda profile: profile.largest[0])
