"""What is wrong with the cells of a mesh, or may be, in one sentence each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from archord.geometry.basis import Array, bulk_quadrature, tabulate
from archord.geometry.meshes.cells import distinct_edges, n_corners, sides_of
from archord.geometry.meshes.jacobian import smallest_determinants
from archord.geometry.meshes.plane_mesh import PlaneMesh

_FLAT = 1e-9  # smallest over largest jacobian of a cell that has collapsed
# Smallest over largest jacobian below which a cell is told of. Cells below -0.02 are refused: the
# corner of a curved cell with two sides on one arc is flat, and comes out a little below zero.
_DISTORTED = 0.02
_THIN = 0.005  # area over the square of the longest side, below which a cell is told of


def place(x: Array) -> str:
    """A point as text."""
    return f"({x[0]:g}, {x[1]:g})"


def _place_of(mesh: PlaneMesh, cell: int) -> str:
    """The middle of a ``cell`` and the sets that have it."""
    names = [repr(name) for name, tags in mesh.cell_sets.items() if mesh.bodies[cell] in tags]
    middle = place(mesh.x[mesh.cells[cell]].mean(axis=0))
    return f"{middle} in {' and '.join(names)}" if names else middle


def faults(mesh: PlaneMesh) -> list[str]:
    """Why nothing can be computed on ``mesh``: cells that are folded, collapsed, there twice, or
    three at an edge."""
    checks = (_unsound, _there_twice, _crowded, _apart)
    return [said for check in checks for said in check(mesh)]


def _there_twice(mesh: PlaneMesh) -> Iterator[str]:
    nodes = np.sort(mesh.cells, axis=1)
    _, first, count = np.unique(nodes, axis=0, return_index=True, return_counts=True)
    again = first[count > 1]
    if len(again):
        yield f"{len(again)} cells are there twice, the first at {_place_of(mesh, again[0])}"


def _crowded(mesh: PlaneMesh) -> Iterator[str]:
    sides = sides_of(mesh.kind, mesh.cells)
    first, which = distinct_edges(sides[:, :2])
    crowded = first[np.bincount(which) > 2]
    if len(crowded):
        at = place(mesh.x[sides[crowded[0]]].mean(axis=0))
        yield (
            f"{len(crowded)} edges belong to more than two cells, the first at {at}: cells overlap"
        )


def _apart(mesh: PlaneMesh) -> Iterator[str]:
    """Cells that share the ends of a side, but not the nodes between them."""
    sides = sides_of(mesh.kind, mesh.cells)
    first, which = distinct_edges(sides[:, :2])
    same_side = sides[first][which]
    unlike = (np.sort(sides, axis=1) != np.sort(same_side, axis=1)).any(axis=1)
    at_corners = len(np.unique(sides[:, :2]))
    on_sides = sides[first, 2:].size
    within_cells = mesh.cells.size - sides[:, 1:].size
    if unlike.any():
        at = place(mesh.x[sides[unlike][0, 0]])
        yield f"cells do not have all nodes of their common sides in common, as at {at}"
    elif at_corners + on_sides + within_cells != len(np.unique(mesh.cells)):
        yield "cells do not have all nodes of their common sides in common"


def _jacobians(mesh: PlaneMesh) -> tuple[Array, Array]:
    """At ``q`` points of each cell ``(n, q, 2, 2)``, and the points' weights."""
    X, weights = bulk_quadrature(mesh.kind, mesh.order + 1)
    slopes = tabulate(mesh.kind, mesh.order, X)[1:]
    return np.einsum("jqa,nai->nqij", slopes, mesh.x[mesh.cells]), weights


def _unsound(mesh: PlaneMesh) -> Iterator[str]:
    """Cells whose map cannot be inverted everywhere, corners and middles of sides included."""
    nodes = np.sort(mesh.cells, axis=1)
    repeating = np.flatnonzero((nodes[:, 1:] == nodes[:, :-1]).any(axis=1))
    if len(repeating):
        at = _place_of(mesh, repeating[0])
        yield (
            f"{len(repeating)} cells have a node twice, the first at {at}: a {mesh.kind.name} "
            "must not be collapsed; "
            "mesh such bodies with triangles alone, or with quadrilaterals of four different "
            "corners"
        )
        return
    smallest, largest = smallest_determinants(mesh)
    size = np.ptp(mesh.x[mesh.cells], axis=1).max(axis=1) ** 2
    flat = largest <= _FLAT * size
    lowest = -_DISTORTED * largest if mesh.order > 1 else 0.0
    folded = (smallest < lowest) | _turned_at_points(mesh)
    bad = np.flatnonzero(flat | folded)
    if not len(bad):
        return
    worst = bad[np.argmin((smallest / size)[bad])]
    how = "it has no area"
    if not flat[worst]:
        how = f"{_falls(smallest[worst] / largest[worst])}; move the nodes on its sides"
    at = _place_of(mesh, worst)
    yield f"{len(bad)} cells are folded or have no area, the worst at {at}: {how}"


def _turned_at_points(mesh: PlaneMesh) -> np.ndarray:
    """Whether the determinants of a cell ``(n,)`` do not have one sign at its integration
    points."""
    J, _ = _jacobians(mesh)
    determinant = np.linalg.det(J)
    none = _FLAT * (J**2).sum(axis=(2, 3)).max(axis=1)
    return (determinant.min(axis=1) <= none) & (determinant.max(axis=1) >= -none)


def _falls(ratio: float) -> str:
    return f"its Jacobian determinant falls to {ratio:.2g} of its largest value"


def distorted(mesh: PlaneMesh) -> list[str]:
    """A warning of cells whose map is nearly singular somewhere: stresses there are worthless."""
    smallest, largest = smallest_determinants(mesh)
    bad = np.flatnonzero(smallest < _DISTORTED * largest)
    if not len(bad):
        return []
    ratio = smallest[bad] / largest[bad]
    at = _place_of(mesh, bad[ratio.argmin()])
    return [
        f"{len(bad)} cells are distorted, the worst at {at}: "
        f"{_falls(ratio.min())}, so stresses there are not to be trusted"
    ]


def thin(mesh: PlaneMesh) -> list[str]:
    """A warning of cells that are far longer than wide, as with one node that lies far off."""
    ends = mesh.x[sides_of(mesh.kind, mesh.cells)[:, :2]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    longest = lengths.reshape(-1, n_corners(mesh.kind)).max(axis=1)
    roundness = areas(mesh) / longest**2
    bad = np.flatnonzero(roundness < _THIN)
    if not len(bad):
        return []
    at = _place_of(mesh, bad[roundness[bad].argmin()])
    return [
        f"{len(bad)} cells are far longer than wide, the worst at {at} by about "
        f"{1 / roundness.min():.2g}: look "
        "whether their nodes are where they belong"
    ]


def areas(mesh: PlaneMesh) -> Array:
    """Area ``(n,)`` of each cell."""
    J, weights = _jacobians(mesh)
    return np.abs(np.linalg.det(J)) @ weights


def beyond_axis(x: Array) -> list[str]:
    """A fault of the nodes ``x`` ``(n, 2)`` of an axisymmetric mesh on the wrong side of the axis
    x = 0, where radii would be negative."""
    size = np.ptp(x, axis=0).max(initial=0.0)
    beyond = x[x[:, 0] < -_FLAT * size]
    if not len(beyond):
        return []
    farthest = place(beyond[beyond[:, 0].argmin()])
    return [
        f"{len(beyond)} nodes have a negative radius, the farthest at {farthest}: an axisymmetric "
        "mesh "
        "is a half section with x >= 0, where x is the radius and the axis is x = 0"
    ]
