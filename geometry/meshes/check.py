"""What is wrong with the bodies and surfaces of a mesh, or may be, in one sentence each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, combinations

import basix
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from archord.geometry.basis import Array
from archord.geometry.curve import circle_through
from archord.geometry.meshes.cells import (
    corners_of,
    distinct,
    entities_of,
    n_sides,
    outer_sides,
    side_kind,
    sides_among,
    sides_of,
)
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.overlap import PIECES, Inside, overlaps, polygons
from archord.geometry.meshes.quality import faults, place, poor_cells, quality
from archord.geometry.meshes.refine import cylinder_through
from archord.geometry.meshes.tagged_mesh import TaggedMesh, tags_of
from archord.materials.kinematics import Bools, Ints

_SAME = 1e-9  # of the mesh's size: distance of nodes that ought to be one
# of the clearance: sagitta from which corners of straight sides show in the pressure
_POLYGONAL = 1e-3
_ROUND_OFF = 1e-12  # of the radius: a sagitta that is none, of sides along a cylinder's axis
_COARSE = 0.05  # of the clearance: sagitta of straight sides that spoils it
_STRAIGHT = np.cos(0.5)  # of the angle up to which two facets are of one line
_NO_CELL = "look whether a cell is missing there"
_LEFT_OUT = "look whether they are missing"

Pair = Sequence[str | float]


def check_mesh(
    tagged: TaggedMesh,
    bodies: Mapping[str, str],
    pairs: Sequence[Pair] = (),
    overlap: float = 0.0,
    millimetres: bool = False,
) -> list[str]:
    """Warnings about a mesh whose ``bodies`` are the named cell sets. Collective.

    ``pairs`` are surfaces in contact, each with another one or with a rigid disc of that radius;
    one alone touches whatever its clearance. Bodies may lie in each other by the ``overlap``.
    Lengths may be known to be in ``millimetres``. Raises ValueError with the first fault on all
    ranks.
    """
    for cells in bodies.values():
        tagged.cell_tags(cells)
    surfaces = [name for pair in pairs for name in pair if isinstance(name, str)]
    for name in surfaces:
        tags_of("facet", tagged.facet_sets, name)
    mesh = gathered(tagged)
    fault = ""
    warnings = list[str]()
    if mesh is not None:
        inside = {
            body: np.isin(mesh.bodies, mesh.cell_sets[cells]) for body, cells in bodies.items()
        }
        is_plane = mesh.dimension == 2
        straight = [found for pair in pairs if len(pair) == 2 for found in _sagitta(mesh, pair)]
        found = chain(
            faults(mesh),
            _of_bodies(mesh, inside, millimetres),
            *(_of_surface(mesh, inside, name) for name in surfaces),
            (said for said, spoils in straight if spoils),
            overlaps(mesh, inside, overlap),
        )
        fault = next(found, "")
    if mesh is not None and not fault:
        warnings = poor_cells(mesh, quality(mesh)) + [said for said, _ in straight]
        for body, within in inside.items():
            warnings += cracks(mesh, body, within)
            if is_plane:
                warnings += holes(mesh, body, within)
    fault, warnings = tagged.mesh.comm.bcast((fault, warnings))
    if fault:
        raise ValueError(fault)
    return [*tagged.notes, *warnings]


def _of_bodies(mesh: MeshArrays, inside: Inside, millimetres: bool) -> Iterator[str]:
    size = np.ptp(mesh.x, axis=0).max()
    if millimetres and size < 1:
        yield f"the mesh is {size:g} mm large; is it in metres? Then give mesh.scale = 1000"
    middle = mesh.x[mesh.cells].mean(axis=1)
    of_none = ~np.logical_or.reduce(list(inside.values()))
    if of_none.any():
        at = place(middle[of_none][0])
        yield f"{of_none.sum()} cells belong to no body, the first at {at}"
    for a, b in combinations(inside, 2):
        both = np.intersect1d(mesh.cells[inside[a]], mesh.cells[inside[b]])
        if len(both):
            at = place(mesh.x[both[0]])
            yield (
                f"the bodies {a!r} and {b!r} share {len(both)} nodes, as at {at}: mesh them "
                "apart, and tie them"
            )
    for body, cells in inside.items():
        part = parts(mesh.kind, mesh.cells[cells])
        count = np.bincount(part)
        if len(count) > 1:
            at = place(middle[cells][part == count.argmin()][0])
            yield (
                f"the body {body!r} has {len(count)} unconnected parts, the smallest of "
                f"{count.min()} cells at {at}"
            )


def parts(kind: basix.CellType, cells: Ints) -> Ints:
    """The part ``(m,)`` of each of ``cells``, from 0: cells that share sides are of one part."""
    if not len(cells):
        return np.zeros(0, dtype=np.int32)
    _, side = distinct(corners_of(kind, sides_of(kind, cells)))
    cell = np.arange(len(cells)).repeat(n_sides(kind))
    at_sides = coo_matrix((np.ones(len(side)), (cell, side))).tocsr()
    return connected_components(at_sides @ at_sides.T, directed=False)[1]


def _of_surface(mesh: MeshArrays, inside: Inside, name: str) -> Iterator[str]:
    facets = mesh.facets_of(name)
    owners = [body for body, cells in inside.items() if np.isin(facets, mesh.cells[cells]).any()]
    if len(owners) > 1:
        yield (
            f"the facet set {name!r} is of the bodies {' and '.join(map(repr, owners))}; a "
            "surface is of one"
        )
    if not _outside(mesh, facets).all():
        yield (
            f"the facet set {name!r} lies inside the body {owners[0]!r}; a surface is on a boundary"
        )


def cracks(mesh: MeshArrays, body: str, cells: Bools) -> Iterator[str]:
    """A warning of nodes of a ``body`` of these ``cells`` that ought to be one."""
    sides, _ = outer_sides(mesh.kind, mesh.cells[cells])
    nodes = np.unique(corners_of(mesh.kind, sides))
    near = _SAME * np.ptp(mesh.x, axis=0).max()
    pairs = cKDTree(mesh.x[nodes]).query_pairs(near, output_type="ndarray")
    if len(pairs):
        first = nodes[pairs[0, 0]]
        at = place(mesh.x[first])
        yield (
            f"the body {body!r} has {len(pairs)} pairs of nodes at the same place, as at {at}: a "
            "crack, if not merged"
        )


def holes(mesh: MeshArrays, body: str, cells: Bools) -> Iterator[str]:
    """Warnings of holes in a ``body`` of these ``cells`` that have the sides of one cell, none in a
    facet set, and of nodes in which its boundary meets itself."""
    sides, _ = outer_sides(mesh.kind, mesh.cells[cells])
    ends = sides[:, :2]
    nodes, number = np.unique(ends, return_inverse=True)
    number = number.reshape(-1, 2)
    joined = coo_matrix((np.ones(len(ends)), number.T), shape=(len(nodes), len(nodes)))
    _, loop_of_node = connected_components(joined, directed=False)
    loop = loop_of_node[number[:, 0]]
    farthest = mesh.x[ends, 0].max(axis=1).argmax()
    outermost = loop[farthest]
    named = sides_among(mesh.kind, sides, mesh.facets)
    small = np.bincount(loop) == n_sides(mesh.kind)
    small &= np.bincount(loop, weights=named) == 0
    small[outermost] = False
    if small.any():
        around_first = ends[loop == small.argmax()]
        at = place(mesh.x[around_first].mean(axis=(0, 1)))
        found = f"{small.sum()} holes of the size of one cell, as at {at}"
        yield f"the body {body!r} has {found}: {_NO_CELL}"
    pinched = nodes[np.bincount(number.ravel()) > 2]
    if len(pinched):
        at = place(mesh.x[pinched[0]])
        yield (
            f"the boundary of the body {body!r} meets itself in {len(pinched)} nodes, as at {at}: "
            f"{_NO_CELL}"
        )


def facets_within(mesh: MeshArrays, name: str) -> Iterator[str]:
    """A warning of a facet set with a part inside the bodies and the rest on their boundary."""
    facets = mesh.facets_of(name)
    within = ~_outside(mesh, facets)
    if within.any() and not within.all():
        first, *_ = corners_of(mesh.kind, facets[within])
        at = place(mesh.x[first].mean(axis=0))
        yield (
            f"the facet set {name!r} has {within.sum()} of its {len(facets)} facets inside a body, "
            f"as at {at}"
        )


def gaps(mesh: MeshArrays, name: str) -> Iterator[str]:
    """A warning of single facets on the boundary that no set has, though the facets at both of
    their ends are of sets, one of them of ``name`` and in line with them."""
    if mesh.dimension != 2:
        return
    outer, _ = outer_sides(mesh.kind, mesh.cells)
    has_set = sides_among(mesh.kind, outer, mesh.facets)
    of_none = outer[~has_set, :2]
    meets_sets = np.isin(of_none, mesh.facets[:, :2])
    between = of_none[meets_sets.all(axis=1)]
    direction = {
        int(node): mesh.x[end] - mesh.x[start]
        for start, end in mesh.facets_of(name)[:, :2]
        for node in (start, end)
    }
    missing = [edge for edge in between if _goes_on(mesh, edge, direction)]
    if missing:
        at = place(mesh.x[missing[0]].mean(axis=0))
        yield (
            f"the facet set {name!r} leaves out {len(missing)} single facets that no set has, as "
            f"at {at}: {_LEFT_OUT}"
        )


def _goes_on(mesh: MeshArrays, edge: Ints, direction: Mapping[int, Array]) -> bool:
    """Whether an ``edge`` meets facets, which have a ``direction`` at their ends, and turns little
    there."""
    own = mesh.x[edge[1]] - mesh.x[edge[0]]
    others = [direction[int(node)] for node in edge if int(node) in direction]
    cosines = [abs(o @ own) / np.linalg.norm(o) / np.linalg.norm(own) for o in others]
    return max(cosines, default=0.0) > _STRAIGHT


def _outside(mesh: MeshArrays, facets: Ints) -> Bools:
    """Whether each of the ``facets`` ``(k, b)`` is on the boundary of the mesh."""
    outer, _ = outer_sides(mesh.kind, mesh.cells)
    return sides_among(mesh.kind, facets, outer)


def _sagitta(mesh: MeshArrays, pair: Pair) -> Iterator[tuple[str, bool]]:
    """What is wrong where a round surface beside another, or beside a disc of that radius, has
    straight sides, and whether this spoils their clearance.

    It is judged by the part of the clearance that the sagitta h^2/(8 R) of a side exceeds.
    """
    radii = []
    deepest = 0.0
    names = [name for name in pair if isinstance(name, str)]
    for name in names:
        radius, polygons = _arcs(mesh, mesh.facets_of(name))
        if not radius:
            return
        radii.append(radius)
        start, middle, end = np.swapaxes(polygons[:, :: PIECES // 2], 0, 1)
        squared_chord = ((end - start) ** 2).sum(axis=1)
        sagitta = squared_chord / (8 * radius)
        bulge = np.linalg.norm(middle - (start + end) / 2, axis=1)
        is_straight = bulge < sagitta / 2
        deepest = max(deepest, sagitta[is_straight].max(initial=0.0))
    radii += [radius for radius in pair if not isinstance(radius, str)]
    if deepest < _ROUND_OFF * radii[0]:
        return
    clearance = abs(radii[0] - radii[1])
    arcs = (
        f"the arcs {' and '.join(map(repr, names))} have straight sides with a sagitta of "
        f"{deepest:.2g}"
    )
    remedy = "give order = 2 in [mesh] and a [[mesh.circle]] for each, or a mesh that is curved"
    if deepest > _COARSE * clearance:
        yield f"{arcs}, too much for their clearance of {clearance:.2g}; {remedy}", True
    elif deepest > _POLYGONAL * clearance:
        corners = "their corners make the largest pressure too high, by a fifth and more"
        yield f"{arcs}: {corners}; {remedy}", False


def _arcs(mesh: MeshArrays, facets: Ints) -> tuple[float, Array]:
    """The radius of the circle or cylinder that ``facets`` lie on, 0 for none, and points ``(k,
    pieces + 1, d)`` on their edges, in space less what runs along the axis."""
    if mesh.dimension == 2:
        circle = circle_through(mesh.x[np.unique(facets[:, :2])])
        return circle[1] if circle else 0.0, polygons(mesh, facets)
    cylinder = cylinder_through(mesh.x, facets)
    if cylinder is None:
        return 0.0, np.zeros((0, PIECES + 1, 3))
    points = polygons(mesh, entities_of(side_kind(mesh.kind), facets, 1))
    at = points.reshape(-1, 3)
    return cylinder.radius, (at - cylinder.foot(at)).reshape(points.shape)
