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
from numpy.polynomial.polynomial import polyval

from archord.materials.elasticity import TRACE, Elastic
from archord.materials.hardening import Scaled
from archord.materials.j2 import J2Material
from archord.materials.kinematics import SPACE, Kinematics
from archord.materials.material import Array, Material, State
from archord.materials.return_map import PlasticState
from archord.materials.spatial_logarithm import SpatialLogarithm

_NEAR = 0.05  # relative distance of eigenvalues below which divided differences are series
_RATIO = [1 / (k + 1) if k % 2 == 0 else 0.0 for k in range(15)]  # artanh(x)/x
_MIXED = [
    -1.0 if k % 2 == 0 else (k + 1) / (k + 2) for k in range(14)
]  # (1/(1 + x) - artanh(x)/x)/x


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
        logarithm = _logarithm(strain)
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
        logarithm = _logarithm(strain)
        T, *_ = self._logarithmic(logarithm.strain, state)
        return self.inner.stored(logarithm.strain, T, state)

    def true_stress(self, strain: Array, stress: Array, state: State) -> Array:
        """Cauchy's stress ``(n, n_stress)`` after an update to the gradients ``strain``, the
        nominal ``stress`` and ``state``."""
        logarithm = _logarithm(strain)
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


def _logarithm(gradient: Array) -> Logarithm | SpatialLogarithm:
    """The logarithmic strain of displacement gradients ``(n, k)``, which are nine in space."""
    in_space = gradient.shape[1] == len(SPACE.gradient)
    return SpatialLogarithm(gradient) if in_space else Logarithm(gradient)


def _deformation(gradient: Array) -> tuple[Array, Array, Array, Array]:
    """``F_xx, F_xy, F_yx, F_yy`` ``(n,)`` of displacement gradients; not a number where what is
    deformed is turned inside out."""
    xx, yy, xy, yx, *hoops = gradient.T
    is_right = (1 + xx) * (1 + yy) > xy * yx
    for hoop in hoops:
        is_right &= hoop > -1
    one = np.where(is_right, 1.0, np.nan)
    return one + xx, one * xy, one * yx, one + yy


def _table(rows: list[list[Array]]) -> Array:
    """Matrices ``(n, i, j)`` of rows of entries ``(n,)``."""
    return np.moveaxis(np.array(rows), -1, 0)


class Logarithm:
    """The logarithmic strain of displacement gradients ``(n, k_gradient)`` in a plane or around an
    axis, with its derivatives.

    With ``g = 1/2 ln`` of the eigenvalues of C and its divided differences, ``dE_ij = g[i, j]
    dC_ij`` and ``d2E_ij = sum over k of g[i, k, j] (A_ik B_kj + B_ik A_kj)`` along the principal
    axes (Daleckii and Krein 1965; Higham 2008, theorem 3.11). Around an axis the hoop direction is
    a principal one, with ``E = ln(1 + u_r / r)``.

    - ``working`` ``(k,)``: places in a stress of the components that do work on the strain
    - ``strain`` ``(n, k)``: the logarithmic strain, with engineering shear
    - ``_to_axes`` ``(n, 3, 3)``: takes tensors [xx, yy, xy] to the principal axes, ``_back`` takes
      them back
    - ``_first``: g[1, 1], g[2, 2], g[1, 2], ``(n,)`` each
    - ``_second``: g[1, 1, 1], g[2, 2, 2], g[1, 1, 2], g[1, 2, 2], ``(n,)`` each
    """

    def __init__(self, gradient: Array) -> None:
        self._gradient = gradient
        self.working = [0, 1, 3] if gradient.shape[1] == 4 else [0, 1, 2, 3]
        a, b, c, d = gradient.T[:4]
        # C is one and more, whose digits small strains need
        xx = 2 * a + a**2 + d**2
        yy = 2 * b + b**2 + c**2
        xy = c + d + a * c + b * d
        more = (xx + yy) / 2
        radius = np.hypot((xx - yy) / 2, xy)
        angle = np.arctan2(2 * xy, xx - yy) / 2
        cos = np.cos(angle)
        sin = np.sin(angle)
        self._to_axes = _rotation(cos, sin)
        self._back = _rotation(cos, -sin)
        self._divide(1 + more, radius)
        E_1 = 0.5 * np.log1p(more + radius)
        E_2 = 0.5 * np.log1p(more - radius)
        E_xx = cos**2 * E_1 + sin**2 * E_2
        E_yy = sin**2 * E_1 + cos**2 * E_2
        shear = 2 * cos * sin * (E_1 - E_2)
        hoops = gradient.T[4:]
        known = np.where(hoops > -1, hoops, np.nan)
        self.strain = np.stack([E_xx, E_yy, *np.log1p(known), shear], axis=1)

    def _divide(self, mean: Array, radius: Array) -> None:
        """Divided differences of the logarithm at the eigenvalues ``mean +- radius`` of C."""
        one = mean + radius
        two = mean - radius
        x = radius / mean
        ratio = polyval(x, _RATIO)
        mixed = polyval(x, _MIXED)
        swapped = polyval(-x, _MIXED)
        far = x >= _NEAR
        y = x[far]
        exact = np.arctanh(y) / y
        ratio[far] = exact
        mixed[far] = (1 / (1 + y) - exact) / y
        swapped[far] = (exact - 1 / (1 - y)) / y
        g_11 = 0.5 / one
        g_22 = 0.5 / two
        g_12 = 0.5 * ratio / mean
        self._first = g_11, g_22, g_12
        g_111 = -0.25 / one**2
        g_222 = -0.25 / two**2
        quarter = 0.25 / mean**2
        self._second = g_111, g_222, quarter * mixed, quarter * swapped

    def nominal(self, T: Array, moduli: Array) -> tuple[Array, Array]:
        """The nominal stress ``(n, k_gradient)`` and its derivative by the gradient, from ``T``
        ``(n, k)`` and its derivative ``(n, k, k)`` by the logarithmic strain.

        Along the principal axes ``P = Q^T (g T)`` with ``Q = dC/dF``, so that ``dP = Q^T (g M g +
        T g') Q dF + dQ^T (g T)``.
        """
        Q = self._to_axes @ self._metric()
        T_11, T_22, T_12 = np.einsum("nij,nj->in", self._to_axes, T[:, [0, 1, -1]])
        g_11, g_22, g_12 = self._first
        weight = np.stack(self._first, axis=1)
        # half the second Piola-Kirchhoff stress
        S_11 = g_11 * T_11
        S_22 = g_22 * T_22
        S_12 = g_12 * T_12
        work = np.stack([S_11, S_22, 2 * S_12], axis=1)
        # takes strains along the axes to engineering ones along x and y
        turn = self._back * np.array([1.0, 1.0, 2.0])[:, None]
        slope = turn @ (weight[:, :, None] * Q)
        in_plane = [0, 1, T.shape[1] - 1]
        M = moduli[:, np.array(in_plane)[:, None], in_plane]
        stress = np.einsum("nik,ni->nk", Q, work)
        tangent = np.swapaxes(slope, 1, 2) @ M @ slope
        tangent += np.swapaxes(Q, 1, 2) @ self._bent(T_11, T_22, T_12) @ Q
        tangent += self._turning(S_11, S_22, S_12)
        if T.shape[1] == 3:
            return stress, tangent
        return self._with_hoop(stress, tangent, slope, T, moduli)

    def kirchhoff(self, stress: Array, T: Array) -> Array:
        """Kirchhoff's stress ``(n, 4)`` of nominal ones ``(n, k_gradient)``; ``T`` ``(n, 4)`` has
        its component out of the plane."""
        F_xx, F_xy, F_yx, F_yy = _deformation(self._gradient)
        P_xx, P_yy, P_xy, P_yx = stress.T[:4]
        kirchhoff = np.empty((len(stress), 4))
        kirchhoff[:, 0] = P_xx * F_xx + P_xy * F_xy
        kirchhoff[:, 1] = P_yx * F_yx + P_yy * F_yy
        kirchhoff[:, 2] = T[:, 2]
        kirchhoff[:, 3] = P_xx * F_yx + P_xy * F_yy
        return kirchhoff

    def _metric(self) -> Array:
        """``dC/dF`` ``(n, 3, 4)``, of [C_xx, C_yy, C_xy]."""
        F_xx, F_xy, F_yx, F_yy = _deformation(self._gradient)
        zero = np.zeros_like(F_xx)
        return _table(
            [
                [2 * F_xx, zero, zero, 2 * F_yx],
                [zero, 2 * F_yy, 2 * F_xy, zero],
                [F_xy, F_yx, F_xx, F_yy],
            ]
        )

    def _bent(self, T_11: Array, T_22: Array, T_12: Array) -> Array:
        """``T : d2E/dC2`` ``(n, 3, 3)`` along the principal axes."""
        g_111, g_222, g_112, g_122 = self._second
        zero = np.zeros_like(T_11)
        first = 2 * g_112 * T_12
        second = 2 * g_122 * T_12
        shear = 2 * (g_112 * T_11 + g_122 * T_22)
        return _table(
            [
                [2 * g_111 * T_11, zero, first],
                [zero, 2 * g_222 * T_22, second],
                [first, second, shear],
            ]
        )

    def _turning(self, S_11: Array, S_22: Array, S_12: Array) -> Array:
        """The part ``(n, 4, 4)`` of the tangent from the second derivative of C, with the halved
        second Piola-Kirchhoff stress along the principal axes."""
        S = 2 * np.einsum("nij,jn->in", self._back, np.stack([S_11, S_22, S_12]))
        xx, yy, xy = S
        zero = np.zeros_like(xx)
        return _table(
            [[xx, zero, xy, zero], [zero, yy, zero, xy], [xy, zero, yy, zero], [zero, xy, zero, xx]]
        )

    def _with_hoop(
        self, stress: Array, tangent: Array, slope: Array, T: Array, moduli: Array
    ) -> tuple[Array, Array]:
        """``stress`` and ``tangent`` in the plane, with the hoop component behind; ``slope`` ``(n,
        3, 4)`` is the derivative of the strain in the plane."""
        stretch = 1 + self._gradient[:, 4]
        in_plane = [0, 1, 3]
        P_tt = T[:, 2] / stretch
        by_hoop = np.einsum("nik,ni->nk", slope, moduli[:, in_plane, 2])
        of_hoop = np.einsum("ni,nik->nk", moduli[:, 2, in_plane], slope)
        stiffness = moduli[:, 2, 2] / stretch
        whole = np.empty((len(T), 5, 5))
        whole[:, :4, :4] = tangent
        whole[:, :4, 4] = by_hoop / stretch[:, None]
        whole[:, 4, :4] = of_hoop / stretch[:, None]
        whole[:, 4, 4] = (stiffness - P_tt) / stretch
        return np.column_stack([stress, P_tt]), whole


def _rotation(cos: Array, sin: Array) -> Array:
    """Takes the components [xx, yy, xy] of a tensor to axes that are turned, ``(n, 3, 3)``."""
    cc = cos * cos
    ss = sin * sin
    cs = cos * sin
    return _table([[cc, ss, 2 * cs], [ss, cc, -2 * cs], [-cs, cs, cc - ss]])
