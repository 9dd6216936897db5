"""Isotropic linear elasticity in the plane.

Strains are ``[eps_xx, eps_yy, gamma_xy]`` (engineering shear), stresses ``[s_xx, s_yy, s_zz, s_xy]``, tension positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Plane = Literal["strain", "stress"]


def lame(E: float, nu: float) -> tuple[float, float]:
    """Lame's constants ``(lambda, mu)`` of a solid with Young's modulus ``E`` and Poisson's ratio ``nu``."""
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))


def contact_modulus(E: float, nu: float, plane: Plane) -> float:
    """Modulus that one body brings to the contact: ``E / (1 - nu^2)`` in plane strain, ``E`` in plane stress."""
    return E / (1 - nu**2) if plane == "strain" else E


def elastic_tangent(E: float, nu: float, plane: Plane) -> Array:
    """Elastic tangent ``(3, 3)`` from ``[eps_xx, eps_yy, gamma_xy]`` to ``[s_xx, s_yy, s_xy]``, in units of ``E``."""
    lam, mu = lame(E, nu)
    if plane == "stress":
        lam = E * nu / (1 - nu**2)
    return np.array([[lam + 2 * mu, lam, 0.0], [lam, lam + 2 * mu, 0.0], [0.0, 0.0, mu]])


def elastic_stress(strain: Array, E: float, nu: float, plane: Plane) -> Array:
    """Stress ``(n, 4)`` of elastic points with strain ``(n, 3)``."""
    stress = np.zeros((len(strain), 4))
    stress[:, [0, 1, 3]] = strain @ elastic_tangent(E, nu, plane)
    if plane == "strain":
        stress[:, 2] = nu * (stress[:, 0] + stress[:, 1])
    return stress


def von_mises(stress: Array) -> Array:
    """Von Mises stress ``(n,)`` of ``(n, 4)`` stresses ``[s_xx, s_yy, s_zz, s_xy]``."""
    xx, yy, zz, xy = stress.T
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * xy**2)


def mean_stress(stress: Array) -> Array:
    """Mean stress ``(s_xx + s_yy + s_zz) / 3`` ``(n,)`` of ``(n, 4)`` stresses, tension positive."""
    return stress[:, :3].sum(axis=1) / 3


@dataclass(frozen=True)
class Elastic:
    """Linear elastic solid; ``E`` sets the unit of stress."""

    E: float
    nu: float
    plane: Plane
