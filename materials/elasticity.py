"""Isotropic linear elasticity; strains and stresses as in `Material`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from archord.materials.kinematics import Kinematics, kinematics
from archord.materials.material import Array, Material, Plane, State

# of stresses in space; those of a plane and around an axis have the first four components
TRACE = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
ENGINEERING = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])  # engineering strains over tensor strains


def contact_modulus(E: float, nu: float, plane: Plane) -> float:
    """Modulus that one body brings to the contact: ``E / (1 - nu^2)``, in plane stress ``E``."""
    return E if kinematics(plane).is_thin else E / (1 - nu**2)


def von_mises(stress: Array) -> Array:
    """Von Mises stress ``(...,)`` of stresses ``(..., 4)``, or ``(..., 6)`` in space."""
    xx, yy, zz, *shears = np.moveaxis(stress, -1, 0)
    differences = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    of_shears = sum(shear**2 for shear in shears)
    return np.sqrt(0.5 * differences + 3 * of_shears)


def mean_stress(stress: Array) -> Array:
    """Mean stress ``(s_xx + s_yy + s_zz) / 3`` ``(...,)`` of stresses ``(..., 4)``, or ``(..., 6)``
    in space, tension positive."""
    return stress[..., :3].sum(axis=-1) / 3


def principal_stresses(stress: Array) -> tuple[Array, Array]:
    """Principal stresses ``(..., 3)`` of stresses ``(..., 4)``, or ``(..., 6)`` in space, the
    largest first, and the angle ``(...,)`` from the x axis of the larger one in the plane of x and
    y, in (-pi/2, pi/2]."""
    xx, yy, zz, xy, *others = np.moveaxis(stress, -1, 0)
    angle = np.arctan2(2 * xy, xx - yy) / 2
    if others:
        yz, zx = others
        rows = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]
        tensors = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
        return np.linalg.eigvalsh(tensors)[..., ::-1], angle
    middle = (xx + yy) / 2
    radius = np.hypot((xx - yy) / 2, xy)
    unsorted = np.stack([middle + radius, middle - radius, zz], axis=-1)
    values = np.sort(unsorted, axis=-1)
    return values[..., ::-1], angle


@dataclass(frozen=True)
class Elastic(Material):
    """Isotropic linear elastic solid.

    Parameters
    ----------
    E : float
        Young's modulus. It sets the unit of stress.
    nu : float
        Poisson's ratio.
    plane : {"strain", "stress", "axisymmetric", "space"}
        How displacement becomes strain. The default becomes the problem's kinematics; another
        value must agree with them.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import Elastic
    >>> steel = Elastic(E=210e3, nu=0.3)
    >>> stress, tangent, _ = steel.update(np.array([[1e-3, 0.0, 0.0]]), None)
    >>> stress.round(1).tolist()
    [[282.7, 121.2, 121.2, 0.0]]
    """

    E: float
    nu: float
    plane: Plane = "strain"

    @property
    def kinematics(self) -> Kinematics:
        """The kinematics named by ``plane``."""
        return kinematics(self.plane)

    @property
    def working(self) -> list[int]:
        """Places in a stress of the components that do work on the strain."""
        return list(self.kinematics.working)

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's constants ``(lambda, mu)``."""
        E = self.E
        nu = self.nu
        return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    @property
    def moduli(self) -> Array:
        """Moduli ``(n_stress, n_stress)`` of all components of the stress, with engineering shear;
        in plane stress none out of the plane."""
        lam, mu = self.lame
        trace = TRACE[: self.kinematics.n_stress].copy()
        shear = 2 * mu / ENGINEERING[: self.kinematics.n_stress]
        if self.kinematics.is_thin:
            lam = self.E * self.nu / (1 - self.nu**2)
            trace[2] = shear[2] = 0.0
        return lam * np.outer(trace, trace) + np.diag(shear)

    @property
    def elastic_tangent(self) -> Array:
        """Moduli ``(k, k)`` of the components that do work on the strain."""
        return self.moduli[np.ix_(self.working, self.working)]

    def update(self, strain: Array, state: State) -> tuple[Array, Array, State]:
        """Hooke's law, with the stress out of the plane."""
        moduli = self.elastic_tangent
        stress = strain @ self.moduli[self.working]
        return stress, np.broadcast_to(moduli, (len(strain), *moduli.shape)), state

    def energy(self, stress: Array) -> Array:
        """Half the stress times its elastic strain, of all components."""
        _, mu = self.lame
        bulk = self.E / (3 * (1 - 2 * self.nu))
        mean = mean_stress(stress)
        volumetric = mean**2 / (2 * bulk)
        return volumetric + von_mises(stress) ** 2 / (6 * mu)
