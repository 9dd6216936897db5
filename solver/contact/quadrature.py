"""Quadrature with breaks where facets of the opposite curve or surface end.

A point's force goes to the nodes of its partner facet, whose shape functions have kinks at its
ends. A kink between two points costs an error of the square of their distance. Facets broken at
the kinks pass a patch test exactly. Breaks stay, as points carry history, while the kinks of pairs
that slide do not: so no part of a facet is long.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import basix
import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import Curve, Index, Projection
from archord.geometry.overlay import (
    broken_facets,
    piece_rule,
    polygon_rule,
    quartered,
    without_slivers,
)
from archord.geometry.patches import Patches

_EXACT = 4  # degree of the rule in a piece
_FEWEST = 4  # pieces of a facet with points of the second degree
_SHORTEST = 1e-6  # breaks nearer than this, in xi, are one
# for each facet that a facet faces: means of a smooth pressure scatter by 0.1 % at most, wherever
# the kinks slide to
_PARTS = 6
# where the points of curves lie: "even", or "halved" as in version 0.2, for the runs that it began
RULE: ContextVar[str] = ContextVar("rule of contact points", default="even")


@contextmanager
def points_by(rule: str) -> Iterator[None]:
    """Let contact points of curves lie by the ``rule``."""
    token = RULE.set(rule)
    try:
        yield
    finally:
        RULE.reset(token)


def segment_rule(own: Curve, opposite: Curve) -> tuple[Array, Array]:
    """Positions and weights ``(n_facets of own, q)`` in xi; all facets of ``own`` get equally many
    parts.

    Breaks lie where ``own`` faces the vertices of ``opposite``; the longest segments between them
    are cut further.
    """
    met = own.closest_point(*opposite.vertices(), np.zeros_like(own.X))
    inside = met.found & (met.xi > _SHORTEST) & (met.xi < 1 - _SHORTEST)
    breaks = []
    for k in range(own.n_facets):
        met_here = np.sort(met.xi[inside & (met.facet == k)])
        distance = np.diff(met_here, prepend=0.0)
        apart = met_here[distance > _SHORTEST]
        breaks.append(np.concatenate([[0.0], apart, [1.0]]))
    n_parts = max(len(ends) - 1 for ends in breaks)
    if RULE.get() == "halved":
        ends = np.array([_halved(ends, n_parts) for ends in breaks])
        n_points = own.degree + 3
    else:
        n_parts = max(_PARTS * max(round(_n_faced(met, own.n_facets)), 1), n_parts)
        ends = np.array([_divided(ends, n_parts) for ends in breaks])
        # exact for a linear pressure against the shape functions of a facet that is hardly curved
        n_points = own.degree + 1
    x, w = np.polynomial.legendre.leggauss(n_points)
    length = np.diff(ends, axis=1)[:, :, None]
    xi = ends[:, :-1, None] + length * (x + 1) / 2
    weight = length * w / 2
    return xi.reshape(own.n_facets, -1), weight.reshape(own.n_facets, -1)


def _n_faced(met: Projection, n_facets: int) -> float:
    """How many facets each of ``n_facets`` faces, on average, by the vertices of the opposite curve
    that are ``met``. Of vertices that lie at ends of facets round-off decides on which: all count
    on the one before, or all on the one behind, whichever is on fewer facets."""
    place = (met.facet + met.xi)[met.found]
    before = np.floor(place - _SHORTEST).clip(0)
    behind = np.floor(place + _SHORTEST).clip(max=n_facets - 1)
    fewest = min(len(np.unique(before)), len(np.unique(behind)))
    return len(place) / max(fewest, 1)


def _halved(ends: Array, n_parts: int) -> Array:
    """The ``ends`` of segments with the longest one halved until there are ``n_parts``."""
    while len(ends) <= n_parts:
        k = int(np.argmax(np.diff(ends)))
        middle = (ends[k] + ends[k + 1]) / 2
        ends = np.insert(ends, k + 1, middle)
    return ends


def _divided(ends: Array, n_parts: int) -> Array:
    """The ``ends`` of segments and between them as many more that there are ``n_parts``, of
    lengths as equal as segments allow.

    Of segments whose parts are equally long the longest one gets the next part, and of these the
    first one, whatever the rounding.
    """
    length = np.diff(ends)
    parts = np.ones(len(length), dtype=int)
    while parts.sum() < n_parts:
        of_parts = length / parts
        longest = np.where(of_parts > of_parts.max() - _SHORTEST, length, 0.0)
        parts[np.argmax(longest > longest.max() - _SHORTEST)] += 1
    size = np.repeat(length / parts, parts)
    within = np.concatenate([np.arange(count) for count in parts])
    start = np.repeat(ends[:-1], parts)
    return np.append(start + within * size, ends[-1])


def pieces_rule(own: Patches, opposite: Patches, *, same: bool) -> tuple[Array, Array, Index]:
    """Positions ``(pieces, q, 2)`` and weights ``(pieces, q)`` in the pieces into which the facets
    of ``opposite`` break those of ``own``, and the facets ``(pieces,)`` of the pieces, in rising
    order.

    Six points in a triangle, nine in a quadrilateral are exact for a uniform pressure on curved
    facets of second order. Triangular facets have three in each polygon where the surfaces are not
    the ``same``: their distance spoils more than that, as it does on a cylinder whose meshes
    differ.
    """
    facet, polygon, pieces = broken_facets(own, opposite)
    if own.cell == basix.CellType.triangle and not same:
        facet, xi, w = _of_polygons(facet, polygon, pieces)
    else:
        xi, w = piece_rule(pieces, _EXACT)
    whole = basix.make_quadrature(own.cell, 1)[1].sum()
    covered = np.bincount(facet, w.sum(axis=1))
    return xi, w * (whole / covered)[facet, None], facet


def _of_polygons(facet: Index, polygon: Index, triangles: Array) -> tuple[Index, Array, Array]:
    """The facets ``(p,)``, and points and weights ``(p, 3, ...)``, of the polygons that
    `broken_facets` has found. On a facet with few of them each triangle counts as a polygon; with
    few triangles, each quarter of one."""
    begins: np.ndarray = np.diff(polygon, prepend=-1) > 0
    has_few_polygons = np.bincount(facet[begins])[facet] < _FEWEST
    has_few_triangles = np.bincount(facet)[facet] < _FEWEST
    times = np.where(has_few_triangles, 4, 1)
    is_quarter = np.repeat(has_few_triangles, times)
    begins = np.repeat(begins | has_few_polygons, times) | is_quarter
    parts = np.repeat(triangles, times, axis=0)
    parts[is_quarter] = quartered(triangles[has_few_triangles])
    facet = np.repeat(facet, times)
    merged = without_slivers(parts, np.cumsum(begins) - 1, facet)
    xi, w = polygon_rule(parts, merged)
    return facet[np.unique(merged, return_index=True)[1]], xi, w
