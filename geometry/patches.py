"""Surfaces of curved triangles or quadrilaterals in space, and the closest points on them.

A facet is a polynomial in ``xi`` ``(s, t)`` on the reference triangle or square. Facets that share
an edge are neighbours; an edge of one facet alone is a free border. At the sharp edges of a body
the surface ends, too: no point has its partner beyond. The product of the tangents by ``s`` and
``t`` points out of the body.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import basix
import numpy as np

from archord.geometry.basis import Array, element_of
from archord.geometry.curve import EVERY, Index, lost_points, replace_some
from archord.geometry.vectors import unit
from archord.kernels.compiled import library, pointer, structure
from archord.materials.kinematics import Bools

_SOURCE = Path(__file__).with_name("patches.c")
_BORDER_MARGIN = 0.05  # in xi, by which facets are continued beyond a free border
_CONTINUED = 0.5  # the same of all edges where points are to stay on their facets
_FAR = 100.0  # the same where facets are planes of coordinates
_SHARP = np.cos(np.radians(40))  # of the angle between the normals of facets at a sharp edge
_ACROSS = 1e-6  # the product of unit normals of facets that stand on each other
_NEAREST = 32  # points of a surface with corners, of which one that faces a point is chosen
_MOST_FACETS = 64  # on the way from the facet at which a point begins to its partner
# edges as lines a . xi = b, with a outward: the first leads from the first corner to the second
_TRIANGLE_EDGES = ((0, -1, 0), (1, 1, 1), (-1, 0, 0))
_SQUARE_EDGES = ((0, -1, 0), (1, 0, 1), (0, 1, 1), (-1, 0, 0))
_CORNERS = {basix.CellType.triangle: (0, 1, 2), basix.CellType.quadrilateral: (0, 1, 3, 2)}


@dataclass(frozen=True)
class PatchProjection:
    """Closest points ``y`` on an opposite surface of ``m`` points ``x``, and what their
    linearisation needs.

    With ``n`` the outward normal of the opposite surface at ``y``, ``gap = (x - y) . n``: positive
    when open. A point is not ``found`` if it lies beyond a free border, or faces away. A closest
    point on an edge moves along it only, and one at a corner stands still: ``along`` takes the
    variation of ``(x - y) . tangent`` at a fixed ``xi`` to the variation of ``xi``.
    """

    facet: Index  # (m,) facet of the opposite surface
    xi: Array  # (m, 2) position on it
    point: Array  # (m, 3)
    normal: Array  # (m, 3) unit
    tangent: Array  # (m, 2, 3) d y / d xi
    bend: Array  # (m, 2, 2) n . d2y / d xi2
    shape: Array  # (m, k) shape functions of the nodes that carry y
    slope: Array  # (m, 2, k) their derivatives in xi
    along: Array  # (m, 2, 2)
    found: Bools  # (m,)
    nodes: Index  # (m, k) the nodes that carry y

    @property
    def slopes(self) -> tuple[Array, ...]:
        """The derivatives of the shape functions by each coordinate of the facet."""
        return self.slope[:, 0], self.slope[:, 1]

    @classmethod
    def empty(cls, m: int, k: int) -> PatchProjection:
        """Of ``m`` points, to be filled in."""
        return cls(
            facet=np.empty(m, dtype=np.int32),
            xi=np.empty((m, 2)),
            point=np.empty((m, 3)),
            normal=np.empty((m, 3)),
            tangent=np.empty((m, 2, 3)),
            bend=np.empty((m, 2, 2)),
            shape=np.empty((m, k)),
            slope=np.empty((m, 2, k)),
            along=np.empty((m, 2, 2)),
            found=np.empty(m, dtype=bool),
            nodes=np.empty((m, k), dtype=np.int32),
        )


class Patches:
    """``n_facets`` polynomial facets of the reference ``cell``, triangles or quadrilaterals, of
    degree 1 to 4.

    Raises ValueError if more than two facets share an edge.

    X : (nodes, 3) the nodes
    connectivity : (n_facets, k) the nodes of each facet, in the order of basix
    vertices : (n_facets, e) its vertices, in the order in which its edges follow
    corners : (n_facets, e) the same, counted on, in the order in which its edges follow
    beyond : (n_facets, e) the facet across each edge, -1 at a free border; the edge leads from the
        corner of its number to the next one
    ends : (n_facets, e) whether the surface ends at the edge: at free borders and sharp edges
    """

    def __init__(self, X: Array, connectivity: Index, cell: basix.CellType, degree: int) -> None:
        self.X = X
        self.cell = cell
        self.degree = degree
        self.connectivity = connectivity.astype(np.int32)
        self.n_facets = len(connectivity)
        self.vertices = self.connectivity[:, list(_CORNERS[cell])]
        _, corners = np.unique(self.vertices, return_inverse=True)
        self.corners = corners.reshape(self.vertices.shape).astype(np.int32)
        self.beyond = self._across_edges()
        self._element = element_of(cell, connectivity.shape[1])
        are_sharp = self._are_sharp()
        self.ends = (self.beyond < 0) | are_sharp
        self._has_corners = bool(are_sharp.any())
        self._exponents, self._coefficients = _monomials(self._element)
        edges = _TRIANGLE_EDGES if cell == basix.CellType.triangle else _SQUARE_EDGES
        self._lines = np.array(edges, dtype=float)
        in_turn = np.argsort(self.corners.ravel(), kind="stable")
        self._around = (in_turn // len(edges)).astype(np.int32)
        counts = np.bincount(self.corners.ravel())
        self._first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)

    def part(self, first: int, last: int) -> Patches:
        """The facets from ``first`` on, before ``last``, alone."""
        return Patches(self.X, self.connectivity[first:last], self.cell, self.degree)

    def _across_edges(self) -> Index:
        """The facets ``(n_facets, e)`` across the edges."""
        ends = np.stack([self.corners, np.roll(self.corners, -1, axis=1)], axis=-1)
        ends = np.sort(ends.reshape(-1, 2), axis=1)
        _, edge, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
        if count.max(initial=0) > 2:
            raise ValueError("more than two facets share an edge")
        edge = edge.ravel()
        in_turn = np.argsort(edge, kind="stable")
        is_first = np.flatnonzero(np.diff(edge[in_turn]) == 0)
        one = in_turn[is_first]
        other = in_turn[is_first + 1]
        n_edges = self.corners.shape[1]
        across = np.full(self.corners.size, -1, dtype=np.int32)
        across[one] = other // n_edges
        across[other] = one // n_edges
        return across.reshape(self.corners.shape)

    def _are_sharp(self) -> Bools:
        """Whether the edges ``(n_facets, e)`` are sharp and convex."""
        corners = self.reference_corners()
        middles = (corners + np.roll(corners, -1, axis=0)) / 2
        shape, slope = self.shapes(middles)
        nodes = self.X[self.connectivity]
        by_s, by_t = np.einsum("eca,fai->cfei", slope, nodes)
        normal = unit(np.cross(by_s, by_t))
        there = self.beyond
        facets = np.arange(self.n_facets)[:, None, None]
        same_edge = (self.beyond[there] == facets).argmax(axis=2)
        turned = (normal * normal[there, same_edge]).sum(axis=2)
        centre = self.corner_points().mean(axis=1)
        rise = ((centre[there] - shape @ nodes) * normal).sum(axis=2)
        is_sharp: Bools = (there >= 0) & (turned < _SHARP) & (rise < 0)
        return is_sharp

    def shapes(self, xi: Array) -> tuple[Array, Array]:
        """Shape functions ``(m, k)`` and their derivatives ``(m, 2, k)`` at ``xi`` ``(m, 2)``."""
        value, by_s, by_t = self._element.tabulate(1, np.ascontiguousarray(xi))[..., 0]
        return value, np.stack([by_s, by_t], axis=1)

    def corner_shapes(self, xi: Array) -> Array:
        """Linear, or bilinear, functions ``(m, e)`` of the corners in turn at ``xi`` ``(m, 2)``."""
        in_turn = list(_CORNERS[self.cell])
        element = element_of(self.cell, len(in_turn))
        values = element.tabulate(0, np.ascontiguousarray(xi))
        return values[0, :, in_turn, 0].T

    def areas(self) -> Array:
        """Area ``(n_facets,)`` of each facet."""
        xi, w = basix.make_quadrature(self.cell, 2 * self.degree)
        _, slope = self.shapes(xi)
        tangent = np.einsum("fai,qca->fqci", self.X[self.connectivity], slope)
        product = np.cross(tangent[:, :, 0], tangent[:, :, 1])
        return np.linalg.norm(product, axis=-1) @ w

    def neighbours(self, facets: Index, rings: int) -> tuple[Index, Index]:
        """Places ``(k,)`` in ``facets`` ``(m,)``, and the facets that are at most ``rings`` edges
        away from each."""
        place = np.arange(len(facets))
        near = np.asarray(facets, dtype=np.int64)
        for _ in range(rings):
            across = self.beyond[near]
            row, column = np.nonzero(across >= 0)
            place = np.concatenate([place, place[row]])
            near = np.concatenate([near, across[row, column]])
            pairs = np.unique(place * self.n_facets + near)
            place, near = np.divmod(pairs, self.n_facets)
        return place, near

    def nearest_facet(self, x: Array, displacement: Array, outward: Array | None = None) -> Index:
        """Facet ``(m,)`` of the displaced surface of whose sample points one comes nearest to each
        of ``x`` ``(m, 3)``; where the surface has sharp edges, the next one that faces the
        ``outward`` normal ``(m, 3)`` of the point."""
        from scipy.spatial import cKDTree  # a plane problem does not pay for it

        xi, _ = basix.make_quadrature(self.cell, 4)
        shape, slope = self.shapes(xi)
        nodes = (self.X + displacement)[self.connectivity]
        samples = np.einsum("qa,fai->fqi", shape, nodes).reshape(-1, 3)
        tree = cKDTree(samples)
        if outward is None or not self._has_corners:
            _, nearest = tree.query(x)
            return nearest // len(xi)
        _, near = tree.query(x, k=min(_NEAREST, len(samples)))
        by_s, by_t = np.einsum("qca,fai->cfqi", slope, nodes).reshape(2, -1, 3)
        product = np.cross(by_s, by_t)
        faces = np.einsum("mki,mi->mk", unit(product)[near], outward) < -_ACROSS
        first = faces.argmax(axis=1)
        return near[np.arange(len(x)), first] // len(xi)

    def closest_point(
        self,
        x: Array,
        outward: Array,
        displacement: Array,
        start: Index | None = None,
        faced: Index | None = None,
    ) -> PatchProjection:
        """Closest points on the surface displaced by ``displacement`` (as ``X``) of the points
        ``x`` ``(m, 3)``.

        ``outward`` ``(m, 3)`` is the outward normal of the own body at ``x``; a partner must face
        it. ``start`` holds a facet for each point near its partner (by default `nearest_facet`, a
        search without a radius). Newton's method runs on that facet, kept within it; where it ends
        on an edge or at a corner the facets that meet there follow, as long as they are nearer.
        Points that have no partner near ``start`` are searched for on the whole surface. A facet at
        a free border is a little wider for points whose ``faced`` facet it is or touches (`EVERY`
        by default, or `NONE`). Raises `ProjectionError` for a point that found none.
        """
        home = self.nearest_facet(x, displacement, outward) if start is None else start
        margin = np.where(self.beyond < 0, _BORDER_MARGIN, 0.0)
        if faced is None:
            faced = np.full(len(x), EVERY)
        partners = self._project(x, outward, displacement, home, faced, margin, _MOST_FACETS)
        lost = ~partners.found
        if start is not None and lost.any():
            elsewhere = self.closest_point(x[lost], outward[lost], displacement, faced=faced[lost])
            replace_some(partners, lost, elsewhere)
        return partners

    def continued(
        self, x: Array, outward: Array, displacement: Array, facet: Index
    ) -> PatchProjection:
        """As `closest_point`, but on the given facets, each a polynomial continued beyond its
        edges: smooth in ``x``."""
        margin = np.full(self.beyond.shape, _CONTINUED)
        every = np.full(len(x), EVERY)
        return self._project(x, outward, displacement, facet, every, margin, others=0)

    def coordinates(self, x: Array, facet: Index) -> Array:
        """Where the undeformed facets ``facet`` ``(m,)``, continued far beyond their edges, come
        closest to ``x`` ``(m, 3)``: their coordinates ``(m, 2)``."""
        margin = np.full(self.beyond.shape, _FAR)
        members = self._members(np.zeros_like(self.X), margin)
        xi = np.empty((len(x), 2))
        patches = structure(_SOURCE, "Patches", members)
        arrays = np.ascontiguousarray(x), facet.astype(np.int32, copy=False), xi
        library(_SOURCE).coordinates_on_patches(patches, len(x), *map(pointer, arrays))
        return xi

    def _members(self, displacement: Array, margin: Array) -> dict[str, int | np.ndarray]:
        """The members of the structure ``Patches`` for the kernels: the displaced facets, each
        continued by its ``margin``."""
        nodes = (self.X + displacement)[self.connectivity]
        return {
            "k": self.connectivity.shape[1],
            "n_edges": self.corners.shape[1],
            "exponents": self._exponents,
            "coefficients": self._coefficients,
            "polynomials": np.ascontiguousarray(self._coefficients.T @ nodes),
            "lines": self._lines,
            "margin": margin,
            "beyond": self.beyond,
            "ends": self.ends,
            "corners": self.corners,
            "first": self._first,
            "around": self._around,
        }

    def corner_points(self) -> Array:
        """The vertices ``(n_facets, e, 3)`` of the facets, in the order in which edges follow."""
        return self.X[self.vertices]

    def reference_corners(self) -> Array:
        """Corners ``(e, 2)`` of the reference facet, anticlockwise."""
        return basix.geometry(self.cell)[list(_CORNERS[self.cell])]

    def spheres(self) -> tuple[Array, Array, Array]:
        """Middle ``(n_facets, 3)`` of each facet, the unit normal there, and the radius
        ``(n_facets,)`` of a sphere about the middle that holds its nodes."""
        at = self.reference_corners().mean(axis=0)
        [shape], [slope] = self.shapes(at[None])
        nodes = self.X[self.connectivity]
        middle = shape @ nodes
        by_s, by_t = (slope[:, None, None] @ nodes[None])[:, :, 0]
        normal = unit(np.cross(by_s, by_t))
        distances = np.linalg.norm(nodes - middle[:, None], axis=2)
        return middle, normal, distances.max(axis=1)

    def _project(
        self,
        x: Array,
        outward: Array,
        displacement: Array,
        home: Index,
        faced: Index,
        margin: Array,
        others: int,
    ) -> PatchProjection:
        """Closest points on the facets ``home`` and at most so many ``others`` from there on, each
        continued by its ``margin``."""
        members = self._members(displacement, margin)
        patches = structure(_SOURCE, "Patches", members)
        partners = PatchProjection.empty(len(x), self.connectivity.shape[1])
        points = np.ascontiguousarray(x), np.ascontiguousarray(outward)
        near = [facets.astype(np.int32, copy=False) for facets in (home, faced)]
        results: list[np.ndarray] = list(vars(partners).values())
        on_nodes = results.pop()
        first_lost = np.zeros(1, dtype=np.int32)
        given = map(pointer, (*points, *near))
        found = map(pointer, (*results, first_lost))
        kernel = library(_SOURCE).closest_on_patches
        n_lost = kernel(patches, len(x), *given, others, *found)
        if n_lost:
            raise lost_points(n_lost, x[first_lost[0]])
        on_nodes[:] = self.connectivity[partners.facet]
        return partners


def _monomials(element: basix.finite_element.FiniteElement) -> tuple[Index, Array]:
    """Exponents ``(k, 2)`` of the monomials of a facet, and their coefficients ``(k, k)`` in its
    shape functions."""
    degree = element.degree
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1)]
    if element.cell_type == basix.CellType.triangle:
        powers = [(i, j) for i, j in powers if i + j <= degree]
    elif element.dim < len(powers):  # without a node inside
        powers = [(i, j) for i, j in powers if min(i, j) < 2]
    exponents = np.array(powers, dtype=np.int32)
    nodes = element.points
    values = np.prod(nodes[:, None] ** exponents, axis=-1)
    inverse = np.linalg.inv(values)
    return exponents, np.ascontiguousarray(inverse.T)
