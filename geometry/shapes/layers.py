"""Plane meshes of quadrilaterals, extruded in layers along z to hexahedra."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from archord.geometry.basis import HEXAHEDRON, QUADRILATERAL, Array, lagrange_element
from archord.geometry.meshes.fenicsx import distribute, gathered
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.tagged_mesh import TaggedMesh, tags_of
from archord.materials.kinematics import Ints


def layered(plane: TaggedMesh, heights: Mapping[str, Sequence[float]]) -> TaggedMesh:
    """Extrude a ``plane`` mesh of quadrilaterals to hexahedra. Collective.

    ``heights`` between the layers are given for each body, from the lowest on, by its set of cells.
    Facet sets keep their names over their edges, and point sets over their points. The lowest faces
    of a body "pin" become the set "pin below", its highest ones "pin above". Raises ValueError for
    heights that do not fit, and for triangles, whose prisms are not supported.
    """
    comm = plane.mesh.comm
    made = comm.bcast(gathered(plane))  # small: all ranks find its faults
    solid = extruded(made, heights)
    return distribute(comm, solid if comm.rank == 0 else None)


def extruded(plane: MeshArrays, heights: Mapping[str, Sequence[float]]) -> MeshArrays:
    """The arrays of a `layered` mesh."""
    cell_sets: dict[str, list[Ints]] = defaultdict(list)
    facet_sets: dict[str, list[Ints]] = defaultdict(list)
    point_sets: dict[str, list[np.ndarray]] = defaultdict(list)
    x = []
    cells = []
    n_nodes = 0
    n_cells = 0
    for levels, chosen in _cells_by_heights(plane, heights).items():
        n_layers = len(levels) - 1
        z = _node_heights(levels, plane.order)
        feet = plane.x.repeat(len(z), axis=0)
        heights_of_feet = np.tile(z, len(plane.x))
        x.append(np.column_stack([feet, heights_of_feet]))
        numbers = n_nodes + np.arange(len(feet))
        over = numbers.reshape(-1, len(z))  # (nodes of the plane, heights)
        cells.append(_hexahedra(plane, chosen, over))
        corners = plane.cells[chosen, :4]
        for name, tags in plane.cell_sets.items():
            within = np.isin(plane.bodies[chosen], tags)
            own = np.flatnonzero(within.repeat(n_layers))
            cell_sets[name].append(n_cells + own)
            if within.any():
                columns = over[corners[within]]
                facet_sets[f"{name} below"].append(columns[..., 0])
                facet_sets[f"{name} above"].append(columns[..., -1])
        for name in plane.facet_sets:
            ends = plane.facets_of(name)[:, :2]
            inside = ends[np.isin(ends, corners).all(axis=1)]
            facet_sets[name].append(_sides(over[inside], plane.order))
        for name, nodes in plane.point_sets.items():
            point_sets[name].append(over[nodes].ravel())
        n_nodes += len(feet)
        n_cells += len(cells[-1])
    return MeshArrays.of_sets(
        HEXAHEDRON,
        np.concatenate(x),
        np.concatenate(cells),
        _joined(cell_sets),
        _joined(facet_sets),
        _joined(point_sets),
    )


def _node_heights(levels: tuple[float, ...], order: int) -> Array:
    """The heights of the nodes of layers of this ``order`` between ``levels``."""
    n_layers = len(levels) - 1
    steps = np.arange(order * n_layers + 1) / order
    return np.interp(steps, np.arange(n_layers + 1), levels)


def _sides(over: Ints, order: int) -> Ints:
    """Corners ``(n layers, 4)`` of the faces over edges, whose two ends have the nodes ``over``
    ``(n, 2, heights)`` them."""
    low = over[..., :-1:order]
    high = over[..., order::order]
    corners = np.concatenate([low, high], axis=1)
    return corners.swapaxes(1, 2).reshape(-1, 4)


def _joined(parts: Mapping[str, list[np.ndarray]]) -> dict[str, np.ndarray]:
    return {name: np.concatenate(found) for name, found in parts.items()}


def _cells_by_heights(
    plane: MeshArrays, heights: Mapping[str, Sequence[float]]
) -> dict[tuple[float, ...], np.ndarray]:
    """The cells ``(n,)`` of the bodies with the same heights, by these. Raises ValueError."""
    if plane.kind != QUADRILATERAL:
        raise ValueError("layers of triangles would be prisms, which are not supported")
    tags: dict[tuple[float, ...], tuple[int, ...]] = defaultdict(tuple)
    for name, levels in heights.items():
        thicknesses = np.diff(levels)
        if len(levels) < 2 or not np.all(thicknesses > 0):
            raise ValueError(f"heights of {name!r} must be two or more, and increase")
        tags[tuple(levels)] += tags_of("cell", plane.cell_sets, name)
    cells = {levels: np.flatnonzero(np.isin(plane.bodies, own)) for levels, own in tags.items()}
    without = len(plane.cells) - sum(map(len, cells.values()))
    if without > 0:
        raise ValueError(f"{without} cells have no heights: give heights of every body")
    of_bodies = [np.unique(plane.cells[chosen]) for chosen in cells.values()]
    nodes = np.concatenate(of_bodies)
    if len(np.unique(nodes)) < len(nodes):
        raise ValueError("bodies that share nodes must have the same heights")
    return cells


def _hexahedra(plane: MeshArrays, chosen: Ints, over: Ints) -> Ints:
    """The cells ``(n layers, b)`` over the ``chosen`` ones ``(n,)`` of the plane mesh, whose nodes
    have the nodes ``over`` ``(nodes, levels)`` them."""
    order = plane.order
    points = lagrange_element(HEXAHEDRON, order).points  # (b, 3)
    below = lagrange_element(QUADRILATERAL, order).points
    distance = np.abs(points[:, None, :2] - below).sum(axis=-1)
    column = distance.argmin(axis=1)  # (b,), the node of the quadrilateral below
    level = np.rint(order * points[:, 2]).astype(int)  # (b,), the height within the layer
    first = np.arange(0, over.shape[1] - 1, order)[:, None]  # (layers, 1)
    feet = plane.cells[chosen][:, None, column]  # (n, 1, b)
    return over[feet, first + level].reshape(-1, len(points))
