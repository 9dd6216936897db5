"""Meshes cut finer or given a higher order, with nodes on given circles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import basix
import basix.ufl
import numpy as np
from dolfinx import fem
from dolfinx.mesh import create_mesh
from mpi4py import MPI

from archord.geometry.basis import Array, lagrange_element
from archord.geometry.curve import circle_through, nearest_circle
from archord.geometry.meshes.cells import corners_of, parts_of, side_kind
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.tagged_mesh import tags_of
from archord.geometry.vectors import unit
from archord.materials.kinematics import Ints

_OFF_CIRCLE = 0.05  # of the radius
_ELSEWHERE = 1e-4  # of the radius: more than the rounding of a file moves nodes onto their circle
_SAME = 1e-9  # distance in a reference cell
_ROUND = 1e-4  # of the radius: how far corners of facets may be off their cylinder
_FLAT = 0.02  # of the radius: facets of a smaller extent have no cylinder
_ALIKE = 1e-8  # squared sine of the angle between normals that are the same
_IN_METRES = 0.01  # of the radius: a facet set smaller than this is drawn in another unit


class Circle(NamedTuple):
    """The circle that the nodes of a facet set lie on; in space a sphere, or a cylinder with an
    ``axis`` through its ``centre``."""

    facets: str
    centre: tuple[Any, ...]
    radius: float
    axis: tuple[float, ...] | None = None

    @property
    def shape(self) -> str:
        """What it is."""
        if len(self.centre) == 2:
            return "circle"
        return "cylinder" if self.axis else "sphere"

    def foot(self, x: Array) -> Array:
        """The point of the axis, or the centre, that is nearest to points ``(k, d)``."""
        centre = np.array(self.centre)
        if self.axis is None:
            return np.broadcast_to(centre, x.shape)
        along = np.array(self.axis) / np.linalg.norm(self.axis)
        height = (x - centre) @ along
        return centre + height[:, None] * along

    def distance(self, x: Array) -> Array:
        """How far points ``(k, d)`` are off the circle."""
        return np.abs(np.linalg.norm(x - self.foot(x), axis=1) - self.radius)


def cylinder_through(x: Array, facets: Ints) -> Circle | None:
    """The cylinder that the corners of ``facets`` ``(k, 3 or more)`` lie on; None if there is
    none.

    The normals of facets are nearly across its axis, from which a least-squares fit starts.
    """
    from scipy.optimize import least_squares  # a solve without first-order arcs does not pay for it

    triangles = x[facets[:, :3]]
    a, b, c = np.swapaxes(triangles, 0, 1)
    normal = unit(np.cross(b - a, c - a))
    _, spread, turned = np.linalg.svd(normal.T @ normal)  # across the axis twice, then along it
    if spread[1] < _ALIKE * spread[0]:
        return None  # the corners of a strip of flat facets lie on any cylinder
    corners = np.unique(triangles.reshape(-1, 3), axis=0)
    middle, radius = nearest_circle(corners @ turned[:2].T)
    height = (corners @ turned[2]).mean()
    start = np.array([*middle / radius, 0.0, 0.0])

    def on_axis(place: Array) -> Circle:
        centre = np.append(radius * place[:2], height) @ turned
        axis = np.append(place[2:], 1.0) @ turned
        return Circle("", tuple(centre), 0.0, tuple(axis))

    def unevenness(place: Array) -> Array:
        distance = on_axis(place).distance(corners)
        return distance / distance.mean() - 1

    found = least_squares(unevenness, start, xtol=_SAME, ftol=None, gtol=None)
    made = on_axis(found.x)
    distance = made.distance(corners)
    radius = distance.mean()
    is_round = np.ptp(distance) < _ROUND * radius
    is_flat = np.ptp(corners, axis=0).max() < _FLAT * radius
    return made._replace(radius=radius) if is_round and not is_flat else None


def refined(
    mesh: MeshArrays, times: int = 0, order: int | None = None, circles: Sequence[Circle] = ()
) -> MeshArrays:
    """``mesh`` with the edges of each cell cut in two so many ``times``, then of a higher
    ``order``.

    The nodes of ``circles`` are moved onto them along their rays. Without a circle, new nodes lie
    on the curved edges that are there. A note of the mesh tells of nodes that lie on another circle
    than theirs. Raises ValueError if a node is far from its circle.
    """
    notes = list(mesh.notes)
    for circle in circles:
        if len(circle.centre) != mesh.dimension:
            said = f"must have a centre of {mesh.dimension} numbers, as the mesh has dimensions"
            raise ValueError(f"the circle of {circle.facets!r} {said}")
        tags_of("facet", mesh.facet_sets, circle.facets, "mesh.circle.facets: ")
        _require_near(mesh, circle)
        notes += _elsewhere(mesh, circle)

    def settled(mesh: MeshArrays) -> MeshArrays:
        if not circles:
            return mesh
        on = [np.unique(mesh.facets_of(circle.facets)) for circle in circles]
        return on_circles(mesh, circles).centred(np.concatenate(on))

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
    place = ", ".join(f"{value:g}" for value in at)
    middle = "axis" if circle.axis else "centre"
    said = (
        f"the node ({place}) of the facet set {circle.facets!r} is {off.max():.3g} off its "
        f"{circle.shape}, whose {middle} or radius {circle.radius:g} must be wrong"
    )
    if np.ptp(x, axis=0).max() < _IN_METRES * circle.radius:
        said += "; or is the mesh in metres? Then give mesh.scale = 1000"
    raise ValueError(said)


def _elsewhere(mesh: MeshArrays, circle: Circle) -> list[str]:
    """A warning if the ends of the facets of ``circle`` lie on another one: its clearance is not
    the drawn one."""
    facets = mesh.facets_of(circle.facets)
    corners = mesh.x[np.unique(corners_of(mesh.kind, facets))]
    moved = circle.distance(corners).max()
    if moved <= _ELSEWHERE * circle.radius:
        return []
    if mesh.dimension == 3:
        return [
            f"the facet set {circle.facets!r} is drawn up to {moved:.3g} off its [[mesh.circle]], "
            "which changes the clearance by as much"
        ]
    drawn = circle_through(corners)
    if drawn is None:
        return []
    centre, radius = drawn
    x, y = centre.round(9) + 0.0
    x_wanted, y_wanted = circle.centre
    return [
        f"the facet set {circle.facets!r} is drawn on the circle of radius {radius:.6g} "
        f"about ({x:.6g}, {y:.6g}), but its [[mesh.circle]] has radius {circle.radius:.6g} "
        f"about ({x_wanted:.6g}, {y_wanted:.6g}) and moves nodes by up to {moved:.3g}, "
        "which changes the clearance by as much"
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
        foot = circle.foot(x[nodes])
        ray = x[nodes] - foot
        stretch = circle.radius / np.linalg.norm(ray, axis=1)
        x[nodes] = foot + ray * stretch[:, None]
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
    """Each cell of order p cut in the middles of its edges, into parts whose nodes are the nodes of
    a cell of order 2 p."""
    p = mesh.order
    made = _raised(mesh, 2 * p)
    cells = _parts(mesh.kind, p, made.cells)
    facets = _parts(side_kind(mesh.kind), p, made.facets)
    bodies = mesh.bodies.repeat(len(cells) // len(mesh.cells))
    tags = mesh.tags.repeat(2 ** (mesh.dimension - 1))
    return replace(made, cells=cells, bodies=bodies, facets=facets, tags=tags)


def _parts(kind: basix.CellType, p: int, nodes: Ints) -> Ints:
    """Nodes ``(m s, b)`` of the parts, of order ``p``, of cells with ``nodes`` ``(m, a)`` of order
    2 p."""
    points = parts_of(kind, lagrange_element(kind, p).points)
    there = lagrange_element(kind, 2 * p).points
    of_parts = _distances(points.reshape(-1, points.shape[2]), there).argmin(axis=1)
    return nodes[:, of_parts].reshape(-1, points.shape[1])


def _distances(points: Array, others: Array) -> Array:
    """The largest of the distances ``(k, j)`` along the axes between two sets of points."""
    return np.abs(points[:, None] - others).max(axis=2)
