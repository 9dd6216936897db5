"""J2 plasticity with kinematic hardening of Armstrong and Frederick beside the isotropic one, for
cyclic loads.

The elastic range has the radius that the isotropic hardening gives, and its centre is a sum of back
stresses, each with ``d a = 2/3 C d eps_p - gamma a d_peeq`` (Armstrong and Frederick 1966; Chaboche
1986): in tension it moves by ``C`` per plastic strain at first, and saturates at ``C / gamma``.
Backward Euler leaves one scalar equation a point for the increment of PEEQ (Kobayashi and Ohno
2002), which decreases monotonically.

Stresses and strains of this file have all ``s`` components of the kinematics, ``[xx, yy, zz, xy]``
and in space ``[xx, yy, zz, xy, yz, zx]``. Products of two of them count shear twice. In plane
stress the strain out of the plane is found such that the stress out of it is zero.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from archord.materials.elasticity import ENGINEERING, TRACE
from archord.materials.hardening import Hardening
from archord.materials.j2 import J2Material
from archord.materials.material import Array, State
from archord.materials.return_map import STEEP, PlasticState, beyond, bracketed_newton
from archord.report.errors import InputError, shown

_TWICE = ENGINEERING  # products of tensors count shear twice
# of engineering strains
_DEVIATOR = np.diag(1 / ENGINEERING) - np.outer(TRACE, TRACE) / 3


@dataclass(frozen=True)
class KinematicState(PlasticState):
    """History of ``n`` points, with ``m`` back stresses ``(n, m, s)`` and the plastic work density
    ``(n,)``."""

    back_stress: Array
    work: Array


class _Increment(NamedTuple):
    """How far ``n`` points yield, with ``m`` back stresses ``a``.

    Attributes
    ----------
    d_peeq : array (n,)
        The increment of PEEQ.
    fall : array (n,)
        How fast the difference from the yield condition falls with it.
    theta : array (n, m)
        ``1 / (1 + gamma d_peeq)``.
    eta : array (n, s)
        ``trial stress - sum of theta a``.
    rate : array (n, s)
        The derivative of ``eta`` by ``d_peeq``.
    """

    d_peeq: Array
    fall: Array
    theta: Array
    eta: Array
    rate: Array


@dataclass(frozen=True)
class KinematicMaterial(J2Material):
    """Elastic-plastic solid of von Mises with isotropic and kinematic hardening.

    With recovery (``gamma > 0``) its tangent is not symmetric.

    Parameters
    ----------
    E : float
        Young's modulus. It sets the unit of stress.
    nu : float
        Poisson's ratio.
    plane : {"strain", "stress", "axisymmetric", "space"}
        How displacement becomes strain. The default becomes the problem's kinematics; another
        value must agree with them.
    hardening : LinearHardening, TabularHardening, VoceHardening or SwiftHardening
        The yield stress over PEEQ: the size of the elastic range.
    back_stresses : tuple of (float, float)
        A modulus C and a rate of recovery gamma for each back stress (Armstrong and Frederick).
        ``gamma = 0`` is Prager's linear kinematic hardening.

    Raises
    ------
    InputError
        For what are no pairs, a C that is not positive, or a negative gamma.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import KinematicMaterial, LinearHardening
    >>> steel = KinematicMaterial(
    ...     210e3, 0.3, hardening=LinearHardening(300.0), back_stresses=((60e3, 400.0),)
    ... )
    >>> state = steel.state(1)
    >>> for shear in (0.01, 0.0):
    ...     stress, _, state = steel.update(np.array([[0.0, 0.0, shear]]), state)
    ...     print(stress[0, 3].round())
    227.0
    -193.0
    """

    back_stresses: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """Check the back stresses."""
        try:
            own = tuple((float(C), float(gamma)) for C, gamma in self.back_stresses)
        except (TypeError, ValueError):
            own = ((0.0, 0.0),)
        if not all(C > 0 and gamma >= 0 for C, gamma in own):
            raise InputError(
                f"archord.KinematicMaterial: back_stresses = {shown(self.back_stresses)} must be "
                "pairs of a positive modulus and a rate of recovery that is not negative."
            )
        object.__setattr__(self, "back_stresses", own)  # an array may be changed later

    @property
    def _moduli(self) -> Array:
        """C and gamma ``(2, m)``."""
        return np.array(self.back_stresses, dtype=float).reshape(-1, 2).T

    def state(self, n: int) -> KinematicState:
        """``n`` points that never yielded."""
        s = self.kinematics.n_stress
        back = np.zeros((n, len(self.back_stresses), s))
        return KinematicState(np.zeros((n, s)), np.zeros(n), back, np.zeros(n))

    def update(self, strain: Array, state: State) -> tuple[Array, Array, KinematicState]:
        """The return map; in plane stress with the strain out of the plane as one more unknown."""
        whole = np.zeros((len(strain), self.kinematics.n_stress))
        whole[:, self.working] = strain
        if self.kinematics.is_thin:
            stress, tangent, new = self._plane_stress(whole, state)
            ratio = tangent[:, :, 2] / tangent[:, 2, 2, None]
            tangent = tangent - ratio[:, :, None] * tangent[:, 2, None]
            # all normal stresses share the pressure's round-off
            stress = stress - ratio * stress[:, 2, None]
        else:
            stress, tangent, new = self._return(whole, state)
        rows, columns = np.ix_(self.working, self.working)
        flows = self.flows(state, new)[:, None, None]
        working = np.where(flows, tangent[:, rows, columns], self.elastic_tangent)
        return stress, working, new

    def _plane_stress(
        self, strain: Array, old: KinematicState
    ) -> tuple[Array, Array, KinematicState]:
        """`_return` at the ``eps_zz`` at which ``s_zz`` vanishes, which increases with it."""
        lam, mu = self.lame
        modulus = lam + 2 * mu

        def off(z: Array) -> tuple:
            strain[:, 2] = z
            stress, tangent, new = self._return(strain, old)
            stiffness = tangent[:, 2, 2]
            strains = (np.abs(strain) + np.abs(old.plastic_strain)).sum(axis=1)
            round_off = 1e-13 * np.abs(stress).max(axis=1) + 4e-15 * modulus * strains
            return stress[:, 2], stiffness, round_off / stiffness, stress, tangent, new

        elastic = strain - old.plastic_strain * _TWICE[:4]
        in_plane = elastic[:, 0] + elastic[:, 1]
        thinner = self.nu / (1 - self.nu) * in_plane
        start = old.plastic_strain[:, 2] - thinner
        far = np.full(len(strain), 1e100)
        _, (_, _, _, *found) = bracketed_newton(off, start, -far, far)
        return tuple(found)

    def _return(self, strain: Array, old: KinematicState) -> tuple[Array, Array, KinematicState]:
        """Stress ``(n, s)``, tangent ``(n, s, s)`` and new state at engineering strains ``(n,
        s)``."""
        lam, mu = self.lame
        bulk = lam + 2 * mu / 3
        s = strain.shape[1]
        trace = TRACE[:s]
        deviator = _DEVIATOR[:s, :s]
        elastic_strain = strain - old.plastic_strain * _TWICE[:s]
        trial = 2 * mu * elastic_strain @ deviator
        pressure = bulk * strain @ trace
        stress = trial + pressure[:, None] * trace
        elastic_tangent = bulk * np.outer(trace, trace) + 2 * mu * deviator
        tangent = np.tile(elastic_tangent, (len(strain), 1, 1))
        from_centre = trial - self.centre(old)
        mises = np.sqrt(1.5) * _norm(from_centre)
        p = beyond(mises, self.hardening, old.peeq)
        if not len(p):
            return stress, tangent, old
        hardening = self.hardening.at(p)
        grown = self._increment(trial[p], old.back_stress[p], old.peeq[p], hardening)
        length = _norm(grown.eta)
        n = grown.eta / length[:, None]
        flow = np.sqrt(1.5) * grown.d_peeq[:, None] * n
        stress[p] -= 2 * mu * flow

        # the flow turns with the trial stress, and grows with the increment
        steep = np.sqrt(6) * mu
        shrunk = steep * grown.d_peeq / length
        dyad = n[:, :, None] * n[:, None, :]
        turned = deviator - dyad
        along = _dot(grown.rate, n)
        aside = grown.rate - along[:, None] * n
        drift = steep * n + shrunk[:, None] * aside
        stretch = (steep / grown.fall)[:, None] * drift
        tangent[p] -= shrunk[:, None, None] * 2 * mu * turned
        tangent[p] -= stretch[:, :, None] * n[:, None, :]
        return stress, tangent, self._grown(old, p, grown, flow, hardening)

    def _grown(
        self,
        old: KinematicState,
        p: np.ndarray,
        grown: _Increment,
        flow: Array,
        hardening: Hardening,
    ) -> KinematicState:
        """The state when the points ``p`` have yielded, by the increments ``flow`` of the plastic
        strain."""
        C, gamma = self._moduli
        before = old.back_stress[p]
        after = old.peeq[p] + grown.d_peeq
        moved = before + 2 / 3 * C[:, None] * flow[:, None, :]
        back = grown.theta[:, :, None] * moved

        # stress . d eps_p = (yield stress + sum of 3 gamma a . a / (2 C)) d_peeq
        #     + sum of 3 d(a . a) / (4 C)
        now = _dot(back, back) / C
        between = _dot(back, before) / C
        then = _dot(before, before) / C
        kept = 0.75 * (now - then).sum(axis=1)
        lost = 0.75 * grown.d_peeq * ((now + between) @ gamma)
        isotropic = hardening.work(after) - hardening.work(old.peeq[p])

        new = deepcopy(old)
        new.plastic_strain[p] += flow
        new.peeq[p] = after
        new.back_stress[p] = back
        new.work[p] += isotropic + kept + lost
        return new

    def _increment(
        self, trial: Array, back: Array, peeq: Array, hardening: Hardening
    ) -> _Increment:
        """The increment of PEEQ at which ``sqrt(1.5) |eta| = (3 mu + sum of theta C) d_peeq + yield
        stress``."""
        _, mu = self.lame
        C, gamma = self._moduli
        at_most = _norm(trial) + _norm(back).sum(axis=1)
        high = np.sqrt(1.5) * at_most / (3 * mu)
        close = 1e-14 * high

        def off(d_peeq: Array) -> tuple:
            theta = 1 / (1 + gamma * d_peeq[:, None])
            eta = trial - np.einsum("nk,nki->ni", theta, back)
            rate = np.einsum("nk,nki->ni", gamma * theta**2, back)
            length = _norm(eta)
            after = peeq + d_peeq
            strength = hardening.stress(after)
            relaxed = (3 * mu + theta @ C) * d_peeq
            value = relaxed + strength - np.sqrt(1.5) * length
            hardened = 3 * mu + theta**2 @ C + hardening.slope(after)
            lengthening = np.sqrt(1.5) * _dot(rate, eta) / length
            fall = hardened - lengthening
            return value, fall, close, theta, eta, rate

        start = np.zeros(len(trial))
        d_peeq, found = bracketed_newton(off, start, start, high, STEEP * mu)
        _, fall, _, theta, eta, rate = found
        return _Increment(d_peeq, fall, theta, eta, rate)

    def centre(self, state: State) -> Array:
        """The sum of the back stresses ``(n, s)``."""
        return state.back_stress.sum(axis=1)

    def stiffening(self, old: PlasticState, new: PlasticState) -> Array:
        """By how much their sum moves per PEEQ, but for the recovery of what was there before."""
        C, gamma = self._moduli
        d_peeq = new.peeq - old.peeq
        theta_squared = 1 / (1 + gamma * d_peeq[:, None]) ** 2
        return theta_squared @ C

    def dissipation(self, state: State) -> Array:
        """Plastic work density ``(n,)``, with what the back stresses store."""
        return state.work


def _dot(a: Array, b: Array) -> Array:
    return (a * b) @ _TWICE[: a.shape[-1]]


def _norm(a: Array) -> Array:
    return np.sqrt(_dot(a, a))
