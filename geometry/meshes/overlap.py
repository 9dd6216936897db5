"""Bodies of a mesh that lie in each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import permutations
from typing import NamedTuple

import numpy as np

from archord.geometry.basis import TRIANGLE, Array
from archord.geometry.curve import Curve
from archord.geometry.meshes.cells import along, outer_sides, side_kind
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.quality import place
from archord.geometry.patches import Patches
from archord.materials.kinematics import Bools, Ints

# of a side: how deep bodies may overlap by their sides being straight, or curved
_INTO_STRAIGHT = 0.02
_INTO_CURVED = 1e-3
PIECES = 8  # of a side, as a polygon
_AT_ONCE = 2_000_000  # pairs of points and pieces
_BESIDE = 1e-6  # of a reference side: how far beyond it the foot of a point counts

Inside = Mapping[str, np.ndarray]  # which cells ``(n,)`` are in each body


def polygons(mesh: MeshArrays, edges: Ints) -> Array:
    """Points ``(k, pieces + 1, d)`` on ``edges`` ``(k, b)``."""
    order = edges.shape[1] - 1
    places = np.linspace(0, 1, PIECES + 1)
    edge = Curve(np.zeros((order + 1, 2)), order)
    shape, _ = edge.shapes(places)
    return np.einsum("qa,kai->kqi", shape, mesh.x[along(edges)])


class _Outline(NamedTuple):
    """The boundary of a body of curved sides.

    - ``points`` ``(2 k, 2)``: the first corners of the sides, and the middles of the cells there
    - ``start``, ``end`` ``(s, 2)``: the straight pieces that the sides are cut into
    """

    points: Array
    start: Array
    end: Array

    @classmethod
    def of(cls, mesh: MeshArrays, cells: Ints) -> _Outline:
        sides, behind = outer_sides(mesh.kind, cells)
        middles = mesh.x[cells[behind]].mean(axis=1)
        polygon = polygons(mesh, sides)
        start = polygon[:, :-1].reshape(-1, 2)
        end = polygon[:, 1:].reshape(-1, 2)
        corners = mesh.x[sides[:, 0]]
        return cls(np.concatenate([corners, middles]), start, end)

    def contains(self, x: Array) -> Bools:
        """Whether points ``(k, 2)`` lie within: a ray to the right crosses an odd number of
        pieces."""
        to = x[:, None] - self.start
        piece_x, piece_y = (self.end - self.start).T
        # one and the same comparison for both ends, so that it is exact where pieces meet
        height = x[:, None, 1]
        below_start = height < self.start[:, 1]
        below_end = height < self.end[:, 1]
        left = to[..., 0] * piece_y < to[..., 1] * piece_x
        is_right = left == (piece_y > 0)
        crosses = (below_start != below_end) & is_right
        return crosses.sum(axis=1) % 2 == 1

    @property
    def extent(self) -> Array:
        """Smallest and largest coordinates ``(2, 2)``."""
        return np.stack([self.start.min(axis=0), self.start.max(axis=0)])

    def depth(self, x: Array, allowed: float, into: float) -> Array:
        """How deep points ``(k, 2)`` lie within, 0 outside and where it is no more than
        ``allowed``, and the part ``into`` of the side next to them."""
        lengths = np.linalg.norm(self.end - self.start, axis=1)
        spare = allowed + into * PIECES * lengths
        n_parts = 1 + len(x) * len(spare) // _AT_ONCE
        parts = np.array_split(x, n_parts)
        return np.concatenate([self._depth(few, spare) * self.contains(few) for few in parts])

    def _depth(self, x: Array, spare: Array) -> Array:
        """Distance ``(k,)`` of points ``(k, 2)`` from the nearest piece, 0 where it is within what
        that piece has to ``spare`` ``(s,)``."""
        to = x[:, None] - self.start
        piece = self.end - self.start
        along = (to * piece).sum(axis=2) / (piece**2).sum(axis=1)
        xi = np.clip(along, 0, 1)
        away = np.linalg.norm(to - xi[..., None] * piece, axis=2)
        nearest = away.argmin(axis=1)
        depth = away.min(axis=1)
        return np.where(depth > spare[nearest], depth, 0.0)


class _Hull(NamedTuple):
    """The boundary of a body in space.

    - ``points`` ``(2 k, 3)``: the first corners of the sides, and the middles of the cells there
    - ``sides``: the sides of its cells, curved
    - ``outward`` ``(k,)``: 1 where the normal of a side points out of the body, else -1
    """

    points: Array
    sides: Patches
    outward: Array

    @classmethod
    def of(cls, mesh: MeshArrays, cells: Ints) -> _Hull:
        sides, behind = outer_sides(mesh.kind, cells)
        middles = mesh.x[cells[behind]].mean(axis=1)
        patches = Patches(mesh.x, sides, side_kind(mesh.kind), mesh.order)
        at, normal, _ = patches.spheres()
        along_normal = ((at - middles) * normal).sum(axis=1)
        outward = np.sign(along_normal)
        corners = mesh.x[sides[:, 0]]
        return cls(np.concatenate([corners, middles]), patches, outward)

    @property
    def extent(self) -> Array:
        """Smallest and largest coordinates ``(2, 3)``."""
        x = self.sides.X[self.sides.connectivity]
        return np.stack([x.min(axis=(0, 1)), x.max(axis=(0, 1))])

    def depth(self, x: Array, allowed: float, into: float) -> Array:
        """How deep points ``(k, 3)`` lie within, as of an `_Outline`.

        A point lies behind the side next to it if its foot is on that side. Few other points are
        left out.
        """
        sides = self.sides
        nearest = sides.nearest_facet(x, np.zeros_like(sides.X))
        xi = sides.coordinates(x, nearest)
        nodes = sides.X[sides.connectivity[nearest]]
        shape, slope = sides.shapes(xi)
        behind = np.einsum("mk,mki->mi", shape, nodes) - x
        normal = np.cross(*np.einsum("mak,mki->ami", slope, nodes))
        inward = (behind * normal).sum(axis=1) * self.outward[nearest] > 0
        depth = np.linalg.norm(behind, axis=1)
        _, _, radius = sides.spheres()
        spare = allowed + into * 2 * radius[nearest]
        low = -_BESIDE
        on_side = (xi > low).all(axis=1) & (xi < 1 - low).all(axis=1)
        if sides.cell == TRIANGLE:
            on_side &= xi.sum(axis=1) < 1 - low
        return np.where(inward & on_side & (depth > spare), depth, 0.0)


def depths(
    mesh: MeshArrays, inside: Inside, allowed: float
) -> Iterator[tuple[str, str, float, Array]]:
    """How deep a body lies in another one at most, and where: of their boundary vertices and the
    middles of cells there, deeper than is ``allowed``."""
    into = _INTO_CURVED if mesh.order > 1 else _INTO_STRAIGHT
    outline = _Outline if mesh.dimension == 2 else _Hull
    outlines = {}
    for body, cells in inside.items():
        with suppress(ValueError):  # of a body in space whose boundary meets itself along an edge
            outlines[body] = outline.of(mesh, mesh.cells[cells])
    for (a, inner), (b, outer) in permutations(outlines.items(), 2):
        lowest, highest = outer.extent
        near = (inner.points > lowest) & (inner.points < highest)
        x = inner.points[near.all(axis=1)]
        depth = outer.depth(x, allowed, into) if len(x) else np.zeros(0)
        if depth.any():
            yield a, b, float(depth.max()), x[depth.argmax()]


def overlaps(mesh: MeshArrays, inside: Inside, allowed: float) -> Iterator[str]:
    """Boundary vertices of a body, or middles of its cells there, that lie in another by more than
    is ``allowed``."""
    for a, b, depth, at in depths(mesh, inside, allowed):
        deep = f"{depth:.3g}"
        cure = (
            "draw them apart, or, if they are pressed together, give their interaction "
            f"overlap = {deep}"
        )
        yield f"the body {a!r} lies {deep} deep in the body {b!r} at {place(at)}: {cure}"
