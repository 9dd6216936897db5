"""J2 plasticity with linear isotropic hardening: return mapping on arrays of points.

Backward Euler, with the tangent consistent with it (Simo and Hughes, Computational Inelasticity, 1998): radial return
in plane strain (Box 3.2), the projected algorithm in plane stress (Box 3.3). Strains are ``[eps_xx, eps_yy, gamma_xy]``
(engineering shear), stresses ``[s_xx, s_yy, s_zz, s_xy]``, plastic strains ``[xx, yy, zz, xy]`` (tensor shear), tension
positive. Everything is a pure function: a step is taken back by dropping the new state.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from archord.kernels.compiled import library, pointer
from archord.materials.elasticity import Array, Plane, elastic_tangent, lame


@dataclass(frozen=True)
class PlasticState:
    """History of ``n`` points: plastic strain ``(n, 4)`` and equivalent plastic strain ``peeq`` ``(n,)``."""

    plastic_strain: Array
    peeq: Array

    @classmethod
    def virgin(cls, n: int) -> PlasticState:
        """State of ``n`` points that never yielded."""
        return cls(np.zeros((n, 4)), np.zeros(n))


@dataclass(frozen=True)
class J2Material:
    """Elastic-plastic solid; ``yield_stress`` and the modulus ``hardening`` are in units of ``E``.

    ``hardening`` is the derivative of the yield stress with respect to PEEQ; ``hardening`` = 0 is perfect plasticity.
    """

    E: float
    nu: float
    yield_stress: float
    hardening: float
    plane: Plane

    def return_map(self, strain: Array, old: PlasticState) -> tuple[Array, Array, PlasticState]:
        """Stress ``(n, 4)``, consistent tangent ``(n, 3, 3)`` and new state at ``strain`` ``(n, 3)`` from ``old``.

        The tangent maps ``[eps_xx, eps_yy, gamma_xy]`` to ``[s_xx, s_yy, s_xy]`` and is symmetric.
        """
        if self.plane == "strain":
            return _radial_return(strain, old, self)
        return _projected_return(strain, old, self)

    def elastic_energy(self, stress: Array) -> Array:
        """Elastic energy density ``(n,)`` of ``(n, 4)`` stresses."""
        _, mu = lame(self.E, self.nu)
        bulk = self.E / (3 * (1 - 2 * self.nu))
        mean = stress[:, :3].sum(axis=1) / 3
        deviator = stress - mean[:, None] * np.array([1.0, 1.0, 1.0, 0.0])
        return mean**2 / (2 * bulk) + ((deviator[:, :3] ** 2).sum(axis=1) + 2 * deviator[:, 3] ** 2) / (4 * mu)

    def dissipation(self, peeq: Array) -> Array:
        """Plastic work density ``(n,)``: the integral of the current yield stress over the PEEQ accumulated so far."""
        return self.yield_stress * peeq + 0.5 * self.hardening * peeq**2


def _radial_return(strain: Array, old: PlasticState, m: J2Material) -> tuple[Array, Array, PlasticState]:
    """Plane strain: ``d_peeq = (q - sigma_y) / (3 mu + H)`` scales the trial deviator by ``1 - 3 mu d_peeq / q``."""
    n, strain = len(strain), np.ascontiguousarray(strain, dtype=float)
    stress, tangent = np.empty((n, 4)), np.empty((n, 3, 3))
    new = PlasticState(np.empty((n, 4)), np.empty(n))
    inputs = map(pointer, (strain, old.plastic_strain, old.peeq))
    outputs = map(pointer, (stress, tangent, new.plastic_strain, new.peeq))
    elastic, moduli = elastic_tangent(m.E, m.nu, "strain"), lame(m.E, m.nu)
    radial_return = library(Path(__file__).with_name("radial_return.c")).radial_return
    yielding = radial_return(n, *inputs, *moduli, m.yield_stress, m.hardening, pointer(elastic), *outputs)
    return stress, tangent, new if yielding else old


def _projected_return(strain: Array, old: PlasticState, m: J2Material) -> tuple[Array, Array, PlasticState]:
    """Plane stress: ``sigma = (C^-1 + zeta P)^-1 C^-1 sigma_trial`` with ``zeta = 1.5 d_peeq / q``.

    ``C`` and ``P`` share their eigenvectors, so the stress splits into sum, difference and shear, each scaled alone.
    The scalar equation ``1/q(zeta) = (1 - 2/3 H zeta) / sigma_y`` is increasing and concave: Newton from 0 cannot
    overshoot.
    """
    _, mu = lame(m.E, m.nu)
    C = elastic_tangent(m.E, m.nu, "stress")
    elastic = strain - old.plastic_strain[:, [0, 1, 3]] * np.array([1.0, 1.0, 2.0])
    trial = elastic @ C
    stress = np.zeros((len(strain), 4))
    stress[:, [0, 1, 3]] = trial
    tangent = np.broadcast_to(C, (len(strain), 3, 3)).copy()
    parts = np.stack([trial[:, 0] + trial[:, 1], trial[:, 1] - trial[:, 0], trial[:, 2]], axis=1)
    weights = np.array([0.25, 0.75, 3.0])  # q^2 = (sum^2)/4 + 3 (difference^2)/4 + 3 shear^2
    strength = m.yield_stress + m.hardening * old.peeq

    p = np.flatnonzero(np.sqrt(parts**2 @ weights) > strength)
    if not len(p):
        return stress, tangent, old
    compliance = np.array([m.E / (3 * (1 - m.nu)), 2 * mu, 2 * mu])  # products of the eigenvalues of C and P
    a, k = parts[p], strength[p]
    zeta = np.zeros(len(p))
    close = 1e-10 / compliance.min()  # Newton is quadratic: a step this small leaves nothing but round-off
    for _ in range(60):
        shrink = 1 + zeta[:, None] * compliance
        q = np.sqrt((a / shrink) ** 2 @ weights)
        residual = 1 / q - (1 - 2 / 3 * m.hardening * zeta) / k
        slope = ((a**2 / shrink**3) @ (weights * compliance)) / q**3 + 2 / 3 * m.hardening / k
        step = residual / slope
        zeta -= step
        if np.all(np.abs(step) <= 1e-10 * zeta + close):
            break
    shrink = 1 + zeta[:, None] * compliance
    b = a / shrink
    q = np.sqrt(b**2 @ weights)
    d_peeq = 2 / 3 * zeta * q
    sigma = np.stack([(b[:, 0] - b[:, 1]) / 2, (b[:, 0] + b[:, 1]) / 2, b[:, 2]], axis=1)
    flow = sigma @ np.array([[2 / 3, -1 / 3, 0.0], [-1 / 3, 2 / 3, 0.0], [0.0, 0.0, 2.0]])  # P sigma, engineering shear

    plastic_strain, peeq = old.plastic_strain.copy(), old.peeq.copy()
    peeq[p] += d_peeq
    plastic_strain[p, 0] += zeta * flow[:, 0]
    plastic_strain[p, 1] += zeta * flow[:, 1]
    plastic_strain[p, 2] -= zeta * (flow[:, 0] + flow[:, 1])
    plastic_strain[p, 3] += 0.5 * zeta * flow[:, 2]
    stress[p[:, None], [0, 1, 3]] = sigma

    plane_sum, plane_difference = m.E / (1 - m.nu) / shrink[:, 0], 2 * mu / shrink[:, 1]
    xi = np.zeros((len(p), 3, 3))
    xi[:, 0, 0] = xi[:, 1, 1] = (plane_sum + plane_difference) / 2
    xi[:, 0, 1] = xi[:, 1, 0] = (plane_sum - plane_difference) / 2
    xi[:, 2, 2] = mu / shrink[:, 2]
    direction = np.einsum("nij,nj->ni", xi, flow)
    hardening = 4 / 9 * m.hardening * q**2 / (1 - 2 / 3 * m.hardening * zeta)
    denominator = np.einsum("ni,ni->n", flow, direction) + hardening
    tangent[p] = xi - direction[:, :, None] * direction[:, None, :] / denominator[:, None, None]
    return stress, tangent, PlasticState(plastic_strain, peeq)
