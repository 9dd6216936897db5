"""The boundary conditions that the solver applies: displacements and forces of sets, and the drives
that move them along the path of the loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from archord.geometry.basis import Array
from archord.report.errors import in_sentences

Vector = Sequence[float] | Array  # (d,)
Control = Literal["displacement", "force"]


@in_sentences
@dataclass(frozen=True)
class Drive:
    """A displacement or a force along the path, which moves sets and discs or multiplies loads.

    ``path`` holds the values at the load factors 0, 1, 2, ..., with straight lines between them and
    the last value behind them. Without a path the value is the load factor itself. Under
    ``control`` "force" the value is the force that works on the drive's displacement, over all
    symmetric parts of the problem, and the displacement is unknown. Dead loads always take a force.
    """

    name: str
    path: Sequence[float] = ()
    control: Control = "displacement"

    def value(self, factor: float) -> float:
        """The value at the load ``factor``."""
        return float(self.values(np.array(factor)))

    def values(self, factors: Array) -> Array:
        """The values at the load ``factors``."""
        if not len(self.path):
            return factors
        return np.interp(factors, np.arange(len(self.path)), self.path)


@dataclass(frozen=True)
class Dirichlet:
    """A Dirichlet condition: one component of the displacement of a facet set is prescribed.

    The component ``axis`` is ``rate`` times the displacement of the ``drive``. ``rate`` is a
    number, or a function of the nodes' positions ``(n, d)`` that returns ``(n,)``. Conditions of
    one ``name`` have one reaction, and the drives of conditions on one set add up. Drives "x", "y",
    "turn" of one name, at rates 1, 1, ``(Y - y, x - X)``, are a rigid reference point (X, Y).

    Where sets share a node, a condition without a rate wins over a displacement, with a warning. It
    must not meet a set that moves as one, under a force or along both axes, unless the set keeps
    the node at rest. All other conditions of a node must move it alike. Conditions that hold a node
    together have equal parts of its reaction.
    """

    name: str
    facets: str
    axis: int
    rate: float | Callable[[Array], Array] = 0.0
    drive: str = ""

    @property
    def moves(self) -> bool:
        """Whether the displacement depends on the drive."""
        return callable(self.rate) or self.rate != 0


@in_sentences
@dataclass(frozen=True)
class Turn:
    """A finite rotation of what the Dirichlet conditions of a ``name`` turn linearly.

    The drives of the rotations about x, y and z, "" without a rotation, in a plane of the one
    rotation, make a rotation vector about the ``point``. Their displacements must be prescribed;
    what is conjugate to them is work, for a rotation about one axis the moment.
    """

    name: str
    point: Vector
    drives: Sequence[str]


@in_sentences
@dataclass(frozen=True)
class DeadLoad:
    """A dead load on the cells or the facets of a set, times the value of the ``drive``.

    ``force`` is the force over all symmetric parts of the problem. It is spread as ``density(x)``
    of positions ``x`` ``(d, ...)``, or evenly without one. ``pressure`` acts on facets, along the
    undeformed normal into the body.
    """

    cells: str = ""
    force: Vector = (0.0, 0.0)
    density: Callable[[Array], Array] | None = None
    facets: str = ""
    pressure: float = 0.0
    drive: str = ""

    def check(self) -> None:
        """Raise ValueError for a load of two kinds, or of none."""
        one_set = bool(self.cells) != bool(self.facets)
        has_force = bool(self.cells) or any(self.force)
        if not one_set or (self.pressure and has_force):
            raise ValueError(
                "a load is a force on the cells of a set or on its facets, or a pressure on facets"
            )


@in_sentences
@dataclass(frozen=True)
class Mean:
    """The mean motion of a facet set: the motion of a reference ``point`` along an ``axis``, or its
    rotation behind the axes: 2 in a plane; 3, 4 and 5 about x, y and z in space.

    It is the rigid motion that is closest to the facets' motion by least squares: with the mean
    displacement ``w`` and the mean rotation ``t = J^-1 integral of (x - c) x u`` about the centroid
    ``c``, of facets with the moments of inertia ``J`` (in a plane ``integral of |x - c|^2``), the
    point moves by ``w + t x (point - c)``. The ``drive`` prescribes this motion, or the force
    (moment) on the point. The facets get the force spread as the motion's derivative says, which is
    statically equivalent. Without a point the centroid is the point. A symmetric half that shows
    half of an edge gives no point: the mirrored facets take up the moment. Means of one ``name``
    have one reaction. A drive has one mean at most. The mean is of the facets with their images
    in the ``mirrors``, each an axis and a place on it.
    """

    name: str
    facets: str
    axis: int
    point: Vector | None = None
    drive: str = ""
    mirrors: Sequence[tuple[int, float]] = ()


@dataclass(frozen=True)
class Guess:
    """Where the first solve starts: the displacement of the drive "", and how far each body has
    moved rigidly."""

    factor: float
    moved: Mapping[str, Vector] = field(default_factory=dict)
