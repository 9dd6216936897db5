"""The parts of a problem as a user states them: bodies, supports, loads and couplings, by names of
sets of the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np

from archord.materials.material import Material
from archord.report.by_name import Names
from archord.report.errors import InputError, in_sentences, require_of

Freedom = Literal["x", "y", "rotation", "z", "rotation x", "rotation y", "rotation z"]
Values = float | Sequence[float]
FREEDOMS = get_args(Freedom)
_KINDS = ("displacement", "force", "pressure")
_IN_WORDS = '"x", "y", "z", "rotation", or "rotation x", "rotation y", "rotation z"'


def freedoms(dimension: int) -> dict[str, int]:
    """The directions of a problem of this ``dimension`` with their numbers: along the axes, then
    about them. Only couplings turn."""
    axes = "xyz"[:dimension]
    turns = [f"rotation {axis}" for axis in axes] if dimension == 3 else ["rotation"]
    return {freedom: k for k, freedom in enumerate((*axes, *turns))}


def _require_name(part: Any, key: str = "name") -> None:
    name = getattr(part, key)
    require_of(part, isinstance(name, str) and bool(name), key, "must be a name")


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.number)) and bool(np.isfinite(value))


def _is_place(value: Any) -> bool:
    return np.shape(value) in ((2,), (3,)) and all(map(_is_number, value))


@in_sentences
@dataclass(frozen=True)
class Body:
    """A deformable body: a set of cells, of one material.

    Parameters
    ----------
    name : str
        The name of the body, and of its set of cells unless ``cells`` says otherwise.
    material : str or Material
        A metal by its name (docs/materials.md), in the problem's unit of stress; or an object of
        the class `Elastic`, `J2Material`, `KinematicMaterial`, or of your own, made from
        `Material`.
    cells : str
        The set of cells in the mesh.

    Raises
    ------
    InputError
        For a name that is no text, or a material that is neither a name nor a material.

    Examples
    --------
    >>> from archord import Body, Elastic
    >>> Body("pin", material="S355").material
    'S355'
    >>> Body("block", Elastic(210e3, 0.3)).cells
    'block'
    """

    name: str
    material: Any
    cells: str = ""
    _made: Any = field(default=(None, None), repr=False, compare=False, kw_only=True)

    def __post_init__(self) -> None:
        """Check the parts; raise `InputError`."""
        _require_name(self)
        is_material = Material in type(self.material).__mro__
        said = "must be the name of a metal, or a material: an object of a class made from Material"
        require_of(self, isinstance(self.material, str) or is_material, "material", said)
        object.__setattr__(self, "cells", self.cells or self.name)
        _require_name(self, "cells")

    @property
    def stated(self) -> Any:
        """The material as its user stated it, whatever a problem made of it."""
        live, stated = self._made
        return self.material if live is None or live is not self.material else stated

    def with_live(self, material: Any) -> Body:
        """The body with the ``material`` that a problem made of the stated one."""
        return replace(self, material=material, _made=(material, self.stated))


@in_sentences
@dataclass(frozen=True)
class Support:
    """What is held.

    Parameters
    ----------
    name : str
        The name of the support, and of what it holds unless ``on`` says otherwise.
    on : str
        A coupling, or a set of facets, points or cells: the first that has the name.
    fixed : str or sequence of str
        The directions held, by default all axes: letters such as "xy", in space "xyz"; or a list,
        which may have the "rotation" of a coupling, in space its "rotation x", "rotation y" and
        "rotation z".

    Raises
    ------
    InputError
        For a name that is no text, or a direction that is none.

    Examples
    --------
    >>> from archord import Support
    >>> Support("clamp", fixed="xy").fixed
    ('x', 'y')
    >>> Support("symmetry", on="axis", fixed="y").on
    'axis'
    """

    name: str
    on: str = ""
    fixed: str | Sequence[str] | None = None

    def __post_init__(self) -> None:
        """Check the parts; raise `InputError`."""
        _require_name(self)
        object.__setattr__(self, "on", self.on or self.name)
        _require_name(self, "on")
        fixed = self.fixed
        if fixed is None:
            return
        if isinstance(fixed, str):
            are_letters = {*fixed} <= {*"xyz"}
            fixed = tuple(fixed) if are_letters else (fixed,)
        fixed = fixed if isinstance(fixed, (tuple, list)) else ()
        known = len(fixed) > 0 and all(freedom in FREEDOMS for freedom in fixed)
        require_of(self, known, "fixed", f"must be directions among {_IN_WORDS}")
        object.__setattr__(self, "fixed", tuple(fixed))

    def held(self, dimension: int) -> Names:
        """The directions held in a problem of this ``dimension``."""
        return tuple("xyz"[:dimension]) if self.fixed is None else tuple(self.fixed)


@in_sentences
@dataclass(frozen=True)
class Load:
    """What moves or presses: one value, or a list of values at the ends of the stages of the path.

    Parameters
    ----------
    name : str
        The name of the load, and of what it acts on unless ``on`` says otherwise.
    on : str
        The interaction of a rigid disc, a coupling, or a set of facets, points or cells: the first
        that has the name.
    direction : {"x", "y", "z", "rotation", "rotation x", "rotation y", "rotation z"}
        The direction of a displacement or a force. Rotations are of couplings alone: "rotation" in
        a plane, in space one about each axis.
    displacement : float or sequence of float
        The displacement, or the angle in radians.
    force : float or sequence of float
        The force on the whole, or the moment. A facet set under a force stays straight.
    pressure : float or sequence of float
        The pressure on a facet set, on its undeformed area, along the normal into the body.
    core : tuple
        The circle ((x, y), radius), in space the ball ((x, y, z), radius), in which a force on
        cells is spread, less and less outward.

    Raises
    ------
    InputError
        Unless there is one of displacement, force and pressure, with a direction if it needs one.

    Examples
    --------
    >>> from archord import Load
    >>> Load("pull", on="flat", direction="x", displacement=0.3).stages
    (0.3,)
    >>> Load("oil", on="bore", pressure=[10.0, 0.0]).kind
    'pressure'
    """

    name: str
    on: str = ""
    direction: str | None = None
    displacement: Values | None = None
    force: Values | None = None
    pressure: Values | None = None
    core: tuple[tuple[float, ...], float] | None = None

    def __post_init__(self) -> None:
        """Check the parts; raise `InputError`."""
        _require_name(self)
        object.__setattr__(self, "on", self.on or self.name)
        _require_name(self, "on")
        given = [kind for kind in _KINDS if getattr(self, kind) is not None]
        if not given:
            said = "displacement is missing (or force, pressure)"
            raise InputError(f'archord.Load: load "{self.name}".{said}.')
        others = " and ".join(given[1:])
        said = f"must not be given together with {others}"
        require_of(self, len(given) == 1, given[0], said)
        values = np.atleast_1d(getattr(self, self.kind))
        numbers = values.ndim == 1 and len(values) > 0 and all(map(_is_number, values))
        require_of(self, numbers, self.kind, "must be a number, or a list of numbers")
        if np.ndim(getattr(self, self.kind)) == 1:
            own = list(map(float, values))
            object.__setattr__(self, self.kind, own)  # an array may be changed later
        wanted = (None,) if self.kind == "pressure" else FREEDOMS
        said = f"must be {_IN_WORDS}, and None for a pressure, which acts along the normal"
        require_of(self, self.direction in wanted, "direction", said)
        said = "is a circle ((x, y), radius) or a ball ((x, y, z), radius), for a force on cells"
        if self.core is not None:
            is_pair = len(self.core) == 2
            is_circle = is_pair and _is_place(self.core[0]) and _is_number(self.core[1])
            require_of(self, is_circle and self.kind == "force", "core", said)

    @property
    def kind(self) -> str:
        """What is given: "displacement", "force" or "pressure"."""
        return next(kind for kind in _KINDS if getattr(self, kind) is not None)

    @property
    def stages(self) -> tuple[float, ...]:
        """The values at the ends of the stages of the path."""
        return tuple(map(float, np.ravel(getattr(self, self.kind))))


@in_sentences
@dataclass(frozen=True)
class Coupling:
    """A reference point that stands for a set of facets: supports and loads may be on it.

    Parameters
    ----------
    name : str
        The name of the coupling, and of its set of facets unless ``facets`` says otherwise.
    facets : str
        The set of facets.
    point : tuple of float
        The reference point (x, y), in space (x, y, z). Without it a problem takes the origin.
    kind : {"rigid", "distributing"}
        Facets of a rigid coupling move as one body. Facets of a distributing one do so only on
        average, and forces are spread over them.

    Raises
    ------
    InputError
        For a name that is no text, a point that is none, or another kind.

    Examples
    --------
    >>> from archord import Coupling
    >>> Coupling("crank", facets="bore", point=(0.0, 5.0)).kind
    'rigid'
    """

    name: str
    facets: str = ""
    point: tuple[float, ...] = ()
    kind: Literal["rigid", "distributing"] = "rigid"

    def __post_init__(self) -> None:
        """Check the parts; raise `InputError`."""
        _require_name(self)
        object.__setattr__(self, "facets", self.facets or self.name)
        _require_name(self, "facets")
        said = "must be two numbers, x and y, or three in space"
        is_place = len(self.point) == 0 or _is_place(self.point)
        require_of(self, is_place, "point", said)
        known = self.kind in ("rigid", "distributing")
        require_of(self, known, "kind", 'must be "rigid" or "distributing"')
        object.__setattr__(self, "point", tuple(map(float, self.point)))
