"""J2 plasticity with isotropic hardening: return mapping on arrays of points.

Backward Euler, with the tangent consistent with it (Simo and Hughes, Computational Inelasticity, 1998): radial return
in plane strain (Box 3.2), the projected algorithm in plane stress (Box 3.3).

Both reduce to one scalar equation a point. The plastic strain grows by ``zeta`` times the deviator of the stress, where
``zeta = 1.5 d_peeq / q`` and ``q`` is the von Mises stress. Elastic moduli and the deviator's projection share their
eigenvectors, so each eigencomponent ``a_k`` of the trial stress shrinks to ``a_k / (1 + zeta c_k)``, and
`plastic_multiplier` finds the ``zeta`` at which ``q`` is the yield stress. In plane strain the deviator is the only
component that shrinks, and linear hardening has a closed form: radial_return.c.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from archord.kernels.compiled import library, pointer
from archord.materials.elasticity import Elastic
from archord.materials.hardening import Hardening, LinearHardening
from archord.materials.material import Array, Material

_ITERATIONS = 60
_DEVIATORIC = np.array([[2 / 3, -1 / 3, 0.0], [-1 / 3, 2 / 3, 0.0], [0.0, 0.0, 2.0]])  # in plane stress, strain's shear


@dataclass(frozen=True)
class PlasticState:
    """History of ``n`` points: plastic strain ``(n, 4)``, ``[xx, yy, zz, xy]`` (tensor shear), and PEEQ ``(n,)``."""

    plastic_strain: Array
    peeq: Array


@dataclass(frozen=True)
class J2Material(Elastic):
    """Elastic-plastic solid: `Elastic` below the von Mises stress that its ``hardening`` gives."""

    hardening: Hardening

    @property
    def yields(self) -> bool:
        """Yes."""
        return True

    def elastic(self) -> Material:
        """The solid with a yield stress out of reach."""
        return replace(self, hardening=LinearHardening(np.inf))

    def state(self, n: int) -> PlasticState:
        """``n`` points that never yielded."""
        return PlasticState(np.zeros((n, 4)), np.zeros(n))

    def update(self, strain: Array, state: PlasticState) -> tuple[Array, Array, PlasticState]:
        """The return map of the plane."""
        if self.plane == "stress":
            return projected_return(strain, state, self)
        if self.hardening.linear is None:
            return radial_return(strain, state, self)
        return _linear_radial_return(strain, state, self)

    def dissipation(self, state: PlasticState) -> Array:
        """Plastic work density ``(n,)``."""
        return self.hardening.work(state.peeq)

    def peeq(self, state: PlasticState) -> Array:
        """PEEQ ``(n,)``."""
        return state.peeq


def plastic_multiplier(
    a: Array, weights: Array, compliance: Array, hardening: Hardening, peeq: Array
) -> tuple[Array, Array]:
    """``zeta`` and von Mises stress ``q``, ``(n,)`` each, of points that yield.

    With components ``a`` ``(n, k)`` of the trial stress, ``q^2 = sum_k weights_k (a_k / (1 + zeta compliance_k))^2``,
    and ``d_peeq = 2/3 zeta q`` from the old ``peeq``. If the yield stress is concave, ``1/q - 1/stress(PEEQ)`` is
    increasing and concave in ``zeta``: Newton from 0 cannot overshoot. What does not converge is not a number.
    """
    zeta = np.zeros(len(a))
    close = 1e-10 / compliance.min()  # Newton is quadratic: a step this small leaves nothing but round-off
    for _ in range(_ITERATIONS):
        shrink = 1 + zeta[:, None] * compliance
        q = np.sqrt((a / shrink) ** 2 @ weights)
        fall = ((a**2 / shrink**3) @ (weights * compliance)) / q  # - dq / dzeta
        now = peeq + 2 / 3 * zeta * q
        strength = hardening.stress(now)
        rise = hardening.slope(now) * 2 / 3 * (q - zeta * fall)
        step = (1 / q - 1 / strength) / (fall / q**2 + rise / strength**2)
        zeta = zeta - step
        moving = ~(np.abs(step) <= 1e-10 * zeta + close)
        if not moving.any():
            break
    else:
        zeta[moving] = np.nan
    return zeta, np.sqrt((a / (1 + zeta[:, None] * compliance)) ** 2 @ weights)


def radial_return(strain: Array, old: PlasticState, m: J2Material) -> tuple[Array, Array, PlasticState]:
    """Plane strain: the trial deviator keeps its direction ``n`` (unit) and shrinks by ``1 / (1 + 2 mu zeta)``.

    With ``H`` the slope of the hardening and ``s = 3 mu d_peeq / q_trial`` the tangent is
    ``K 1 x 1 + 2 mu (1 - s) I_dev - 2 mu (3 mu / (3 mu + H) - s) n x n``.
    """
    lam, mu = m.lame
    full = np.stack([strain[:, 0], strain[:, 1], np.zeros(len(strain)), 0.5 * strain[:, 2]], axis=1)
    elastic = full - old.plastic_strain
    volume = np.array([1.0, 1.0, 1.0, 0.0])
    mean = elastic[:, :3].sum(axis=1, keepdims=True) / 3
    deviator = 2 * mu * (elastic - mean * volume)
    q = np.sqrt(1.5 * (deviator**2 @ np.array([1.0, 1.0, 1.0, 2.0])))
    stress = deviator + (3 * lam + 2 * mu) * mean * volume
    tangent = np.tile(m.elastic_tangent, (len(strain), 1, 1))
    p = np.flatnonzero(q > m.hardening.stress(old.peeq))
    if not len(p):
        return stress, tangent, old
    zeta, _ = plastic_multiplier(q[p, None], np.ones(1), np.array([2 * mu]), m.hardening, old.peeq[p])
    flow = (zeta / (1 + 2 * mu * zeta))[:, None] * deviator[p]
    plastic_strain, peeq = old.plastic_strain.copy(), old.peeq.copy()
    plastic_strain[p] += flow
    peeq[p] += 2 / 3 * zeta * q[p] / (1 + 2 * mu * zeta)
    stress[p] -= 2 * mu * flow

    scale = 2 * mu * zeta / (1 + 2 * mu * zeta)
    loss = 2 * mu * (3 * mu / (3 * mu + m.hardening.slope(peeq[p])) - scale)
    normal = np.sqrt(1.5) * deviator[p][:, [0, 1, 3]] / q[p, None]
    in_plane, shear = np.array([1.0, 1.0, 0.0]), np.array([1.0, 1.0, 0.5])
    projector = np.diag(shear) - np.outer(in_plane, in_plane) / 3
    tangent[p] = (lam + 2 / 3 * mu) * np.outer(in_plane, in_plane) + 2 * mu * (1 - scale)[:, None, None] * projector
    tangent[p] -= loss[:, None, None] * normal[:, :, None] * normal[:, None, :]
    return stress, tangent, PlasticState(plastic_strain, peeq)


def _linear_radial_return(strain: Array, old: PlasticState, m: J2Material) -> tuple[Array, Array, PlasticState]:
    """`radial_return` with linear hardening, where ``d_peeq = (q_trial - stress(PEEQ)) / (3 mu + H)``, in C."""
    n, strain = len(strain), np.ascontiguousarray(strain, dtype=float)
    stress, tangent = np.empty((n, 4)), np.empty((n, 3, 3))
    new = PlasticState(np.empty((n, 4)), np.empty(n))
    inputs = map(pointer, (strain, old.plastic_strain, old.peeq))
    outputs = map(pointer, (stress, tangent, new.plastic_strain, new.peeq))
    kernel = library(Path(__file__).with_name("radial_return.c")).radial_return
    yielding = kernel(n, *inputs, *m.lame, *m.hardening.linear, pointer(m.elastic_tangent), *outputs)
    return stress, tangent, new if yielding else old


def projected_return(strain: Array, old: PlasticState, m: J2Material) -> tuple[Array, Array, PlasticState]:
    """Plane stress: ``sigma = (C^-1 + zeta P)^-1 C^-1 sigma_trial``, with the elastic moduli ``C`` and the projection
    ``P`` to the deviator; the components that shrink are sum, difference and shear of the stresses in the plane."""
    _, mu = m.lame
    C = m.elastic_tangent
    elastic = strain - old.plastic_strain[:, [0, 1, 3]] * np.array([1.0, 1.0, 2.0])
    trial = elastic @ C
    stress = np.zeros((len(strain), 4))
    stress[:, [0, 1, 3]] = trial
    tangent = np.tile(C, (len(strain), 1, 1))
    parts = np.stack([trial[:, 0] + trial[:, 1], trial[:, 1] - trial[:, 0], trial[:, 2]], axis=1)
    weights = np.array([0.25, 0.75, 3.0])  # q^2 = (sum^2)/4 + 3 (difference^2)/4 + 3 shear^2
    p = np.flatnonzero(np.sqrt(parts**2 @ weights) > m.hardening.stress(old.peeq))
    if not len(p):
        return stress, tangent, old
    compliance = np.array([m.E / (3 * (1 - m.nu)), 2 * mu, 2 * mu])  # products of the eigenvalues of C and P
    zeta, q = plastic_multiplier(parts[p], weights, compliance, m.hardening, old.peeq[p])
    shrink = 1 + zeta[:, None] * compliance
    b = parts[p] / shrink
    sigma = np.stack([(b[:, 0] - b[:, 1]) / 2, (b[:, 0] + b[:, 1]) / 2, b[:, 2]], axis=1)
    flow = sigma @ _DEVIATORIC

    plastic_strain, peeq = old.plastic_strain.copy(), old.peeq.copy()
    peeq[p] += 2 / 3 * zeta * q
    plastic_strain[p] += zeta[:, None] * np.stack(
        [flow[:, 0], flow[:, 1], -flow[:, 0] - flow[:, 1], 0.5 * flow[:, 2]], axis=1
    )
    stress[p[:, None], [0, 1, 3]] = sigma

    plane_sum, plane_difference = m.E / (1 - m.nu) / shrink[:, 0], 2 * mu / shrink[:, 1]
    xi = np.zeros((len(p), 3, 3))
    xi[:, 0, 0] = xi[:, 1, 1] = (plane_sum + plane_difference) / 2
    xi[:, 0, 1] = xi[:, 1, 0] = (plane_sum - plane_difference) / 2
    xi[:, 2, 2] = mu / shrink[:, 2]
    direction = np.einsum("nij,nj->ni", xi, flow)
    slope = m.hardening.slope(peeq[p])
    left = 1 - 2 / 3 * slope * zeta
    factor = left / (left * np.einsum("ni,ni->n", flow, direction) + 4 / 9 * slope * q**2)
    tangent[p] = xi - factor[:, None, None] * direction[:, :, None] * direction[:, None, :]
    return stress, tangent, PlasticState(plastic_strain, peeq)
