"""archord's mesh of the joint as arrays in the node order of input decks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import entities_to_geometry
from mpi4py import MPI

from archord.geometry.joint_mesh import Facets, JointMesh
from archord.geometry.quarter_joint import quarter_joint
from archord.scene.scene import Scene

Ints = npt.NDArray[np.int64]
Array = npt.NDArray[np.float64]
Elements = Literal["quadratic", "linear"]

# dolfinx numbers the midpoint of an edge by the corner opposite to it, Abaqus by the corner it starts from.
_COUNTERCLOCKWISE = [0, 1, 2, 5, 3, 4]
_MIRRORED = [0, 2, 1, 4, 3, 5]
_QUARTERS = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]


@dataclass(frozen=True)
class PlaneMesh:
    """Triangles of the half model, numbered from 0, in the node order of Abaqus.

    ``x`` ``(n, 2)`` nodes; ``elements`` ``(m, 3 or 6)`` their nodes, counterclockwise, corners before midpoints;
    ``bodies`` ``(m,)`` their `Cells`; ``edges`` per tag of `Facets` the element and its edge ``(n, 2)``, edge i
    going from corner i to the next.
    """

    x: Array
    elements: Ints
    bodies: Ints
    edges: dict[Facets, Ints]

    def edge_nodes(self, tag: Facets) -> Ints:
        """Nodes ``(n, 2 or 3)`` of the tagged edges: start, end, midpoint."""
        element, edge = self.edges[tag].T
        local = [edge, (edge + 1) % 3, edge + 3][: self.elements.shape[1] // 3 + 1]
        return np.stack([self.elements[element, i] for i in local], axis=1)

    def areas(self) -> Array:
        """Areas ``(m,)``, counting the curved edges' parabolic segments; positive if counterclockwise."""
        order = [0, 3, 1, 4, 2, 5] if self.elements.shape[1] == 6 else [0, 1, 2]
        x, y = np.moveaxis(self.x[self.elements[:, order]], 2, 0)
        polygon = 0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
        if len(order) == 3:
            return polygon
        x, y = np.moveaxis(self.x[self.elements[:, :3]], 2, 0)
        corners = 0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
        return corners + 4 / 3 * (polygon - corners)  # Archimedes: a segment has 4/3 of its triangle's area


def deck_mesh(scene: Scene, elements: Elements) -> PlaneMesh:
    """The mesh that archord solves ``scene`` on, with a pin even if it is rigid, on this rank alone.

    Raises `InputError` if the scene leaves the mesh open.
    """
    scene.require_mesh()
    joint = scene.joint
    sizes = (joint.radius, joint.dR, joint.W, joint.h, joint.growth)
    mesh = quadratic_triangles(quarter_joint(MPI.COMM_SELF, *sizes, size_ratio=joint.size_ratio))
    return mesh if elements == "quadratic" else linear_triangles(mesh)


def quadratic_triangles(joint: JointMesh) -> PlaneMesh:
    """The mesh ``joint``, which must live on one rank, in triangles of six nodes; the midpoints of arcs are on them."""
    mesh = joint.mesh
    x = mesh.geometry.x[:, :2]
    dofmap = np.asarray(mesh.geometry.dofmap, dtype=np.int64)
    a, b, c = (x[dofmap[:, i]] for i in range(3))
    turn = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    elements = np.where((turn > 0)[:, None], dofmap[:, _COUNTERCLOCKWISE], dofmap[:, _MIRRORED])
    mesh.topology.create_connectivity(1, 2)
    bodies = np.zeros(len(elements), dtype=np.int64)
    bodies[joint.cells.indices] = joint.cells.values
    edges = {tag: find_edges(elements, entities_to_geometry(mesh, 1, joint.facets.find(tag))[:, :2]) for tag in Facets}
    return PlaneMesh(x.copy(), elements, bodies, edges)


def linear_triangles(mesh: PlaneMesh) -> PlaneMesh:
    """Each six-node triangle of ``mesh`` cut into four of three nodes; the nodes are the same."""
    elements = mesh.elements[:, _QUARTERS].reshape(-1, 3)
    edges = {}
    for tag in mesh.edges:
        first, last, middle = mesh.edge_nodes(tag).T
        edges[tag] = find_edges(elements, np.concatenate([np.c_[first, middle], np.c_[middle, last]]))
    return PlaneMesh(mesh.x, elements, np.repeat(mesh.bodies, 4), edges)


def find_edges(elements: Ints, ends: Ints) -> Ints:
    """Element and edge ``(n, 2)`` of the boundary edges with the end nodes ``ends`` ``(n, 2)``, in either order."""
    corners = elements[:, :3]
    sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    size = np.array([elements.max() + 1, 1])
    keys, wanted = sides @ size, np.sort(ends, axis=1) @ size
    order = np.argsort(keys)
    found = order[np.searchsorted(keys, wanted, sorter=order)]
    return np.stack([found // 3, found % 3], axis=1)
