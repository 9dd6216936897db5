"""One integrated side of a contact against its opposite: pairs, gaps and pressures at its points."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from archord.geometry.curve import Array, Curve, Projection, RigidCircle
from archord.kernels.compiled import library, pointer
from archord.solver.contact.surface import ContactSide

Kinematics = Literal["current", "reference", "tied"]


@dataclass
class Pairing:
    """The points of ``side`` (``m`` on this rank) against ``opposite``; arrays hold the last evaluated displacement.

    ``share`` of the contact's virtual work is integrated here, with ``gamma`` ``(m,)``. Under reference and tied
    kinematics the pairs stay those of the undeformed curves.
    """

    side: ContactSide
    opposite: ContactSide | RigidCircle
    share: float
    gamma: Array
    kinematics: Kinematics
    projection: Projection = field(init=False)
    separation: Array = field(init=False)  # x - y (m, 2)
    gap: Array = field(init=False)  # (m,)
    traction: Array = field(init=False)  # (m, 2) of the own body; tied: with the penalty of the jump
    trial: Array = field(init=False)  # (m,) what the pressure would be, were it not for its sign
    pressure: Array = field(init=False)  # (m,)
    active: npt.NDArray[np.bool_] = field(init=False)  # (m,) points that carry a contact force
    tangent: Array = field(init=False)  # (m, 3, 3) of the material
    _kernels: Any = field(init=False, repr=False)
    _search: bool = field(init=False, default=True)
    _hold: bool = field(init=False, default=False)

    def __post_init__(self) -> None:
        """Pair the undeformed curves. Raises `ProjectionError`."""
        self._kernels = library(Path(__file__).with_name("contact_points.c"))
        x, outward = self.side.point.reshape(-1, 2), self.side.outward.reshape(-1, 2)
        self.projection = self.curve.closest_point(x, outward, self.opposite_motion(None))
        self.separation = x - self.projection.point
        self.trial = self.pressure = np.zeros(len(x))
        self.active = self.projection.found if self.kinematics == "tied" else np.zeros(len(x), dtype=bool)

    @property
    def curve(self) -> Curve | RigidCircle:
        """The opposite as a curve."""
        return self.opposite.curve if isinstance(self.opposite, ContactSide) else self.opposite

    def opposite_motion(self, u: Array | None, rigid_motion: Array | None = None) -> Array:
        """Displacement of the opposite's nodes, or of the rigid disc ``(2,)``; at rest without ``u``. Collective."""
        if isinstance(self.opposite, ContactSide):
            return np.zeros_like(self.opposite.curve.X) if u is None else self.opposite.curve_displacement(u)
        return np.zeros(2) if rigid_motion is None else rigid_motion

    def search(self) -> None:
        """Forget where the pairs were: the next evaluation searches them anew, over the whole curve."""
        self._search, self._hold = True, False

    def hold(self) -> None:
        """Keep every point on the facet it was last paired with, until `search`."""
        self._search, self._hold = False, True

    def evaluate(self, u: Array, motion: Array) -> None:
        """Pairs, gaps, pressures and trial history at ``u`` ``(n, 2)``, with the opposite moved by ``motion``.

        Raises `ProjectionError`.
        """
        side, outward = self.side, self.side.outward.reshape(-1, 2)
        displacement, stress, tangent = (values.reshape(-1, *values.shape[2:]) for values in side.deform(u))
        self.tangent = np.ascontiguousarray(tangent)
        if self.kinematics == "current":
            self._pair_anew(side.point.reshape(-1, 2) + displacement, outward, motion)
            opening = self.separation
        else:
            jump = displacement - self._opposite_displacement(motion)
            opening = self.separation + jump
        self.traction, self.gap, self.trial = self._pressed(stress, outward, opening)
        if self.kinematics == "tied":
            self.traction -= self.gamma[:, None] * jump
            self.pressure = (self.traction * self.projection.normal).sum(1)
        else:
            self.press(self.projection.found & ~(self.trial <= 0))  # not a number stays that

    def press(self, active: npt.NDArray[np.bool_]) -> None:
        """Let the points ``active`` ``(m,)`` carry their trial pressures, whatever the sign, and no others."""
        self.active, self.pressure = active, np.where(active, self.trial, 0.0)

    def _pressed(self, stress: Array, outward: Array, opening: Array) -> tuple[Array, Array, Array]:
        """Traction ``(m, 2)``, gap and trial pressure ``(m,)``."""
        m, P = len(stress), self.projection
        given = stress, outward, opening, P.normal, self.gamma
        found = np.empty((m, 2)), np.empty(m), np.empty(m)
        self._kernels.contact_pressure(m, *map(pointer, given + found))
        return found

    def _pair_anew(self, x: Array, outward: Array, motion: Array) -> None:
        if isinstance(self.curve, Curve) and self._hold:
            self.projection = self.curve.continued(x, outward, motion, self.projection.facet)
        elif isinstance(self.curve, Curve):
            start = None if self._search else self.projection.facet
            self.projection = self.curve.closest_point(x, outward, motion, start)
        else:
            self.projection = self.curve.closest_point(x, outward, motion)
        self._search = False
        self.separation = x - self.projection.point

    def _opposite_displacement(self, motion: Array) -> Array:
        if isinstance(self.opposite, RigidCircle):
            return motion
        return np.einsum("ma,mai->mi", self.projection.shape, motion[self.projection.nodes])

    @property
    def forces(self) -> Array:
        """Weighted contact force ``(m, 2)`` of each point on its own body."""
        w = self.share * self.side.weight.ravel()
        if self.kinematics == "tied":
            return np.where(self.projection.found, w, 0.0)[:, None] * self.traction
        return (w * self.pressure)[:, None] * self.projection.normal

    def add_forces(self, own: Array, opposite: Array) -> None:
        """Add the forces on the nodes of the own curve to ``own`` ``(nodes, 2)``, their reactions to ``opposite``."""
        side, P = self.side, self.projection
        n, q, k = side.trace_shape.shape
        on_own = self.forces, side.trace_shape, side.curve.connectivity[side.facet]
        on_opposite = P.shape, P.nodes
        arrays = *on_own, *on_opposite, own, opposite
        self._kernels.contact_forces(n, q, k, P.shape.shape[1], *map(pointer, arrays))
