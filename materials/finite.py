"""Large strain: any material of small strain in the space of logarithmic strains (Miehe, Apel and
Lambrecht 2002).

The logarithmic strain is ``E = 1/2 ln C`` with ``C = F^T F``. The inner material makes of it the
stress ``T`` that does work on it, along the principal axes Kirchhoff's: Hencky's elasticity, and
plastic strains that add up as logarithms, which is multiplicative plasticity where the axes do not
turn. The nominal stress ``P = T : dE/dF`` and its derivative follow from the derivatives of the
logarithm. J2 materials yield by Cauchy's von Mises stress: their yield stress times ``J``, which
elasticity alone changes, is Kirchhoff's. Back stresses are Kirchhoff's.

Gradients ``(n, k)`` of the displacement and nominal stresses have the components of the kinematics:
in a plane ``[xx, yy, xy, yx]``, P_xy a force along x on a face that was normal to y, around an axis
``[rr, zz, rz, zr, tt]``, and in space ``[xx, yy, zz, xy, yx, yz, zy, zx, xz]``. In plane stress
forces are per undeformed thickness, and the thickness follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from archord.materials.elasticity import TRACE, Elastic
from archord.materials.hardening import Scaled
from archord.materials.j2 import J2Material
from archord.materials.kinematics import Kinematics
from archord.materials.logarithm import Logarithm
from archord.materials.material import Array, Material, State
from archord.materials.return_map import PlasticState


@dataclass(frozen=True)
class LargeState(PlasticState):
    """History of ``n`` points of a J2 material at large strain.

    - ``volume_work`` ``(n,)``: what the change of volume adds to the plastic work density
    """

    volume_work: Array


@dataclass(frozen=True)
class LargeStrain(Material):
    """A material of small strain at large strain, by logarithmic strains.

    The method is by Miehe, Apel and Lambrecht (2002). The material gets displacement gradients and
    gives nominal stresses, in the unit of ``inner``, whose states and moduli it has. If one body of
    a problem is at large strain, all bodies that yield must be.

    Parameters
    ----------
    inner : Material
        The material of small strain, such as `Elastic` or `J2Material`.

    Attributes
    ----------
    finite : bool
        True: it gets displacement gradients, in a plane ``[xx, yy, xy, yx]``, in space ``[xx, yy,
        zz, xy, yx, yz, zy, zx, xz]``.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import Elastic, LargeStrain
    >>> steel = LargeStrain(Elastic(210e3, 0.3))
    >>> stress, _, _ = steel.update(np.array([[0.1, 0.0, 0.0, 0.0]]), None)
    >>> stress.round(-1).tolist()
    [[24490.0, 11550.0, 0.0, 0.0]]

    A rotation is no strain:

    >>> c, s = np.cos(0.5), np.sin(0.5)
    >>> stress, _, _ = steel.update(np.array([[c - 1, c - 1, -s, s]]), None)
    >>> bool(abs(stress).max() < 1e-6)
    True
    """

    finite: ClassVar[bool] = True

    inner: Any

    def __getattr__(self, name: str) -> Any:
        """What else the inner material has, as its constants."""
        if name.startswith("__") or name == "inner":
            raise AttributeError(name)
        return getattr(self.inner, name)

    @property
    def of_small_strain(self) -> Material:
        """The inner material."""
        return self.inner

    @property
    def yields(self) -> bool:  # type: ignore[override]
        """Whether the inner material does."""
        return self.inner.yields

    @property
    def elastic_tangent(self) -> Array:
        """The elastic tangent of small strains ``(k, k)``."""
        return self.inner.elastic_tangent

    def elastic(self) -> Material:
        """The material that cannot yield (further), at large strain."""
        return LargeStrain(self.inner.elastic())

    def under(self, kinematics: Kinematics) -> LargeStrain:
        """The inner material in a problem of these ``kinematics``, at large strain. Raises
        ValueError for a material of one's own in plane stress: it does not tell how thick it is."""
        if kinematics.is_thin and not isinstance(self.inner, Elastic):
            raise ValueError(
                "true stresses at large strain need the thickness, which in plane stress is known "
                "of Elastic and what is made from it alone"
            )
        return replace(self, inner=self.inner.under(kinematics))

    def state(self, n: int) -> State:
        """The state of the inner material; with isotropic hardening and the work of its volume."""
        state = self.inner.state(n)
        if type(state) is PlasticState:
            return LargeState(state.plastic_strain, state.peeq, np.zeros(n))
        return state

    def dissipation(self, state: State) -> Array | float:
        """Plastic work density ``(n,)`` per undeformed volume."""
        dissipated = self.inner.dissipation(state)
        return dissipated + state.volume_work if isinstance(state, LargeState) else dissipated

    def peeq(self, state: State) -> Array | float:
        """The inner material's."""
        return self.inner.peeq(state)

    def update(self, strain: Array, state: State) -> tuple[Array, Array, State]:
        """Nominal stress ``(n, k)``, its derivative ``(n, k, k)`` and the new state at displacement
        gradients ``(n, k)``; not a number at points that are turned inside out."""
        logarithm = Logarithm(strain)
        T, moduli, new = self._logarithmic(logarithm.strain, state)
        stress, tangent = logarithm.nominal(T[:, logarithm.working], moduli)
        return stress, tangent, new

    def _logarithmic(self, strain: Array, state: State) -> tuple[Array, Array, State]:
        """The inner material at logarithmic strains ``(n, k)``."""
        m = self.inner
        if not isinstance(m, J2Material):
            return m.update(strain, state)
        normal = _normals(m.working)
        if m.kinematics.is_thin:
            # it follows the stress, which hardly depends on it: its derivative is left out
            elastic_stress, *_ = m.update(strain, state)
            trace = elastic_stress[:, :2].sum(axis=1)
            volume = (1 - 2 * m.nu) / m.E * trace
        else:
            volume = strain @ normal
        scaled = replace(m, hardening=Scaled(m.hardening, np.exp(volume)))
        stress, moduli, new = scaled.update(strain, state)
        if isinstance(state, LargeState) and new is not state:
            grown = m.dissipation(new) - m.dissipation(state)
            volume_work = state.volume_work + np.expm1(volume) * grown
            new = LargeState(new.plastic_strain, new.peeq, volume_work)
        if m.kinematics.is_thin or new is state:
            return stress, moduli, new
        # a yield stress that grows makes the deviator grow with it
        mean = stress[:, :3].mean(axis=1)
        spherical = mean[:, None] * TRACE[: stress.shape[1]]
        deviator = stress - spherical - m.centre(new)
        slope = scaled.hardening.slope(new.peeq) + m.stiffening(state, new)
        _, mu = m.lame
        hardened = 1 + slope / (3 * mu)
        grown = m.flows(state, new) / hardened
        by_volume = (grown[:, None] * deviator)[:, m.working]
        return stress, moduli + by_volume[:, :, None] * normal, new

    def energy(self, stress: Array) -> Array:
        """Elastic energy density ``(n,)`` of stresses ``(n, n_stress)`` that do work on logarithmic
        strains."""
        return self.inner.energy(stress)

    def stored(self, strain: Array, stress: Array, state: State) -> Array:
        """Elastic energy per undeformed volume ``(n,)`` after an update to the gradients ``strain``
        and ``state``."""
        logarithm = Logarithm(strain)
        T, *_ = self._logarithmic(logarithm.strain, state)
        return self.inner.stored(logarithm.strain, T, state)

    def true_stress(self, strain: Array, stress: Array, state: State) -> Array:
        """Cauchy's stress ``(n, n_stress)`` after an update to the gradients ``strain``, the
        nominal ``stress`` and ``state``."""
        logarithm = Logarithm(strain)
        T, _, _ = self._logarithmic(logarithm.strain, state)
        if self._is_thin:
            compliance = (1 - 2 * self.inner.nu) / self.inner.E
            volume = compliance * T[:, :3].sum(axis=1)
        else:
            volume = logarithm.strain @ _normals(logarithm.working)
        J = np.exp(volume)
        return logarithm.kirchhoff(stress, T) / J[:, None]

    @property
    def _is_thin(self) -> bool:
        """Whether the thickness follows from the stress, by isotropic elasticity."""
        return isinstance(self.inner, Elastic) and self.inner.kinematics.is_thin


def _normals(working: Sequence[int]) -> Array:
    """Takes strains ``(n, k)``, whose components have these places in a stress, to their trace."""
    return np.array([float(place < 3) for place in working])
