"""A measure: a number that is told of every accepted step, with its name and unit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.materials.material import Array
from archord.measures.record import Record
from archord.report.by_name import ByName, Names

if TYPE_CHECKING:
    from archord.solver.contact.interaction import Interaction
    from archord.solver.path.system import System

Column = tuple[str, Callable[[Record], Any]]  # heading, and its value of a step
Place = tuple[float, ...]  # a largest value, and the coordinates of its place


@dataclass(frozen=True)
class Measure:
    """A number that is told of every accepted step by its ``name``, in a ``unit``; ``value`` takes
    it from the state. Collective."""

    name: str
    unit: str
    value: Callable[[Accepted], float]

    @property
    def column(self) -> Column:
        """The measure as a column of history.csv."""
        return column(self.name, self.unit)


class Accepted:
    """The last accepted state of a ``system``. Measures are taken of it; what several of them need
    is computed once. Collective.

    ``profiles`` is the contact along the surfaces by their names, ``before`` the records of the
    steps before, ``residual`` what Newton's method left of the residual over the reaction.
    """

    def __init__(
        self,
        system: System,
        profiles: Mapping[str, Any],
        before: Sequence[Record] = (),
        residual: float = 0.0,
    ) -> None:
        self.system = system
        self.profiles = profiles
        self.before = before
        self.residual = residual
        self.reaction: Callable[[str], Array] = cache(system.reaction)
        origin = [0.0] * system.problem.kinematics.dimension
        self.reaction_moments: Callable[[str], Array] = cache(
            lambda name: system.reaction_moments(name, origin)
        )
        self.contact_force: Callable[[str], Array] = cache(system.contact_force)
        self.contact_moments: Callable[[str], Array] = cache(
            lambda name: system.contact_moments(name, origin)
        )
        self.mean_motion: Callable[[str, tuple[float, ...]], Array] = cache(system.mean_motion)
        self.quantities = cache(lambda name: system.contact.interface(name).quantities())
        self.largest_peeq: Callable[[str], Place] = cache(self._largest_peeq)
        self._found: ByName = {}

    def once(self, name: str, find: Callable[[], Any]) -> Any:
        """What ``find`` finds of this state, found once by this ``name``."""
        if name not in self._found:
            self._found[name] = find()
        return self._found[name]

    def _largest_peeq(self, body: str) -> Place:
        found = next(given for given in self.system.problem.bodies if given.name == body)
        return self.system.largest_peeq(found)

    @property
    def axes(self) -> Names:
        """The names of the coordinates."""
        return self.system.problem.kinematics.axes

    @cached_property
    def driven(self) -> dict[str, tuple[float, float]]:
        """Displacement and force of each drive, by name."""
        names = self.system.drive_names
        q, force = self.system.driven()
        return {name: (float(q[k]), float(force[k])) for k, name in enumerate(names)}

    @cached_property
    def peeq(self) -> tuple[float, float]:
        """The largest PEEQ at a quadrature point, and the integral of PEEQ."""
        return self.system.peeq()

    @cached_property
    def met(self) -> dict[str, list[Any]]:
        """The profiles of each interaction, by its name."""
        return {
            interaction.name: [
                profile for name, profile in self.profiles.items() if name in _names(interaction)
            ]
            for interaction in self.system.problem.interactions
        }

    @cached_property
    def contact_area(self) -> float:
        """Length or area of the surfaces in contact: of each interaction the mean of its sides."""
        met = self.met.values()
        return float(sum(np.mean([p.contact_length for p in profiles]) for profiles in met))


def _names(interaction: Interaction) -> list[str]:
    """The surfaces of bodies of an ``interaction``."""
    return [given for given in interaction.surfaces if isinstance(given, str)]


def column(name: str, unit: str = "", of: str = "") -> Column:
    """The column ``name`` of history.csv: what a record has by that name, or by the name ``of``."""
    heading = f"{name} [{unit}]" if unit else name
    return heading, lambda m: m[of or name]
