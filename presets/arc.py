"""The contact pressure along the arcs: per-facet projection, peak and contact angle.

The raw pressure at quadrature points scatters inside plastic facets, its integrals over facets do not: everything here
is built from them. Angles and arc lengths are measured on the undeformed arcs from the contact axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from archord.materials.material import Array

if TYPE_CHECKING:  # a profile is read from a run folder, too, without the solver
    from archord.presets.joint import Joint

SYMMETRY = 2.0  # the half that is modelled makes up a joint so many times
FIXED, PER_STEP = ("s", "angle", "weight"), ("coordinates", "pressure", "raw_pressure", "gap")  # of contact.h5
_PEAK_FRACTION = 0.25  # part of the contact angle over which the parabola of the peak is fitted
_EDGE_FACETS = 4  # facets whose forces give the edge of the contact


@dataclass(frozen=True)
class ArcProfile:
    """One side's contact state at ``q`` points of its ``n`` facets, ordered from the contact axis, on every rank.

    Of a joint cut in half. In the facet at the edge of the contact the line of `pressure` may dip below zero.
    """

    radius: float
    s: Array  # (n, q) arc length from the contact axis
    weight: Array  # (n, q) measure
    coordinates: Array  # (n, q, 2) deformed
    pressure: Array  # (n, q) positive in compression; projected: linear on each facet, with the facet's force
    raw_pressure: Array  # (n, q) as integrated by the solver
    gap: Array  # (n, q) positive when open

    @property
    def width(self) -> Array:
        """Length ``(n,)`` of each facet."""
        return self.weight.sum(axis=1)

    @property
    def facet_force(self) -> Array:
        """Integral of the pressure over each facet ``(n,)``."""
        return (self.weight * self.raw_pressure).sum(axis=1)

    @property
    def angle(self) -> Array:
        """Angle ``(n, q)`` from the contact axis."""
        return np.divide(self.s, self.radius)

    @property
    def in_contact(self) -> Array:
        """Share ``(n,)`` of each facet that carries pressure."""
        return (self.weight * (self.raw_pressure > 0)).sum(axis=1) / self.width

    def facet_means(self) -> tuple[Array, Array]:
        """Angle ``(n,)`` and pressure ``(n,)`` of the facets: their means, which do not scatter where it yields."""
        angle, pressure = ((self.weight * v).sum(axis=1) / self.width for v in (self.angle, self.pressure))
        return angle, pressure


def arc_profiles(joint: Joint) -> dict[str, ArcProfile]:
    """Contact state along the integrated arcs, by side, at the last evaluation. Collective."""
    g, u = joint.scene.joint, joint.equilibrium.displacement()
    radius = {"pin": g.radius, "hole": g.radius + g.dR}
    found = {}
    for name, side in joint.sides.items():
        pair = joint.contact.pair_of(side)
        if pair is None:  # its edge is not integrated
            continue
        displaced = side.point + np.einsum("nqa,nai->nqi", side.shape, u[side.cell_dofs])
        local = np.zeros((side.n_facets, side.weight.shape[1], 5))
        at_points = (side.weight, displaced[..., 0], displaced[..., 1], pair.pressure, pair.distance)
        local[side.facet] = np.stack(at_points, axis=-1)
        whole, s = side.sum_over_ranks(local), side.arc_position(np.array([0.0, -radius["hole"]]))
        order, along = np.argsort(s[:, 0]), slice(None, None, -1 if s[0, 0] > s[0, -1] else 1)
        whole, s = whole[order, along], s[order, along]
        weight, raw = whole[..., 0], whole[..., 3]
        pressure = project(raw, s, weight)
        found[name] = ArcProfile(radius[name], s, weight, whole[..., 1:3], pressure, raw, whole[..., 4])
    return found


def project(pressure: Array, s: Array, weight: Array) -> Array:
    """L2 projection ``(n, q)`` of ``pressure`` onto one linear function a facet; facet integrals are kept exactly."""
    total = weight.sum(axis=1, keepdims=True)
    mean = (weight * pressure).sum(axis=1, keepdims=True) / total
    lever = s - (weight * s).sum(axis=1, keepdims=True) / total
    slope = (weight * lever * pressure).sum(axis=1, keepdims=True) / (weight * lever**2).sum(axis=1, keepdims=True)
    return mean + slope * lever


def semi_angle(profile: ArcProfile) -> float:
    """Contact semi-angle ``eps`` in radians.

    Near its edge an elastic contact pressure is ``C sqrt(eps - phi)``, so the force beyond an angle, to the power 2/3,
    is linear in the angle; it is extrapolated to zero from the last facets in contact.
    """
    force = profile.facet_force
    last = int(np.flatnonzero(force > 0).max(initial=-1))
    if last < 0:
        return 0.0
    if last < 2:
        return float((profile.in_contact * profile.width).sum() / profile.radius)
    start = np.concatenate([[0.0], np.cumsum(profile.width)]) / profile.radius
    at_edge = slice(max(0, last + 1 - _EDGE_FACETS), last + 1)
    beyond, angle = np.cumsum(force[::-1])[::-1][at_edge] ** (2 / 3), start[at_edge]
    slope, value = np.polyfit(angle - angle[-1], beyond, 1)
    edge = angle[-1] - value / slope
    return float(np.clip(edge, angle[-1], start[-1]))


def peak_pressure(profiles: list[ArcProfile], eps: float) -> float:
    """Pressure ``p0`` on the contact axis: an even parabola through the facet means of all sides near it."""
    near = []
    for p in profiles:
        chosen = np.cumsum(p.width) <= max(_PEAK_FRACTION * eps * p.radius, 3.001 * p.width[0])
        chosen &= p.in_contact == 1
        chosen[0] = True
        square = (p.weight * p.angle**2).sum(axis=1) / p.width
        near.append(np.stack([np.sqrt(p.width), square, p.facet_force / p.width])[:, chosen])
    w, square, mean = np.concatenate(near, axis=1)
    A = np.stack([w, w * square], axis=1)[:, : 2 if len(w) > len(profiles) else 1]
    return float(np.linalg.lstsq(A, w * mean, rcond=None)[0][0])
