"""What is wrong with a mesh, or may be, in one sentence each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, compress, permutations

import numpy as np
from scipy.linalg import null_space
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from archord.geometry.basis import Array, bulk_quadrature, cell_kind, tabulate
from archord.geometry.curve import Curve, circle_through
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.jacobian import smallest_determinants
from archord.geometry.meshes.plane_mesh import PlaneMesh, distinct_edges, outer_sides, sides_of
from archord.geometry.meshes.tagged_mesh import TaggedMesh, tags_of

_FLAT = 1e-9  # smallest over largest jacobian of a cell that has collapsed
# smallest over largest jacobian of a cell that is told of; refused are those below -0.02, as the
_DISTORTED = 0.02
# corner of a curved cell with two sides on one arc, which is flat, comes out a little below zero
_THIN = 0.005  # area over the square of the longest side, below which a cell is told of
_SAME = 1e-9  # of the mesh's size: distance of nodes that ought to be one
_INTO = (
    0.02,
    1e-3,
)  # of a side: how deep bodies may overlap by their sides being straight, or curved
_PIECES = 8  # of a side, as a polygon
_AT_ONCE = 2_000_000  # pairs of points and pieces
_POLYGONAL = (
    1e-3  # of the clearance: sagitta from which corners of straight sides show in the pressure
)
_COARSE = 0.05  # of the clearance: sagitta of straight sides that spoils it
_STRAIGHT = np.cos(0.5)  # of the angle up to which two facets are of one line
_NO_CELL = "look whether a cell is missing there"
_LEFT_OUT = "look whether they are missing"
_MOTIONS = ("x", "y", "rotation")
_HELD = 1e-8  # singular value over the largest one, below which a motion is free


def _at(x: Array) -> str:
    return f"({x[0]:g}, {x[1]:g})"


def _in(mesh: PlaneMesh, cell: int) -> str:
    """The place of a ``cell`` and the sets that have it."""
    names = [repr(name) for name, tags in mesh.cell_sets.items() if mesh.bodies[cell] in tags]
    place = _at(mesh.x[mesh.cells[cell]].mean(axis=0))
    return f"{place} in {' and '.join(names)}" if names else place


def faults(mesh: PlaneMesh) -> list[str]:
    """Why nothing can be computed on ``mesh``: cells that are folded, collapsed, there twice, or
    three at an edge."""
    said = _unsound(mesh)
    _, first, count = np.unique(
        np.sort(mesh.cells, axis=1), axis=0, return_index=True, return_counts=True
    )
    if (count > 1).any():
        said.append(
            f"{(count > 1).sum()} cells are there twice, the first at {_in(mesh, first[count > 1][0])}"
        )
    sides = sides_of(mesh.cells)
    first, which = distinct_edges(sides[:, :2])
    crowded = first[np.bincount(which) > 2]
    if len(crowded):
        at = _at(mesh.x[sides[crowded[0]]].mean(axis=0))
        said.append(
            f"{len(crowded)} edges belong to more than two cells, the first at {at}: cells overlap"
        )
    unlike = (np.sort(sides, axis=1) != np.sort(sides[first][which], axis=1)).any(axis=1)
    within = mesh.cells.size - sides[:, 1:].size  # nodes inside cells
    if unlike.any() or len(np.unique(sides[:, :2])) + sides[first, 2:].size + within != len(
        np.unique(mesh.cells)
    ):
        at = f", as at {_at(mesh.x[sides[unlike][0, 0]])}" if unlike.any() else ""
        said.append(f"cells do not have all nodes of their common sides in common{at}")
    return said


def _jacobians(mesh: PlaneMesh) -> tuple[Array, Array]:
    """At ``q`` points of each cell ``(n, q, 2, 2)``, and the points' weights."""
    kind, order = cell_kind(mesh.cells.shape[1])
    X, w = bulk_quadrature(kind, order + 1)
    return np.einsum("jqa,nai->nqij", tabulate(kind, order, X)[1:], mesh.x[mesh.cells]), w


def _unsound(mesh: PlaneMesh) -> list[str]:
    """Why the map of a cell cannot be inverted everywhere, corners and middles of sides
    included."""
    ordered = np.sort(mesh.cells, axis=1)
    repeating = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if len(repeating):
        at, kind = _in(mesh, repeating[0]), cell_kind(mesh.cells.shape[1])[0].name
        return [
            f"{len(repeating)} cells have a node twice, the first at {at}: a {kind} must not be collapsed; "
            "mesh such bodies with triangles alone, or with quadrilaterals of four different corners"
        ]
    smallest, largest = smallest_determinants(mesh)
    size = np.ptp(mesh.x[mesh.cells], axis=1).max(axis=1) ** 2
    flat = largest <= _FLAT * size
    curved = cell_kind(mesh.cells.shape[1])[1] > 1
    lowest = -_DISTORTED * largest if curved else np.zeros(len(largest))
    folded = (smallest < lowest) | _turned_at_points(mesh)
    bad = np.flatnonzero(flat | folded)
    if not len(bad):
        return []
    worst = bad[np.argmin((smallest / size)[bad])]
    how = "it has no area"
    if not flat[worst]:
        how = f"{_falls(smallest, largest, worst)}; move the nodes on its sides"
    return [f"{len(bad)} cells are folded or have no area, the worst at {_in(mesh, worst)}: {how}"]


def _turned_at_points(mesh: PlaneMesh) -> np.ndarray:
    """Whether the determinants of a cell ``(n,)`` do not have one sign at its integration
    points."""
    J, _ = _jacobians(mesh)
    det = np.linalg.det(J)
    none = _FLAT * (J**2).sum(axis=(2, 3)).max(axis=1)
    return (det.min(axis=1) <= none) & (det.max(axis=1) >= -none)


def _falls(smallest: Array, largest: Array, cell: int) -> str:
    return f"its Jacobian determinant falls to {smallest[cell] / largest[cell]:.2g} of its largest value"


def distorted(mesh: PlaneMesh) -> list[str]:
    """A warning of cells whose map is nearly singular somewhere: stresses there are worthless."""
    smallest, largest = smallest_determinants(mesh)
    bad = np.flatnonzero(smallest < _DISTORTED * largest)
    if not len(bad):
        return []
    worst = bad[np.argmin((smallest / largest)[bad])]
    return [
        f"{len(bad)} cells are distorted, the worst at {_in(mesh, worst)}: "
        f"{_falls(smallest, largest, worst)}, so stresses there are not to be trusted"
    ]


def thin(mesh: PlaneMesh) -> list[str]:
    """A warning of cells that are far longer than wide, as with one node that lies far off."""
    sides = sides_of(mesh.cells)[:, :2].reshape(len(mesh.cells), -1, 2)
    lengths = np.linalg.norm(mesh.x[sides[:, :, 1]] - mesh.x[sides[:, :, 0]], axis=2)
    roundness = areas(mesh) / lengths.max(axis=1) ** 2
    bad = np.flatnonzero(roundness < _THIN)
    if not len(bad):
        return []
    worst = bad[np.argmin(roundness[bad])]
    ratio = 1 / roundness[worst]
    return [
        f"{len(bad)} cells are far longer than wide, the worst at {_in(mesh, worst)} by about {ratio:.2g}: look "
        "whether their nodes are where they belong"
    ]


def areas(mesh: PlaneMesh) -> Array:
    """Area ``(n,)`` of each cell."""
    J, w = _jacobians(mesh)
    return np.abs(np.linalg.det(J)) @ w


def check_mesh(
    tagged: TaggedMesh,
    bodies: Mapping[str, str],
    pairs: Sequence[Sequence[str | float]] = (),
    overlap: float = 0.0,
    millimetres: bool = False,
) -> list[str]:
    """Warnings about a mesh whose ``bodies`` are the named cell sets, with ``pairs`` of surfaces in
    contact, each with another one or with a rigid disc of that radius; one alone touches whatever
    its clearance. Collective.

    Bodies may lie in each other by the ``overlap``; lengths may be known to be in ``millimetres``.
    Raises ValueError with the first fault on all ranks.
    """
    for cells in bodies.values():
        tagged.cell_tags(cells)
    surfaces = [name for pair in pairs for name in pair if isinstance(name, str)]
    for name in surfaces:
        tags_of("facet", tagged.facet_sets, name)
    mesh, found, warnings = gathered(tagged), "", list[str]()
    if mesh is not None:
        inside = {
            body: np.isin(mesh.bodies, mesh.cell_sets[cells]) for body, cells in bodies.items()
        }
        checks = [iter(faults(mesh)), _of_bodies(mesh, inside, millimetres)]
        checks += [_of_surface(mesh, inside, name) for name in surfaces]
        straight = {_COARSE: list[str](), _POLYGONAL: list[str]()}
        for pair in pairs:
            if len(pair) == 2:
                _sagitta(mesh, pair, straight)
        checks += [iter(straight[_COARSE]), _overlaps(mesh, inside, overlap)]
        found = next((said for check in checks for said in check), "")
        warnings = distorted(mesh) + thin(mesh) + straight[_POLYGONAL]
        for body, within in inside.items():
            warnings += [*cracks(mesh, body, within), *holes(mesh, body, within)]
    found, warnings = tagged.mesh.comm.bcast((found, warnings))
    if found:
        raise ValueError(found)
    return [*tagged.notes, *warnings]


def _of_bodies(
    mesh: PlaneMesh, inside: Mapping[str, np.ndarray], millimetres: bool
) -> Iterator[str]:
    size, middle = np.ptp(mesh.x, axis=0).max(), mesh.x[mesh.cells].mean(axis=1)
    if millimetres and size < 1:
        yield f"the mesh is {size:g} mm large; is it in metres? Then give mesh.scale = 1000"
    of_none = ~np.logical_or.reduce(list(inside.values()))
    if of_none.any():
        yield f"{of_none.sum()} cells belong to no body, the first at {_at(middle[of_none][0])}"
    for a, b in combinations(inside, 2):
        if len(both := np.intersect1d(mesh.cells[inside[a]], mesh.cells[inside[b]])):
            at = _at(mesh.x[both[0]])
            yield f"the bodies {a!r} and {b!r} share {len(both)} nodes, as at {at}: mesh them apart, and tie them"
    for body, cells in inside.items():
        part = parts(mesh.cells[cells])
        count = np.bincount(part)
        if len(count) > 1:
            at = _at(middle[cells][part == count.argmin()][0])
            yield f"the body {body!r} has {len(count)} unconnected parts, the smallest of {count.min()} cells at {at}"


def parts(cells: np.ndarray) -> np.ndarray:
    """The part ``(m,)`` of each of ``cells``, from 0: cells that share sides are of one."""
    if not len(cells):
        return np.zeros(0, dtype=np.int32)
    _, which = distinct_edges(sides_of(cells)[:, :2])
    cell = np.arange(len(which)) // (len(which) // len(cells))
    at_sides = coo_matrix((np.ones(len(which)), (cell, which))).tocsr()
    return connected_components(at_sides @ at_sides.T, directed=False)[1]


def _of_surface(mesh: PlaneMesh, inside: Mapping[str, np.ndarray], name: str) -> Iterator[str]:
    edges = mesh.edges[np.isin(mesh.tags, mesh.facet_sets[name])]
    owners = [body for body, cells in inside.items() if np.isin(edges, mesh.cells[cells]).any()]
    if len(owners) > 1:
        yield f"the facet set {name!r} is of the bodies {' and '.join(map(repr, owners))}; a surface is of one"
    if not _outside(mesh, edges).all():
        yield f"the facet set {name!r} lies inside the body {owners[0]!r}; a surface is on a boundary"


def _polygons(mesh: PlaneMesh, edges: np.ndarray) -> Array:
    """Points ``(k, pieces + 1, 2)`` on ``edges`` ``(k, b)``."""
    order = edges.shape[1] - 1
    shape, _ = Curve(np.zeros((order + 1, 2)), order).shapes(np.linspace(0, 1, _PIECES + 1))
    return np.einsum("qa,kai->kqi", shape, mesh.x[edges[:, [0, *range(2, order + 1), 1]]])


def _overlaps(mesh: PlaneMesh, inside: Mapping[str, np.ndarray], allowed: float) -> Iterator[str]:
    """Boundary vertices of a body, or middles of its cells there, that lie in another by more than
    is ``allowed``."""
    outer = {body: outer_sides(mesh.cells[cells]) for body, cells in inside.items()}
    for (a, (sides, behind)), (b, (around, _)) in permutations(outer.items(), 2):
        x = np.concatenate(
            [mesh.x[sides[:, 0]], mesh.x[mesh.cells[inside[a]][behind]].mean(axis=1)]
        )
        polygon = _polygons(mesh, around)
        start, end = polygon[:, :-1].reshape(-1, 2), polygon[:, 1:].reshape(-1, 2)
        along = end - start
        x = x[((x > start.min(axis=0)) & (x < start.max(axis=0))).all(axis=1)]
        length = np.linalg.norm(along, axis=1)
        spare = allowed + _INTO[mesh.edges.shape[1] > 2] * _PIECES * length
        for part in np.array_split(x, 1 + len(x) * len(start) // _AT_ONCE):
            to = part[:, None] - start
            above = (
                part[:, None, 1] < np.stack([start[:, 1], end[:, 1]])[:, None]
            )  # exact where edges meet
            crosses = above[0] != above[1]  # of a ray to the right: an odd number from within
            crosses &= (to[..., 0] * along[:, 1] < to[..., 1] * along[:, 0]) == (along[:, 1] > 0)
            within = crosses.sum(axis=1) % 2 == 1
            part, to = part[within], to[within]
            xi = np.clip((to * along).sum(axis=2) / length**2, 0, 1)
            away = np.linalg.norm(to - xi[..., None] * along, axis=2)
            depth = np.where(away.min(axis=1) > spare[away.argmin(axis=1)], away.min(axis=1), 0.0)
            if depth.any():
                deep, at = f"{depth.max():.3g}", _at(part[depth.argmax()])
                cure = f"draw them apart, or, if they are pressed together, give their interaction overlap = {deep}"
                yield f"the body {a!r} lies {deep} deep in the body {b!r} at {at}: {cure}"
                break


def cracks(mesh: PlaneMesh, body: str, cells: np.ndarray) -> Iterator[str]:
    """A warning of nodes of a ``body`` of these ``cells`` that ought to be one."""
    nodes = np.unique(outer_sides(mesh.cells[cells])[0][:, :2])
    pairs = cKDTree(mesh.x[nodes]).query_pairs(
        _SAME * np.ptp(mesh.x, axis=0).max(), output_type="ndarray"
    )
    if len(pairs):
        at = _at(mesh.x[nodes[pairs[0, 0]]])
        yield f"the body {body!r} has {len(pairs)} pairs of nodes at the same place, as at {at}: a crack, if not merged"


def holes(mesh: PlaneMesh, body: str, cells: np.ndarray) -> Iterator[str]:
    """Warnings of holes in a ``body`` of these ``cells`` that have the sides of one cell, none in a
    facet set, and of nodes in which its boundary meets itself."""
    ends = outer_sides(mesh.cells[cells])[0][:, :2]
    nodes, place = np.unique(ends, return_inverse=True)
    place = place.reshape(-1, 2)
    joined = coo_matrix((np.ones(len(ends)), place.T), shape=(len(nodes), len(nodes)))
    loop = connected_components(joined, directed=False)[1][place[:, 0]]
    outermost = loop[np.argmax(mesh.x[ends, 0].max(axis=1))]
    corners = sides_of(mesh.cells[:1]).shape[0]
    _, which = distinct_edges(np.concatenate([ends, mesh.edges[:, :2]]))
    named = np.isin(which[: len(ends)], which[len(ends) :])
    small = (np.bincount(loop) == corners) & (np.bincount(loop, weights=named) == 0)
    small[outermost] = False
    if small.any():
        at = _at(mesh.x[ends[loop == np.flatnonzero(small)[0]]].mean(axis=(0, 1)))
        found = f"{small.sum()} holes of the size of one cell, as at {at}"
        yield f"the body {body!r} has {found}: {_NO_CELL}"
    pinched = nodes[np.bincount(place.ravel()) > 2]
    if len(pinched):
        at = _at(mesh.x[pinched[0]])
        yield f"the boundary of the body {body!r} meets itself in {len(pinched)} nodes, as at {at}: {_NO_CELL}"


def facets_within(mesh: PlaneMesh, name: str) -> Iterator[str]:
    """What is said of a facet set of which a part is inside the bodies, where the rest is on their
    boundary."""
    edges = mesh.edges[np.isin(mesh.tags, mesh.facet_sets.get(name, ()))]
    within = ~_outside(mesh, edges)
    if within.any() and not within.all():
        at = _at(mesh.x[edges[within][0, :2]].mean(axis=0))
        yield f"the facet set {name!r} has {within.sum()} of its {len(edges)} facets inside a body, as at {at}"


def gaps(mesh: PlaneMesh, name: str) -> Iterator[str]:
    """A warning of single facets on the boundary that no set has, though those at both of their
    ends are of sets, one of them of ``name`` and in line with them."""
    outer = outer_sides(mesh.cells)[0][:, :2]
    _, which = distinct_edges(np.concatenate([mesh.edges[:, :2], outer]))
    of_none = outer[~np.isin(which[len(mesh.edges) :], which[: len(mesh.edges)])]
    between = of_none[np.isin(of_none, mesh.edges[:, :2]).all(axis=1)]
    inside = np.isin(mesh.tags, mesh.facet_sets.get(name, ()))
    along = {int(node): mesh.x[b] - mesh.x[a] for a, b in mesh.edges[inside, :2] for node in (a, b)}
    missing = [edge for edge in between if _goes_on(mesh, edge, along)]
    if missing:
        at = _at(mesh.x[missing[0]].mean(axis=0))
        yield f"the facet set {name!r} leaves out {len(missing)} single facets that no set has, as at {at}: {_LEFT_OUT}"


def _goes_on(mesh: PlaneMesh, edge: np.ndarray, along: Mapping[int, Array]) -> bool:
    """Whether an ``edge`` meets facets, which have directions ``along`` them, and turns little
    there."""
    direction = mesh.x[edge[1]] - mesh.x[edge[0]]
    others = [along[int(node)] for node in edge if int(node) in along]
    cosines = [abs(o @ direction) / np.linalg.norm(o) / np.linalg.norm(direction) for o in others]
    return max(cosines, default=0.0) > _STRAIGHT


def _outside(mesh: PlaneMesh, edges: np.ndarray) -> np.ndarray:
    """Whether each of the ``edges`` ``(k, b)`` is on the boundary of the mesh."""
    outer, _ = outer_sides(mesh.cells)
    _, which = distinct_edges(np.concatenate([outer, edges])[:, :2])
    return np.isin(which[len(outer) :], which[: len(outer)])


def _sagitta(mesh: PlaneMesh, pair: Sequence[str | float], said: dict[float, list[str]]) -> None:
    """Add to what is ``said`` if a round surface beside another, or beside a disc of that radius,
    has straight sides, by the part of the clearance that their sagitta h^2/(8 R) exceeds:
    `_COARSE`, which spoils the clearance, or `_POLYGONAL`."""
    radii, deepest, names = [], 0.0, [name for name in pair if isinstance(name, str)]
    for name in names:
        edges = mesh.edges[np.isin(mesh.tags, mesh.facet_sets[name])]
        if (circle := circle_through(mesh.x[np.unique(edges[:, :2])])) is None:
            return
        radii.append(circle[1])
        start, middle, end = np.swapaxes(_polygons(mesh, edges)[:, :: _PIECES // 2], 0, 1)
        sagitta = ((end - start) ** 2).sum(axis=1) / (8 * circle[1])
        bulge = np.linalg.norm(middle - (start + end) / 2, axis=1)
        deepest = max(deepest, sagitta[bulge < sagitta / 2].max(initial=0.0))
    first, second = [*radii, *(radius for radius in pair if not isinstance(radius, str))]
    clearance = abs(first - second)
    arcs = f"the arcs {' and '.join(map(repr, names))} have straight sides with a sagitta of {deepest:.2g}"
    remedy = "give order = 2 in [mesh] and a [[mesh.circle]] for each, or a mesh that is curved"
    if deepest > _COARSE * clearance:
        said[_COARSE].append(f"{arcs}, too much for their clearance of {clearance:.2g}; {remedy}")
    elif deepest > _POLYGONAL * clearance:
        corners = "their corners make the largest pressure too high, by a fifth and more"
        said[_POLYGONAL].append(f"{arcs}: {corners}; {remedy}")


def free_motions(
    held: Mapping[str, Sequence[tuple[Array, Array]]],
    links: Sequence[tuple[str, str, Array, Array]] = (),
) -> dict[str, list[str]]:
    """Which of "x", "y" and "rotation" nothing holds, by body.

    Each body is ``held`` at points ``(k, 2)`` in directions ``(k, 2)``. Two bodies hold each other
    likewise by ``links``: contact without friction along its normals, ties in both directions.
    """
    names, parts = list(held), [np.zeros((1, len(held), 3))]
    everything = [(a, a, x, n) for a, found in held.items() for x, n in found] + list(links)
    size = max((np.ptp(x, axis=0).max() for _, _, x, _ in everything), default=1.0) or 1.0
    centre = {
        name: next((x[0] for a, b, x, _ in everything if name in (a, b)), 0.0) for name in names
    }
    for a, b, x, n in everything:
        row = np.zeros((len(x), len(names), 3))
        for body, sign in {b: -1, a: 1}.items():
            X, Y = (x - centre[body]).T / size
            row[:, names.index(body)] = sign * np.column_stack([n, X * n[:, 1] - Y * n[:, 0]])
        parts.append(row)
    rows, moves = np.concatenate(parts), np.zeros((len(names), 3), dtype=bool)
    for kept in (3, 2):  # with rotations, of which others are a part, and without
        modes = null_space(
            np.linalg.qr(rows[:, :, :kept].reshape(len(rows), -1), mode="r"), rcond=_HELD
        )
        moves[:, :kept] = (np.abs(modes) > _HELD).any(axis=1).reshape(-1, kept)
    return {name: list(compress(_MOTIONS, moved)) for name, moved in zip(names, moves, strict=True)}
