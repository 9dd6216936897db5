"""Large strain: any material of small strain in the space of logarithmic strains (Miehe, Apel and
Lambrecht 2002).

The logarithmic strain is ``E = 1/2 ln C`` with ``C = F^T F``. The inner material makes of it the
stress ``T`` that does work on it, along the principal axes Kirchhoff's: Hencky's elasticity, and
plastic strains that add up as logarithms, which is multiplicative plasticity where the axes do not
turn. The second Piola-Kirchhoff stress ``S = T : 2 dE/dC`` and its derivative follow by those of
the logarithm, and the nominal stress is ``P = F S``. J2 materials yield by Cauchy's von Mises
stress: their yield stress times ``J``, which elasticity alone changes, is Kirchhoff's. Back
stresses are Kirchhoff's.

Gradients ``(n, 4)`` of the displacement and nominal stresses are ``[xx, yy, xy, yx]``, P_xy a force
along x on a face that was normal to y. In plane stress forces are per undeformed thickness, and the
thickness follows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial.polynomial import polyval

from archord.materials.hardening import Scaled
from archord.materials.j2 import J2Material
from archord.materials.kinematics import Kinematics
from archord.materials.material import Array, Material, State

_NEAR = 0.05  # relative distance of eigenvalues below which divided differences are series
_RATIO = [1 / (k + 1) if k % 2 == 0 else 0.0 for k in range(15)]  # artanh(x)/x
_MIXED = [
    -1.0 if k % 2 == 0 else (k + 1) / (k + 2) for k in range(14)
]  # (1/(1 + x) - artanh(x)/x)/x


@dataclass(frozen=True)
class LargeStrain(Material):
    """The material ``inner`` of small strain at large strain, by logarithmic strains (Miehe, Apel
    and Lambrecht 2002).

    It gets displacement gradients and gives nominal stresses, ``[xx, yy, xy, yx]``, in the unit of
    ``inner``, whose states and moduli it has. All bodies of a problem that yield must be at large
    strain if one is.
    """

    finite: ClassVar[bool] = True

    inner: Any

    def __getattr__(self, name: str) -> Any:
        """What else the inner material has, as its constants."""
        if name.startswith("__") or name == "inner":
            raise AttributeError(name)
        return getattr(self.inner, name)

    @property
    def yields(self) -> bool:  # type: ignore[override]
        """Whether the inner material does."""
        return self.inner.yields

    @property
    def elastic_tangent(self) -> Array:
        """That of small strains ``(3, 3)``."""
        return self.inner.elastic_tangent

    def elastic(self) -> Material:
        """The material that cannot yield (further), at large strain."""
        return LargeStrain(self.inner.elastic())

    def under(self, kinematics: Kinematics) -> LargeStrain:
        """The inner material in a problem of these ``kinematics``, at large strain."""
        return replace(self, inner=self.inner.under(kinematics))

    def state(self, n: int) -> State:
        """The inner material's."""
        return self.inner.state(n)

    def dissipation(self, state: State) -> Array | float:
        """The inner material's, per undeformed volume."""
        return self.inner.dissipation(state)

    def peeq(self, state: State) -> Array | float:
        """The inner material's."""
        return self.inner.peeq(state)

    def update(self, strain: Array, state: State) -> tuple[Array, Array, State]:
        """Nominal stress ``(n, 4)``, its derivative ``(n, 4, 4)`` and the new state at displacement
        gradients ``(n, 4)``; not a number at points that are turned inside out."""
        F = _gradient(strain)
        axes = _PrincipalAxes(strain)
        T, moduli, new = self._logarithmic(axes.strain, state)
        S, hessian = axes.back(T[:, [0, 1, 3]], moduli)
        ((a, b), (c, d)), z, (xx, yy, xy) = np.moveaxis(F, 0, -1), np.zeros(len(F)), S.T
        to_nominal = _table([[a, z, b], [z, d, c], [z, b, a], [c, z, d]])
        dC = _table([[2 * a, z, z, 2 * c], [z, 2 * d, 2 * b, z], [b, c, a, d]])
        turning = _table([[xx, z, xy, z], [z, yy, z, xy], [xy, z, yy, z], [z, xy, z, xx]])
        return (to_nominal @ S[..., None])[..., 0], to_nominal @ hessian @ dC + turning, new

    def _logarithmic(self, strain: Array, state: State) -> tuple[Array, Array, State]:
        """The inner material at logarithmic strains ``(n, 3)``."""
        m = self.inner
        if not isinstance(m, J2Material):
            return m.update(strain, state)
        if m.plane == "strain":
            volume = strain[:, 0] + strain[:, 1]
        else:  # it follows the stress, which hardly depends on it: its derivative is left out
            volume = (1 - 2 * m.nu) / m.E * m.update(strain, state)[0][:, :2].sum(axis=1)
        hardening = Scaled(m.hardening, np.exp(volume))
        stress, moduli, new = replace(m, hardening=hardening).update(strain, state)
        if (
            m.plane == "strain" and new is not state
        ):  # a yield stress that grows makes the deviator grow with it
            deviator = stress - stress[:, :3].mean(axis=1)[:, None] * [1.0, 1.0, 1.0, 0.0]
            deviator, slope = (
                deviator - m.centre(new),
                hardening.slope(new.peeq) + m.stiffening(state, new),
            )
            _, mu = m.lame
            grown = (new.peeq > state.peeq) / (1 + slope / (3 * mu))
            moduli = moduli + (grown[:, None] * deviator)[:, [0, 1, 3], None] * np.array(
                [1.0, 1.0, 0.0]
            )
        return stress, moduli, new

    def energy(self, stress: Array) -> Array:
        """Elastic energy density ``(n,)`` of stresses ``(n, 4)`` that do work on logarithmic
        strains."""
        return self.inner.energy(stress)

    def stored(self, strain: Array, stress: Array, state: State) -> Array:
        """Elastic energy per undeformed volume ``(n,)`` at gradients of which ``state`` is the new
        one."""
        return self.energy(self._logarithmic(_PrincipalAxes(strain).strain, state)[0])

    def true_stress(self, strain: Array, stress: Array, state: State) -> Array:
        """Cauchy's stress ``(n, 4)`` at gradients with the nominal ``stress``, of which ``state``
        is the new one."""
        F = _gradient(strain)
        T = self._logarithmic(_PrincipalAxes(strain).strain, state)[0]
        J = np.exp((1 - 2 * self.inner.nu) / self.inner.E * T[:, :3].sum(axis=1))
        ((a, b), (c, d)), (xx, yy, xy, yx) = np.moveaxis(F, 0, -1), stress.T
        return (
            np.stack([xx * a + xy * b, yx * c + yy * d, T[:, 2], xx * c + xy * d], axis=1)
            / J[:, None]
        )


def _gradient(strain: Array) -> Array:
    """``F`` ``(n, 2, 2)`` of displacement gradients; not a number where its determinant is not
    positive."""
    xx, yy, xy, yx = strain.T
    F = _table([[1 + xx, xy], [yx, 1 + yy]])
    return np.where(((1 + xx) * (1 + yy) > xy * yx)[:, None, None], F, np.nan)


def _table(rows: list[list[Array]]) -> Array:
    """Matrices ``(n, i, j)`` of rows of entries ``(n,)``."""
    return np.moveaxis(np.array(rows), -1, 0)


class _PrincipalAxes:
    """Principal axes of ``C = F^T F`` at displacement gradients, the logarithmic ``strain`` ``(n,
    3)`` and its derivatives.

    With ``g = 1/2 ln`` and its divided differences, ``dE_ij = g[i, j] dC_ij`` and ``d2E_ij = sum
    over k of g[i, k, j] (A_ik B_kj + B_ik A_kj)`` (Daleckii and Krein 1965; Higham 2008, theorem
    3.11).
    """

    def __init__(self, strain: Array) -> None:
        a, b, c, d = strain.T  # C is one and more, whose digits small strains need
        xx, yy, xy = 2 * a + a**2 + d**2, 2 * b + b**2 + c**2, c + d + a * c + b * d
        more, radius, angle = (
            (xx + yy) / 2,
            np.hypot((xx - yy) / 2, xy),
            np.arctan2(2 * xy, xx - yy) / 2,
        )
        mean, one, two = 1 + more, 1 + more + radius, 1 + more - radius
        c, s = np.cos(angle), np.sin(angle)
        self._there, self._back = (
            _table(
                [
                    [c * c, s * s, 2 * c * s],
                    [s * s, c * c, -2 * c * s],
                    [-c * s, c * s, c * c - s * s],
                ]
            )
            for s in (s, -s)
        )
        x = radius / mean
        ratio, (mixed, swapped) = polyval(x, _RATIO), (polyval(y, _MIXED) for y in (x, -x))
        far = x >= _NEAR
        y = x[far]
        ratio[far] = np.arctanh(y) / y
        mixed[far], swapped[far] = (1 / (1 + y) - ratio[far]) / y, (ratio[far] - 1 / (1 - y)) / y
        self._first = 0.5 / one, 0.5 / two, 0.5 * ratio / mean  # g[1, 1], g[2, 2], g[1, 2]
        quarter = 0.25 / mean**2
        self._second = (
            -0.25 / one**2,
            -0.25 / two**2,
            quarter * mixed,
            quarter * swapped,
        )  # g[1, 1, 1], ..., g[1, 2, 2]
        E, F = 0.5 * np.log1p(more + radius), 0.5 * np.log1p(more - radius)
        self.strain = np.stack(
            [c * c * E + s * s * F, s * s * E + c * c * F, 2 * c * s * (E - F)], axis=1
        )

    def back(self, T: Array, moduli: Array) -> tuple[Array, Array]:
        """S ``(n, 3)``, ``[xx, yy, xy]``, and its derivative ``(n, 3, 3)`` by ``[C_xx, C_yy,
        C_xy]``, from T ``(n, 3)`` and its derivative by the logarithmic strain."""
        g, h, k = self._first
        aaa, bbb, aab, abb = self._second
        xx, yy, xy = np.einsum("nij,nj->in", self._there, T)
        z, weights = np.zeros(len(T)), np.stack(self._first, axis=1)
        S = np.stack([2 * g * xx, 2 * h * yy, 2 * k * xy], axis=1)
        bent = _table([[4 * aaa * xx, z, 4 * aab * xy], [z, 4 * bbb * yy, 4 * abb * xy],
                       [2 * aab * xy, 2 * abb * xy, 2 * (aab * xx + abb * yy)]])  # fmt: skip
        own = self._there @ moduli @ np.swapaxes(self._there, 1, 2)
        of_strain = 2 * weights[:, :, None] * own * (weights * [1, 1, 2])[:, None, :]
        return np.einsum("nij,nj->ni", self._back, S), self._back @ (bent + of_strain) @ self._there
