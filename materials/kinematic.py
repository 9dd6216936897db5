"""J2 plasticity with kinematic hardening of Armstrong and Frederick beside the isotropic one, for cyclic loads.

The elastic range has the radius that the isotropic hardening gives, and its centre is a sum of back stresses, each with
``d a = 2/3 C d eps_p - gamma a d_peeq`` (Armstrong and Frederick 1966; Chaboche 1986): in tension it moves by ``C``
per plastic strain at first, and saturates at ``C / gamma``. Backward Euler leaves one scalar equation a point for the
increment of PEEQ (Kobayashi and Ohno 2002), which decreases monotonically.

Stresses and strains of this file have four components, ``[xx, yy, zz, xy]``, and products of two of them count shear
twice. In plane stress the strain out of the plane is found such that the stress out of it is zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from archord.materials.elasticity import Elastic
from archord.materials.hardening import Hardening, LinearHardening
from archord.materials.material import Array, Material

_ITERATIONS = 60
_TWICE = np.array([1.0, 1.0, 1.0, 2.0])  # products of tensors; engineering over tensor shear
_TRACE = np.array([1.0, 1.0, 1.0, 0.0])
_DEVIATOR = np.diag([1.0, 1.0, 1.0, 0.5]) - np.outer(_TRACE, _TRACE) / 3  # of engineering strains
_PLANE = np.array([0, 1, 3])


@dataclass(frozen=True)
class KinematicState:
    """History of ``n`` points: plastic strain ``(n, 4)`` (tensor shear), PEEQ ``(n,)``, ``m`` back stresses
    ``(n, m, 4)``, and the plastic work density ``(n,)``."""

    plastic_strain: Array
    peeq: Array
    back_stress: Array
    work: Array


@dataclass(frozen=True)
class KinematicMaterial(Elastic):
    """Elastic-plastic solid with isotropic ``hardening`` and back stresses ``(C, gamma)``, moduli and rates of
    recovery; ``gamma = 0`` is Prager's linear kinematic hardening. With recovery its tangent is not symmetric.

    Raises ValueError unless C is positive and gamma is not negative.
    """

    yields = True

    hardening: Hardening
    back_stresses: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        """Check the back stresses."""
        if not all(C > 0 and gamma >= 0 for C, gamma in self.back_stresses):
            raise ValueError("moduli of back stresses must be positive, rates of recovery must not be negative")

    def elastic(self) -> Material:
        """The solid with a yield stress out of reach."""
        return replace(self, hardening=LinearHardening(np.inf))

    def state(self, n: int) -> KinematicState:
        """``n`` points that never yielded."""
        back = np.zeros((n, len(self.back_stresses), 4))
        return KinematicState(np.zeros((n, 4)), np.zeros(n), back, np.zeros(n))

    def update(self, strain: Array, state: KinematicState) -> tuple[Array, Array, KinematicState]:
        """The return map; in plane stress with the strain out of the plane as one more unknown."""
        whole = np.zeros((len(strain), 4))
        whole[:, _PLANE] = strain
        if self.plane == "strain":
            stress, tangent, new = self._return(whole, state)
            flows = new.peeq > state.peeq
        else:
            stress, tangent, new = self._plane_stress(whole, state)
            flows = new.peeq > state.peeq
            ratio = tangent[:, :, 2] / tangent[:, 2, 2, None]
            tangent = tangent - ratio[:, :, None] * tangent[:, 2, None]
            stress = stress - ratio * stress[:, 2, None]  # all normal stresses share the pressure's round-off
        in_plane = np.tile(self.elastic_tangent, (len(strain), 1, 1))
        in_plane[flows] = tangent[flows][:, _PLANE[:, None], _PLANE]
        return stress, in_plane, new

    def _plane_stress(self, strain: Array, old: KinematicState) -> tuple[Array, Array, KinematicState]:
        """`_return` at the ``eps_zz`` at which ``s_zz`` vanishes, which increases with it."""
        elastic, modulus = strain - old.plastic_strain * _TWICE, self.lame[0] + 2 * self.lame[1]
        strain[:, 2] = old.plastic_strain[:, 2] - self.nu / (1 - self.nu) * (elastic[:, 0] + elastic[:, 1])
        bounds: tuple[Array, Array] = np.full(len(strain), -np.inf), np.full(len(strain), np.inf)
        low, high = bounds
        for _ in range(_ITERATIONS):
            stress, tangent, new = self._return(strain, old)
            off, z = stress[:, 2], strain[:, 2]
            low, high = np.where(off < 0, z, low), np.where(off > 0, z, high)
            step = off / tangent[:, 2, 2]
            strains = (np.abs(strain) + np.abs(old.plastic_strain)).sum(axis=1)
            moving = ~(np.abs(off) <= 1e-13 * np.abs(stress).max(axis=1) + 4e-15 * modulus * strains)
            if not moving.any():
                break
            z = np.where(moving, z - step, z)
            astray = moving & ~((z > low) & (z < high))
            strain[:, 2] = z
            strain[astray, 2] = (low[astray] + high[astray]) / 2
        else:
            stress[moving] = np.nan
        return stress, tangent, new

    def _return(self, strain: Array, old: KinematicState) -> tuple[Array, Array, KinematicState]:
        """Stress ``(n, 4)``, tangent ``(n, 4, 4)`` and new state at engineering strains ``(n, 4)``."""
        lam, mu = self.lame
        bulk = lam + 2 * mu / 3
        trial = 2 * mu * (strain - old.plastic_strain * _TWICE) @ _DEVIATOR
        stress = trial + (bulk * strain @ _TRACE)[:, None] * _TRACE
        tangent = np.tile(bulk * np.outer(_TRACE, _TRACE) + 2 * mu * _DEVIATOR, (len(strain), 1, 1))
        from_centre = trial - old.back_stress.sum(axis=1)
        p = np.flatnonzero(np.sqrt(1.5) * _norm(from_centre) > self.hardening.stress(old.peeq))
        if not len(p):
            return stress, tangent, old
        d_peeq, fall, theta, eta, rate = self._increment(trial[p], old.back_stress[p], old.peeq[p])
        length = _norm(eta)
        n = eta / length[:, None]
        flow = np.sqrt(1.5) * d_peeq[:, None] * n
        stress[p] -= 2 * mu * flow
        modulus = np.array([C for C, _ in self.back_stresses])[:, None]
        recovery = np.array([gamma for _, gamma in self.back_stresses])
        before = old.back_stress[p]
        back = theta[:, :, None] * (before + 2 / 3 * modulus * flow[:, None, :])

        # stress . d eps_p = yield stress d_peeq + sum of d(a . a) 3 / (4 C) + gamma a . a 3 / (2 C) d_peeq
        now, between, then = (
            (a * b) @ _TWICE / modulus[:, 0] for a, b in ((back, back), (back, before), (before, before))
        )
        kept = 0.75 * (now - then).sum(axis=1)
        lost = 0.75 * d_peeq * ((now + between) @ recovery)
        after = old.peeq[p] + d_peeq
        isotropic = self.hardening.work(after) - self.hardening.work(old.peeq[p])
        new = KinematicState(*(a.copy() for a in (old.plastic_strain, old.peeq, old.back_stress, old.work)))
        new.plastic_strain[p] += flow
        new.peeq[p], new.back_stress[p] = after, back
        new.work[p] += isotropic + kept + lost

        shrunk = np.sqrt(6) * mu * d_peeq / length
        aside = rate - _dot(rate, n)[:, None] * n
        drift = np.sqrt(6) * mu * n + shrunk[:, None] * aside
        tangent[p] -= shrunk[:, None, None] * 2 * mu * (_DEVIATOR - n[:, :, None] * n[:, None, :])
        tangent[p] -= (np.sqrt(6) * mu / fall)[:, None, None] * drift[:, :, None] * n[:, None, :]
        return stress, tangent, new

    def _increment(self, trial: Array, back: Array, peeq: Array) -> tuple[Array, Array, Array, Array, Array]:
        """The increment of PEEQ at which ``sqrt(1.5) |eta| = (3 mu + sum of theta C) d_peeq + yield stress``, with
        ``theta = 1 / (1 + gamma d_peeq)`` and ``eta = trial - sum of theta a``; how fast the difference falls, with
        ``theta``, ``eta`` and its derivative."""
        _, mu = self.lame
        C, gamma = np.array(self.back_stresses, dtype=float).reshape(-1, 2).T
        start: tuple[Array, Array] = np.zeros(len(trial)), np.zeros(len(trial))
        d_peeq, low = start
        high: Array = np.sqrt(1.5) * (_norm(trial) + _norm(back).sum(axis=1)) / (3 * mu)
        close = 1e-14 * high
        for _ in range(_ITERATIONS):
            theta = 1 / (1 + gamma * d_peeq[:, None])
            eta = trial - np.einsum("nk,nki->ni", theta, back)
            rate = np.einsum("nk,nki->ni", gamma * theta**2, back)
            length = _norm(eta)
            off = np.sqrt(1.5) * length - (3 * mu + theta @ C) * d_peeq - self.hardening.stress(peeq + d_peeq)
            slope = self.hardening.slope(peeq + d_peeq)
            fall = 3 * mu + (theta**2) @ C + slope - np.sqrt(1.5) * _dot(rate, eta) / length
            low, high = np.where(off > 0, d_peeq, low), np.where(off < 0, d_peeq, high)
            step = off / fall
            moving = ~(np.abs(step) <= close)
            if not moving.any():
                return d_peeq, fall, theta, eta, rate
            d_peeq = np.where(moving, d_peeq + step, d_peeq)
            astray = moving & ~((d_peeq >= low) & (d_peeq <= high))
            d_peeq[astray] = (low + high)[astray] / 2
        d_peeq[moving] = np.nan
        return d_peeq, fall, theta, eta, rate

    def dissipation(self, state: KinematicState) -> Array:
        """Plastic work density ``(n,)``, with what the back stresses store."""
        return state.work

    def peeq(self, state: KinematicState) -> Array:
        """PEEQ ``(n,)``."""
        return state.peeq


def _dot(a: Array, b: Array) -> Array:
    return (a * b) @ _TWICE


def _norm(a: Array) -> Array:
    return np.sqrt((a * a) @ _TWICE)
