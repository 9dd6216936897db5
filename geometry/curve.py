"""Piecewise polynomial curves in the plane and the closest points on them.

A curve consists of facets, polynomials of degree ``p`` in ``xi`` in [0, 1], which follow each other
in pieces: open ones with two free ends, and closed ones. The body lies on the left of the direction
of travel, so the outward normal is the tangent turned clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from archord.kernels.compiled import library, pointer
from archord.materials.material import Array

Index = npt.NDArray[np.integer]

_END_MARGIN = (
    0.05  # a polynomial facet may be continued by this much beyond a free end of its curve
)
_CONTINUED = 0.5  # and a facet by this much where points are to stay on theirs
_NEWTON_STEPS = 30
# of an arc's size: how far points may be off its circle; and size over radius, below which it is a
# line
_ROUND = 1e-3


class ProjectionError(RuntimeError):
    """A point that has a partner on the opposite curve did not find it."""


@dataclass(frozen=True)
class Projection:
    """Closest points ``y`` on an opposite curve of ``m`` points ``x``, and what their linearisation
    needs.

    With ``n`` the outward normal of the opposite curve at ``y``, ``gap = (x - y) . n``: positive
    when open.
    """

    found: npt.NDArray[
        np.bool_
    ]  # (m,) False: the point lies beyond a free end of the curve, or faces away
    point: Array  # (m, 2)
    normal: Array  # (m, 2) unit
    tangent: Array  # (m, 2) d y / d xi
    bend: Array  # (m,) n . d2y / d xi2
    slides: npt.NDArray[np.bool_]  # (m,) False: the closest point is a vertex, xi stands still
    nodes: Index  # (m, k) curve nodes that carry y (k = 0: rigid)
    shape: Array  # (m, k) their shape functions
    slope: Array  # (m, k) and the derivatives in xi
    facet: Index  # (m,) facet of the opposite curve
    xi: Array  # (m,) position on it


def lagrange(degree: int) -> Array:
    """Monomial coefficients ``(degree + 1, degree + 1)`` of the Lagrange polynomials of equispaced
    nodes in [0, 1]."""
    nodes = np.linspace(0.0, 1.0, degree + 1)
    return np.ascontiguousarray(np.linalg.inv(np.vander(nodes, increasing=True)).T)


def in_pieces(start: np.ndarray, end: np.ndarray, height: Array) -> np.ndarray:
    """Order that links facets end to start: open pieces first, closed ones from their facet of
    least ``height`` on."""
    by_start, ends = {int(s): i for i, s in enumerate(start)}, set(end.tolist())
    firsts = np.argsort(height, kind="stable")
    order: dict[int, None] = {}  # a set that keeps its order
    for first in [*(i for i in firsts if int(start[i]) not in ends), *firsts]:
        at: int | None = int(first)
        while at is not None and at not in order:
            order[at] = None
            at = by_start.get(int(end[at]))
    return np.array(list(order), dtype=np.int64)


class Curve:
    """``n`` polynomial facets with nodes ``X`` ``(m, 2)``, piece by piece in the direction of
    travel.

    ``connectivity`` ``(n, p + 1)`` holds the nodes along each facet; without it, facet ``k`` of one
    open piece has the nodes ``k p .. (k + 1) p``. ``before`` and ``after`` ``(n,)`` are the facets
    at both ends of each, -1 at free ends.
    """

    def __init__(self, X: Array, degree: int, connectivity: Index | None = None) -> None:
        self.X, self.degree = X, degree
        if connectivity is None:
            connectivity = np.arange(0, len(X) - 1, degree)[:, None] + np.arange(degree + 1)
        self.connectivity, self.n_facets = connectivity.astype(np.int32), len(connectivity)
        first, last = self.connectivity[:, 0], self.connectivity[:, -1]
        starting, ending = np.full((2, len(X)), -1, dtype=np.int32)
        starting[first] = ending[last] = np.arange(self.n_facets)
        self.before, self.after = ending[first], starting[last]
        self._first = (
            np.flatnonzero(self.before[1:] != np.arange(self.n_facets - 1)) + 1
        )  # of each piece but one
        self._coefficients = lagrange(degree)

    @property
    def n_pieces(self) -> int:
        """Number of pieces that do not touch."""
        return 1 + len(self._first)

    def shapes(self, xi: Array) -> tuple[Array, Array]:
        """Shape functions and their derivatives, each ``(..., p + 1)``, at ``xi`` ``(...)``."""
        k = np.arange(self.degree + 1)
        powers = np.stack([xi[..., None] ** k, k * xi[..., None] ** np.maximum(k - 1, 0)])
        # one product of two matrices: numpy would multiply point by point
        value, slope = (powers.reshape(-1, self.degree + 1) @ self._coefficients.T).reshape(
            powers.shape
        )
        return value, slope

    def vertices(self) -> tuple[Array, Array]:
        """Where facets meet or the curve ends ``(k, 2)``, and the outward normals of the chords
        there."""
        ends = self.X[self.connectivity[:, [0, -1]]]
        earlier, free = (
            np.where(self.before < 0, np.arange(self.n_facets), self.before),
            self.after < 0,
        )
        x = np.concatenate([ends[:, 0], ends[free, 1]])
        step = np.concatenate([ends[:, 1] - ends[earlier, 0], ends[free, 1] - ends[free, 0]])
        outward = np.stack([step[:, 1], -step[:, 0]], axis=1)
        return x, outward / np.linalg.norm(outward, axis=1)[:, None]

    def arc_length(self, xi: Array) -> Array:
        """Length ``(n, m)`` along each piece from its start to ``xi`` ``(m,)``, or ``(n, m)``, of
        each facet."""
        xi = np.broadcast_to(xi, (self.n_facets, np.shape(xi)[-1]))
        ends = np.concatenate([xi, np.ones((self.n_facets, 1))], axis=1)
        q, w = np.polynomial.legendre.leggauss(8)
        _, slope = self.shapes(ends[..., None] * (q + 1) / 2)
        speed = np.linalg.norm(
            np.einsum("fai,fmqa->fmqi", self.X[self.connectivity], slope), axis=-1
        )
        lengths = (speed @ w) * ends / 2
        start = np.concatenate([[0.0], np.cumsum(lengths[:, -1])[:-1]])
        for first in self._first:
            start[first:] -= start[first]
        return start[:, None] + lengths[:, :-1]

    def neighbours(self, facets: Index, rings: int) -> tuple[Index, Index]:
        """Places ``(k,)`` in ``facets`` ``(m,)``, and the facets within ``rings`` around each, some
        perhaps twice."""
        near = [facets]
        for adjacent in (self.before, self.after):
            facet = facets
            for _ in range(rings):
                facet = np.where(facet < 0, -1, adjacent[facet])
                near.append(facet)
        ring, place = np.nonzero(np.array(near) >= 0)
        return place, np.array(near)[ring, place]

    def nearest_facet(self, x: Array, displacement: Array) -> Index:
        """Facet ``(m,)`` of the displaced curve whose four sample points come nearest to each of
        ``x`` ``(m, 2)``."""
        samples = (np.arange(4) + 0.5) / 4
        nodes = (self.X + displacement)[self.connectivity]
        sampled = np.einsum("qa,fai->fqi", self.shapes(samples)[0], nodes).reshape(-1, 2)
        half_square = 0.5 * (sampled**2).sum(1)
        nearest = np.empty(len(x), dtype=np.int64)
        for part in np.array_split(np.arange(len(x)), 1 + len(x) * len(sampled) // 4_000_000):
            nearest[part] = np.argmin(half_square - x[part] @ sampled.T, axis=1)
        return nearest // 4

    def closest_point(
        self, x: Array, outward: Array, displacement: Array, start: Index | None = None
    ) -> Projection:
        """Closest points on the curve displaced by ``displacement`` (as ``X``) of the points ``x``
        ``(m, 2)``.

        ``outward`` ``(m, 2)`` is the outward normal of the own body at ``x``; a partner must face
        it. ``start`` holds a facet for each point near its partner (by default `nearest_facet`, a
        search without a radius). Newton runs on that facet and its two neighbours, kept within
        each, and the nearest result is taken; a point that leaves them, or the piece that they
        belong to, is searched for on the whole curve. Raises `ProjectionError` if one between the
        curve's ends gets no partner.
        """
        home = self.nearest_facet(x, displacement) if start is None else start
        found = self._project(x, outward, displacement, home)
        before, after = self.before[home], self.after[home]
        back, forth = (
            (found.facet == before) & (found.xi <= 0),
            (found.facet == after) & (found.xi >= 1),
        )
        further = np.where(
            back, self.before[found.facet], np.where(forth, self.after[found.facet], -1)
        )
        away = (further >= 0) & (further != before) & (further != home) & (further != after)
        if away.any():
            if start is None:
                raise ProjectionError(
                    f"{away.sum()} contact points have closest points beyond the facets searched"
                )
            return self.closest_point(x, outward, displacement)
        lost = ~found.found
        if start is not None and self.n_pieces > 1 and lost.any():
            again = self.closest_point(x[lost], outward[lost], displacement)
            for name, values in vars(found).items():
                values[lost] = getattr(again, name)
        return found

    def continued(self, x: Array, outward: Array, displacement: Array, facet: Index) -> Projection:
        """As `closest_point`, but on the given facets, each a polynomial continued beyond its ends:
        smooth in ``x``."""
        return self._project(x, outward, displacement, facet, reach=0, margin=_CONTINUED)

    def _project(
        self,
        x: Array,
        outward: Array,
        displacement: Array,
        home: Index,
        reach: int = 1,
        margin: float = 0.0,
    ) -> Projection:
        m, k = len(x), self.degree + 1
        facet, lost = np.empty(m, dtype=np.int32), np.zeros(1, dtype=np.int32)
        (xi, bend), (shape, slope) = np.empty((2, m)), np.empty((2, m, k))
        point, normal, tangent = np.empty((3, m, 2))
        slides, found = np.empty((2, m), dtype=bool)
        x, outward, home = (
            np.ascontiguousarray(x),
            np.ascontiguousarray(outward),
            home.astype(np.int32, copy=False),
        )
        nodes = (self.X + displacement)[self.connectivity]
        curve: tuple[np.ndarray, ...] = (nodes, self.before, self.after, self._coefficients, home)
        results: tuple[np.ndarray, ...] = (
            facet,
            xi,
            point,
            normal,
            tangent,
            bend,
            shape,
            slope,
            slides,
            found,
            lost,
        )
        n_lost = library(Path(__file__).with_name("closest_point.c")).closest_points(
            m, pointer(x), pointer(outward), self.degree, *map(pointer, curve), reach, margin, _END_MARGIN,
            _NEWTON_STEPS, *map(pointer, results),
        )  # fmt: skip
        if n_lost:
            at = "({:g}, {:g})".format(*x[lost[0]])
            raise ProjectionError(
                f"{n_lost} contact points found no closest point, the first at {at}"
            )
        of_facet = self.connectivity[facet]
        return Projection(
            found, point, normal, tangent, bend, slides, of_facet, shape, slope, facet, xi
        )


def circle_through(x: Array) -> tuple[Array, float] | None:
    """Centre and radius of the circle that the points ``x`` ``(n, 2)`` lie on; None if there is
    none (Kasa 1976)."""
    shift = x.mean(axis=0)
    y = x - shift
    (a, b, c), *_ = np.linalg.lstsq(
        np.column_stack([2 * y, np.ones(len(y))]), (y**2).sum(axis=1), rcond=None
    )
    radius = float(np.sqrt(max(c + a * a + b * b, 0.0)))
    off = np.abs(np.linalg.norm(y - [a, b], axis=1) - radius).max()
    size = np.ptp(y, axis=0).max()
    if len(x) < 4 or off > _ROUND * size or _ROUND * radius > size:
        return None
    return shift + np.array([a, b]), radius


class RigidCircle:
    """A rigid disc of the given centre and radius, as an opposite curve of one facet with one node,
    which moves it."""

    n_facets = 1

    def __init__(self, centre: Array, radius: float) -> None:
        self.centre = np.asarray(centre, dtype=float)
        self.radius = radius
        self.X, self.connectivity = self.centre[None], np.zeros((1, 1), dtype=np.int32)

    def closest_point(
        self, x: Array, outward: Array, displacement: Array, start: Index | None = None
    ) -> Projection:
        """Closest points on the disc moved by ``displacement`` ``(1, 2)``; see
        `Curve.closest_point`."""
        m = len(x)
        ray = x - self.centre - displacement
        normal = ray / np.linalg.norm(ray, axis=1)[:, None]
        return Projection(
            found=(normal * outward).sum(1) < 0,
            point=x - ray + self.radius * normal,
            normal=normal,
            tangent=np.stack([-normal[:, 1], normal[:, 0]], axis=1),
            bend=np.full(m, -1.0 / self.radius),
            slides=np.ones(m, dtype=bool),
            nodes=np.zeros((m, 1), dtype=np.int32),
            shape=np.ones((m, 1)),
            slope=np.zeros((m, 1)),
            facet=np.zeros(m, dtype=np.int32),
            xi=np.zeros(m),
        )

    continued = closest_point

    def neighbours(self, facets: Index, rings: int) -> tuple[Index, Index]:
        """Places in ``facets``, and these facets: there is no other."""
        return np.arange(len(facets)), facets
