"""What the solver asks of a material: strain and state in, stress, tangent and state out; and
points of it, with their history.

Arrays are those of ``n`` points, with the components of the `Kinematics`. In a plane strains ``(n,
3)`` are ``[eps_xx, eps_yy, gamma_xy]`` (engineering shear), and stresses ``(n, 4)`` are ``[s_xx,
s_yy, s_zz, s_xy]``, tension positive. In space both are ``(n, 6)``, ``[xx, yy, zz, xy, yz, zx]``.
A state is None (no history) or a dataclass of arrays whose first axis are the points, which is how
checkpoints store it.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import is_dataclass, replace
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from archord.materials.kinematics import Array, Arrays, Bools, Kinematics, Plane

__all__ = ["Array", "Arrays", "Material", "Plane", "Points", "State"]
State = Any


class Material(Protocol):
    """What a material of your own is made from: a constitutive law.

    Every method is a pure function. A material must define `elastic_tangent`, `update` and
    `energy`. It inherits the rest, which fits a material without history.

    A body whose material neither ``yields`` nor is ``finite`` is assembled once, from the elastic
    tangent alone.

    Attributes
    ----------
    yields : bool
        Whether the material can leave its `elastic_tangent`, by yielding or otherwise.
    finite : bool
        Whether it gets displacement gradients for strains (see `LargeStrain`).

    Examples
    --------
    >>> import numpy as np
    >>> from archord import Body, Material
    >>> class Sponge(Material):
    ...     E = 10.0
    ...
    ...     @property
    ...     def elastic_tangent(self):
    ...         return self.E * np.diag([1.0, 1.0, 0.5])
    ...
    ...     def update(self, strain, state):
    ...         stress = np.zeros((len(strain), 4))
    ...         stress[:, [0, 1, 3]] = strain @ self.elastic_tangent
    ...         return stress, np.tile(self.elastic_tangent, (len(strain), 1, 1)), state
    ...
    ...     def energy(self, stress):
    ...         return (stress**2 @ [0.5, 0.5, 0.5, 1.0]) / self.E
    >>> sponge = Sponge()
    >>> stress, _, state = sponge.update(np.array([[0.1, 0.0, 0.2]]), sponge.state(1))
    >>> stress.tolist(), sponge.energy(stress).round(3).tolist()
    ([[1.0, 0.0, 0.0, 1.0]], [0.15])
    >>> Body("pad", sponge).name
    'pad'
    """

    yields: ClassVar[bool] = False
    finite: ClassVar[bool] = False

    @property
    def elastic_tangent(self) -> Array:
        """The elastic moduli ``(k, k)``, symmetric, of the ``k`` components that do work: in a
        plane ``(3, 3)``, from ``[eps_xx, eps_yy, gamma_xy]`` to ``[s_xx, s_yy, s_xy]``."""
        ...

    def update(self, strain: Array, state: State) -> tuple[Array, Array, State]:
        """Stress ``(n, 4)``, consistent tangent ``(n, 3, 3)`` and new state at ``strain`` ``(n,
        3)`` from ``state``; in space ``(n, 6)``, ``(n, 6, 6)`` and ``(n, 6)``.

        The tangent is the `elastic_tangent` at points that `flows` leaves out; it may be a view,
        not to be written to. If it is not symmetric, `TangentMatrix.border` takes it as such
        under force control: more iterations, the same equilibrium. A stress that does not exist is
        not a number: the solver takes the step back.
        """
        ...

    def flows(self, old: State, new: State) -> Bools | bool:
        """Which points ``(n,)`` left the `elastic_tangent` on the way from the ``old`` state to the
        ``new`` one: all of them, where a material does not tell."""
        return True

    def energy(self, stress: Array) -> Array:
        """Elastic energy density ``(n,)`` of stresses ``(n, n_stress)``."""
        ...

    def stored(self, strain: Array, stress: Array, state: State) -> Array:
        """Elastic energy density ``(n,)`` after an update to ``stress`` and ``state``, per
        undeformed volume."""
        return self.energy(stress)

    def true_stress(self, strain: Array, stress: Array, state: State) -> Array:
        """Cauchy's stress ``(n, n_stress)`` after an update to ``stress`` and ``state``."""
        return stress

    def elastic(self) -> Material:
        """A material with the same states that answers from each as if it could not yield
        (further)."""
        return self

    def under(self, kinematics: Kinematics) -> Self:
        """The material in a problem of these ``kinematics``, by its field ``plane`` if it has one.
        Raises ValueError for a material of another plane; the default, "strain", fits all."""
        plane = getattr(self, "plane", None)
        if plane in (None, kinematics.name) or not is_dataclass(self):
            return self
        if plane != "strain":
            raise ValueError(
                f"a material with plane = {plane!r} does not fit a problem whose kinematics are "
                f"{kinematics.name!r}"
            )
        return replace(self, plane=kinematics.name)

    def state(self, n: int) -> State:
        """State of ``n`` points at the beginning."""
        return None

    def dissipation(self, state: State) -> Array | float:
        """Density of the energy dissipated so far ``(n,)``."""
        return 0.0

    def peeq(self, state: State) -> Array | float:
        """Equivalent plastic strain ``(n,)``."""
        return 0.0


def of_small_strain(material: Material) -> Material:
    """The inner material of a `LargeStrain`, any other material itself."""
    return getattr(material, "of_small_strain", material)


class Points:
    """``n`` points of a ``material``: the committed ``state``, and ``trial``, which belongs to the
    last strain seen.

    ``yields`` tells whether they can. What answers `update` is ``acting``: the material, or for the
    time being one with the same states, such as its `elastic` one. A contact law is a material too,
    of traction, derivative and state, whose strain are gap, slip and trial traction.
    """

    def __init__(self, material: Any, n: int) -> None:
        self.material = material
        self.n = n
        self.acting = material
        self.state = self.trial = material.state(n)
        if self.state is not None and not _is_of_points(self.state, n):
            raise ValueError(
                f"the state of a {type(material).__name__} must be None or a dataclass of arrays "
                f"whose first axis are its {n} points"
            )
        self.yields = bool(getattr(material, "yields", False))

    def update(self, *strain: Array) -> tuple[Array, Array]:
        """Stress ``(n, n_stress)`` and consistent tangent ``(n, k, k)`` at ``strain`` ``(n, k)``,
        from the committed state."""
        own = (array.copy() for array in strain)
        stress, tangent, self.trial = self.acting.update(*own, self.given())
        return stress, tangent

    def given(self) -> State:
        """The committed state for a trial: a copy, as own classes may write into what they get."""
        return deepcopy(self.state)

    def told(self) -> State:
        """The state of the last strain seen, to ask the material of it: a copy as well."""
        return deepcopy(self.trial)

    @property
    def flows(self) -> Bools:
        """Which points ``(n,)`` left the elastic tangent at the last strain seen."""
        return np.broadcast_to(self.acting.flows(self.state, self.trial), self.n)

    @property
    def peeq(self) -> Array:
        """PEEQ ``(n,)`` at the last strain seen."""
        return np.broadcast_to(self.material.peeq(self.told()), self.n)

    def commit(self) -> None:
        """Make the state of the last strain seen the committed one."""
        self.state = self.trial


def _is_of_points(state: State, n: int) -> bool:
    """Whether a ``state`` is a dataclass of arrays ``(n, ...)``."""
    return is_dataclass(state) and all(
        isinstance(values, np.ndarray) and values.shape[:1] == (n,)
        for values in vars(state).values()
    )
