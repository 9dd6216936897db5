"""Facets in space broken into pieces where the facets of an opposite surface end: triangles into
triangles, quadrilaterals into quadrilaterals.

The corners of the opposite facets are projected on the undeformed surface, and straight lines join
them in the coordinates of the facet on which they lie. That is exact where both surfaces are
planes, or graphs of one polynomial over straight triangles. Other curved edges are off by the
sagitta of their chords.
"""

from __future__ import annotations

from pathlib import Path

import basix
import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import NONE, Index
from archord.geometry.patches import Patches
from archord.geometry.vectors import crossed
from archord.kernels.compiled import library, pointer, structure

_SOURCE = Path(__file__).with_name("overlay.c")
_TOUCH = 1e-7  # distance of surfaces that coincide, in radii of their facets
_FLAT = 1e-15  # least second moment of a polygon, of the sum of both
_EVEN = 1e-6  # third moment, of a polygon stretched to unit ones, that round-off may turn
_SLIVER = 1 / 40  # of the mean area of the polygons on a facet
_APART = 10.0  # distance of facets with unit sides, as good as infinite
_ACROSS = 1e-6  # the product of unit normals of facets that stand on each other
_REACH = 1.2  # of facets, in radii: how far apart those may be that overlie each other


def broken_facets(own: Patches, opposite: Patches) -> tuple[Index, Index, Array]:
    """The facets ``(n,)`` of ``own``, in rising order, and corners ``(n, e, 2)`` on them of the
    pieces into which the facets of ``opposite`` break them; and between both the numbers ``(n,)``,
    in rising order, of the convex polygons that the pieces make up. Together the pieces of a facet
    cover it. A quadrilateral with its last corner twice is a triangle."""
    facet, other = _overlying(own, opposite)
    corners = opposite.corner_points()[other]
    n_corners = corners.shape[1]
    facet_of_corners = np.repeat(facet, n_corners)
    xi = own.coordinates(corners.reshape(-1, 3), facet_of_corners)
    window = own.reference_corners()
    counts = np.bincount(facet, minlength=own.n_facets)
    overlay: dict[str, int | np.ndarray] = {
        "n": own.n_facets,
        "sides": len(window),
        "n_corners": n_corners,
        "window": window,
        "first": np.concatenate([[0], np.cumsum(counts)]).astype(np.int32),
        "polygons": xi,
    }
    given = structure(_SOURCE, "Overlay", overlay)
    kernel = library(_SOURCE).broken_facets
    most = 0
    needed = 8 * own.n_facets + 2 * len(facet)
    while needed > most:
        most = needed
        broken, polygon = np.empty((2, most), dtype=np.int32)
        pieces = np.empty((most, len(window), 2))
        needed = kernel(given, most, pointer(broken), pointer(polygon), pointer(pieces))
    return broken[:needed], polygon[:needed], pieces[:needed]


def _overlying(own: Patches, opposite: Patches) -> tuple[Index, Index]:
    """Pairs ``(p,)`` of a facet of ``own``, in rising order, and a facet of ``opposite`` that may
    lie over it."""
    from scipy.spatial import cKDTree  # a plane problem does not pay for it

    middle, normal, radius = own.spheres()
    centre, other_normal, other_radius = opposite.spheres()
    undeformed = np.zeros_like(opposite.X)
    closest = opposite.closest_point(middle, normal, undeformed).point
    gap = ((closest - middle) * normal).sum(axis=1)
    over = middle + gap[:, None] * normal
    farthest = _REACH * (radius + other_radius.max())
    near = cKDTree(centre).query_ball_point(over, farthest, return_sorted=True)
    n_near = [len(found) for found in near]
    facet = np.repeat(np.arange(own.n_facets), n_near)
    other = np.concatenate([np.asarray(found, dtype=np.int64) for found in near])
    apart = np.linalg.norm(centre[other] - over[facet], axis=1)
    is_near = apart < _REACH * (radius[facet] + other_radius[other])
    is_facing = (normal[facet] * other_normal[other]).sum(axis=1) < -_ACROSS
    chosen = is_near & is_facing
    return facet[chosen], other[chosen]


def piece_rule(pieces: Array, degree: int) -> tuple[Array, Array]:
    """Points ``(n, q, 2)`` and weights ``(n, q)`` in ``pieces`` ``(n, e, 2)``, exact for
    polynomials of this ``degree``."""
    start = pieces[:, 0, None]
    if pieces.shape[1] == 3:
        X, w = basix.make_quadrature(basix.CellType.triangle, degree)
        sides = pieces[:, 1:] - start
        size = np.abs(np.linalg.det(sides))
        return start + X @ sides, size[:, None] * w
    X, w = basix.make_quadrature(basix.CellType.quadrilateral, degree + 1)
    s, t = X.T[..., None]
    one, opposite, two = (pieces[:, k, None] - start for k in (1, 2, 3))
    twist = opposite - one - two
    points = start + s * one + t * two + s * t * twist
    by_s = one + t * twist
    by_t = two + s * twist
    area = crossed(by_s, by_t)
    return points, area * w


def polygon_rule(triangles: Array, polygon: Index) -> tuple[Array, Array]:
    """Three points ``(p, 3, 2)`` and their weights ``(p, 3)`` in each polygon, exact for
    polynomials of the second degree. The ``triangles`` ``(n, 3, 2)`` make up the polygons
    ``polygon`` ``(n,)``, numbered from zero on.

    Where a polygon is stretched to equal second moments, equal weights at the corners of an
    equilateral triangle about its middle have the same moments, however that triangle is turned.
    They lie in a convex polygon (Kannan, Lovasz and Simonovits 1995, theorem 4.1). The triangle is
    turned so that the third moments agree best, as on a triangle they do.
    """
    size, middle = measured(triangles, polygon)
    x, w = piece_rule(triangles, 3)
    x = x - middle[polygon, None]

    def mean(values: Array) -> Array:
        return np.bincount(polygon, (w * values).sum(axis=1)) / size

    ss, st, tt = (mean(x[..., i] * x[..., j]) for i, j in ((0, 0), (0, 1), (1, 1)))
    # factors of Cholesky's of the second moments
    least = _FLAT * (ss + tt)
    along = np.sqrt(np.maximum(ss, least))
    aside = st / along
    across = np.sqrt(np.maximum(tt - aside**2, least))
    s = x[..., 0] / along[polygon, None]
    t = (x[..., 1] - s * aside[polygon, None]) / across[polygon, None]
    by_s = mean(s**3 - 3 * s * t**2)
    by_t = mean(3 * s**2 * t - t**3)
    third = by_s + 1j * by_t
    is_odd = np.abs(third) > _EVEN
    turn = np.where(is_odd, np.angle(third), 0.0) / 3
    corners = 2 * np.pi / 3 * np.arange(3)
    angle = turn[:, None] + corners
    s = np.sqrt(2) * np.cos(angle)
    t = np.sqrt(2) * np.sin(angle)
    stretched = s * along[:, None], s * aside[:, None] + t * across[:, None]
    weights: Array = np.repeat(size[:, None] / 3, 3, axis=1)
    return middle[:, None] + np.stack(stretched, axis=2), weights


def measured(triangles: Array, polygon: Index) -> tuple[Array, Array]:
    """Areas ``(p,)`` of the polygons that `polygon_rule` takes, and their middles ``(p, 2)``."""
    [middles], [areas] = (values.swapaxes(0, 1) for values in piece_rule(triangles, 1))
    size = np.bincount(polygon, areas).astype(float)
    moments = [np.bincount(polygon, areas * coordinate) for coordinate in middles.T]
    return size, np.stack(moments, axis=1) / size[:, None]


def without_slivers(triangles: Array, polygon: Index, facet: Index) -> Index:
    """The polygons ``(n,)`` of the ``triangles``, numbered from zero on, where slivers belong to
    the polygon on the same ``facet`` ``(n,)`` whose middle is nearest."""
    from scipy.spatial import cKDTree  # a plane problem does not pay for it

    size, middle = measured(triangles, polygon)
    _, first = np.unique(polygon, return_index=True)
    on_facet = facet[first]
    n_polygons = np.bincount(on_facet)
    mean = np.bincount(on_facet, size) / n_polygons.clip(1)
    is_sliver = size < _SLIVER * mean[on_facet]
    kept = np.flatnonzero(~is_sliver)
    at = np.column_stack([middle, _APART * on_facet])
    _, nearest = cKDTree(at[kept]).query(at)
    number_of_kept = np.cumsum(~is_sliver) - 1
    joined = np.where(is_sliver, nearest, number_of_kept)
    return joined[polygon]


def quartered(triangles: Array) -> Array:
    """Each of the ``triangles`` ``(n, 3, 2)`` cut in four: ``(4 n, 3, 2)``."""
    across = (triangles[:, [1, 2, 0]] + triangles[:, [2, 0, 1]]) / 2
    parts = [across]
    for corner in range(3):
        part = across.copy()
        part[:, corner] = triangles[:, corner]
        parts.append(part)
    return np.stack(parts, axis=1).reshape(-1, 3, 2)


def coincide(own: Patches, opposite: Patches) -> bool:
    """Whether the undeformed surfaces are the same where they face each other."""
    middle, normal, radius = own.spheres()
    undeformed = np.zeros_like(opposite.X)
    nothing = np.full(len(middle), NONE)
    over = opposite.closest_point(middle, normal, undeformed, faced=nothing)
    apart = np.linalg.norm(over.point - middle, axis=1)
    is_same = apart < _TOUCH * radius
    return bool(is_same[over.found].all())
