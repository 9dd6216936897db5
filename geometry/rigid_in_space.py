"""Rigid balls and cylinders in space, and the closest points on them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import Index, RigidRound
from archord.geometry.patches import PatchProjection
from archord.geometry.vectors import unit
from archord.report.errors import is_number, require_of

_ON_CENTRE = 1e-300  # a distance from the centre that is none


class RigidBall(RigidRound):
    """A rigid ball that bodies in space touch.

    Parameters
    ----------
    centre : sequence of float
        The centre (x, y, z).
    radius : float
        The radius.

    Raises
    ------
    InputError
        For a centre that is not three numbers, and a radius that is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import Interaction, RigidBall
    >>> ball = RigidBall((0.0, 0.0, 5.0), radius=5.0)
    >>> press = Interaction("press", (ball, "block top"))

    The closest point to one at (0, 0, -2), which faces up:

    >>> x, up, still = np.array([[[0.0, 0, -2]], [[0, 0, 1]], [[0, 0, 0]]])
    >>> ball.closest_point(x, up, still).point.tolist()
    [[0.0, 0.0, 0.0]]
    """

    dimension = 3
    _is_curved = (True, True)  # along both tangents

    def closest_point(
        self,
        x: Array,
        outward: Array,
        displacement: Array,
        start: Index | None = None,
        faced: Index | None = None,
    ) -> PatchProjection:
        """Closest points on the surface moved by ``displacement`` ``(1, 3)``; see
        `Patches.closest_point`.

        A facet's coordinates are the lengths along the tangents. The frame of a point that is not
        found faces the point.
        """
        m = len(x)
        ray = self._ray(x - self.centre - displacement)
        distance = np.linalg.norm(ray, axis=1, keepdims=True).clip(min=_ON_CENTRE)
        normal = ray / distance
        found = (normal * outward).sum(1) < 0
        axis = self._second_tangent(normal)
        bent = np.diag(self._is_curved) / self.radius
        along = np.where(self._is_curved, self.radius / distance, 1.0)
        return PatchProjection(
            found=found,
            point=x - ray + self.radius * normal,
            normal=np.where(found[:, None], normal, -outward),
            tangent=np.stack([np.cross(axis, normal), axis], axis=1),
            bend=np.tile(-bent, (m, 1, 1)),
            along=along[:, :, None] * np.eye(2),
            nodes=np.zeros((m, 1), dtype=np.int32),
            shape=np.ones((m, 1)),
            slope=np.zeros((m, 2, 1)),
            facet=np.zeros(m, dtype=np.int32),
            xi=np.zeros((m, 2)),
        )

    continued = closest_point

    def _ray(self, from_centre: Array) -> Array:
        """The vectors ``(m, 3)`` to points, across the surface."""
        return from_centre

    def _second_tangent(self, normal: Array) -> Array:
        """Unit vectors ``(m, 3)`` along the surface."""
        least = np.abs(normal).argmin(axis=1)
        return unit(np.cross(normal, np.eye(3)[least]))


class RigidCylinder(RigidBall):
    """A rigid cylinder, infinitely long, that bodies in space touch.

    Parameters
    ----------
    centre : sequence of float
        A point (x, y, z) of the axis.
    radius : float
        The radius.
    axis : sequence of float
        The direction of the axis, of any length.

    Raises
    ------
    InputError
        For a centre or an axis that is not three numbers, and a radius that is not positive.

    Examples
    --------
    >>> from archord import Interaction, RigidCylinder
    >>> roller = RigidCylinder((0.0, 0.0, 5.0), radius=5.0, axis=(0, 1, 0))
    >>> rub = Interaction("rub", (roller, "block top"), friction=0.1)
    """

    _is_curved = (True, False)

    def __init__(
        self,
        centre: Sequence[float] | Array,
        radius: float,
        axis: Sequence[float] | Array = (0.0, 0.0, 1.0),
    ) -> None:
        super().__init__(centre, radius)
        given = np.asarray(axis)
        self.axis: Array = given
        is_direction = given.shape == (3,) and all(map(is_number, given.ravel()))
        is_direction = is_direction and bool(given.any())
        require_of(self, is_direction, "axis", "must be three numbers, not all of them zero")
        self.axis = unit(given.astype(float))

    def _ray(self, from_centre: Array) -> Array:
        """The vectors ``(m, 3)`` to points, across the axis."""
        return from_centre - np.outer(from_centre @ self.axis, self.axis)

    def _second_tangent(self, normal: Array) -> Array:
        """The axis, for each point ``(m, 3)``."""
        return np.tile(self.axis, (len(normal), 1))
