"""The compressible neo-Hookean solid of codes for large strain, in a plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from archord.geometry.basis import Array
from archord.materials.elasticity import Elastic
from archord.materials.material import Material, State

# of gradients [xx, yy, xy, yx]: the derivative of the cofactors (F_yy, F_xx, -F_yx, -F_xy)
_COFACTORS = np.array([[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, -1], [0, 0, -1, 0]], dtype=float)
_NEWTON = 12  # steps that find the thickness
_ONE = np.array([1.0, 1.0, 0.0, 0.0])


@dataclass(frozen=True)
class NeoHooke(Material):
    """Energy ``mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2``, as of Kratos and GetFEM.

    Nominal stresses ``(n, 4)`` of displacement gradients ``(n, 4)`` are ``P = mu F + (lambda ln J -
    mu) F^-T``. In plane stress they are per undeformed thickness, and the thickness follows.
    """

    E: float
    nu: float
    plane: Literal["strain", "stress"] = "strain"
    finite: ClassVar[bool] = True

    @property
    def _small(self) -> Elastic:
        """The solid of small strains."""
        return Elastic(self.E, self.nu, self.plane)

    @property
    def elastic_tangent(self) -> Array:
        """The moduli ``(3, 3)`` of small strains."""
        return self._small.elastic_tangent

    def _thickness(self, J: Array) -> Array:
        """The stretch ``(n,)`` out of the plane, where ``J`` ``(n,)`` is the determinant in it."""
        lam, mu = self._small.lame
        stretch = np.ones_like(J)
        for _ in range(_NEWTON if self.plane == "stress" else 0):
            stress = mu * (stretch**2 - 1) + lam * np.log(J * stretch)
            slope = 2 * mu * stretch + lam / stretch
            stretch = stretch - stress / slope
        return stretch

    def update(self, strain: Array, state: State) -> tuple[Array, Array, State]:
        """Nominal stress ``(n, 4)``, its derivative ``(n, 4, 4)`` and the state; not a number at
        points that are turned inside out."""
        lam, mu = self._small.lame
        F, J, inverse = _deformation(strain)
        stretch = self._thickness(J)
        k = lam * np.log(J * stretch) - mu
        slope: Array | float = lam
        if self.plane == "stress":
            slope = lam / (1 + lam / (2 * mu * stretch**2))
        stress = mu * F + k[:, None] * inverse
        dyads = inverse[:, :, None] * inverse[:, None, :]
        by_volume = (slope - k)[:, None, None] * dyads
        by_inverse = (k / J)[:, None, None] * _COFACTORS
        return stress, by_volume + by_inverse + mu * np.eye(4), state

    def energy(self, stress: Array) -> Array:
        """Energy density ``(n,)`` of stresses ``(n, 4)`` of small strains."""
        return self._small.energy(stress)

    def stored(self, strain: Array, stress: Array, state: State) -> Array:
        """Energy density ``(n,)`` per undeformed volume."""
        lam, mu = self._small.lame
        F, J, _ = _deformation(strain)
        stretch = self._thickness(J)
        log = np.log(J * stretch)
        stretches = (F**2).sum(axis=1) + stretch**2
        of_volume = lam / 2 * log**2
        return mu / 2 * (stretches - 3) - mu * log + of_volume

    def true_stress(self, strain: Array, stress: Array, state: State) -> Array:
        """Cauchy's stress ``(n, 4)``, ``P F^T / J``."""
        lam, mu = self._small.lame
        F, J, _ = _deformation(strain)
        F_xx, F_yy, F_xy, F_yx = F.T
        P_xx, P_yy, P_xy, P_yx = stress.T
        stretch = self._thickness(J)
        xx = P_xx * F_xx + P_xy * F_xy
        yy = P_yx * F_yx + P_yy * F_yy
        zz = mu * (stretch**2 - 1) + lam * np.log(J * stretch)
        xy = P_xx * F_yx + P_xy * F_yy
        volume = J * stretch
        return np.stack([xx, yy, zz, xy], axis=1) / volume[:, None]


def _deformation(gradient: Array) -> tuple[Array, Array, Array]:
    """``F`` ``(n, 4)``, its determinant ``(n,)`` and its inverse, transposed, ``(n, 4)``."""
    F = gradient + _ONE
    cofactors = F @ _COFACTORS
    J = F[:, 0] * F[:, 1] - F[:, 2] * F[:, 3]
    J = np.where(J > 0, J, np.nan)
    return F, J, cofactors / J[:, None]
