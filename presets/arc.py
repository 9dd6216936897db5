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
    from archord.solver.contact.contact import Contact
    from archord.solver.contact.surface import Surface

SYMMETRY = 2.0  # the half that is modelled makes up a joint so many times
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
        return (self.weight * (self.raw_pressure > 0)).sum(axis=1) / self.weight.sum(axis=1)

    @property
    def resultant(self) -> float:
        """Vertical force of both halves, the sum of ``weight pressure cos(angle)`` on the undeformed arc."""
        return SYMMETRY * float((self.weight * self.pressure * np.cos(self.angle)).sum())

    def facet_means(self) -> tuple[Array, Array]:
        """Angle ``(n,)`` and pressure ``(n,)`` of the facets: their means, which do not scatter where it yields."""
        total = self.weight.sum(axis=1)
        return (self.weight * self.angle).sum(axis=1) / total, (self.weight * self.pressure).sum(axis=1) / total


def arc_profile(contact: Contact, side: Surface, radius: float, axis_point: Array, u: Array) -> ArcProfile | None:
    """State of ``side`` at the displacement ``u`` ``(n, 2)``, last evaluated; None if its edge is not integrated.

    ``axis_point`` is the end of the arc on the contact axis. Collective.
    """
    pair = contact.pair_of(side)
    if pair is None:
        return None
    n, q = side.n_facets, side.weight.shape[1]
    local = np.zeros((n, q, 5))
    displaced = side.point + np.einsum("nqa,nai->nqi", side.shape, u[side.cell_dofs])
    at_points = (side.weight, displaced[..., 0], displaced[..., 1], pair.pressure, pair.distance)
    local[side.facet] = np.stack(at_points, axis=-1)
    whole = side.sum_over_ranks(local)
    s = side.arc_position(axis_point)
    order, along = np.argsort(s[:, 0]), slice(None, None, -1 if s[0, 0] > s[0, -1] else 1)
    whole, s = whole[order, along], s[order, along]
    weight, raw = whole[..., 0], whole[..., 3]
    return ArcProfile(radius, s, weight, whole[..., 1:3], project(raw, s, weight), raw, whole[..., 4])


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
    width = profile.weight.sum(axis=1) / profile.radius
    start = np.concatenate([[0.0], np.cumsum(width)])
    count = min(_EDGE_FACETS, last + 1)
    if count < 3:
        return float((profile.weight * (profile.raw_pressure > 0)).sum() / profile.radius)
    beyond = np.cumsum(force[::-1])[::-1][last + 1 - count : last + 1] ** (2 / 3)
    angle = start[last + 1 - count : last + 1]
    slope, value = np.polyfit(angle - angle[-1], beyond, 1)
    edge = angle[-1] - value / slope
    return float(np.clip(edge, angle[-1], start[-1]))


def peak_pressure(profiles: list[ArcProfile], eps: float) -> float:
    """Pressure ``p0`` on the contact axis: an even parabola through the facet means of all sides near it."""
    rows, means, weights = [], [], []
    for p in profiles:
        width = p.weight.sum(axis=1)
        near = np.cumsum(width) <= max(_PEAK_FRACTION * eps * p.radius, 3.001 * width[0])
        near &= p.in_contact == 1
        near[0] = True
        square = (p.weight * p.angle**2).sum(axis=1) / width
        rows.append(np.stack([np.ones(near.sum()), square[near]], axis=1))
        means.append(p.facet_force[near] / width[near])
        weights.append(width[near])
    A, b, w = np.concatenate(rows), np.concatenate(means), np.sqrt(np.concatenate(weights))
    columns = 2 if len(b) > len(profiles) else 1
    return float(np.linalg.lstsq(A[:, :columns] * w[:, None], b * w, rcond=None)[0][0])
