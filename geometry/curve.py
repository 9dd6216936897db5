"""Piecewise polynomial curves in the plane and the closest points on them.

A curve consists of facets, polynomials of degree ``p`` in ``xi`` in [0, 1], which follow each other
in pieces: open ones with two free ends, and closed ones. The body lies on the left of the direction
of travel, so the outward normal is the tangent turned clockwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.vectors import unit
from archord.kernels.compiled import library, pointer
from archord.materials.kinematics import Bools, Ints
from archord.materials.material import Array
from archord.report.errors import is_number, require_between, require_of

Index = Ints

_SOURCE = Path(__file__).with_name("closest_point.c")
_END_MARGIN = (
    0.05  # part of its length by which a facet is continued beyond a free end of its curve
)
_CONTINUED = 0.5  # the same of a facet where points are to stay on theirs
EVERY = -1  # `faced`: all facets are continued
NONE = -2  # no facet is
_NEWTON_STEPS = 30
_SAMPLES = 4  # points a facet, among which the nearest facet is searched
_ROUND = (
    1e-3  # over an arc's size, how far points may be off its circle; size over radius of a line
)
# Gauss rule on [-1, 1] for arc lengths
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class ProjectionError(RuntimeError):
    """A point that has a partner on the opposite curve did not find it."""


def lost_points(count: int, first: Array) -> ProjectionError:
    """The error of so many points, the ``first`` of them at a place ``(d,)``."""
    at = ", ".join(f"{coordinate:g}" for coordinate in first)
    return ProjectionError(f"{count} contact points found no closest point, the first at ({at})")


def replace_some(partners: Any, chosen: Bools, others: Any) -> None:
    """Put ``others``, of the ``chosen`` points ``(m,)`` alone, in the place of their ``partners``,
    both a `Projection` or both a `PatchProjection`."""
    for name, values in vars(partners).items():
        values[chosen] = getattr(others, name)


@dataclass(frozen=True)
class Projection:
    """Closest points ``y`` on an opposite curve of ``m`` points ``x``, and what their linearisation
    needs.

    With ``n`` the outward normal of the opposite curve at ``y``, ``gap = (x - y) . n``: positive
    when open. A point is not ``found`` if it lies beyond a free end of the curve, or faces away. A
    closest point that is a vertex does not slide: ``xi`` stands still.
    """

    facet: Index  # (m,) facet of the opposite curve
    xi: Array  # (m,) position on it
    point: Array  # (m, 2)
    normal: Array  # (m, 2) unit
    tangent: Array  # (m, 2) d y / d xi
    bend: Array  # (m,) n . d2y / d xi2
    shape: Array  # (m, k) shape functions of the nodes that carry y
    slope: Array  # (m, k) their derivatives in xi
    slides: Bools  # (m,)
    found: Bools  # (m,)
    nodes: Index  # (m, k) the nodes that carry y

    @property
    def slopes(self) -> tuple[Array, ...]:
        """The derivatives of the shape functions by each coordinate of the facet, here one."""
        return (self.slope,)

    @classmethod
    def empty(cls, m: int, k: int) -> Projection:
        """Of ``m`` points, to be filled in."""
        return cls(
            facet=np.empty(m, dtype=np.int32),
            xi=np.empty(m),
            point=np.empty((m, 2)),
            normal=np.empty((m, 2)),
            tangent=np.empty((m, 2)),
            bend=np.empty(m),
            shape=np.empty((m, k)),
            slope=np.empty((m, k)),
            slides=np.empty(m, dtype=bool),
            found=np.empty(m, dtype=bool),
            nodes=np.empty((m, k), dtype=np.int32),
        )


def lagrange(degree: int) -> Array:
    """Monomial coefficients ``(degree + 1, degree + 1)`` of the Lagrange polynomials of equispaced
    nodes in [0, 1]."""
    nodes = np.linspace(0.0, 1.0, degree + 1)
    monomials = np.vander(nodes, increasing=True)
    inverse = np.linalg.inv(monomials)
    return np.ascontiguousarray(inverse.T)


def in_pieces(start: Ints, end: np.ndarray, height: Array) -> Ints:
    """Order that links facets end to start: open pieces first, closed ones from their facet of
    least ``height`` on."""
    starting_at = {int(node): facet for facet, node in enumerate(start)}
    ends = set(end.tolist())
    lowest_first = np.argsort(height, kind="stable")
    of_open_pieces = [facet for facet in lowest_first if int(start[facet]) not in ends]
    order: dict[int, None] = {}  # a set that keeps its order
    for first in [*of_open_pieces, *lowest_first]:
        facet: int | None = int(first)
        while facet is not None and facet not in order:
            order[facet] = None
            facet = starting_at.get(int(end[facet]))
    return np.array(list(order), dtype=np.int64)


class Curve:
    """``n`` polynomial facets, piece by piece in the direction of travel.

    X : (nodes, 2) the nodes
    connectivity : (n, degree + 1) the nodes along each facet; without it, facet ``k`` of one open
        piece has the nodes ``k degree .. (k + 1) degree``
    before, after : (n,) the facets at both ends of each, -1 at free ends
    """

    def __init__(self, X: Array, degree: int, connectivity: Index | None = None) -> None:
        self.X = X
        self.degree = degree
        if connectivity is None:
            begins = np.arange(0, len(X) - 1, degree)
            connectivity = begins[:, None] + np.arange(degree + 1)
        self.connectivity = connectivity.astype(np.int32)
        self.n_facets = len(connectivity)
        first = self.connectivity[:, 0]
        last = self.connectivity[:, -1]
        facets = np.arange(self.n_facets)
        starting, ending = np.full((2, len(X)), -1, dtype=np.int32)
        starting[first] = facets
        ending[last] = facets
        self.before = ending[first]
        self.after = starting[last]
        follows = self.before[1:] == facets[:-1]
        self._first = np.flatnonzero(~follows) + 1  # facet of each piece but one
        self._coefficients = lagrange(degree)

    @property
    def n_pieces(self) -> int:
        """Number of pieces that do not touch."""
        return 1 + len(self._first)

    def shapes(self, xi: Array) -> tuple[Array, Array]:
        """Shape functions and their derivatives, ``(..., degree + 1)`` each, at ``xi``."""
        k = np.arange(self.degree + 1)
        at = xi[..., None]
        derivatives = k * at ** np.maximum(k - 1, 0)
        powers = np.stack([at**k, derivatives])
        # one product of two matrices: numpy would multiply point by point
        flat = powers.reshape(-1, self.degree + 1) @ self._coefficients.T
        value, slope = flat.reshape(powers.shape)
        return value, slope

    def vertices(self) -> tuple[Array, Array]:
        """Where facets meet or the curve ends ``(k, 2)``, and the outward normals of the chords
        there."""
        start, end = self.X[self.connectivity[:, [0, -1]]].swapaxes(0, 1)
        starts_free = self.before < 0
        ends_free = self.after < 0
        earlier = np.where(starts_free, np.arange(self.n_facets), self.before)
        x = np.concatenate([start, end[ends_free]])
        at_starts = end - start[earlier]
        at_ends = (end - start)[ends_free]
        step_x, step_y = np.concatenate([at_starts, at_ends]).T
        outward = np.stack([step_y, -step_x], axis=1)
        return x, unit(outward)

    def arc_length(self, xi: Array) -> Array:
        """Length ``(n, m)`` along each piece from its start to ``xi`` ``(m,)``, or ``(n, m)``, of
        each facet."""
        xi = np.broadcast_to(xi, (self.n_facets, np.shape(xi)[-1]))
        ends = np.concatenate([xi, np.ones((self.n_facets, 1))], axis=1)
        places = ends[..., None] * (_PLACES + 1) / 2
        _, slope = self.shapes(places)
        tangent = np.einsum("fai,fmqa->fmqi", self.X[self.connectivity], slope)
        lengths = (np.linalg.norm(tangent, axis=-1) @ _WEIGHTS) * ends / 2
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
        rows = np.array(near)
        ring, place = np.nonzero(rows >= 0)
        return place, rows[ring, place]

    def nearest_facet(self, x: Array, displacement: Array) -> Index:
        """Facet ``(m,)`` of the displaced curve of whose sample points one comes nearest to each of
        ``x`` ``(m, 2)``."""
        places = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        shape, _ = self.shapes(places)
        nodes = (self.X + displacement)[self.connectivity]
        samples = np.einsum("qa,fai->fqi", shape, nodes).reshape(-1, 2)
        half_square = 0.5 * (samples**2).sum(1)
        nearest = np.empty(len(x), dtype=np.int64)
        n_parts = 1 + len(x) * len(samples) // 4_000_000  # by their memory
        for part in np.array_split(np.arange(len(x)), n_parts):
            nearest[part] = np.argmin(half_square - x[part] @ samples.T, axis=1)
        return nearest // _SAMPLES

    def closest_point(
        self,
        x: Array,
        outward: Array,
        displacement: Array,
        start: Index | None = None,
        faced: Index | None = None,
    ) -> Projection:
        """Closest points on the curve displaced by ``displacement`` (as ``X``) of the points ``x``
        ``(m, 2)``.

        ``outward`` ``(m, 2)`` is the outward normal of the own body at ``x``; a partner must face
        it. ``start`` holds a facet for each point near its partner (by default `nearest_facet`, a
        search without a radius). Newton runs on that facet and its two neighbours, kept within
        each, and the nearest result is taken; a point that leaves them, or the piece that they
        belong to, is searched for on the whole curve. Beyond a free end facets are continued a
        little for points whose ``faced`` facet is not `NONE`. Raises `ProjectionError` if one
        between the curve's ends gets no partner.
        """
        home = self.nearest_facet(x, displacement) if start is None else start
        if faced is None:
            faced = np.full(len(x), EVERY)
        partners = self._project(x, outward, displacement, home, faced)
        n_away = self._leaves(home, partners).sum()
        if n_away and start is None:
            raise ProjectionError(
                f"{n_away} contact points have closest points beyond the facets searched"
            )
        if n_away:
            return self.closest_point(x, outward, displacement, faced=faced)
        lost = ~partners.found
        if start is not None and self.n_pieces > 1 and lost.any():
            elsewhere = self.closest_point(x[lost], outward[lost], displacement, faced=faced[lost])
            replace_some(partners, lost, elsewhere)
        return partners

    def _leaves(self, home: Index, partners: Projection) -> Bools:
        """Which points ``(m,)`` have partners at an end of the facets around ``home`` beyond which
        the curve goes on."""
        before = self.before[home]
        after = self.after[home]
        back = (partners.facet == before) & (partners.xi <= 0)
        forth = (partners.facet == after) & (partners.xi >= 1)
        beyond = np.where(forth, self.after[partners.facet], -1)
        beyond = np.where(back, self.before[partners.facet], beyond)
        return (beyond >= 0) & (beyond != before) & (beyond != home) & (beyond != after)

    def continued(self, x: Array, outward: Array, displacement: Array, facet: Index) -> Projection:
        """As `closest_point`, but on the given facets, each a polynomial continued beyond its ends:
        smooth in ``x``."""
        every = np.full(len(x), EVERY)
        return self._project(x, outward, displacement, facet, every, reach=0, margin=_CONTINUED)

    def _project(
        self,
        x: Array,
        outward: Array,
        displacement: Array,
        home: Index,
        faced: Index,
        reach: int = 1,
        margin: float = 0.0,
    ) -> Projection:
        """Closest points on the facets ``home`` and, with ``reach`` 1, their neighbours, each
        continued by ``margin``."""
        partners = Projection.empty(len(x), self.degree + 1)
        points = np.ascontiguousarray(x), np.ascontiguousarray(outward)
        nodes = (self.X + displacement)[self.connectivity]
        near = [facets.astype(np.int32, copy=False) for facets in (home, faced)]
        curve: list[np.ndarray] = [nodes, self.before, self.after, self._coefficients, *near]
        results: list[np.ndarray] = list(vars(partners).values())
        on_nodes = results.pop()
        first_lost = np.zeros(1, dtype=np.int32)
        kernel = library(_SOURCE).closest_points
        n_lost = kernel(
            len(x),
            *map(pointer, points),
            self.degree,
            *map(pointer, curve),
            reach,
            margin,
            _END_MARGIN,
            _NEWTON_STEPS,
            *map(pointer, (*results, first_lost)),
        )
        if n_lost:
            raise lost_points(n_lost, x[first_lost[0]])
        on_nodes[:] = self.connectivity[partners.facet]
        return partners


def circle_through(x: Array) -> tuple[Array, float] | None:
    """Centre and radius of the circle that the points ``x`` ``(n, 2)`` lie on; None if there is
    none."""
    if len(x) < 4:
        return None
    centre, radius = nearest_circle(x)
    size = np.ptp(x, axis=0).max()
    distances = np.linalg.norm(x - centre, axis=1)
    off = np.abs(distances - radius).max()
    is_line = _ROUND * radius > size
    if off > _ROUND * size or is_line:
        return None
    return centre, radius


def nearest_circle(x: Array) -> tuple[Array, float]:
    """Centre and radius of the circle that fits the points ``x`` ``(n, 2)`` best (Kasa 1976)."""
    shift = x.mean(axis=0)
    y = x - shift
    rows = np.column_stack([2 * y, np.ones(len(y))])
    (a, b, c), *_ = np.linalg.lstsq(rows, (y**2).sum(axis=1), rcond=None)
    radius = float(np.sqrt(max(c + a * a + b * b, 0.0)))
    return shift + np.array([a, b]), radius


class RigidRound:
    """What rigid discs, balls and cylinders share: an opposite of one facet with one node, which
    moves it.

    centre : (d,) the centre
    radius : the radius
    """

    n_facets = 1
    dimension = 2
    axis: Array | None = None  # of a cylinder

    def __init__(self, centre: Sequence[float] | Array, radius: float) -> None:
        self.centre = np.asarray(centre)
        self.radius = radius
        is_place = self.centre.shape == (self.dimension,)
        is_place = is_place and all(map(is_number, self.centre.ravel()))
        count = {2: "two", 3: "three"}[self.dimension]
        require_of(self, is_place, "centre", f"must be {count} numbers")
        require_between(self, "radius", 0, np.inf, "must be positive and finite")
        self.centre = self.centre.astype(float)
        self.X = self.centre[None]
        self.connectivity = np.zeros((1, 1), dtype=np.int32)

    @property
    def farthest(self) -> float:
        """The largest number of which distances from it are differences."""
        return float(max(np.abs(self.centre).max(), self.radius))

    def neighbours(self, facets: Index, rings: int) -> tuple[Index, Index]:
        """Places in ``facets``, and these facets: there is no other."""
        return np.arange(len(facets)), facets


class RigidCircle(RigidRound):
    """A rigid disc that bodies touch.

    Parameters
    ----------
    centre : sequence of float
        The centre (x, y).
    radius : float
        The radius.

    Raises
    ------
    InputError
        For a centre that is not two numbers, and a radius that is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import Interaction, RigidCircle
    >>> roller = RigidCircle((0.0, 10.0), radius=10.0)
    >>> rub = Interaction("rub", (roller, "block top"), friction=0.1)

    The closest point to one at (0, -2), which faces up:

    >>> x, up, still = np.array([[0.0, -2.0]]), np.array([[0.0, 1.0]]), np.zeros((1, 2))
    >>> roller.closest_point(x, up, still).point.tolist()
    [[0.0, 0.0]]
    """

    def closest_point(
        self,
        x: Array,
        outward: Array,
        displacement: Array,
        start: Index | None = None,
        faced: Index | None = None,
    ) -> Projection:
        """Closest points on the disc moved by ``displacement`` ``(1, 2)``; see
        `Curve.closest_point`."""
        m = len(x)
        ray = x - self.centre - displacement
        normal = unit(ray)
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
