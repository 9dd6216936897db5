"""The contact along the surfaces of a problem: points, pressure and gap, with the pressure
projected facet by facet.

The raw pressure at quadrature points scatters inside plastic facets, its integrals over facets do
not: what is reported is built from them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from archord.materials.material import Array

if TYPE_CHECKING:  # a profile is read from a run folder, too, without the solver
    from archord.solver.path.system import System

PER_STEP = ("coordinates", "pressure", "raw_pressure", "gap")  # of contact.h5
_ON_CONE = 1e-6  # of the largest shear: what comes as close slides
OF_FRICTION = ("shear", "sticks")  # of one with friction also


@dataclass(frozen=True)
class EdgeProfile:
    """One surface's contact state at ``q`` points of its ``n`` facets, on every rank."""

    s: Array  # (n, q) arc length along the curve
    weight: Array  # (n, q) measure
    coordinates: Array  # (n, q, 2) deformed
    # (n, q) positive in compression; projected: linear on each facet, with the facet's force
    pressure: Array
    raw_pressure: Array  # (n, q) as integrated by the solver
    gap: Array  # (n, q) positive when open
    shear: Array | None = field(
        default=None, kw_only=True
    )  # (n, q) with friction: on the surface, positive along s
    sticks: Array | None = field(
        default=None, kw_only=True
    )  # (n, q) with friction: 1 where points touch and stick

    @property
    def width(self) -> Array:
        """Measure ``(n,)`` of each facet: a length in a plane, an area around an axis."""
        return self.weight.sum(axis=1)

    @property
    def facet_force(self) -> Array:
        """Integral of the pressure over each facet ``(n,)``."""
        return (self.weight * self.raw_pressure).sum(axis=1)

    @property
    def in_contact(self) -> Array:
        """Share ``(n,)`` of each facet that carries pressure."""
        return (self.weight * (self.raw_pressure > 0)).sum(axis=1) / self.width

    @property
    def contact_length(self) -> float:
        """Measure of the surface under pressure: a length in a plane, an area around an axis."""
        return float((self.in_contact * self.width).sum())


@dataclass(frozen=True)
class SurfaceProfile(EdgeProfile):
    """As `EdgeProfile`, with the undeformed points and how far they slid along the opposite surface
    (`Pair.slip`)."""

    X: Array  # (n, q, 2)
    slip: Array  # (n, q)

    @property
    def largest_slip(self) -> float:
        """Largest slip, whichever way, where there is pressure."""
        return float(np.abs(self.slip[self.raw_pressure > 0]).max(initial=0.0))

    @property
    def largest_shear(self) -> float:
        """Largest shear, whichever way, on a surface with friction."""
        return float(np.abs(self.shear).max()) if self.shear is not None else 0.0

    @property
    def largest(self) -> tuple[float, Array]:
        """Largest projected pressure, and the undeformed place ``(2,)`` where it is."""
        at = np.unravel_index(
            np.argmax(np.where(self.raw_pressure > 0, self.pressure, 0.0)), self.pressure.shape
        )
        return max(float(self.pressure[at]), 0.0), self.X[at]

    @property
    def n_arcs(self) -> int:
        """Number of separate stretches under pressure."""
        closed = self.in_contact > 0
        first = self.X[:, 0]
        last = self.X[:, -1]
        # gaps between the points of neighbours are a seventh of the longest chord
        longest = np.linalg.norm(last - first, axis=1).max()
        apart = np.linalg.norm(first[1:] - last[:-1], axis=1) > longest
        begins = closed[1:] & (~closed[:-1] | apart)
        arcs = int(closed[0]) + int(begins.sum())
        is_ring = np.linalg.norm(first[0] - last[-1]) < longest
        if arcs > 1 and is_ring and closed[0] and closed[-1]:
            return arcs - 1
        return arcs


def per_step(system: System) -> tuple[str, ...]:
    """Names of the arrays of contact.h5 that change."""
    return PER_STEP + OF_FRICTION if system.contact.has_friction else PER_STEP


def surface_profiles(system: System) -> dict[str, SurfaceProfile]:
    """Contact state along the integrated surfaces, by name, at the last evaluation. Collective."""
    u, found = system.equilibrium.displacement(), {}
    for name, side in system.sides.items():
        pair = system.contact.pair_of(side)
        if pair is None or side.in_space:  # it is not integrated, or no edge
            continue
        displaced = side.point + np.einsum("nqa,nai->nqi", side.shape, u[side.cell_dofs])
        local = np.zeros((side.n_facets, side.weight.shape[1], 10))
        # the frame's tangent runs along the opposite surface, which this one meets the other way
        # round
        shear = 0.0 - pair.shear
        sticks = np.abs(shear) < (1 - _ON_CONE) * getattr(pair.law, "friction", 0.0) * pair.pressure
        values = np.stack(
            [side.weight, pair.pressure, pair.distance, pair.slip, shear, sticks], axis=-1
        )
        local[side.facet] = np.concatenate([values, displaced, side.point], axis=-1)
        whole = side.sum_over_ranks(local)
        weight, raw, gap, slip, *of_friction = np.moveaxis(whole[..., :6], -1, 0)
        coordinates, X, s = whole[..., 6:8], whole[..., 8:], side.arc_length(side.curve_xi)
        more = (
            dict(zip(OF_FRICTION, of_friction, strict=True)) if system.contact.has_friction else {}
        )
        found[name] = SurfaceProfile(
            s, weight, coordinates, project(raw, s, weight), raw, gap, X, slip, **more
        )
    return found


def project(pressure: Array, s: Array, weight: Array) -> Array:
    """L2 projection ``(n, q)`` of ``pressure`` onto one linear function a facet; facet integrals
    are kept exactly."""
    total = weight.sum(axis=1, keepdims=True)
    mean = (weight * pressure).sum(axis=1, keepdims=True) / total
    lever = s - (weight * s).sum(axis=1, keepdims=True) / total
    slope = (weight * lever * pressure).sum(axis=1, keepdims=True) / (weight * lever**2).sum(
        axis=1, keepdims=True
    )
    return mean + slope * lever
