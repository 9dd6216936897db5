"""Meshes cut finer or given a higher order, with nodes on given circles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import basix.ufl
import numpy as np
from dolfinx import fem
from dolfinx.mesh import create_mesh
from mpi4py import MPI

from archord.geometry.basis import Array, lagrange_element
from archord.geometry.curve import circle_through
from archord.geometry.meshes.cells import along, parts_of
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.tagged_mesh import tags_of

_OFF_CIRCLE = 0.05  # of the radius
_ELSEWHERE = 1e-4  # of the radius: more than the rounding of a file moves nodes onto their circle
_SAME = 1e-9  # distance in a reference cell
_IN_METRES = 0.01  # of the radius: a facet set smaller than this is drawn in another unit


class Circle(NamedTuple):
    """The circle that the nodes of a facet set lie on."""

    facets: str
    centre: tuple[float, float]
    radius: float

    def distance(self, x: Array) -> Array:
        """How far points ``(k, 2)`` are off the circle."""
        return np.abs(np.linalg.norm(x - self.centre, axis=1) - self.radius)


def refined(
    mesh: MeshArrays, times: int = 0, order: int | None = None, circles: Sequence[Circle] = ()
) -> MeshArrays:
    """``mesh`` with each cell cut in four so many ``times``, then of a higher ``order``.

    The nodes of ``circles`` are moved onto them along their rays. Without a circle, new nodes lie
    on the curved edges that are there. A note of the mesh tells of nodes that lie on another circle
    than theirs. Raises ValueError if a node is far from its circle.
    """
    notes = list(mesh.notes)
    for circle in circles:
        tags_of("facet", mesh.facet_sets, circle.facets)
        _require_near(mesh, circle)
        notes += _elsewhere(mesh, circle)

    def settled(mesh: MeshArrays) -> MeshArrays:
        return on_circles(mesh, circles).centred() if circles else mesh

    mesh = settled(replace(mesh, notes=tuple(notes)))
    own = mesh.order
    for _ in range(times):
        mesh = settled(_cut(mesh))
    if order is None or order == own:
        return mesh
    if order < own:
        raise ValueError(f"the mesh is of order {own}, which cannot be lowered to {order}")
    return settled(_raised(mesh, order))


def _require_near(mesh: MeshArrays, circle: Circle) -> None:
    """Raise ValueError if a node of ``circle`` is far from it."""
    x = mesh.x[np.unique(mesh.facets_of(circle.facets))]
    off = circle.distance(x)
    if off.max() <= _OFF_CIRCLE * circle.radius:
        return
    at = x[off.argmax()]
    said = (
        f"the node ({at[0]:g}, {at[1]:g}) of the facet set {circle.facets!r} is {off.max():.3g} "
        "off "
        f"its circle, whose centre or radius {circle.radius:g} must be wrong"
    )
    if np.ptp(x, axis=0).max() < _IN_METRES * circle.radius:
        said += "; or is the mesh in metres? Then give mesh.scale = 1000"
    raise ValueError(said)


def _elsewhere(mesh: MeshArrays, circle: Circle) -> list[str]:
    """A warning if the ends of the facets of ``circle`` lie on another one: its clearance is not
    the drawn one."""
    corners = mesh.x[np.unique(mesh.facets_of(circle.facets)[:, :2])]
    drawn = circle_through(corners)
    moved = circle.distance(corners).max()
    if drawn is None or moved <= _ELSEWHERE * circle.radius:
        return []
    centre, radius = drawn
    x, y = centre.round(9) + 0.0
    return [
        f"the facet set {circle.facets!r} is drawn on the circle of radius {radius:.6g} about "
        f"({x:.6g}, {y:.6g}), but "
        f"its [[mesh.circle]] has radius {circle.radius:.6g} about ({circle.centre[0]:.6g}, "
        f"{circle.centre[1]:.6g}) "
        f"and moves nodes by up to {moved:.3g}, which changes the clearance by as much"
    ]


def on_circles(mesh: MeshArrays, circles: Sequence[Circle]) -> MeshArrays:
    """``mesh`` with the nodes of ``circles`` moved onto them along their rays, as far as it has
    these facet sets.

    The clearance is a small difference of large numbers, which the rounding of a mesh generator
    would spoil.
    """
    x = mesh.x.copy()
    for circle in circles:
        nodes = np.unique(mesh.facets_of(circle.facets))
        ray = x[nodes] - circle.centre
        x[nodes] = circle.centre + ray * (circle.radius / np.linalg.norm(ray, axis=1))[:, None]
    return replace(mesh, x=x)


def _raised(mesh: MeshArrays, order: int) -> MeshArrays:
    """``mesh`` with nodes of a higher ``order`` on its cells as they are curved."""
    variant = basix.LagrangeVariant.equispaced
    geometry = basix.ufl.element("P", mesh.kind, mesh.order, variant, shape=(mesh.dimension,))
    made = create_mesh(MPI.COMM_SELF, cells=mesh.cells, x=mesh.x, e=geometry)
    V = fem.functionspace(made, basix.ufl.element("P", mesh.kind, order, variant))
    cells = np.empty(V.dofmap.list.shape, dtype=np.int64)
    cells[made.topology.original_cell_index] = V.dofmap.list
    old = lagrange_element(mesh.kind, mesh.order)
    new = lagrange_element(mesh.kind, order)
    there, here = np.nonzero(_distances(new.points, old.points) < _SAME)
    place = np.full(len(mesh.x), -1)
    place[mesh.cells[:, here]] = cells[:, there]
    points = {name: place[nodes] for name, nodes in mesh.point_sets.items()}
    if any((nodes < 0).any() for nodes in points.values()):
        raise ValueError(
            f"point sets have nodes of order {mesh.order} that a mesh of order {order} has not"
        )
    x = V.tabulate_dof_coordinates()[:, : mesh.dimension].copy()
    return replace(mesh, point_sets=points).with_cells(x, cells)


def _cut(mesh: MeshArrays) -> MeshArrays:
    """Each cell of order p cut in four, whose nodes are the nodes of a cell of order 2 p."""
    p = mesh.order
    made = _raised(mesh, 2 * p)
    parts = parts_of(mesh.kind, lagrange_element(mesh.kind, p).points)
    points = lagrange_element(mesh.kind, 2 * p).points
    nodes = _distances(parts.reshape(-1, 2), points).argmin(axis=1)
    cells = made.cells[:, nodes].reshape(4 * len(mesh.cells), -1)
    line = along(made.facets)
    halves = np.stack([line[:, : p + 1], line[:, p:]], axis=1).reshape(-1, p + 1)
    facets = halves[:, [0, p, *range(1, p)]]
    bodies = mesh.bodies.repeat(4)
    return replace(made, cells=cells, bodies=bodies, facets=facets, tags=mesh.tags.repeat(2))


def _distances(points: Array, others: Array) -> Array:
    """The larger of the distances ``(k, j)`` along x and y between two sets of points."""
    return np.abs(points[:, None] - others).max(axis=2)
