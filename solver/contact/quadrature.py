"""Quadrature with breaks where facets of the opposite curve or surface end.

A point's force goes to the nodes of its partner facet, whose shape functions have kinks at its
ends. Points that ignore them integrate a uniform pressure with an error of the order of the mesh;
facets broken there pass a patch test exactly. Breaks stay, as points carry history: pairs that
slide by a part of a facet get that part of the error back.
"""

from __future__ import annotations

import basix
import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import Curve, Index
from archord.geometry.overlay import broken_facets, coincide, piece_rule, quartered
from archord.geometry.patches import Patches

_EXACT = 4  # degree of the rule in a piece
_NEARLY_EXACT = 2
_FEWEST = 4  # pieces of a facet with points of the second degree
_SHORTEST = 1e-6  # breaks nearer than this, in xi, are one


def segment_rule(own: Curve, opposite: Curve) -> tuple[Array, Array]:
    """Positions and weights ``(n_facets of own, q)`` in xi; all facets of ``own`` get equally many
    segments.

    Breaks lie where ``own`` faces the vertices of ``opposite``; facets with fewer of them are
    broken further.
    """
    met = own.closest_point(*opposite.vertices(), np.zeros_like(own.X))
    inside = met.found & (met.xi > _SHORTEST) & (met.xi < 1 - _SHORTEST)
    breaks = []
    for k in range(own.n_facets):
        met_here = np.sort(met.xi[inside & (met.facet == k)])
        breaks.append(
            np.concatenate([[0.0], met_here[np.diff(met_here, prepend=0.0) > _SHORTEST], [1.0]])
        )
    points = max(map(len, breaks))
    ends = np.array([_refined(b, points) for b in breaks])
    # two more than a quadratic pressure against quadratic shape functions wants, as pairs slide and
    # breaks do not
    x, w = np.polynomial.legendre.leggauss(own.degree + 3)
    length = np.diff(ends, axis=1)[:, :, None]
    xi = ends[:, :-1, None] + length * (x + 1) / 2
    return xi.reshape(own.n_facets, -1), (length * w / 2).reshape(own.n_facets, -1)


def _refined(ends: Array, points: int) -> Array:
    """``ends`` with the longest segment halved until there are ``points`` of them."""
    while len(ends) < points:
        k = int(np.argmax(np.diff(ends)))
        ends = np.insert(ends, k + 1, (ends[k] + ends[k + 1]) / 2)
    return ends


def pieces_rule(own: Patches, opposite: Patches) -> tuple[Array, Array, Index]:
    """Positions ``(pieces, q, 2)`` and weights ``(pieces, q)`` in the pieces into which the facets
    of ``opposite`` break those of ``own``, and the facets ``(pieces,)`` of the pieces.

    Six points in a triangle, nine in a quadrilateral are exact for a uniform pressure on curved
    facets of second order. Triangles have three where the surfaces do not coincide: their distance
    spoils more than that, as it does on a cylinder whose meshes differ.
    """
    facet, pieces = broken_facets(own, opposite)
    degree = _EXACT
    if own.cell == basix.CellType.triangle and not coincide(own, opposite):
        degree = _NEARLY_EXACT
        is_large = np.bincount(facet)[facet] < _FEWEST
        facet = np.concatenate([facet[~is_large], np.repeat(facet[is_large], 4)])
        pieces = np.concatenate([pieces[~is_large], quartered(pieces[is_large])])
        order = np.argsort(facet, kind="stable")
        facet = facet[order]
        pieces = pieces[order]
    xi, w = piece_rule(pieces, degree)
    whole = basix.make_quadrature(own.cell, 1)[1].sum()
    covered = np.bincount(facet, w.sum(axis=1))
    return xi, w * (whole / covered)[facet, None], facet
