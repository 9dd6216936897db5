"""What is wrong with the cells of a mesh, or may be, in one sentence each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import basix
import numpy as np
from dolfinx.mesh import Mesh
from mpi4py import MPI

from archord.geometry.basis import Array, bulk_quadrature, lagrange_element, tabulate
from archord.geometry.meshes.cells import corners_of, distinct, entities_of, lengths, sides_of
from archord.geometry.meshes.jacobian import smallest_determinants
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.kernels.compat import cell_nodes
from archord.materials.kinematics import Bools
from archord.report.by_name import Amounts

_FLAT = 1e-9  # smallest over largest jacobian of a cell that has collapsed
# Smallest over largest jacobian below which a cell is told of. Cells below -0.02 are refused: the
# corner of a curved cell with two sides on one arc is flat, and comes out a little below zero.
_DISTORTED = 0.02
# area over the square of the longest edge, or the root of the volume over its cube, below which a
# cell is told of
_THIN = 0.005
# area over the square of the edge of the regular cell, or the root of the volume over its cube
_REGULAR = {
    basix.CellType.triangle: 3**0.5 / 4,
    basix.CellType.quadrilateral: 1.0,
    basix.CellType.tetrahedron: (2**0.5 / 12) ** 0.5,
    basix.CellType.hexahedron: 1.0,
}
_UNLIKE_CORNERS = {
    2: "triangles alone, or with quadrilaterals of four different corners",
    3: "tetrahedra alone, or with hexahedra of eight different corners",
}


def place(x: Iterable[float]) -> str:
    """A point as text."""
    return f"({', '.join(f'{value:g}' for value in x)})"


def _place_of(mesh: MeshArrays, cell: int) -> str:
    """The middle of a ``cell`` and the sets that have it."""
    names = [repr(name) for name, tags in mesh.cell_sets.items() if mesh.bodies[cell] in tags]
    nodes = mesh.x[mesh.cells[cell]]
    middle = place(nodes.mean(axis=0))
    return f"{middle} in {' and '.join(names)}" if names else middle


def faults(mesh: MeshArrays) -> list[str]:
    """Why nothing can be computed on ``mesh``: cells that are folded, collapsed, there twice, or
    three at a side."""
    checks = (_unsound, _there_twice, _crowded, _apart)
    return [said for check in checks for said in check(mesh)]


def _there_twice(mesh: MeshArrays) -> Iterator[str]:
    nodes = np.sort(mesh.cells, axis=1)
    _, first, count = np.unique(nodes, axis=0, return_index=True, return_counts=True)
    again = first[count > 1]
    if len(again):
        yield f"{len(again)} cells are there twice, the first at {_place_of(mesh, again[0])}"


def _crowded(mesh: MeshArrays) -> Iterator[str]:
    sides = sides_of(mesh.kind, mesh.cells)
    first, which = distinct(corners_of(mesh.kind, sides))
    crowded = first[np.bincount(which) > 2]
    if len(crowded):
        first_side = mesh.x[sides[crowded[0]]]
        at = place(first_side.mean(axis=0))
        what = "edges" if mesh.dimension == 2 else "faces"
        yield (
            f"{len(crowded)} {what} belong to more than two cells, the first at {at}: cells overlap"
        )


def _apart(mesh: MeshArrays) -> Iterator[str]:
    """Cells that share the corners of a side, but not the nodes between them."""
    sides = sides_of(mesh.kind, mesh.cells)
    corners = corners_of(mesh.kind, sides)
    first, which = distinct(corners)
    same_side = sides[first][which]
    differs = np.sort(sides, axis=1) != np.sort(same_side, axis=1)
    unlike = differs.any(axis=1)
    expected = len(np.unique(corners)) + _nodes_between_corners(mesh)
    if unlike.any():
        at = place(mesh.x[sides[unlike][0, 0]])
        yield f"cells do not have all nodes of their common sides in common, as at {at}"
    elif expected != len(np.unique(mesh.cells)):
        yield "cells do not have all nodes of their common sides in common"


def _nodes_between_corners(mesh: MeshArrays) -> int:
    """How many nodes a sound mesh of these cells has within edges, faces and cells."""
    count = 0
    within = lagrange_element(mesh.kind, mesh.order).entity_dofs
    topology = basix.topology(mesh.kind)
    for dim in range(1, mesh.dimension + 1):
        n_corners = len(topology[dim][0])
        corners = entities_of(mesh.kind, mesh.cells, dim)[:, :n_corners]
        first, _ = distinct(corners)
        count += len(first) * len(within[dim][0])
    return count


def _jacobians(mesh: MeshArrays) -> tuple[Array, Array]:
    """At ``q`` points of each cell ``(n, q, d, d)``, and the points' weights."""
    X, weights = bulk_quadrature(mesh.kind, mesh.order + 1)
    slopes = tabulate(mesh.kind, mesh.order, X)[1:]
    J = np.einsum("jqa,nai->nqij", slopes, mesh.x[mesh.cells], optimize=True)  # four times faster
    return J, weights


def _unsound(mesh: MeshArrays) -> Iterator[str]:
    """Cells whose map cannot be inverted everywhere, corners and middles of sides included."""
    nodes = np.sort(mesh.cells, axis=1)
    is_again = nodes[:, 1:] == nodes[:, :-1]
    repeating = np.flatnonzero(is_again.any(axis=1))
    if len(repeating):
        at = _place_of(mesh, repeating[0])
        yield (
            f"{len(repeating)} cells have a node twice, the first at {at}: a {mesh.kind.name} "
            f"must not be collapsed; mesh such bodies with {_UNLIKE_CORNERS[mesh.dimension]}"
        )
        return
    smallest, largest = smallest_determinants(mesh)
    extent = np.ptp(mesh.x[mesh.cells], axis=1).max(axis=1)
    size = extent**mesh.dimension
    flat = largest <= _FLAT * size
    bad = np.flatnonzero(flat | is_folded(mesh, smallest, largest))
    if not len(bad):
        return
    worst = bad[np.argmin((smallest / size)[bad])]
    measure = "area" if mesh.dimension == 2 else "volume"
    how = f"it has no {measure}"
    if not flat[worst]:
        ratio = smallest[worst] / largest[worst]
        how = f"{_falls(ratio)}; move the nodes on its sides"
    at = _place_of(mesh, worst)
    yield f"{len(bad)} cells are folded or have no {measure}, the worst at {at}: {how}"


def is_folded(mesh: MeshArrays, smallest: Array, largest: Array) -> Bools:
    """Whether cells ``(n,)`` are folded, by their `smallest_determinants` and the largest ones."""
    lowest = -_DISTORTED * largest if mesh.order > 1 else 0.0
    return (smallest < lowest) | _turned_at_points(mesh)


def _turned_at_points(mesh: MeshArrays) -> Bools:
    """Whether the determinants of a cell ``(n,)`` do not have one sign at its integration
    points."""
    J, _ = _jacobians(mesh)
    determinant = np.linalg.det(J)
    squared = (J**2).sum(axis=(2, 3)).max(axis=1)
    none = _FLAT * squared ** (mesh.dimension / 2)
    return (determinant.min(axis=1) <= none) & (determinant.max(axis=1) >= -none)


def _falls(ratio: float) -> str:
    return f"its Jacobian determinant falls to {ratio:.2g} of its largest value"


class Quality(NamedTuple):
    """How good ``n`` cells are; 1 is best.

    - ``jacobian`` ``(n,)``: smallest over largest Jacobian determinant of the cell's map
    - ``roundness`` ``(n,)``: about the width over the longest edge, over this of the regular cell
    """

    jacobian: Array
    roundness: Array


def quality(mesh: MeshArrays) -> Quality:
    """How good the cells of ``mesh`` are."""
    smallest, largest = smallest_determinants(mesh)
    return Quality(smallest / largest, _widths(mesh) / _REGULAR[mesh.kind])


def worst_cells(mesh: Mesh) -> Amounts:
    """The smallest values of `Quality`, by their names, of a distributed ``mesh``. Collective."""
    dimension = mesh.topology.dim
    own = cell_nodes(mesh)[: mesh.topology.index_map(dimension).size_local]
    no_tags = np.zeros(len(own), dtype=np.int32)
    no_facets = np.zeros((0, dimension), dtype=np.int32)
    x = mesh.geometry.x[:, :dimension]
    good = quality(MeshArrays(x, mesh.basix_cell(), own, no_tags, no_facets, no_tags[:0]))
    worst = np.array([values.min(initial=np.inf) for values in good])
    mesh.comm.Allreduce(MPI.IN_PLACE, worst, op=MPI.MIN)
    return dict(zip(Quality._fields, map(float, worst), strict=True))


def _widths(mesh: MeshArrays) -> Array:
    """The area over the square of the longest edge, or the root of the volume over its cube
    ``(n,)``: about the width of cells over their length."""
    d = mesh.dimension
    of_edges = lengths(mesh.x, entities_of(mesh.kind, mesh.cells, 1))
    longest = of_edges.reshape(len(mesh.cells), -1).max(axis=1)
    return (measures(mesh) / longest**d) ** (1 / (d - 1))


def poor_cells(mesh: MeshArrays, good: Quality) -> list[str]:
    """Warnings of cells of ``mesh``, which are as ``good`` as `quality` says: of those whose map is
    nearly singular somewhere, where stresses are worthless, and of those that are far longer than
    wide, as with one node that lies far off."""
    said = []
    bad = np.flatnonzero(good.jacobian < _DISTORTED)
    if len(bad):
        worst = bad[good.jacobian[bad].argmin()]
        said.append(
            f"{len(bad)} cells are distorted, the worst at {_place_of(mesh, worst)}: "
            f"{_falls(good.jacobian[worst])}, so stresses there are not to be trusted"
        )
    width = good.roundness * _REGULAR[mesh.kind]
    bad = np.flatnonzero(width < _THIN)
    if len(bad):
        worst = bad[width[bad].argmin()]
        said.append(
            f"{len(bad)} cells are far longer than wide, the worst at {_place_of(mesh, worst)} by "
            f"about {1 / width[worst]:.2g}: look whether their nodes are where they belong"
        )
    return said


def measures(mesh: MeshArrays) -> Array:
    """Area or volume ``(n,)`` of each cell."""
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
