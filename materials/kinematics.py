"""Kinematics: how displacements become strains, in plane strain, plane stress and around an axis.

All that depends on the number of dimensions asks this object: the blocks of the matrix, the points
of the bulk, the materials, the contact, the loads, and the names of components in files.

Axisymmetric problems have the coordinates x = r >= 0 and y = z, the axis being x = 0. Their forces
and energies are of the whole ring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating]
Plane = Literal["strain", "stress", "axisymmetric"]

_PLANE_GRADIENT = {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1), "yx": (1, 0)}
_TURNS = {2: ((0, 1),), 3: ((1, 2), (2, 0), (0, 1))}  # about z; about x, y and z
_RING_GRADIENT = {"rr": (0, 0), "zz": (1, 1), "rz": (0, 1), "zr": (1, 0), "tt": (0, 2)}


@dataclass(frozen=True)
class Kinematics:
    """How a displacement becomes strain; made by `kinematics`.

    Forces and energies are per unit thickness of a plane, whose ``thickness`` multiplies what is
    reported. Only a plane may have one. Raises ValueError.
    """

    name: Plane
    thickness: float = 1.0

    def __post_init__(self) -> None:
        """Check the name and the thickness."""
        if self.name == "space":
            raise ValueError("problems in space cannot be solved yet; give them in a plane")
        if self.name not in get_args(Plane):
            raise ValueError(f"kinematics are {', '.join(get_args(Plane))}, not {self.name!r}")
        if not self.is_plane and self.thickness != 1:
            raise ValueError("only a plane has a thickness; axisymmetric bodies are whole rings")

    @property
    def is_plane(self) -> bool:
        """Whether bodies are slices of a thickness, not rings."""
        return self.name != "axisymmetric"

    @property
    def has_hoop(self) -> bool:
        """Whether there is a hoop strain ``u_r / r``."""
        return not self.is_plane

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
        return ("x", "y") if self.is_plane else ("r", "z")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the components of a stress ``(n, 4)``."""
        return ("xx", "yy", "zz", "xy") if self.is_plane else ("rr", "zz", "tt", "rz")

    @property
    def _terms(self) -> dict[str, tuple[int, int]]:
        return _PLANE_GRADIENT if self.is_plane else _RING_GRADIENT

    @property
    def gradient(self) -> tuple[str, ...]:
        """Names of the components of the displacement gradient; tt is ``u_r / r``."""
        return tuple(self._terms)

    @property
    def terms(self) -> tuple[tuple[int, int], ...]:
        """For each component of the gradient the component of the displacement, and its
        derivative: by axis 0, by axis 1, or (2) its quotient by r."""
        return tuple(self._terms.values())

    @property
    def working(self) -> tuple[int, ...]:
        """Places in a stress ``(n, 4)`` of the components that do work on the strain."""
        return (0, 1, 3) if self.is_plane else (0, 1, 2, 3)

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
        """What multiplies areas and lengths at the positions ``x`` ``(..., d)``, in numpy or
        UFL."""
        return 1.0 if self.is_plane else 2 * math.pi * x[..., 0]

    @property
    def n_rigid(self) -> int:
        """Rigid motions, which make no strain."""
        return 3 if self.is_plane else 1

    @property
    def turns(self) -> tuple[tuple[int, int], ...]:
        """Axes ``(i, j)`` of the planes in which bodies can turn rigidly, from i to j."""
        return _TURNS[self.dimension] if not self.has_hoop else ()

    def rigid_motions(self, x: Array) -> Array:
        """Displacements ``(n_rigid, n, d)`` of the rigid motions at the positions ``x`` ``(n, d)``:
        along x, along y and the turn about the origin; around an axis only along it."""
        translations = np.broadcast_to(np.eye(self.dimension)[:, None], (self.dimension, *x.shape))
        if self.has_hoop:
            return translations[1:].copy()
        turns: Array = np.zeros((len(self.turns), *x.shape))
        for turn, (i, j) in enumerate(self.turns):
            turns[turn, :, i] = -x[:, j]
            turns[turn, :, j] = x[:, i]
        return np.concatenate([translations, turns])

    def traction(self, normal: Array, *, large: bool = False) -> Array:
        """Matrices ``(..., d, k)`` that take the working stress to the force on an edge with the
        ``normal`` ``(..., d)``; at large strain the nominal stress, in the order of `gradient`."""
        matrix = np.zeros((*normal.shape, len(self.terms)))
        for k, (component, derivative) in enumerate(self.terms):
            if derivative < self.dimension:
                matrix[..., component, k] = normal[..., derivative]
        return matrix if large else matrix @ self.small.T

    def with_thickness(self, thickness: float) -> Kinematics:
        """The same, of this ``thickness``."""
        return replace(self, thickness=thickness)


@cache
def kinematics(name: str, thickness: float = 1.0) -> Kinematics:
    """The kinematics "strain", "stress" (plane strain, plane stress) or "axisymmetric"; "space" has
    its place here, and is not there yet. Raises ValueError."""
    return Kinematics(name, thickness)  # type: ignore[arg-type]


PLANE_STRAIN = Kinematics("strain")
PLANE_STRESS = Kinematics("stress")
AXISYMMETRIC = Kinematics("axisymmetric")
