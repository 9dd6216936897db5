"""The measures of the parts of a general problem: loads, supports, interactions and bodies."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from archord.measures.edge import AnyProfile
from archord.measures.measure import Accepted, Measure
from archord.scene.columns import part_columns
from archord.scene.parts import CouplingSection
from archord.scene.problem import ProblemScene

Value = Callable[[Accepted, str], float]  # of a part by its name

_AXES = ("x", "y", "z", "r")


def _component(axis: str, vector: Callable[[Accepted, str], Any], first: int) -> Value:
    return lambda state, part: vector(state, part)[first + state.axes.index(axis)]


def _along(prefix: str, vector: Callable[[Accepted, str], Any], first: int = 0) -> dict[str, Value]:
    """The components of a ``vector``, the ``first`` and those after it, by the names of their axes
    after a ``prefix``."""
    return {f"{prefix}{axis}": _component(axis, vector, first) for axis in _AXES}


def _moments(moments: Callable[[Accepted, str], Any]) -> dict[str, Value]:
    """The one moment of a plane, and the moments about the axes of space."""
    return {"moment": lambda state, part: moments(state, part)[-1], **_along("moment ", moments)}


def _contact_length(state: Accepted, contact: str) -> float:
    """Of the whole, as the force is."""
    modelled = np.mean([profile.contact_length for profile in state.met[contact]])
    return state.system.problem.symmetry * float(modelled)


def _contact_fraction(state: Accepted, contact: str) -> float:
    return float(np.mean([p.contact_length / p.width.sum() for p in state.met[contact]]))


_LOAD: dict[str, Value] = {
    "displacement": lambda state, load: state.driven[load][0],
    "force": lambda state, load: state.driven[load][1],
}
_SUPPORT: dict[str, Value] = {
    **_along("", lambda state, support: state.reaction(support)),
    **_moments(lambda state, support: state.reaction_moments(support)),
}
_INTERACTION: dict[str, Value] = {
    **_along("force ", lambda state, contact: state.contact_force(contact)),
    **_moments(lambda state, contact: state.contact_moments(contact)),
    "largest pressure": lambda state, contact: _most_pressed(state, contact).largest[0],
    **_along("at ", lambda state, contact: _most_pressed(state, contact).largest[1]),
    "contact length": _contact_length,
    "contact area": _contact_length,  # of a ring, whose measure has 2 pi r, and in space
    "contact fraction": _contact_fraction,
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
    spread = {part.name: part for part in scene.coupling if part.kind == "distributing"}
    for section, part, what, unit in part_columns(scene):
        if section == "coupling" and part in spread:
            value = partial(_mean_motion, spread[part], what)
        elif section == "law":
            value = partial(_value, _of_law(what), part)
        else:
            value = partial(_value, _VALUES[section][what], part)
        measures.append(Measure(f"{part} {what}", unit, value))
    return measures


def _mean_motion(coupling: CouplingSection, what: str, state: Accepted) -> float:
    """The displacement or rotation of a ``coupling`` in space along or about an axis."""
    kind, axis = what.split()
    motion = state.mean_motion(coupling.facets, tuple(coupling.point))
    behind = len(state.axes) if kind == "rotation" else 0
    return motion[behind + state.axes.index(axis)]


def _value(value: Value, part: str, state: Accepted) -> float:
    return value(state, part)


def _of_law(quantity: str) -> Value:
    """What the law of an interaction tells by this name, of the whole, as the force is."""

    def of_whole(state: Accepted, contact: str) -> float:
        modelled, _ = state.quantities(contact)[quantity]
        return state.system.problem.symmetry * modelled

    return of_whole


def _most_pressed(state: Accepted, contact: str) -> AnyProfile:
    """The surface of an interaction with the largest pressure."""
    return max(state.met[contact], key=lambda profile: profile.largest[0])
