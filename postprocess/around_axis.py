"""The contact in space around an axis, as of a pin: unrolled over angle and length, and the load
along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from archord.geometry.vectors import unit
from archord.materials.material import Array
from archord.measures.edge import PatchProfile
from archord.report.errors import InputError, is_number, require_of, shown

ORIGIN = (0.0, 0.0, 0.0)
ALONG_Z = (0.0, 0.0, 1.0)
_PIECES = 40  # of a line load, by default
_NORMAL = 1 - 1e-9  # cosine of an axis that is normal to a plane


@dataclass(frozen=True)
class Axis:
    """A straight line through a ``point`` along a ``direction``. Angles about it count from the
    first of x, y and z that is not along it. Raises `InputError` for what is no line."""

    point: Sequence[float] = ORIGIN
    direction: Sequence[float] = ALONG_Z

    def __post_init__(self) -> None:
        """Check both; raise `InputError`."""
        for name in ("point", "direction"):
            given = getattr(self, name)
            is_vector = np.shape(given) == (3,) and all(map(is_number, given))
            require_of(self, is_vector, name, "must be three numbers, x, y and z")
        has_length = 0 < np.linalg.norm(self.direction) < np.inf
        require_of(self, bool(has_length), "direction", "must have a length, and not be zero")

    def cylindrical(self, x: Array) -> tuple[Array, Array, Array]:
        """Radius, angle in degrees and place along the axis ``(...)`` of the points ``x``
        ``(..., 3)``."""
        along = unit(np.array(self.direction))
        first = np.eye(3)[np.flatnonzero(np.abs(along) < np.sqrt(0.5))[0]]
        first = unit(first - (first @ along) * along)
        arm = np.asarray(x) - self.point
        a = arm @ first
        b = arm @ np.cross(along, first)
        return np.hypot(a, b), np.degrees(np.arctan2(b, a)), arm @ along

    def meets(self, number: int, at: float) -> float | None:
        """The place along the axis of the plane across x, y or z, by its ``number``, ``at`` a
        coordinate; None unless the axis is normal to the plane."""
        along = unit(np.array(self.direction))[number]
        if abs(along) < _NORMAL:
            return None
        return float((at - self.point[number]) * np.sign(along))


@dataclass(frozen=True)
class Unrolled:
    """The facets of a surface around an axis.

    Attributes
    ----------
    angle : array (n,)
        The angles of the facets' middles in degrees, in (-180, 180].
    along : array (n,)
        The places of the middles along the axis.
    pressure : array (n,)
        The mean pressures.
    area : array (n,)
        The areas.
    radius : float
        The mean radius.
    corners : array (n, c, 2)
        The angles and places of the facets' corners, to draw them by: an angle may be beyond 180
        degrees, next to the angle of the middle.
    """

    angle: Array
    along: Array
    pressure: Array
    area: Array
    radius: float
    corners: Array


@dataclass(frozen=True)
class LineLoad:
    """The contact force of an interaction on its second surface per length of an axis.

    Attributes
    ----------
    along : array (k + 1,)
        The ends of the pieces of the axis.
    load : array (k, 3)
        The force per length of each piece. It is the force of the history if it is integrated, but
        along the axis where the whole is mirrored across it: there the forces cancel.
    """

    along: Array
    load: Array


def unrolled(profile: PatchProfile, axis: Axis) -> Unrolled:
    """The facets of a ``profile`` around an ``axis``."""
    _, first, facet = np.unique(profile.facet, return_index=True, return_inverse=True)
    area = np.bincount(facet, profile.width).astype(float)
    moment = np.einsum("nq,nqi->ni", profile.weight, profile.X)
    middle = np.stack([np.bincount(facet, part) for part in moment.T], axis=1) / area[:, None]
    _, angle, along = axis.cylindrical(middle)
    radius, _, _ = axis.cylindrical(profile.X)  # middles of curved facets lie beneath these
    _, of_corners, along_corners = axis.cylindrical(profile.corners[first])
    beside = (of_corners - angle[:, None] + 180) % 360 - 180
    return Unrolled(
        angle=angle,
        along=along,
        pressure=profile.facet_pressure[first],
        area=area,
        radius=float(np.average(radius, weights=profile.weight)),
        corners=np.stack([angle[:, None] + beside, along_corners], axis=-1),
    )


def line_load(
    profiles: Sequence[PatchProfile],
    shares: Sequence[float],
    axis: Axis,
    along: Sequence[float] | None = None,
    mirrors: Sequence[tuple[int, float]] = (),
) -> LineLoad:
    """The load of an interaction with these ``profiles`` along an ``axis``. Their ``shares`` are
    negative where the force on the surface is opposite, and count the images in ``mirrors``, each
    number and place on one of x, y and z. A piece of a facet has its force spread evenly over the
    length of the facet. Raises `InputError` for places ``along`` the axis that do not rise."""
    low = []
    high = []
    force = []
    for profile, share in zip(profiles, shares, strict=True):
        force.append(share * np.einsum("nq,nqi->ni", profile.weight, profile.traction))
        _, _, ends = axis.cylindrical(profile.corners)
        low.append(ends.min(axis=1))
        high.append(ends.max(axis=1))
    for number, at in mirrors:
        plane = axis.meets(number, at)
        if plane is None:
            continue
        begin = np.concatenate(low)
        end = np.concatenate(high)
        low += [2 * plane - end]
        high += [2 * plane - begin]
        halves = np.concatenate(force) / 2
        force = [halves, halves * (1 - 2 * np.eye(3)[number])]
    begin = np.concatenate(low)[:, None]
    end = np.concatenate(high)[:, None]
    evenly = np.linspace(begin.min(), end.max(), _PIECES + 1)
    edges = evenly if along is None else np.atleast_1d(along)
    rises = len(edges) > 1 and all(map(is_number, edges)) and bool((np.diff(edges) > 0).all())
    if not rises:
        raise InputError(
            f"line_load: along = {shown(along)} must be two numbers or more that rise."
        )
    behind = (edges - begin) / np.maximum(end - begin, np.finfo(float).tiny)
    parts = np.diff(np.clip(behind, 0.0, 1.0), axis=1)
    return LineLoad(edges, parts.T @ np.concatenate(force) / np.diff(edges)[:, None])
