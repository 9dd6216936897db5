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

from archord.geometry.basis import TRIANGLE, cell_kind, lagrange_element
from archord.geometry.curve import circle_through
from archord.geometry.meshes.plane_mesh import PlaneMesh, sides_between
from archord.geometry.meshes.tagged_mesh import tags_of

_OFF_CIRCLE = 0.05  # of the radius
_ELSEWHERE = 1e-4  # of the radius: more than the rounding of a file moves nodes onto their circle
_SAME = 1e-9  # distance in a reference cell


class Circle(NamedTuple):
    """The circle that the nodes of a facet set lie on."""

    facets: str
    centre: tuple[float, float]
    radius: float


def refined(
    mesh: PlaneMesh, times: int = 0, order: int | None = None, circles: Sequence[Circle] = ()
) -> PlaneMesh:
    """``mesh`` with each cell cut in four so many ``times``, then of a higher ``order``; the nodes
    of ``circles`` are moved onto them along their rays. Without a circle, new nodes lie on the
    curved edges that are there.

    A note of the mesh tells of nodes that lie on another circle than theirs. Raises ValueError if a
    node is far from its circle.
    """
    notes = list[str]()
    for circle in circles:
        nodes = np.unique(
            mesh.edges[np.isin(mesh.tags, tags_of("facet", mesh.facet_sets, circle.facets))]
        )
        off = np.abs(np.linalg.norm(mesh.x[nodes] - circle.centre, axis=1) - circle.radius)
        if off.max() > _OFF_CIRCLE * circle.radius:
            x, y = mesh.x[nodes[off.argmax()]]
            said = f"the node ({x:g}, {y:g}) of the facet set {circle.facets!r} is {off.max():.3g} off its circle"
            said += f", whose centre or radius {circle.radius:g} must be wrong"
            small = np.ptp(mesh.x[nodes], axis=0).max() < circle.radius / 100
            raise ValueError(
                f"{said}; or is the mesh in metres? Then give mesh.scale = 1000" if small else said
            )
        notes += _elsewhere(mesh, circle)
    mesh = replace(mesh, notes=(*mesh.notes, *notes))

    def settled(mesh: PlaneMesh) -> PlaneMesh:
        return on_circles(mesh, circles).centred() if circles else mesh

    mesh, own = settled(mesh), cell_kind(mesh.cells.shape[1])[1]
    for _ in range(times):
        mesh = settled(_cut(mesh))
    if order is None or order == own:
        return mesh
    if order < own:
        raise ValueError(f"the mesh is of order {own}, which cannot be lowered to {order}")
    return settled(_raised(mesh, order))


def _elsewhere(mesh: PlaneMesh, circle: Circle) -> list[str]:
    """A warning if the ends of the facets of ``circle`` lie on another one: its clearance is not
    the drawn one."""
    facets = np.isin(mesh.tags, mesh.facet_sets[circle.facets])
    corners = mesh.x[np.unique(mesh.edges[facets, :2])]
    drawn = circle_through(corners)
    moved = np.abs(np.linalg.norm(corners - circle.centre, axis=1) - circle.radius).max()
    if drawn is None or moved <= _ELSEWHERE * circle.radius:
        return []
    (x, y), radius = drawn[0].round(9) + 0.0, drawn[1]
    return [
        f"the facet set {circle.facets!r} is drawn on the circle of radius {radius:.6g} about ({x:.6g}, {y:.6g}), but "
        f"its [[mesh.circle]] has radius {circle.radius:.6g} about ({circle.centre[0]:.6g}, {circle.centre[1]:.6g}) "
        f"and moves nodes by up to {moved:.3g}, which changes the clearance by as much"
    ]


def on_circles(mesh: PlaneMesh, circles: Sequence[Circle]) -> PlaneMesh:
    """``mesh`` with the nodes of ``circles`` moved onto them along their rays, as far as it has
    these facet sets.

    The clearance is a small difference of large numbers, which the rounding of a mesh generator
    would spoil.
    """
    x = mesh.x.copy()
    for circle in circles:
        nodes = np.unique(mesh.edges[np.isin(mesh.tags, mesh.facet_sets.get(circle.facets, ()))])
        ray = x[nodes] - circle.centre
        x[nodes] = circle.centre + ray * (circle.radius / np.linalg.norm(ray, axis=1))[:, None]
    return replace(mesh, x=x)


def _raised(mesh: PlaneMesh, order: int) -> PlaneMesh:
    """``mesh`` with nodes of a higher ``order`` on its cells as they are curved."""
    (kind, own), equispaced = cell_kind(mesh.cells.shape[1]), basix.LagrangeVariant.equispaced
    elements = [
        basix.ufl.element("P", kind, p, equispaced, shape=s) for p, s in ((own, (2,)), (order, ()))
    ]
    made = create_mesh(MPI.COMM_SELF, cells=mesh.cells, x=mesh.x, e=elements[0])
    V = fem.functionspace(made, elements[1])
    cells = np.empty(V.dofmap.list.shape, dtype=np.int64)
    cells[made.topology.original_cell_index] = V.dofmap.list
    sides = cells[:, lagrange_element(kind, order).entity_closure_dofs[1]].reshape(-1, order + 1)
    apart = np.abs(
        lagrange_element(kind, order).points[:, None] - lagrange_element(kind, own).points
    ).max(axis=2)
    there, here = np.nonzero(apart < _SAME)
    place = np.full(len(mesh.x), -1)
    place[mesh.cells[:, here]] = cells[:, there]
    points = {name: place[nodes] for name, nodes in mesh.point_sets.items()}
    if any((nodes < 0).any() for nodes in points.values()):
        raise ValueError(
            f"point sets have nodes of order {own} that a mesh of order {order} has not"
        )
    x, edges = (
        V.tabulate_dof_coordinates()[:, :2].copy(),
        sides[sides_between(mesh.cells, mesh.edges[:, :2])],
    )
    return replace(mesh, x=x, cells=cells, edges=edges, point_sets=points)


def _cut(mesh: PlaneMesh) -> PlaneMesh:
    """Each cell of order p cut in four, whose nodes are those of a cell of order 2 p."""
    kind, p = cell_kind(mesh.cells.shape[1])
    made = _raised(mesh, 2 * p)
    corner = np.array(
        [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]]
    )  # of each part; the last triangle is turned
    size = np.array([0.5, 0.5, 0.5, -0.5 if kind == TRIANGLE else 0.5])
    parts = corner[:, None] + size[:, None, None] * lagrange_element(kind, p).points
    nodes = (
        np.abs(parts[:, :, None] - lagrange_element(kind, 2 * p).points).max(axis=3).argmin(axis=2)
    )
    along = made.edges[:, [0, *range(2, 2 * p + 1), 1]]
    halves = np.stack([along[:, : p + 1], along[:, p:]], axis=1).reshape(-1, p + 1)[
        :, [0, p, *range(1, p)]
    ]
    cells, bodies, tags = (
        made.cells[:, nodes].reshape(-1, nodes.shape[1]),
        mesh.bodies.repeat(4),
        mesh.tags.repeat(2),
    )
    return replace(made, cells=cells, bodies=bodies, edges=halves, tags=tags)
