"""The return map of J2 plasticity with isotropic hardening and its consistent tangent, on arrays of
points.

Backward Euler, with the tangent consistent with it (Simo and Hughes, Computational Inelasticity,
1998, Boxes 3.2 and 3.3). Of the components that there are, ``C`` are the elastic moduli and ``P``
takes a stress to its deviator (as a strain), so that the von Mises stress is ``q^2 = 1.5 sigma . P
sigma``. The plastic strain grows by ``zeta P sigma``, ``zeta = 1.5 d_peeq / q``, and the stress is
``(C^-1 + zeta P)^-1`` times the elastic trial strain. ``C`` and ``P`` share their eigenvectors:
each eigencomponent of the trial stress shrinks alone, by ``1 + zeta C_k P_k``, and one scalar
equation a point is left for ``zeta``.

With linear hardening it has a closed form but for plane stress, `radial_return`, computed in C.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from archord.kernels.compiled import library, pointer
from archord.materials.elasticity import ENGINEERING, Elastic
from archord.materials.hardening import Hardening
from archord.materials.kinematics import Ints, Kinematics
from archord.materials.material import Array

_SOURCE = Path(__file__).with_name("radial_return.c")
_ITERATIONS = 60
# slope over what elasticity makes of it, from which it says nothing of where the zero is
STEEP = 1e3
_NARROW = 1e-3  # width of an interval with a zero over how short Newton's last step is
_STEEPEST = 1e12  # slope of a hardening law over E, from which its tangent is elastic
# eigenvectors and eigenvalues of P on normal stresses, in plane stress and else
_VECTORS_IN_PLANE = np.array([[1, 1], [-1, 1]]) / np.sqrt([[2], [2]])
_IN_PLANE = _VECTORS_IN_PLANE, [1 / 3, 1.0]
_VECTORS = np.array([[1, 1, 1], [-1, 1, 0], [1, 1, -2]]) / np.sqrt([[3], [2], [6]])
_NORMAL = _VECTORS, [0.0, 1.0, 1.0]


@dataclass(frozen=True)
class PlasticState:
    """History of ``n`` points: plastic strain ``(n, n_stress)``, with the components of the stress
    (tensor shear), and PEEQ ``(n,)``."""

    plastic_strain: Array
    peeq: Array


@cache
def _eigensystem(kinematics: Kinematics) -> tuple[list[int], Array, Array]:
    """The components of a stress on which the map works, and the eigenvectors and eigenvalues of P
    on them."""
    normal, deviator = _IN_PLANE if kinematics.is_thin else _NORMAL
    n_normal = len(deviator)
    shears = range(3, kinematics.n_stress)
    parts = [*range(n_normal), *shears]
    Q = np.eye(len(parts))
    Q[:n_normal, :n_normal] = normal
    of_shears = [2.0] * len(shears)
    return parts, Q, np.array(deviator + of_shears)


def return_map(
    strain: Array, old: PlasticState, m: Elastic, hardening: Hardening
) -> tuple[Array, Array, PlasticState]:
    """Stress ``(n, n_stress)``, tangent ``(n, k, k)`` and new state at ``strain`` ``(n, k)`` from
    the ``old`` state, with the elasticity of ``m``."""
    n_stress = m.kinematics.n_stress
    parts, Q, deviator = _eigensystem(m.kinematics)
    moduli = _eigenmoduli(m, deviator)
    compliance = moduli * deviator  # C_k P_k
    C = Q.T * moduli @ Q
    P = Q.T * deviator @ Q
    engineering = ENGINEERING[:n_stress]
    elastic = -old.plastic_strain * engineering
    elastic[:, m.working] += strain
    stress = np.zeros((len(strain), n_stress))
    stress[:, parts] = elastic[:, parts] @ C
    tangent = np.tile(m.elastic_tangent, (len(strain), 1, 1))
    trial = stress[:, parts] @ Q.T
    mises = np.sqrt(1.5 * trial**2 @ deviator)
    p = beyond(mises, hardening, old.peeq)
    if not len(p):
        return stress, tangent, old
    hardening = hardening.at(p)
    trial = trial[p]
    zeta, q = plastic_multiplier(trial, 1.5 * deviator, compliance, hardening, old.peeq[p])
    shrink = 1 + zeta[:, None] * compliance
    sigma = (trial / shrink) @ Q
    stress[p[:, None], parts] = sigma

    flow = sigma @ P
    xx = flow[:, 0]
    yy = flow[:, 1]
    shears = flow.T[3 - n_stress :]
    direction = np.stack([xx, yy, -xx - yy, *shears], axis=1) / engineering
    plastic_strain = old.plastic_strain.copy()
    plastic_strain[p] += zeta[:, None] * direction
    peeq = old.peeq.copy()
    peeq[p] += 2 / 3 * zeta * q

    softened = np.einsum("ki,nk,kj->nij", Q, moduli / shrink, Q)  # (C^-1 + zeta P)^-1
    slope = np.minimum(hardening.slope(peeq[p]), _STEEPEST * m.E)
    consistent = _consistent_tangent(softened, flow, zeta, q, slope)
    kept = np.searchsorted(parts, m.working)
    tangent[p] = consistent[:, kept[:, None], kept]
    return stress, tangent, PlasticState(plastic_strain, peeq)


def _eigenmoduli(m: Elastic, deviator: Array) -> Array:
    """The eigenvalues ``(k,)`` of C, beside the eigenvalues ``deviator`` of P."""
    lam, mu = m.lame
    moduli = 2 * mu / np.maximum(deviator, 1.0)
    moduli[0] = m.E / (1 - m.nu) if m.kinematics.is_thin else 3 * lam + 2 * mu
    return moduli


def _consistent_tangent(softened: Array, flow: Array, zeta: Array, q: Array, slope: Array) -> Array:
    """The derivative ``(n, k, k)`` of the stress by the strain (Simo and Hughes, Box 3.2).

    - ``softened`` ``(n, k, k)``: ``(C^-1 + zeta P)^-1``
    - ``flow`` ``(n, k)``: ``P sigma``
    - ``q``, ``slope`` ``(n,)``: the von Mises stress, and the slope of the hardening law
    """
    along = np.einsum("nij,nj->ni", softened, flow)
    work = np.einsum("ni,ni->n", flow, along)
    left = 1 - 2 / 3 * slope * zeta
    hardened = 4 / 9 * slope * q**2
    factor = left / (left * work + hardened)
    return softened - factor[:, None, None] * along[:, :, None] * along[:, None, :]


def beyond(stress: Array, hardening: Hardening, peeq: Array) -> Ints:
    """Numbers of the points whose von Mises ``stress`` ``(n,)`` exceeds the yield stress. Raises
    ValueError where the law gives none."""
    strength = hardening.stress(peeq)
    lost = np.isnan(strength) & np.isfinite(stress)
    if lost.any():
        at = np.broadcast_to(peeq, lost.shape)[lost][0]
        raise ValueError(
            f"the hardening law gives a yield stress that is not a number, at PEEQ = {at:g}"
        )
    return np.flatnonzero(stress > strength)


def plastic_multiplier(
    a: Array, weights: Array, compliance: Array, hardening: Hardening, peeq: Array
) -> tuple[Array, Array]:
    """``zeta`` and von Mises stress ``q``, ``(n,)`` each, of points that yield: the zero of ``1/q -
    1/stress(PEEQ)``, which increases. ``q^2 = sum_k weights_k (a_k / (1 + zeta compliance_k))^2``
    with components ``a`` ``(n, k)`` of the trial stress, and ``d_peeq = 2/3 zeta q`` from the old
    ``peeq``."""

    def off(zeta: Array) -> tuple[Array, Array, Array]:
        shrink = 1 + zeta[:, None] * compliance
        q = np.sqrt((a / shrink) ** 2 @ weights)
        fall = (a**2 / shrink**3) @ (weights * compliance) / q  # - dq / dzeta
        now = peeq + 2 / 3 * zeta * q
        strength = hardening.stress(now)
        rise = hardening.slope(now) * 2 / 3 * (q - zeta * fall)
        value = 1 / q - 1 / strength
        slope = fall / q**2 + rise / strength**2
        close = 1e-10 * (zeta + 1 / largest)
        return value, slope, close

    largest = compliance.max()
    start = np.zeros(len(a))
    anywhere = np.full(len(a), np.inf)
    trial_mises = np.sqrt(a**2 @ weights)
    steep = STEEP * largest / trial_mises
    zeta, (value, slope, close) = bracketed_newton(off, start, start, anywhere, steep)
    # so short a step of Newton's leaves nothing but round-off
    last = np.clip(value / slope, -close, close)
    zeta = np.maximum(zeta - last, 0.0)
    shrink = 1 + zeta[:, None] * compliance
    return zeta, np.sqrt((a / shrink) ** 2 @ weights)


def bracketed_newton(
    f: Callable[[Array], tuple], x: Array, low: Array, high: Array, steep: Array | float = np.inf
) -> tuple[Array, tuple]:
    """Zeros ``(n,)`` of functions that increase, from ``x``, and what ``f`` gives there; not a
    number where it does not converge. ``f(x)`` begins with values, slopes, and how short Newton's
    step from a zero is. Steps that leave what is known to bracket a zero, as they can where a
    hardening law is not concave, are halved intervals instead. So are steps by slopes that are not
    below ``steep``, as of a law that begins vertically: they are short far from a zero."""
    for _ in range(_ITERATIONS):
        found = off, slope, close, *_ = f(x)
        low = np.where(off < 0, x, low)
        high = np.where(off > 0, x, high)
        step = off / slope
        trusted = slope < steep
        is_short = np.abs(step) <= close
        is_narrow = high - low <= _NARROW * close
        moving = ~np.where(trusted, is_short, is_narrow)
        if not moving.any():
            return x, found
        x = np.where(moving, x - step, x)
        within = (x > low) & (x < high)
        astray = moving & ~(within & trusted)
        halved = np.where(high == np.inf, 2 * low + close, (low + high) / 2)
        x = np.where(astray, halved, x)
    x = np.where(moving, np.nan, x)
    return x, f(x)


def radial_return(
    strain: Array, old: PlasticState, m: Elastic, yield_stress: float, modulus: float
) -> tuple[Array, Array, PlasticState]:
    """`return_map` with linear hardening, but for plane stress: ``d_peeq = (q_trial - stress(PEEQ))
    / (3 mu + H)``."""
    n, k = strain.shape
    places = np.array(m.working, dtype=np.int32)
    n_stress = m.kinematics.n_stress
    stress = np.empty((n, n_stress))
    tangent = np.empty((n, k, k))
    new = PlasticState(np.empty((n, n_stress)), np.empty(n))
    numbers = (strain, old.plastic_strain, old.peeq)
    own = (np.ascontiguousarray(array, dtype=float) for array in numbers)
    given = map(pointer, (places, *own))
    constants = *m.lame, yield_stress, modulus, pointer(m.elastic_tangent)
    found = map(pointer, (stress, tangent, new.plastic_strain, new.peeq))
    kernel = library(_SOURCE).radial_return
    yielding = kernel(n, n_stress, k, *given, *constants, *found)
    return stress, tangent, new if yielding else old
