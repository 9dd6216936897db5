"""Kinematics: how displacements become strains, in plane strain, plane stress, around an axis and
in space.

All that depends on the number of dimensions asks this object: the blocks of the matrix, the points
of the bulk, the materials, the contact, the loads, and the names of components in files.

Axisymmetric problems have the coordinates x = r >= 0 and y = z, the axis being x = 0. Their forces
and energies are of the whole ring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating]
Arrays = dict[str, Array]  # by name
Ints = npt.NDArray[np.integer]  # numbers of nodes, cells, steps
Bools = npt.NDArray[np.bool_]  # which of them
Plane = Literal["strain", "stress", "axisymmetric", "space"]


class _Components(NamedTuple):
    """What kinematics are made of.

    - ``axes``: names of the coordinates
    - ``stress``: names of the components of a stress
    - ``working``: places in it of the components that do work on the strain
    - ``gradient``: the components of the displacement gradient by their names, see
      `Kinematics.terms`
    - ``slides``: the axes along which bodies can move rigidly
    - ``turns``: pairs of axes, from the first to the second of which they can turn
    """

    axes: tuple[str, ...]
    stress: tuple[str, ...]
    working: tuple[int, ...]
    gradient: dict[str, tuple[int, int]]
    slides: tuple[int, ...]
    turns: tuple[tuple[int, int], ...]


_IN_PLANE = {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1), "yx": (1, 0)}
_PLANE = _Components(
    axes=("x", "y"),
    stress=("xx", "yy", "zz", "xy"),
    working=(0, 1, 3),
    gradient=_IN_PLANE,
    slides=(0, 1),
    turns=((0, 1),),
)
_RING = _Components(
    axes=("r", "z"),
    stress=("rr", "zz", "tt", "rz"),
    working=(0, 1, 2, 3),
    gradient={"rr": (0, 0), "zz": (1, 1), "rz": (0, 1), "zr": (1, 0), "tt": (0, 2)},
    slides=(1,),
    turns=(),
)
_SPACE = _Components(
    axes=("x", "y", "z"),
    stress=("xx", "yy", "zz", "xy", "yz", "zx"),
    working=(0, 1, 2, 3, 4, 5),
    gradient={"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "yx": (1, 0)}
    | {"yz": (1, 2), "zy": (2, 1), "zx": (2, 0), "xz": (0, 2)},
    slides=(0, 1, 2),
    turns=((1, 2), (2, 0), (0, 1)),
)
_COMPONENTS: dict[str, _Components] = {
    "strain": _PLANE,
    "stress": _PLANE,
    "axisymmetric": _RING,
    "space": _SPACE,
}


@dataclass(frozen=True)
class Kinematics:
    """How a displacement becomes strain; made by `kinematics`.

    Forces and energies are per unit thickness of a plane, whose ``thickness`` multiplies what is
    reported. Only a plane may have one. It ``is_of_problem`` if a problem gave it, which may leave
    it out when it is replaced. Raises ValueError.
    """

    name: Plane
    thickness: float = 1.0
    is_of_problem: bool = field(default=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check the name and the thickness."""
        if self.name not in get_args(Plane):
            raise ValueError(f"kinematics are {', '.join(get_args(Plane))}, not {self.name!r}")
        if not self.is_plane and self.thickness != 1:
            raise ValueError(
                "only a plane has a thickness; axisymmetric bodies are whole rings"
                if self.has_hoop
                else "only a plane has a thickness; bodies in space are drawn whole"
            )

    @property
    def _components(self) -> _Components:
        return _COMPONENTS[self.name]

    @property
    def is_plane(self) -> bool:
        """Whether bodies are slices of a thickness, not rings nor whole bodies in space."""
        return self._components is _PLANE

    @property
    def has_hoop(self) -> bool:
        """Whether there is a hoop strain ``u_r / r``."""
        return self._components is _RING

    @property
    def is_thin(self) -> bool:
        """Whether there is no stress out of the plane (plane stress)."""
        return self.name == "stress"

    @property
    def dimension(self) -> int:
        """Components of a displacement."""
        return len(self.axes)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return self._components.axes

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the components of a stress ``(n, n_stress)``."""
        return self._components.stress

    @property
    def n_stress(self) -> int:
        """Components of a stress: those of a plane or a ring, 4, come first in space, where there
        are 6."""
        return len(self.names)

    @property
    def gradient(self) -> tuple[str, ...]:
        """Names of the components of the displacement gradient; tt is ``u_r / r``."""
        return tuple(self._components.gradient)

    @property
    def terms(self) -> tuple[tuple[int, int], ...]:
        """For each component of the gradient the component of the displacement, and the axis of its
        derivative; behind the last axis (tt) its quotient by r."""
        return tuple(self._components.gradient.values())

    @property
    def working(self) -> tuple[int, ...]:
        """Places in a stress of the components that do work on the strain."""
        return self._components.working

    @cached_property
    def small(self) -> Array:
        """Takes a displacement gradient to the engineering strain, ``(k_strain, k_gradient)``."""
        rows = [{name, name[::-1]} for name in (self.names[k] for k in self.working)]
        small = np.array([[float(name in row) for name in self.gradient] for row in rows])
        small.flags.writeable = False
        return small

    def n_components(self, *, large: bool) -> int:
        """Components of what a material is given: of the strain, or at large strain of the
        gradient."""
        return self.small.shape[1 if large else 0]

    def measure(self, x: Any) -> Any:
        """What multiplies volumes, areas and lengths on the mesh at the positions ``x`` ``(...,
        d)``."""
        return 2 * math.pi * x[..., 0] if self.has_hoop else 1.0

    @property
    def turns(self) -> tuple[tuple[int, int], ...]:
        """Axes ``(i, j)``, from the first to the second of which bodies can turn rigidly: about z
        in a plane, about x, y and z in space."""
        return self._components.turns

    @property
    def n_rigid(self) -> int:
        """Rigid motions, which make no strain."""
        return len(self._components.slides) + len(self.turns)

    def moments(self, arm: Array, force: Array) -> list[Array]:
        """Moments ``(n,)`` of forces ``(n, d)`` at arms ``(n, d)``, of each of the `turns`."""
        return [arm[:, i] * force[:, j] - arm[:, j] * force[:, i] for i, j in self.turns]

    def rigid_motions(self, x: Array) -> Array:
        """Displacements ``(n_rigid, n, d)`` of the rigid motions at the positions ``x`` ``(n, d)``:
        along the axes, around an axis only along it, and the turns about the origin."""
        slides = self._components.slides
        motions = np.zeros((self.n_rigid, *x.shape))
        for k, axis in enumerate(slides):
            motions[k, :, axis] = 1.0
        for k, (i, j) in enumerate(self.turns, len(slides)):
            motions[k, :, i] = -x[:, j]
            motions[k, :, j] = x[:, i]
        return motions

    def traction(self, normal: Array, *, large: bool = False) -> Array:
        """Matrices ``(..., d, k)`` that take the working stress to the force on a facet with the
        ``normal`` ``(..., d)``; at large strain the nominal stress, in the order of `gradient`."""
        matrix = np.zeros((*normal.shape, len(self.terms)))
        for k, (component, derivative) in enumerate(self.terms):
            if derivative < self.dimension:
                matrix[..., component, k] = normal[..., derivative]
        return matrix if large else matrix @ self.small.T

    def with_thickness(self, thickness: float) -> Kinematics:
        """The same, of this ``thickness`` of a problem."""
        return replace(self, thickness=thickness, is_of_problem=True)


@cache
def kinematics(name: str, thickness: float = 1.0) -> Kinematics:
    """The kinematics "strain", "stress" (plane strain, plane stress), "axisymmetric" or "space".
    Raises ValueError."""
    return Kinematics(name, thickness)  # type: ignore[arg-type]


PLANE_STRAIN = Kinematics("strain")
PLANE_STRESS = Kinematics("stress")
AXISYMMETRIC = Kinematics("axisymmetric")
SPACE = Kinematics("space")
