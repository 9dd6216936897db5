"""The contact pressure along the arcs of a joint: peak and semi-angle.

Angles and arc lengths are measured on the undeformed arcs from the contact axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from archord.materials.material import Array
from archord.measures.edge import EdgeProfile, SurfaceProfile, surface_profiles
from archord.scene.presets.joint_geometry import JointGeometry

if TYPE_CHECKING:  # a profile is read from a run folder, too, without the solver
    from archord.solver.path.system import System

SYMMETRY = 2.0  # the half that is modelled makes up a joint so many times
_PEAK_FRACTION = 0.25  # part of the contact angle over which the parabola of the peak is fitted
_EDGE_FACETS = 4  # facets whose forces give the edge of the contact


@dataclass(frozen=True, kw_only=True)
class ArcProfile(EdgeProfile):
    """One side's contact state on an arc of ``radius``, its facets ordered from the contact axis.

    Of a joint cut in half. In the facet at the edge of the contact the line of `pressure` may dip
    below zero.
    """

    radius: float

    @property
    def angle(self) -> Array:
        """Angle ``(n, q)`` from the contact axis."""
        return np.divide(self.s, self.radius)

    def facet_means(self) -> tuple[Array, Array]:
        """Angle ``(n,)`` and pressure ``(n,)`` of the facets: their means, which do not scatter
        where it yields."""
        angle = (self.weight * self.angle).sum(axis=1)
        force = (self.weight * self.pressure).sum(axis=1)
        return angle / self.width, force / self.width


def arc_profiles(joint: JointGeometry, system: System) -> dict[str, ArcProfile]:
    """Contact state along the integrated arcs of a ``joint``, by side, at the last evaluation.
    Collective."""
    radii = {"pin": joint.radius, "hole": joint.radius + joint.dR}
    lowest = np.array([0.0, -radii["hole"]])
    found = {}
    for name, edge in surface_profiles(system).items():
        s = system.sides[name].arc_position(lowest)
        found[name] = _from_the_axis(edge, s, radii[name])
    return found


def _from_the_axis(edge: SurfaceProfile, s: Array, radius: float) -> ArcProfile:
    """The profile with its facets and their points in the order of the arc lengths ``s`` ``(n, q)``
    from the contact axis."""
    order = np.argsort(s[:, 0])
    backward = s[0, 0] > s[0, -1]
    along = slice(None, None, -1 if backward else 1)
    given = vars(edge) | {"s": s}
    arrays = {
        name: array[order, along]
        for name, array in given.items()
        if name not in ("X", "slip") and array is not None
    }
    if backward and edge.shear is not None:
        arrays["shear"] = 0.0 - arrays["shear"]
    return ArcProfile(**arrays, radius=radius)


def semi_angle(profile: ArcProfile) -> float:
    """Contact semi-angle ``eps`` in radians.

    Near its edge an elastic contact pressure is ``C sqrt(eps - phi)``, so the force beyond an
    angle, to the power 2/3, is linear in the angle; it is extrapolated to zero from the last facets
    in contact.
    """
    force = profile.facet_force
    last = int(np.flatnonzero(force > 0).max(initial=-1))
    if last < 0:
        return 0.0
    if last < 2:
        return profile.contact_length / profile.radius
    arc_length = np.concatenate([[0.0], np.cumsum(profile.width)])
    start = arc_length / profile.radius
    at_edge = slice(max(0, last + 1 - _EDGE_FACETS), last + 1)
    force_beyond = np.cumsum(force[::-1])[::-1]
    beyond = force_beyond[at_edge] ** (2 / 3)
    angle = start[at_edge]
    slope, value = np.polyfit(angle - angle[-1], beyond, 1)
    edge = angle[-1] - value / slope
    return float(np.clip(edge, angle[-1], start[-1]))


def peak_pressure(profiles: list[ArcProfile], eps: float) -> float:
    """Pressure ``p0`` on the contact axis: an even parabola through the facet means of all sides
    near it."""
    near = []
    for p in profiles:
        reach = max(_PEAK_FRACTION * eps * p.radius, 3.001 * p.width[0])
        chosen = (np.cumsum(p.width) <= reach) & (p.in_contact == 1)
        chosen[0] = True
        square = (p.weight * p.angle**2).sum(axis=1) / p.width
        mean = p.facet_force / p.width
        near.append(np.stack([np.sqrt(p.width), square, mean])[:, chosen])
    w, square, mean = np.concatenate(near, axis=1)
    terms = 2 if len(w) > len(profiles) else 1
    A = np.stack([w, w * square], axis=1)[:, :terms]
    return float(np.linalg.lstsq(A, w * mean, rcond=None)[0][0])
